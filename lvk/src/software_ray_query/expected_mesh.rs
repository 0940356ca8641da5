//! The mesh that a BLAS blob from a file must be built from.

use super::bvh::primitives::{Mesh, MeshPrimitives};
use crate::accel::desc::BlasDesc;
use crate::accel::geometry::BlasGeometry;
use crate::software_ray_query::layout::LeafBox;

/// The mesh that a blob must be built from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct ExpectedMesh {
    /// True for AABBs, false for triangles.
    pub(crate) is_aabbs: bool,
    /// Number of primitives of each geometry.
    pub(crate) counts: Vec<u32>,
}

impl ExpectedMesh {
    /// Returns the expectation for a build of this mesh.
    pub(crate) fn from_mesh(mesh: &Mesh) -> Self {
        let mut counts = vec![0; mesh.flags.len()];
        let mut add = |geometry: u32, primitive: u32| {
            if let Some(count) = counts.get_mut(geometry as usize) {
                *count = primitive.saturating_add(1).max(*count);
            }
        };
        let boxes = match &mesh.primitives {
            MeshPrimitives::Triangles(all) => {
                all.iter().for_each(|of| add(of.geometry, of.primitive));
                false
            }
            MeshPrimitives::Boxes(all) => {
                all.iter().for_each(|of| add(of.geometry & !LeafBox::OPAQUE, of.primitive));
                true
            }
        };
        Self { is_aabbs: boxes, counts }
    }

    /// Returns the expectation for a BLAS of this description.
    pub(crate) fn from_desc(desc: &BlasDesc<'_>) -> Self {
        Self {
            is_aabbs: desc.geometries.first().is_some_and(BlasGeometry::is_aabbs),
            counts: desc.geometries.iter().map(BlasGeometry::primitive_count).collect(),
        }
    }

    /// Returns an upper bound of the blob's bytes.
    pub(crate) fn max_blob_bytes(&self) -> u64 {
        /// A node of eight children, a leaf and three vertices, or a geometry.
        const MAX_BYTES_PER_PRIMITIVE: u64 = 256;
        let primitives: u64 = self.counts.iter().map(|count| u64::from(*count)).sum();
        (primitives + self.counts.len() as u64 + 16) * MAX_BYTES_PER_PRIMITIVE
    }
}
