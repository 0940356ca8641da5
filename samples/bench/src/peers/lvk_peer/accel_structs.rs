//! Builds of acceleration structures.

use lvk::{
    AccelStructHandle, BlasDesc, BlasGeometry, BufferDesc, BufferHandle, BufferUsage, BuildMode, Context,
    Holder, PrimitiveOrder, TlasDesc, TlasInstance, Triangles,
};

use crate::peers::peer::{Failure, RowRun, Sample};
use crate::peers::workload::Workload;

/// As the other peers: without the order in space that is the default on some drivers.
const ORDER: PrimitiveOrder = PrimitiveOrder::Given;

/// BLAS of many meshes.
pub(super) struct BlasBuilds {
    ctx: Context,
    meshes: Vec<[BlasGeometry; 1]>,
    built: Vec<Holder<AccelStructHandle>>,
    _positions: Vec<Holder<BufferHandle>>,
}

impl BlasBuilds {
    pub(super) fn new(ctx: Context, work: &Workload) -> Result<Self, Failure> {
        needs_ray_tracing(&ctx)?;
        let positions: Vec<_> =
            (0..work.meshes).map(|number| positions(&ctx, work, number)).collect::<lvk::Result<_>>()?;
        let geometry = |buffer: &Holder<BufferHandle>| triangles(**buffer, work);
        let meshes = positions.iter().map(geometry).collect();
        ctx.wait(ctx.flush()?)?;
        Ok(Self { ctx, meshes, built: Vec::new(), _positions: positions })
    }
}

impl RowRun for BlasBuilds {
    fn sample(&mut self) -> Result<Sample, Failure> {
        self.built.clear();
        self.ctx.wait(self.ctx.flush()?)?;
        let mut built = Vec::new();
        let submit = || {
            let desc = |geometries| BlasDesc { geometries, order: ORDER, ..BlasDesc::default() };
            let descs: Vec<_> = self.meshes.iter().map(|mesh| desc(&mesh[..])).collect();
            built = self.ctx.create_blas_batch(&descs)?;
            Ok(self.ctx.flush()?)
        };
        let sample = Sample::take(submit, |submission| Ok(self.ctx.wait(submission)?));
        self.built = built;
        sample
    }
}

/// A TLAS whose instances the host writes anew for each build.
pub(super) struct TlasBuild {
    ctx: Context,
    blas: Holder<AccelStructHandle>,
    tlas: Holder<AccelStructHandle>,
    instances: Vec<TlasInstance>,
    turn: u32,
    _positions: Holder<BufferHandle>,
}

impl TlasBuild {
    pub(super) fn new(ctx: Context, work: &Workload) -> Result<Self, Failure> {
        needs_ray_tracing(&ctx)?;
        let positions = positions(&ctx, work, 0)?;
        let geometries = &triangles(*positions, work);
        let blas = ctx.create_blas(&BlasDesc { geometries, order: ORDER, ..BlasDesc::default() })?;
        let tlas = ctx.create_tlas(&TlasDesc { capacity: work.instances, ..TlasDesc::default() })?;
        ctx.wait(ctx.flush()?)?;
        let instances = vec![TlasInstance::new(*blas); work.instances as usize];
        Ok(Self { ctx, blas, tlas, instances, turn: 0, _positions: positions })
    }
}

impl RowRun for TlasBuild {
    fn sample(&mut self) -> Result<Sample, Failure> {
        self.turn += 1;
        let submit = || {
            for (number, instance) in (0..).zip(&mut self.instances) {
                let transform = Workload::instance_transform(number, self.turn);
                *instance = TlasInstance { transform, ..TlasInstance::new(*self.blas) };
            }
            let mut cmd = self.ctx.acquire_command_buffer()?;
            cmd.update_tlas(*self.tlas, &self.instances, BuildMode::Rebuild)?;
            Ok(self.ctx.submit(cmd)?)
        };
        Sample::take(submit, |submission| Ok(self.ctx.wait(submission)?))
    }
}

fn needs_ray_tracing(ctx: &Context) -> Result<(), Failure> {
    let caps = ctx.capabilities();
    if caps.ray_query || caps.ray_tracing_pipeline {
        return Ok(());
    }
    Err("the device has no acceleration structures".into())
}

fn positions(ctx: &Context, work: &Workload, number: u32) -> lvk::Result<Holder<BufferHandle>> {
    let positions = work.mesh_positions(number);
    let (usage, data) = (BufferUsage::ACCEL_INPUT, Some(bytemuck::cast_slice(&positions)));
    ctx.create_buffer(&BufferDesc { usage, data, ..BufferDesc::default() })
}

fn triangles(positions: BufferHandle, work: &Workload) -> [BlasGeometry; 1] {
    [BlasGeometry::Triangles(Triangles::packed(positions, 3 * work.mesh_triangles))]
}
