//! The rows by plain `ash`, written by hand, with memory from `gpu-allocator`.
//!
//! Rows destroy only what they create again in each sample: the process ends after a row.

mod accel_structs;
mod commands;
mod compute;
mod device;
mod draws;
mod memory;
mod objects;
mod pipelines;
mod ray_pipeline;
mod ray_query;
mod ray_structures;
mod textured;
mod uploads;

use super::peer::{Failure, Peer, PeerDevice, PeerEntry, RowRun, Sample};
use super::program::Program;
use super::row::Row;
use super::workload::Workload;
use commands::Commands;
use device::Device;

const TRIANGLE: &[(&str, &[u8])] = &[
    ("triangle_ash.rs", include_bytes!("../../../examples/triangle_ash.rs")),
    ("triangle.vert.glsl", include_bytes!("../../../examples/triangle.vert.glsl")),
    ("triangle.frag.glsl", include_bytes!("../../../examples/triangle.frag.glsl")),
    ("triangle.vert.spv", include_bytes!("../../../examples/triangle.vert.spv")),
    ("triangle.frag.spv", include_bytes!("../../../examples/triangle.frag.spv")),
];

/// Plain `ash`.
pub(super) const ENTRY: PeerEntry = PeerEntry {
    name: "ash",
    package: "ash",
    open: || Ok(Box::new(AshPeer { device: Device::new()? })),
    triangles: &[Program { label: "ash", dependencies: "ash = \"0.38\"", files: TRIANGLE }],
};

struct AshPeer {
    device: Device,
}

impl Peer for AshPeer {
    fn device(&self) -> PeerDevice {
        self.device.description()
    }

    fn prepare(self: Box<Self>, row: Row, work: &Workload) -> Result<Box<dyn RowRun>, Failure> {
        let device = self.device;
        Ok(match row {
            Row::EmptySubmit => Box::new(EmptySubmits::new(device, work.submits)?),
            Row::Buffers => Box::new(objects::Buffers { device, count: work.objects }),
            Row::Textures => Box::new(objects::Textures { device, count: work.objects }),
            Row::Draws => Box::new(draws::Draws::new(device, work.draws)?),
            Row::Dispatches => Box::new(compute::Dispatches::new(device, work.dispatches)?),
            Row::Uploads => Box::new(uploads::Uploads::new(device, work.uploads)?),
            Row::BlasBuilds => Box::new(accel_structs::BlasBuilds::new(device, work)?),
            Row::TlasBuild => Box::new(accel_structs::TlasBuild::new(device, work)?),
            Row::RayQueryFrame => Box::new(ray_query::RayQueryFrame::new(device, work)?),
            Row::RayPipelineFrame => Box::new(ray_pipeline::RayPipelineFrame::new(device, work)?),
            Row::TexturedFrame => Box::new(textured::Textured::new(device, work)?),
        })
    }
}

struct EmptySubmits {
    device: Device,
    commands: Commands,
    count: u32,
}

impl EmptySubmits {
    fn new(device: Device, count: u32) -> Result<Self, Failure> {
        Ok(Self { commands: Commands::new(&device)?, device, count })
    }
}

impl RowRun for EmptySubmits {
    fn sample(&mut self) -> Result<Sample, Failure> {
        let submit = || {
            for _ in 0..self.count {
                self.commands.begin(&self.device)?;
                self.commands.submit(&self.device)?;
                self.commands.wait(&self.device)?;
            }
            Ok(())
        };
        Sample::take(submit, |()| Ok(()))
    }
}
