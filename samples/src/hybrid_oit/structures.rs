//! Acceleration structures: floor and blocks built once, glass every frame from boxes that a shader wrote, balls as
//! instances of one unit sphere whose records a shader wrote.

use lvk::{
    Aabbs, AccelStructHandle, BlasDesc, BlasGeometry, BufferDesc, BufferHandle, BufferUsage, BuildFlags,
    BuildMode, CommandBuffer, Context, DeviceInstances, GeometryFlags, Holder, TlasDesc, Triangles,
};

use super::buffers::{Buffers, OTHER_INSTANCES};
use super::scene::OitScene;

/// The structures, in the order by which instance records name them (`shaders/hybrid_oit/animate.comp.glsl`).
pub(super) struct Structures {
    solids: Holder<AccelStructHandle>,
    glass: Holder<AccelStructHandle>,
    ball: Holder<AccelStructHandle>,
    pub(super) tlas: Holder<AccelStructHandle>,
    records: BufferHandle,
    instance_count: u32,
    _unit_box: Holder<BufferHandle>,
}

impl Structures {
    /// Builds what does not move, and prepares the rest.
    pub(super) fn new(ctx: &Context, scene: &OitScene, buffers: &Buffers) -> lvk::Result<Self> {
        let unit_box = ctx.create_buffer(&BufferDesc {
            data: Some(bytemuck::bytes_of(&[-1.0_f32, -1.0, -1.0, 1.0, 1.0, 1.0])),
            usage: BufferUsage::ACCEL_INPUT,
            debug_name: "unit box",
            ..BufferDesc::default()
        })?;
        let solids = Triangles::packed(*buffers.positions, buffers.vertex_count);
        let solids = blas(ctx, BlasGeometry::Triangles(solids), BuildFlags::FAST_TRACE, "floor and blocks")?;
        let ball = boxes(*unit_box, 1, GeometryFlags::OPAQUE);
        let ball = blas(ctx, ball, BuildFlags::FAST_TRACE, "ball")?;
        // A shadow ray must meet each sphere once, or its tint would count twice.
        let glass = boxes(*buffers.boxes, scene.glass.len() as u32, GeometryFlags::NO_DUPLICATE_ANY_HIT);
        let glass = blas(ctx, glass, BuildFlags::FAST_BUILD, "glass")?;
        let instance_count = scene.balls.len() as u32 + OTHER_INSTANCES;
        let tlas = ctx.create_tlas(&TlasDesc {
            capacity: instance_count,
            flags: BuildFlags::FAST_BUILD,
            debug_name: "scene",
            ..TlasDesc::default()
        })?;
        let records = *buffers.records;
        Ok(Self { solids, glass, ball, tlas, records, instance_count, _unit_box: unit_box })
    }

    /// Records the builds of a frame.
    pub(super) fn record(&self, cmd: &mut CommandBuffer) -> lvk::Result<()> {
        cmd.build_blas(&[*self.glass], BuildMode::Rebuild)?;
        let instances = DeviceInstances {
            buffer: self.records,
            offset: 0,
            count: self.instance_count,
            blas: &[*self.solids, *self.glass, *self.ball],
        };
        cmd.update_tlas_from_buffer(*self.tlas, &instances, BuildMode::Rebuild)
    }
}

fn boxes(buffer: BufferHandle, count: u32, flags: GeometryFlags) -> BlasGeometry {
    BlasGeometry::Aabbs(Aabbs { buffer, offset: 0, stride: 0, count, flags })
}

fn blas(
    ctx: &Context,
    geometry: BlasGeometry,
    flags: BuildFlags,
    debug_name: &str,
) -> lvk::Result<Holder<AccelStructHandle>> {
    ctx.create_blas(&BlasDesc { geometries: &[geometry], flags, debug_name, ..BlasDesc::default() })
}
