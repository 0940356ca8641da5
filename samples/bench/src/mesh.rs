//! What is traced: triangles of a file or made by formulas, and their structures.

use lvk::{
    AccelStructHandle, BlasDesc, BlasGeometry, BufferDesc, BufferHandle, BufferUsage, BuildFlags, Context,
    Holder, PrimitiveOrder, TlasDesc, TlasInstance, Triangles,
};

use super::args::MeshArgs;
use super::error::BenchError;
use super::synthetic::spheres;
use lvk_samples::app::progress::Progress;
use lvk_samples::scene::{Camera, ObjOptions, Scene};

/// Triangles and a view of them.
#[derive(Debug, Clone)]
pub(super) struct Mesh {
    pub(super) name: String,
    pub(super) positions: Vec<[f32; 3]>,
    /// Three vertices each.
    pub(super) triangles: Vec<[u32; 3]>,
    /// The one to look through.
    pub(super) camera: Camera,
    /// All there are.
    pub(super) cameras: [Camera; 5],
    /// Where shadow rays go.
    pub(super) light: [f32; 3],
}

impl Mesh {
    /// The mesh that the command line names, seen through this camera (1 to 5), or one of so many triangles.
    pub(super) fn new(args: &MeshArgs, camera: u32, default_triangles: u32) -> Result<Self, BenchError> {
        let Some(path) = &args.scene else {
            return Ok(spheres(args.triangles.unwrap_or(default_triangles)));
        };
        let scene = Scene::from_obj(path, &ObjOptions::default(), &mut Progress::visible())?;
        Ok(Self::of_scene(scene, camera))
    }

    /// All triangles in the order of the source, whatever order the scene has them in.
    fn of_scene(scene: Scene, camera: u32) -> Self {
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

    /// For headlines.
    pub(super) fn describe(&self) -> String {
        format!("{}, {} triangles", self.name, super::table::grouped(self.triangles.len() as u64))
    }
}

/// Triangles in memory of the device.
pub(super) struct MeshBuffers {
    pub(super) positions: Holder<BufferHandle>,
    pub(super) indices: Holder<BufferHandle>,
    pub(super) vertex_count: u32,
    pub(super) triangle_count: u32,
}

impl MeshBuffers {
    pub(super) fn new(ctx: &Context, mesh: &Mesh) -> lvk::Result<Self> {
        Ok(Self {
            positions: input(ctx, "positions", bytemuck::cast_slice(&mesh.positions))?,
            indices: input(ctx, "indices", bytemuck::cast_slice(&mesh.triangles))?,
            vertex_count: mesh.positions.len() as u32,
            triangle_count: mesh.triangles.len() as u32,
        })
    }

    /// All triangles as one geometry, opaque.
    pub(super) fn geometry(&self) -> BlasGeometry {
        BlasGeometry::Triangles(Triangles::indexed(
            *self.positions,
            self.vertex_count,
            *self.indices,
            self.triangle_count,
        ))
    }

    /// A structure of all triangles; not waited for.
    pub(super) fn blas(
        &self,
        ctx: &Context,
        flags: BuildFlags,
        order: PrimitiveOrder,
    ) -> lvk::Result<Holder<AccelStructHandle>> {
        ctx.create_blas(&BlasDesc { geometries: &[self.geometry()], flags, order, debug_name: "mesh" })
    }
}

/// A mesh that rays can be traced through.
pub(super) struct Traceable {
    pub(super) blas: Holder<AccelStructHandle>,
    pub(super) tlas: Holder<AccelStructHandle>,
    _buffers: MeshBuffers,
}

impl Traceable {
    /// One untransformed instance of a structure with these triangles, built.
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

/// A buffer that structures are built from.
pub(super) fn input(ctx: &Context, debug_name: &str, data: &[u8]) -> lvk::Result<Holder<BufferHandle>> {
    let usage = BufferUsage::STORAGE | BufferUsage::ACCEL_INPUT;
    ctx.create_buffer(&BufferDesc { usage, data: Some(data), debug_name, ..BufferDesc::default() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scene_comes_in_the_order_of_its_source() {
        let mut scene = Scene::procedural();
        let count = scene.triangles.len();
        scene.source_triangles = (0..count as u32).rev().collect();
        let (first, last) = (scene.triangles[0], scene.triangles[count - 1]);
        let mesh = Mesh::of_scene(scene, 2);
        assert_eq!(
            (mesh.triangles[0], mesh.triangles[count - 1], mesh.triangles.len()),
            (last, first, count)
        );
    }
}
