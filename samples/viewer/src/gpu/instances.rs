//! Where meshes stand: for shaders, for the top-level structure and for the rasteriser.

use std::ops::Range;

use glam::{Mat3, Mat4, Vec3};
use lvk::{InstanceFlags, TlasInstance, rows_from_columns};
use lvk_gltf::{Model, Placement};

use super::geometry::{GpuMesh, GpuMeshes};
use super::layout::{GpuInstance, GpuMeshRun};
use crate::model::deforms;

/// Instances whose volume is a smaller share of that of their mesh have no inside, and are not shown.
const SMALLEST_DETERMINANT: f32 = 1e-30;

/// A mesh on the GPU: that of all nodes where it is at rest, or that of one node whose vertices move.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct MeshKey {
    pub(crate) mesh: usize,
    pub(crate) deformed_by: Option<usize>,
}

impl MeshKey {
    /// The mesh that a placement shows.
    pub(crate) fn new(model: &Model, placement: &Placement) -> Self {
        let deformed_by = deforms(model, placement.node).then_some(placement.node);
        Self { mesh: placement.mesh, deformed_by }
    }
}

/// A geometry to rasterise in some instances.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Draw {
    /// The geometry of the mesh.
    pub(crate) geometry: u32,
    pub(crate) triangle_count: u32,
    /// Places in the table of instances.
    pub(crate) instances: Range<u32>,
}

/// The instances of a scene, those of a mesh side by side.
pub(crate) struct SceneInstances {
    /// The table that shaders read.
    pub(crate) table: Vec<GpuInstance>,
    /// Everything to rasterise.
    pub(crate) draws: Vec<Draw>,
    /// The instances of each mesh, which culling looks at.
    pub(crate) runs: Vec<GpuMeshRun>,
    /// For the top-level structure, without those that have no inside.
    structures: Vec<TlasInstance>,
    /// Places among the placements of the scene.
    order: Vec<usize>,
}

impl SceneInstances {
    /// Instances of the meshes of `keys`, one for each placement.
    pub(crate) fn new(placements: &[Placement], keys: &[MeshKey], meshes: &GpuMeshes) -> Self {
        let (table, draws, runs) = (Vec::new(), Vec::new(), Vec::new());
        let mut shown = Self { table, draws, runs, structures: Vec::new(), order: Vec::new() };
        let mut order: Vec<usize> = (0..placements.len().min(keys.len())).collect();
        order.sort_by_key(|place| keys[*place]);
        for same in order.chunk_by(|a, b| keys[*a] == keys[*b]) {
            let first = shown.order.len() as u32;
            let Some(mesh) = same.first().and_then(|place| meshes.get(keys[*place])) else { continue };
            shown.order.extend(same);
            let instances = first..shown.order.len() as u32;
            for custom_index in instances.clone() {
                let flags =
                    if mesh.is_single_sided { InstanceFlags::empty() } else { InstanceFlags::NO_CULL };
                shown.structures.push(TlasInstance { custom_index, flags, ..TlasInstance::new(*mesh.blas) });
                shown.table.push(GpuInstance {
                    first_geometry: mesh.first_geometry,
                    ..bytemuck::Zeroable::zeroed()
                });
            }
            shown.runs.push(run(mesh, &instances, shown.draws.len()));
            shown.draws.extend((0..mesh.geometry_count).map(|geometry| {
                let triangle_count = meshes.triangle_counts[(mesh.first_geometry + geometry) as usize];
                Draw { geometry, triangle_count, instances: instances.clone() }
            }));
        }
        shown.place(placements);
        shown
    }

    /// Moves the instances to where the placements of another pose are.
    pub(crate) fn place(&mut self, placements: &[Placement]) {
        for ((instance, structure), place) in self.table.iter_mut().zip(&mut self.structures).zip(&self.order)
        {
            let transform = placements.get(*place).map(|placement| placement.transform);
            // All points of what has no inside are one, so that nothing of it is rasterised.
            let transform = transform.filter(has_inside).unwrap_or(Mat4::ZERO);
            instance.rows = transform_rows(&transform);
            instance.normal_columns = normal_columns(&transform);
            structure.transform = instance.rows;
        }
    }

    /// What the top-level structure holds.
    pub(crate) fn structures(&self) -> Vec<TlasInstance> {
        let pairs = self.structures.iter().zip(&self.table);
        pairs.filter(|(_, instance)| instance.rows != [0.0; 12]).map(|(structure, _)| *structure).collect()
    }

    /// Transforms of all instances.
    pub(crate) fn transforms(&self) -> Vec<[f32; 12]> {
        self.table.iter().map(|instance| instance.rows).collect()
    }
}

/// The instances of a mesh, whose first geometry is the draw with this number.
fn run(mesh: &GpuMesh, instances: &Range<u32>, first_draw: usize) -> GpuMeshRun {
    let bounds = mesh.bounds.map(|bounds| (0.5 * (bounds.min + bounds.max), 0.5 * (bounds.max - bounds.min)));
    let (middle, extent) = bounds.unwrap_or((Vec3::ZERO, Vec3::NEG_ONE));
    GpuMeshRun {
        middle: middle.to_array(),
        first_instance: instances.start,
        extent: extent.to_array(),
        instance_count: instances.end - instances.start,
        first_draw: first_draw as u32,
        draw_count: mesh.geometry_count,
    }
}

/// True if a transform leaves a mesh its volume.
fn has_inside(transform: &Mat4) -> bool {
    transform.is_finite() && Mat3::from_mat4(*transform).determinant().abs() >= SMALLEST_DETERMINANT
}

/// The upper three rows of a matrix.
pub(crate) fn transform_rows(matrix: &Mat4) -> [f32; 12] {
    let [x, y, z, w] = [matrix.x_axis, matrix.y_axis, matrix.z_axis, matrix.w_axis];
    rows_from_columns([x, y, z, w].map(|column| column.truncate().to_array()))
}

/// Columns of the matrix of normals; zero where the transform is.
fn normal_columns(transform: &Mat4) -> [f32; 9] {
    let matrix = Mat3::from_mat4(*transform);
    if matrix == Mat3::ZERO { [0.0; 9] } else { matrix.inverse().transpose().to_cols_array() }
}
