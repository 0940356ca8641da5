//! Dispatches, each after the one before, and uploads into a buffer.

use std::sync::Arc;

use vk_graph::Graph;
use vk_graph::driver::ash::vk;
use vk_graph::driver::buffer::Buffer;
use vk_graph::driver::compute::{ComputePipeline, ComputePipelineInfo};
use vk_graph::driver::sync::AccessType;

use lvk_bench::peers::{COUNT_COMPUTE, Failure, GlslStage, RowRun, Sample, UPLOAD_BYTES, upload_bytes};

use super::device::{Gpu, shader, wait};

/// Dispatches that add 1 to the numbers of a buffer, each a command of the graph.
pub(super) struct Dispatches {
    gpu: Gpu,
    pipeline: ComputePipeline,
    numbers: Arc<Buffer>,
    count: u32,
    samples: u32,
}

impl Dispatches {
    pub(super) fn new(gpu: Gpu, count: u32) -> Result<Self, Failure> {
        let shader = shader(GlslStage::Compute, COUNT_COMPUTE)?;
        let pipeline = ComputePipeline::create(&gpu.device, ComputePipelineInfo::default(), shader)?;
        let usage = vk::BufferUsageFlags::STORAGE_BUFFER | vk::BufferUsageFlags::TRANSFER_SRC;
        let numbers = gpu.buffer_with(&[0; 256], usage)?;
        Ok(Self { gpu, pipeline, numbers, count, samples: 0 })
    }
}

impl RowRun for Dispatches {
    fn sample(&mut self) -> Result<Sample, Failure> {
        self.samples += 1;
        let submit = || {
            let mut graph = Graph::default();
            let numbers = graph.bind_resource(&self.numbers);
            for _ in 0..self.count {
                graph
                    .begin_cmd()
                    .bind_pipeline(&self.pipeline)
                    .shader_resource_access(0, numbers, AccessType::ComputeShaderReadWrite)
                    .record_cmd(|cmd| {
                        cmd.dispatch(1, 1, 1);
                    });
            }
            self.gpu.submit(graph)
        };
        Sample::take(submit, wait)
    }

    fn result(&mut self) -> Result<Option<f64>, Failure> {
        let bytes = self.gpu.read(&self.numbers, 256)?;
        let last = bytes.last_chunk().copied().map_or(0, u32::from_ne_bytes);
        Ok(Some(f64::from(last) / f64::from(self.samples)))
    }
}

/// Uploads into one buffer, each an update by a command of the graph.
pub(super) struct Uploads {
    gpu: Gpu,
    buffer: Arc<Buffer>,
    count: u32,
}

impl Uploads {
    pub(super) fn new(gpu: Gpu, count: u32) -> Result<Self, Failure> {
        let bytes = u64::from(count) * UPLOAD_BYTES as u64;
        let usage = vk::BufferUsageFlags::TRANSFER_SRC | vk::BufferUsageFlags::TRANSFER_DST;
        Ok(Self { buffer: gpu.buffer(bytes, usage)?, gpu, count })
    }
}

impl RowRun for Uploads {
    fn sample(&mut self) -> Result<Sample, Failure> {
        let submit = || {
            let mut graph = Graph::default();
            let buffer = graph.bind_resource(&self.buffer);
            for number in 0..u64::from(self.count) {
                let offset = number * UPLOAD_BYTES as u64;
                graph.update_buffer(buffer, offset, upload_bytes(number));
            }
            self.gpu.submit(graph)
        };
        Sample::take(submit, wait)
    }

    fn result(&mut self) -> Result<Option<f64>, Failure> {
        let bytes = self.gpu.read(&self.buffer, u64::from(self.count) * UPLOAD_BYTES as u64)?;
        Ok(Some(bytes.iter().map(|byte| f64::from(*byte)).sum()))
    }
}
