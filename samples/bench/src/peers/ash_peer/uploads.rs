//! Uploads through one mapped staging buffer.

use gpu_allocator::MemoryLocation;
use lvk::ash::vk;

use super::commands::Commands;
use super::device::Device;
use super::memory::Buffer;
use crate::peers::peer::{Failure, RowRun, Sample};
use crate::peers::workload::{UPLOAD_BYTES, upload_bytes};

/// Uploads into one buffer, by one copy command.
pub(super) struct Uploads {
    device: Device,
    commands: Commands,
    buffer: Buffer,
    staging: Buffer,
    count: u32,
}

impl Uploads {
    pub(super) fn new(device: Device, count: u32) -> Result<Self, Failure> {
        let bytes = u64::from(count) * UPLOAD_BYTES as u64;
        let usage = vk::BufferUsageFlags::TRANSFER_DST | vk::BufferUsageFlags::TRANSFER_SRC;
        let buffer = Buffer::new(&device, bytes, usage, MemoryLocation::GpuOnly)?;
        let usage = vk::BufferUsageFlags::TRANSFER_SRC;
        let staging = Buffer::new(&device, bytes, usage, MemoryLocation::CpuToGpu)?;
        Ok(Self { commands: Commands::new(&device)?, buffer, staging, count, device })
    }
}

impl RowRun for Uploads {
    fn sample(&mut self) -> Result<Sample, Failure> {
        let (device, commands) = (&self.device, &mut self.commands);
        let submit = || {
            let list = commands.begin(device)?;
            let mapped = self.staging.mapped()?;
            let mut regions = Vec::with_capacity(self.count as usize);
            for number in 0..self.count as usize {
                let offset = number * UPLOAD_BYTES;
                mapped[offset..offset + UPLOAD_BYTES].copy_from_slice(&upload_bytes(number as u64));
                let offset = offset as u64;
                regions.push(vk::BufferCopy {
                    src_offset: offset,
                    dst_offset: offset,
                    size: UPLOAD_BYTES as u64,
                });
            }
            // SAFETY: both buffers hold all regions, which do not overlap.
            unsafe { device.raw.cmd_copy_buffer(list, self.staging.raw, self.buffer.raw, &regions) };
            commands.submit(device)?;
            Ok(commands)
        };
        Sample::take(submit, |commands| commands.wait(device))
    }

    fn result(&mut self) -> Result<Option<f64>, Failure> {
        let bytes = self.buffer.read(&self.device, &mut self.commands, self.count as usize * UPLOAD_BYTES)?;
        Ok(Some(bytes.iter().map(|byte| f64::from(*byte)).sum()))
    }
}
