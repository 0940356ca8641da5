//! TLAS builds by the GPU from instances in a buffer.

use lvk::{
    AccelStructHandle, BufferDesc, BufferHandle, BuildFlags, BuildMode, Context, DeviceInstances, Holder,
    PrimitiveOrder, TlasDesc, TlasInstance,
};

use crate::error::BenchError;
use crate::instance_record::InstanceRecord;
use crate::measure::Stopwatch;
use crate::mesh::MeshBuffers;
use crate::synthetic::spheres;
use crate::tlas::instance_transform;

/// Instances of the TLAS.
pub(super) const COUNT: u32 = 10_000;
/// Triangles of the mesh that all instances reference.
const MESH_TRIANGLES: u32 = 1000;

/// A TLAS with many instances of one mesh.
pub(super) struct Instances {
    tlas: Holder<AccelStructHandle>,
    blas: Holder<AccelStructHandle>,
    records: Holder<BufferHandle>,
    _buffers: MeshBuffers,
}

impl Instances {
    pub(super) fn new(ctx: &Context) -> lvk::Result<Self> {
        let buffers = MeshBuffers::new(ctx, &spheres(MESH_TRIANGLES))?;
        let blas = buffers.blas(ctx, BuildFlags::FAST_TRACE, PrimitiveOrder::Given)?;
        let transforms: Vec<_> = (0..COUNT).map(|number| instance_transform(number, COUNT)).collect();
        let records: Vec<_> = transforms.iter().map(|rows| InstanceRecord::new(*rows, 0)).collect();
        let records = ctx.create_buffer(&BufferDesc {
            data: Some(bytemuck::cast_slice(&records)),
            debug_name: "instances",
            ..BufferDesc::default()
        })?;
        let instance = |rows: &[f32; 12]| TlasInstance { transform: *rows, ..TlasInstance::new(*blas) };
        let instances: Vec<_> = transforms.iter().map(instance).collect();
        let tlas = ctx.create_tlas(&TlasDesc { instances: &instances, ..TlasDesc::default() })?;
        ctx.wait(ctx.flush()?)?;
        Ok(Self { tlas, blas, records, _buffers: buffers })
    }

    /// Returns the GPU milliseconds of a rebuild.
    pub(super) fn rebuild(&self, stopwatch: &Stopwatch) -> Result<f64, BenchError> {
        let blas = [*self.blas];
        let instances = DeviceInstances { buffer: *self.records, offset: 0, count: COUNT, blas: &blas };
        let timed =
            stopwatch.time(|cmd| cmd.update_tlas_from_buffer(*self.tlas, &instances, BuildMode::Rebuild))?;
        Ok(timed.gpu)
    }
}
