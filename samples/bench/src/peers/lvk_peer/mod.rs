//! The rows by `lvk`.

mod accel_structs;
mod draws;
mod objects;
mod rays;
mod uploads;

use lvk::{Context, ContextDesc, Holder, ShaderModuleDesc, ShaderModuleHandle, ShaderSource, ShaderStage};
use lvk_dev_driver::{DriverRequest, prepare};

use super::peer::{Failure, Peer, PeerDevice, PeerEntry, RowRun, Sample};
use super::program::Program;
use super::row::Row;
use super::workload::Workload;

const TRIANGLE: &[(&str, &[u8])] =
    &[("triangle_lvk.rs", include_bytes!("../../../examples/triangle_lvk.rs"))];

/// `lvk`.
pub(super) const ENTRY: PeerEntry = PeerEntry {
    name: "lvk",
    package: "lvk",
    open: || Ok(Box::new(LvkPeer::new()?)),
    triangles: &[Program { label: "lvk", dependencies: "lvk = { path = \"{root}/lvk\" }", files: TRIANGLE }],
};

struct LvkPeer {
    ctx: Context,
}

impl LvkPeer {
    fn new() -> Result<Self, Failure> {
        let loader = prepare(&DriverRequest::default())?.loader;
        let desc = ContextDesc { vulkan_library: loader.as_deref(), ..ContextDesc::default() };
        Ok(Self { ctx: Context::new(&desc)? })
    }
}

impl Peer for LvkPeer {
    fn device(&self) -> PeerDevice {
        let caps = self.ctx.capabilities();
        PeerDevice { name: caps.device_name.clone(), is_cpu: caps.is_cpu }
    }

    fn prepare(self: Box<Self>, row: Row, work: &Workload) -> Result<Box<dyn RowRun>, Failure> {
        let ctx = self.ctx;
        Ok(match row {
            Row::EmptySubmit => Box::new(EmptySubmits { ctx, count: work.submits }),
            Row::Buffers => Box::new(objects::Buffers { ctx, count: work.objects }),
            Row::Textures => Box::new(objects::Textures { ctx, count: work.objects }),
            Row::Draws => Box::new(draws::Draws::new(ctx, work.draws)?),
            Row::Dispatches => Box::new(uploads::Dispatches::new(ctx, work.dispatches)?),
            Row::Uploads => Box::new(uploads::Uploads::new(ctx, work.uploads)?),
            Row::BlasBuilds => Box::new(accel_structs::BlasBuilds::new(ctx, work)?),
            Row::TlasBuild => Box::new(accel_structs::TlasBuild::new(ctx, work)?),
            Row::RayQueryFrame => Box::new(rays::RayFrame::by_query(ctx, work)?),
            Row::RayPipelineFrame => Box::new(rays::RayFrame::by_pipeline(ctx, work)?),
            Row::TexturedFrame => Box::new(draws::Textured::new(ctx, work)?),
        })
    }
}

struct EmptySubmits {
    ctx: Context,
    count: u32,
}

impl RowRun for EmptySubmits {
    fn sample(&mut self) -> Result<Sample, Failure> {
        let submit = || {
            for _ in 0..self.count {
                let cmd = self.ctx.acquire_command_buffer()?;
                self.ctx.wait(self.ctx.submit(cmd)?)?;
            }
            Ok(())
        };
        Sample::take(submit, |()| Ok(()))
    }
}

fn module(ctx: &Context, stage: ShaderStage, text: &str) -> lvk::Result<Holder<ShaderModuleHandle>> {
    let source = ShaderSource::Glsl(text);
    ctx.create_shader_module(&ShaderModuleDesc { stage, source, ..ShaderModuleDesc::default() })
}
