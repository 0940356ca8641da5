//! Dispatches, each after the one before, and uploads into a buffer.

use blade_graphics as gpu;
use lvk_bench::peers::{Failure, RowRun, Sample, UPLOAD_BYTES, upload_bytes};

use super::bindings::Numbers;
use super::device::Gpu;
use crate::wgsl;

const INPUTS: &str = "var<storage, read_write> numbers: array<u32>;";

/// Dispatches that add 1 to the numbers of a buffer, with a barrier behind each.
pub(super) struct Dispatches {
    gpu: Gpu,
    pipeline: gpu::ComputePipeline,
    numbers: gpu::Buffer,
    count: u32,
    samples: u32,
}

impl Dispatches {
    pub(super) fn new(mut gpu: Gpu, count: u32) -> Result<Self, Failure> {
        let layout = <Numbers as gpu::ShaderData>::layout();
        let pipeline = compute_pipeline(&gpu, &layout, &[INPUTS, wgsl::COUNT].concat(), "count")?;
        let numbers = gpu.buffer(256, gpu::Memory::Device);
        gpu.encoder.start();
        gpu.encoder.transfer("zero").fill_buffer(numbers.into(), 256, 0);
        let point = gpu.submit();
        gpu.wait(&point)?;
        Ok(Self { gpu, pipeline, numbers, count, samples: 0 })
    }
}

impl RowRun for Dispatches {
    fn sample(&mut self) -> Result<Sample, Failure> {
        self.samples += 1;
        let gpu = &mut self.gpu;
        let submit = || {
            gpu.encoder.start();
            let mut pass = gpu.encoder.compute("count");
            for _ in 0..self.count {
                let mut pipeline = pass.with(&self.pipeline);
                pipeline.bind(0, &Numbers { numbers: self.numbers.into() });
                pipeline.dispatch([1, 1, 1]);
                pass.barrier();
            }
            drop(pass);
            let point = gpu.submit();
            Ok((gpu, point))
        };
        Sample::take(submit, |(gpu, point)| gpu.wait(&point))
    }

    fn result(&mut self) -> Result<Option<f64>, Failure> {
        let bytes = self.gpu.read(self.numbers, 256)?;
        let last = bytes.last_chunk().copied().map_or(0, u32::from_ne_bytes);
        Ok(Some(f64::from(last) / f64::from(self.samples)))
    }
}

/// Uploads into one buffer, through one staging buffer.
pub(super) struct Uploads {
    gpu: Gpu,
    buffer: gpu::Buffer,
    staging: gpu::Buffer,
    count: u32,
}

impl Uploads {
    pub(super) fn new(gpu: Gpu, count: u32) -> Self {
        let bytes = u64::from(count) * UPLOAD_BYTES as u64;
        let [buffer, staging] =
            [gpu::Memory::Device, gpu::Memory::Upload].map(|memory| gpu.buffer(bytes, memory));
        Self { gpu, buffer, staging, count }
    }
}

impl RowRun for Uploads {
    fn sample(&mut self) -> Result<Sample, Failure> {
        let gpu = &mut self.gpu;
        let submit = || {
            gpu.encoder.start();
            for number in 0..self.count as usize {
                gpu.write(self.staging, number * UPLOAD_BYTES, &upload_bytes(number as u64))?;
            }
            let mut pass = gpu.encoder.transfer("uploads");
            for number in 0..u64::from(self.count) {
                let offset = number * UPLOAD_BYTES as u64;
                let (from, to) = (self.staging.at(offset), self.buffer.at(offset));
                pass.copy_buffer_to_buffer(from, to, UPLOAD_BYTES as u64);
            }
            drop(pass);
            let point = gpu.submit();
            Ok((gpu, point))
        };
        Sample::take(submit, |(gpu, point)| gpu.wait(&point))
    }

    fn result(&mut self) -> Result<Option<f64>, Failure> {
        let bytes = self.gpu.read(self.buffer, u64::from(self.count) * UPLOAD_BYTES as u64)?;
        Ok(Some(bytes.iter().map(|byte| f64::from(*byte)).sum()))
    }
}

/// Creates a compute pipeline.
pub(super) fn compute_pipeline(
    gpu: &Gpu,
    layout: &gpu::ShaderDataLayout,
    text: &str,
    entry_point: &str,
) -> Result<gpu::ComputePipeline, Failure> {
    let shader = gpu.shader(text)?;
    Ok(gpu.context.create_compute_pipeline(gpu::ComputePipelineDesc {
        name: "peer",
        data_layouts: &[layout],
        compute: shader.at(entry_point),
    }))
}
