//! The traced mesh, from a file or generated, with its buffers and acceleration structures.

use lvk::{
    AccelStructHandle, BlasDesc, BlasGeometry, BufferDesc, BufferHandle, BufferUsage, BuildFlags, Context,
    Holder, PrimitiveOrder, TlasDesc, TlasInstance, Triangles,
};

use crate::args::MeshArgs;
use crate::error::BenchError;
use crate::synthetic::spheres;
use lvk_samples::app::progress::Progress;
use lvk_samples::scene::{Camera, ObjOptions, Scene};

/// Triangles with cameras and a light.
#[derive(Debug, Clone)]
pub(super) struct Mesh {
    pub(super) name: String,
    pub(super) positions: Vec<[f32; 3]>,
    /// Three vertex indices each.
    pub(super) triangles: Vec<[u32; 3]>,
    /// The current camera.
    pub(super) camera: Camera,
    /// All cameras.
    pub(super) cameras: [Camera; 5],
    /// Target of the shadow rays.
    pub(super) light: [f32; 3],
}

impl Mesh {
    /// Loads the mesh that the command line names, with camera `camera` (1 to 5), or generates a mesh.
    pub(super) fn new(args: &MeshArgs, camera: u32, default_triangles: u32) -> Result<Self, BenchError> {
        let Some(path) = &args.scene else {
            return Ok(spheres(args.triangles.unwrap_or(default_triangles)));
        };
        let scene = Scene::from_obj(path, &ObjOptions::default(), &mut Progress::visible())?;
        Ok(Self::from_scene(scene, camera))
    }

    /// Takes the triangles of the scene in the order of the source file.
    fn from_scene(scene: Scene, camera: u32) -> Self {
        let mut numbered: Vec<_> = scene.source_triangles.iter().zip(&scene.triangles).collect();
        numbered.sort_by_key(|(source, _)| **source);
        Self {
            name: scene.name,
            triangles: numbered.into_iter().map(|(_, triangle)| *triangle).collect(),
            positions: scene.positions,
            camera: scene.cameras[(camera as usize).clamp(1, 5) - 1],
            cameras: scene.cameras,
            light: scene.light.position,
        }
    }

    /// Returns the name and triangle count for titles.
    pub(super) fn describe(&self) -> String {
        format!("{}, {} triangles", self.name, super::table::format_grouped(self.triangles.len() as u64))
    }
}

/// Vertex and index buffers of a mesh.
pub(super) struct MeshBuffers {
    pub(super) positions: Holder<BufferHandle>,
    pub(super) indices: Holder<BufferHandle>,
    pub(super) vertex_count: u32,
    pub(super) triangle_count: u32,
}

impl MeshBuffers {
    pub(super) fn new(ctx: &Context, mesh: &Mesh) -> lvk::Result<Self> {
        Ok(Self {
            positions: create_input_buffer(ctx, "positions", bytemuck::cast_slice(&mesh.positions))?,
            indices: create_input_buffer(ctx, "indices", bytemuck::cast_slice(&mesh.triangles))?,
            vertex_count: mesh.positions.len() as u32,
            triangle_count: mesh.triangles.len() as u32,
        })
    }

    /// Returns all triangles as one opaque geometry.
    pub(super) fn geometry(&self) -> BlasGeometry {
        BlasGeometry::Triangles(Triangles::indexed(
            *self.positions,
            self.vertex_count,
            *self.indices,
            self.triangle_count,
        ))
    }

    /// Creates a BLAS of all triangles. Does not wait for the build.
    pub(super) fn blas(
        &self,
        ctx: &Context,
        flags: BuildFlags,
        order: PrimitiveOrder,
    ) -> lvk::Result<Holder<AccelStructHandle>> {
        ctx.create_blas(&BlasDesc {
            geometries: &[self.geometry()],
            flags,
            order,
            debug_name: "mesh",
            ..BlasDesc::default()
        })
    }
}

/// A mesh with a built BLAS and TLAS.
pub(super) struct BuiltMesh {
    pub(super) blas: Holder<AccelStructHandle>,
    pub(super) tlas: Holder<AccelStructHandle>,
    _buffers: MeshBuffers,
}

impl BuiltMesh {
    /// Builds a BLAS of these triangles and a TLAS with one untransformed instance.
    pub(super) fn new(ctx: &Context, buffers: MeshBuffers, order: PrimitiveOrder) -> lvk::Result<Self> {
        let blas = buffers.blas(ctx, BuildFlags::FAST_TRACE, order)?;
        let instances = [TlasInstance::new(*blas)];
        let parts_per_instance = ctx.accel_struct_info(*blas)?.parts;
        let tlas =
            ctx.create_tlas(&TlasDesc { instances: &instances, parts_per_instance, ..TlasDesc::default() })?;
        ctx.wait(ctx.flush()?)?;
        Ok(Self { blas, tlas, _buffers: buffers })
    }
}

/// Creates a buffer with acceleration structure build input.
pub(super) fn create_input_buffer(
    ctx: &Context,
    debug_name: &str,
    data: &[u8],
) -> lvk::Result<Holder<BufferHandle>> {
    let usage = BufferUsage::STORAGE | BufferUsage::ACCEL_INPUT;
    ctx.create_buffer(&BufferDesc { usage, data: Some(data), debug_name, ..BufferDesc::default() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mesh_has_the_triangle_order_of_the_source_file() {
        let mut scene = Scene::procedural();
        let count = scene.triangles.len();
        scene.source_triangles = (0..count as u32).rev().collect();
        let (first, last) = (scene.triangles[0], scene.triangles[count - 1]);
        let mesh = Mesh::from_scene(scene, 2);
        assert_eq!(
            (mesh.triangles[0], mesh.triangles[count - 1], mesh.triangles.len()),
            (last, first, count)
        );
    }
}
