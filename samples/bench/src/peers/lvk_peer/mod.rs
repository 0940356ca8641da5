//! The rows by `lvk`.

mod accel_structs;
mod draws;
mod objects;
mod rays;
mod uploads;

use lvk::{
    Context, ContextDesc, Holder, RayQueryRequest, RayTracingPipelineRequest, ShaderModuleDesc,
    ShaderModuleHandle, ShaderSource, ShaderStage,
};
use lvk_dev_driver::{DriverRequest, prepare};

use super::peer::{Failure, Peer, PeerDevice, PeerEntry, RowRun, Sample};
use super::program::Program;
use super::row::Row;
use super::workload::Workload;

const TRIANGLE: &[(&str, &[u8])] =
    &[("triangle_lvk.rs", include_bytes!("../../../examples/triangle_lvk.rs"))];

/// `lvk` with the driver's acceleration structures and ray queries, as all other peers have them.
pub(super) const ENTRY: PeerEntry = PeerEntry {
    name: "lvk",
    package: "lvk",
    open: || Ok(Box::new(LvkPeer { ctx: open(RayQueryRequest::HardwareIfPresent)? })),
    triangles: &[
        Program { label: "lvk", dependencies: "lvk = { path = \"{root}/lvk\" }", files: TRIANGLE },
        Program {
            label: "lvk without its GLSL compiler",
            dependencies: "lvk = { path = \"{root}/lvk\", default-features = false }",
            files: TRIANGLE,
        },
    ],
};

/// `lvk` with its own builders and its own traversal, on any device. It is the default on drivers that run on the CPU, and
/// on GPUs without ray queries.
pub(super) const SOFTWARE_ENTRY: PeerEntry = PeerEntry {
    name: "lvk-sw",
    package: "lvk",
    open: || {
        let ctx = open(RayQueryRequest::Software)?;
        Ok(Box::new(SoftwarePeer { peer: LvkPeer { ctx } }))
    },
    triangles: &[],
};

fn open(ray_query: RayQueryRequest) -> Result<Context, Failure> {
    let loader = prepare(&DriverRequest::default())?.loader;
    let ray_tracing_pipeline = match ray_query {
        RayQueryRequest::Software => RayTracingPipelineRequest::Off,
        _ => RayTracingPipelineRequest::HardwareIfPresent,
    };
    Ok(Context::new(&ContextDesc {
        vulkan_library: loader.as_deref(),
        ray_query,
        ray_tracing_pipeline,
        ..ContextDesc::default()
    })?)
}

struct LvkPeer {
    ctx: Context,
}

/// The rows with rays.
struct SoftwarePeer {
    peer: LvkPeer,
}

impl Peer for SoftwarePeer {
    fn device(&self) -> PeerDevice {
        self.peer.device()
    }

    fn prepare(self: Box<Self>, row: Row, work: &Workload) -> Result<Box<dyn RowRun>, Failure> {
        match row {
            Row::EmptySubmit | Row::BlasBuilds | Row::TlasBuild | Row::RayQueryFrame => {
                Box::new(self.peer).prepare(row, work)
            }
            Row::RayPipelineFrame => Err("its pipelines are lowered: `bench lowered`".into()),
            _ => Err("as the column of lvk".into()),
        }
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
