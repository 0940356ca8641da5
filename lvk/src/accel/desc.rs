//! The description of a BLAS.

use super::flags::BuildFlags;
use super::geometry::BlasGeometry;

/// In which order the driver's builder gets the primitives of a mesh.
///
/// Shaders see the numbers of the caller's own order, through `lvkPrimitiveIndex` and `lvkRayQueryPrimitiveIndex`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum PrimitiveOrder {
    /// As given, but [`Spatial`](Self::Spatial) for builds with [`BuildFlags::FAST_TRACE`] on drivers that keep the
    /// order and trace unordered meshes slowly ([`Capabilities::prefers_spatial_order`](crate::Capabilities)).
    #[default]
    Auto,
    /// As given.
    Given,
    /// Neighbours in the list are neighbours in space, by the leaves of a tree of small surface; where the given order
    /// is already about as good it stays. Reads the inputs back, so creation waits for the GPU.
    Spatial,
}

/// Describes a bottom-level structure.
#[derive(Debug, Clone, Copy)]
pub struct BlasDesc<'a> {
    /// Its geometries, all triangles or all boxes. Shaders read a hit's place in the list as `gl_GeometryIndexEXT`.
    pub geometries: &'a [BlasGeometry],
    /// What the build is optimised for.
    pub flags: BuildFlags,
    /// In which order the primitives are built, by the contents of the buffers at creation.
    pub order: PrimitiveOrder,
    /// Name in error messages, validation messages and debuggers.
    pub debug_name: &'a str,
}

impl Default for BlasDesc<'_> {
    fn default() -> Self {
        let (flags, order) = (BuildFlags::default(), PrimitiveOrder::default());
        Self { geometries: &[], flags, order, debug_name: "blas" }
    }
}
