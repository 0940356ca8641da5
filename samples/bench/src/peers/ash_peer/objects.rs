//! Creation and destruction of buffers and images.

use gpu_allocator::MemoryLocation;
use lvk::ash::vk;

use super::device::Device;
use super::memory::{Buffer, Image};
use crate::peers::peer::{Failure, RowRun, Sample};

pub(super) struct Buffers {
    pub(super) device: Device,
    pub(super) count: u32,
}

impl RowRun for Buffers {
    fn sample(&mut self) -> Result<Sample, Failure> {
        use vk::BufferUsageFlags as Usage;
        let usage = Usage::TRANSFER_SRC | Usage::TRANSFER_DST | Usage::STORAGE_BUFFER;
        let create = |_| Buffer::new(&self.device, 256, usage, MemoryLocation::GpuOnly);
        let submit = || {
            let made = (0..self.count).map(create).collect::<Result<Vec<_>, _>>()?;
            made.into_iter().try_for_each(|buffer| buffer.destroy(&self.device))
        };
        Sample::take(submit, |()| Ok(()))
    }
}

pub(super) struct Textures {
    pub(super) device: Device,
    pub(super) count: u32,
}

impl RowRun for Textures {
    fn sample(&mut self) -> Result<Sample, Failure> {
        use vk::ImageUsageFlags as Usage;
        let usage = Usage::TRANSFER_SRC | Usage::TRANSFER_DST | Usage::SAMPLED;
        let submit = || {
            let create = |_| Image::new(&self.device, 4, usage);
            let made = (0..self.count).map(create).collect::<Result<Vec<_>, _>>()?;
            made.into_iter().try_for_each(|image| image.destroy(&self.device))
        };
        Sample::take(submit, |()| Ok(()))
    }
}
