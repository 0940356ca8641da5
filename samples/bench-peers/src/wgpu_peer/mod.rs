//! The rows by `wgpu`.

mod accel_structs;
mod compute;
mod device;
mod draws;
mod objects;
mod rays;
mod textured;

use lvk_bench::peers::{Failure, Peer, PeerDevice, PeerEntry, Program, Row, RowRun, Sample, Workload};

use device::Gpu;

const TRIANGLE: &[(&str, &[u8])] = &[("triangle_wgpu.rs", include_bytes!("../../examples/triangle_wgpu.rs"))];

/// `wgpu`.
pub(crate) const ENTRY: PeerEntry = PeerEntry {
    name: "wgpu",
    package: "wgpu",
    open: || Ok(Box::new(WgpuPeer { gpu: Gpu::new()? })),
    triangles: &[Program {
        label: "wgpu",
        dependencies: "wgpu = { version = \"30\", default-features = false, features = [\"vulkan\", \"wgsl\"] }",
        files: TRIANGLE,
    }],
};

struct WgpuPeer {
    gpu: Gpu,
}

impl Peer for WgpuPeer {
    fn device(&self) -> PeerDevice {
        self.gpu.description()
    }

    fn prepare(self: Box<Self>, row: Row, work: &Workload) -> Result<Box<dyn RowRun>, Failure> {
        let gpu = self.gpu;
        Ok(match row {
            Row::EmptySubmit => Box::new(EmptySubmits { gpu, count: work.submits }),
            Row::Buffers => Box::new(objects::Buffers { gpu, count: work.objects }),
            Row::Textures => Box::new(objects::Textures { gpu, count: work.objects }),
            Row::Draws => Box::new(draws::Draws::new(gpu, work.draws)),
            Row::Dispatches => Box::new(compute::Dispatches::new(gpu, work.dispatches)),
            Row::Uploads => Box::new(compute::Uploads::new(gpu, work.uploads)),
            Row::BlasBuilds => Box::new(accel_structs::BlasBuilds::new(gpu, work)?),
            Row::TlasBuild => Box::new(accel_structs::TlasBuild::new(gpu, work)?),
            Row::RayQueryFrame => Box::new(rays::RayFrame::new(gpu, work)?),
            Row::RayPipelineFrame => return Err("the public interface has no ray tracing pipelines".into()),
            Row::TexturedFrame => Box::new(textured::Textured::new(gpu, work)?),
        })
    }
}

struct EmptySubmits {
    gpu: Gpu,
    count: u32,
}

impl RowRun for EmptySubmits {
    fn sample(&mut self) -> Result<Sample, Failure> {
        let submit = || {
            for _ in 0..self.count {
                let encoder = self.gpu.device.create_command_encoder(&Default::default());
                let submission = self.gpu.queue.submit([encoder.finish()]);
                self.gpu.wait(submission)?;
            }
            Ok(())
        };
        Sample::take(submit, |()| Ok(()))
    }
}
