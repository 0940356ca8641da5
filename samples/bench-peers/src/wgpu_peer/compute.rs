//! Dispatches, each after the one before, and uploads into a buffer.

use lvk_bench::peers::{Failure, RowRun, Sample, UPLOAD_BYTES, upload_bytes};

use super::device::Gpu;
use crate::wgsl;

const INPUTS: &str = "@group(0) @binding(0) var<storage, read_write> numbers: array<u32>;";

/// Dispatches that add 1 to the numbers of a buffer. wgpu finds that each needs a barrier.
pub(super) struct Dispatches {
    gpu: Gpu,
    pipeline: wgpu::ComputePipeline,
    group: wgpu::BindGroup,
    numbers: wgpu::Buffer,
    count: u32,
    samples: u32,
}

impl Dispatches {
    pub(super) fn new(gpu: Gpu, count: u32) -> Self {
        let pipeline = compute_pipeline(&gpu, None, &[INPUTS, wgsl::COUNT].concat(), "count");
        let numbers = gpu.storage(256);
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &pipeline.get_bind_group_layout(0),
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: numbers.as_entire_binding() }],
        });
        Self { gpu, pipeline, group, numbers, count, samples: 0 }
    }
}

impl RowRun for Dispatches {
    fn sample(&mut self) -> Result<Sample, Failure> {
        self.samples += 1;
        let submit = || {
            let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, &self.group, &[]);
            for _ in 0..self.count {
                pass.dispatch_workgroups(1, 1, 1);
            }
            drop(pass);
            Ok(self.gpu.queue.submit([encoder.finish()]))
        };
        Sample::take(submit, |submission| self.gpu.wait(submission))
    }

    fn result(&mut self) -> Result<Option<f64>, Failure> {
        let bytes = self.gpu.read_buffer(&self.numbers, 256)?;
        let last = bytes.last_chunk().copied().map_or(0, u32::from_ne_bytes);
        Ok(Some(f64::from(last) / f64::from(self.samples)))
    }
}

/// Uploads into one buffer.
pub(super) struct Uploads {
    gpu: Gpu,
    buffer: wgpu::Buffer,
    count: u32,
}

impl Uploads {
    pub(super) fn new(gpu: Gpu, count: u32) -> Self {
        Self { buffer: gpu.storage(u64::from(count) * UPLOAD_BYTES as u64), gpu, count }
    }
}

impl RowRun for Uploads {
    fn sample(&mut self) -> Result<Sample, Failure> {
        let submit = || {
            for number in 0..u64::from(self.count) {
                let offset = number * UPLOAD_BYTES as u64;
                self.gpu.queue.write_buffer(&self.buffer, offset, &upload_bytes(number));
            }
            Ok(self.gpu.queue.submit([]))
        };
        Sample::take(submit, |submission| self.gpu.wait(submission))
    }

    fn result(&mut self) -> Result<Option<f64>, Failure> {
        let bytes = self.gpu.read_buffer(&self.buffer, u64::from(self.count) * UPLOAD_BYTES as u64)?;
        Ok(Some(bytes.iter().map(|byte| f64::from(*byte)).sum()))
    }
}

/// Creates a compute pipeline with this layout, or that of the shader.
pub(super) fn compute_pipeline(
    gpu: &Gpu,
    layout: Option<&wgpu::PipelineLayout>,
    text: &str,
    entry_point: &str,
) -> wgpu::ComputePipeline {
    gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: None,
        layout,
        module: &gpu.shader(text),
        entry_point: Some(entry_point),
        compilation_options: Default::default(),
        cache: None,
    })
}
