//! Uploads into a buffer, and dispatches that write one.

use lvk::{
    BufferDesc, BufferHandle, ComputePipelineDesc, ComputePipelineHandle, Context, Dependencies, Holder,
    ShaderStage,
};

use super::module;
use crate::peers::peer::{Failure, RowRun, Sample};
use crate::peers::workload::{UPLOAD_BYTES, upload_bytes};

const COUNT: &str = "
    layout(local_size_x = 64) in;
    layout(buffer_reference, scalar) buffer Numbers { uint at[]; };
    layout(push_constant) uniform Push { Numbers numbers; };
    void main() { numbers.at[gl_GlobalInvocationID.x] += 1; }";

/// Dispatches, each after the one before.
pub(super) struct Dispatches {
    ctx: Context,
    pipeline: Holder<ComputePipelineHandle>,
    numbers: Holder<BufferHandle>,
    count: u32,
    samples: u32,
}

impl Dispatches {
    pub(super) fn new(ctx: Context, count: u32) -> Result<Self, Failure> {
        let shader = module(&ctx, ShaderStage::Compute, COUNT)?;
        let desc = ComputePipelineDesc { module: Some(*shader), ..ComputePipelineDesc::default() };
        let pipeline = ctx.create_compute_pipeline(&desc)?;
        let numbers = ctx.create_buffer(&BufferDesc { data: Some(&[0; 256]), ..BufferDesc::default() })?;
        ctx.wait(ctx.flush()?)?;
        Ok(Self { ctx, pipeline, numbers, count, samples: 0 })
    }
}

impl RowRun for Dispatches {
    fn sample(&mut self) -> Result<Sample, Failure> {
        self.samples += 1;
        let submit = || {
            let mut cmd = self.ctx.acquire_command_buffer()?;
            cmd.bind_compute_pipeline(*self.pipeline)?;
            cmd.push_constants(&self.numbers.address()?)?;
            let writes = Dependencies { buffers: &[*self.numbers], ..Dependencies::default() };
            for _ in 0..self.count {
                cmd.dispatch([1, 1, 1], &writes)?;
            }
            Ok(self.ctx.submit(cmd)?)
        };
        Sample::take(submit, |submission| Ok(self.ctx.wait(submission)?))
    }

    fn result(&mut self) -> Result<Option<f64>, Failure> {
        let mut numbers = [0_u32; 64];
        self.ctx.download_buffer(*self.numbers, 0, bytemuck::cast_slice_mut(&mut numbers))?;
        Ok(Some(f64::from(numbers[63]) / f64::from(self.samples)))
    }
}

/// Uploads into one buffer.
pub(super) struct Uploads {
    ctx: Context,
    buffer: Holder<BufferHandle>,
    count: u32,
}

impl Uploads {
    pub(super) fn new(ctx: Context, count: u32) -> Result<Self, Failure> {
        let size_bytes = u64::from(count) * UPLOAD_BYTES as u64;
        let buffer = ctx.create_buffer(&BufferDesc { size_bytes, ..BufferDesc::default() })?;
        Ok(Self { ctx, buffer, count })
    }
}

impl RowRun for Uploads {
    fn sample(&mut self) -> Result<Sample, Failure> {
        let submit = || {
            for number in 0..u64::from(self.count) {
                let offset = number * UPLOAD_BYTES as u64;
                self.ctx.upload_buffer(*self.buffer, offset, &upload_bytes(number))?;
            }
            Ok(self.ctx.flush()?)
        };
        Sample::take(submit, |submission| Ok(self.ctx.wait(submission)?))
    }

    fn result(&mut self) -> Result<Option<f64>, Failure> {
        let mut bytes = vec![0_u8; self.count as usize * UPLOAD_BYTES];
        self.ctx.download_buffer(*self.buffer, 0, &mut bytes)?;
        Ok(Some(bytes.iter().map(|byte| f64::from(*byte)).sum()))
    }
}
