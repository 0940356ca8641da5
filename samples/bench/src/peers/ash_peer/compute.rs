//! Dispatches, each after the one before.

use gpu_allocator::MemoryLocation;
use lvk::ash::vk;

use super::commands::{Commands, memory_barrier};
use super::device::Device;
use super::memory::Buffer;
use super::pipelines::{Layout, Pipeline, write_buffer};
use crate::peers::glsl::COUNT_COMPUTE;
use crate::peers::peer::{Failure, RowRun, Sample};

const SHADER_ACCESS: vk::AccessFlags2 = vk::AccessFlags2::from_raw(
    vk::AccessFlags2::SHADER_READ.as_raw() | vk::AccessFlags2::SHADER_WRITE.as_raw(),
);

/// Dispatches that add 1 to the numbers of a buffer.
pub(super) struct Dispatches {
    device: Device,
    commands: Commands,
    pipeline: Pipeline,
    numbers: Buffer,
    count: u32,
    samples: u32,
}

impl Dispatches {
    pub(super) fn new(device: Device, count: u32) -> Result<Self, Failure> {
        let layout = Layout::new(&device, 0, &[(vk::DescriptorType::STORAGE_BUFFER, 1)])?;
        let pipeline = Pipeline::compute(&device, layout, COUNT_COMPUTE)?;
        let copied = vk::BufferUsageFlags::TRANSFER_SRC | vk::BufferUsageFlags::TRANSFER_DST;
        let usage = vk::BufferUsageFlags::STORAGE_BUFFER | copied;
        let numbers = Buffer::new(&device, 256, usage, MemoryLocation::GpuOnly)?;
        write_buffer(&device, pipeline.set.ok_or("no descriptor set")?, 0, numbers.raw);
        let mut commands = Commands::new(&device)?;
        let list = commands.begin(&device)?;
        // SAFETY: the buffer can be filled, and nothing uses it yet.
        unsafe { device.raw.cmd_fill_buffer(list, numbers.raw, 0, vk::WHOLE_SIZE, 0) };
        let filled = (vk::PipelineStageFlags2::CLEAR, vk::AccessFlags2::TRANSFER_WRITE);
        memory_barrier(&device, list, filled, (vk::PipelineStageFlags2::COMPUTE_SHADER, SHADER_ACCESS));
        commands.submit(&device)?;
        commands.wait(&device)?;
        Ok(Self { commands, pipeline, numbers, count, samples: 0, device })
    }
}

impl RowRun for Dispatches {
    fn sample(&mut self) -> Result<Sample, Failure> {
        self.samples += 1;
        let (device, commands) = (&self.device, &mut self.commands);
        let submit = || {
            let list = commands.begin(device)?;
            self.pipeline.bind(device, list, vk::PipelineBindPoint::COMPUTE, &[]);
            let stage = vk::PipelineStageFlags2::COMPUTE_SHADER;
            for _ in 0..self.count {
                memory_barrier(device, list, (stage, vk::AccessFlags2::SHADER_WRITE), (stage, SHADER_ACCESS));
                // SAFETY: pipeline and set are bound.
                unsafe { device.raw.cmd_dispatch(list, 1, 1, 1) };
            }
            commands.submit(device)?;
            Ok(commands)
        };
        Sample::take(submit, |commands| commands.wait(device))
    }

    fn result(&mut self) -> Result<Option<f64>, Failure> {
        let bytes = self.numbers.read(&self.device, &mut self.commands, 256)?;
        let numbers: &[u32] = bytemuck::try_cast_slice(&bytes).map_err(|error| error.to_string())?;
        Ok(Some(f64::from(numbers[63]) / f64::from(self.samples)))
    }
}
