//! The rows by `vk-graph`.

mod accel_structs;
mod compute;
mod device;
mod draws;
mod objects;
mod rays;
mod scene;
mod textured;

use lvk_bench::peers::{Failure, Peer, PeerDevice, PeerEntry, Program, Row, RowRun, Sample, Workload};
use vk_graph::Graph;

use device::Gpu;

const TRIANGLE: &[(&str, &[u8])] = &[
    ("triangle_vk_graph.rs", include_bytes!("../../examples/triangle_vk_graph.rs")),
    ("triangle.vert.glsl", include_bytes!("../../../bench/examples/triangle.vert.glsl")),
    ("triangle.frag.glsl", include_bytes!("../../../bench/examples/triangle.frag.glsl")),
    ("triangle.vert.spv", include_bytes!("../../examples/triangle.vert.spv")),
    ("triangle.frag.spv", include_bytes!("../../examples/triangle.frag.spv")),
];

/// `vk-graph`.
pub(crate) const ENTRY: PeerEntry = PeerEntry {
    name: "vk-graph",
    package: "vk-graph",
    open: || Ok(Box::new(VkGraphPeer { gpu: Gpu::new()? })),
    triangles: &[Program { label: "vk-graph", dependencies: "vk-graph = \"0.14\"", files: TRIANGLE }],
};

struct VkGraphPeer {
    gpu: Gpu,
}

impl Peer for VkGraphPeer {
    fn device(&self) -> PeerDevice {
        self.gpu.description()
    }

    fn prepare(self: Box<Self>, row: Row, work: &Workload) -> Result<Box<dyn RowRun>, Failure> {
        let gpu = self.gpu;
        Ok(match row {
            Row::EmptySubmit => Box::new(EmptySubmits { gpu, count: work.submits }),
            Row::Buffers => Box::new(objects::Buffers { gpu, count: work.objects }),
            Row::Textures => Box::new(objects::Textures { gpu, count: work.objects }),
            Row::Draws => Box::new(draws::Draws::new(gpu, work.draws)?),
            Row::Dispatches => Box::new(compute::Dispatches::new(gpu, work.dispatches)?),
            Row::Uploads => Box::new(compute::Uploads::new(gpu, work.uploads)?),
            Row::BlasBuilds => Box::new(accel_structs::BlasBuilds::new(gpu, work)?),
            Row::TlasBuild => Box::new(accel_structs::TlasBuild::new(gpu, work)?),
            Row::RayQueryFrame => Box::new(rays::RayQueryFrame::new(gpu, work)?),
            Row::RayPipelineFrame => Box::new(rays::RayPipelineFrame::new(gpu, work)?),
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
        let submit = || (0..self.count).try_for_each(|_| self.gpu.run(Graph::default()));
        Sample::take(submit, |()| Ok(()))
    }
}
