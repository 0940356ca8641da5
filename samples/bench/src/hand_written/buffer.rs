//! A buffer with its own memory.

use std::rc::Rc;

use lvk::ash::vk;

use super::RawDevice;
use crate::error::BenchError;

/// A buffer with its own memory, destroyed on drop. The GPU must have finished with the buffer.
pub(super) struct RawBuffer {
    pub(super) raw: vk::Buffer,
    pub(super) address: u64,
    memory: vk::DeviceMemory,
    device: Rc<RawDevice>,
}

impl RawBuffer {
    /// Creates a device-local buffer.
    pub(super) fn new(
        device: &Rc<RawDevice>,
        bytes: u64,
        usage: vk::BufferUsageFlags,
    ) -> Result<Self, BenchError> {
        Self::create(device, bytes, usage, vk::MemoryPropertyFlags::DEVICE_LOCAL)
    }

    /// Creates a host-visible buffer, device-local if possible.
    pub(super) fn writable(
        device: &Rc<RawDevice>,
        bytes: u64,
        usage: vk::BufferUsageFlags,
    ) -> Result<Self, BenchError> {
        let wanted = vk::MemoryPropertyFlags::HOST_VISIBLE | vk::MemoryPropertyFlags::HOST_COHERENT;
        let best = wanted | vk::MemoryPropertyFlags::DEVICE_LOCAL;
        Self::create(device, bytes, usage, best).or_else(|_| Self::create(device, bytes, usage, wanted))
    }

    /// Writes bytes at `offset` of a host-visible buffer that the GPU does not use.
    pub(super) fn write(&self, offset: u64, contents: &[u8]) -> Result<(), BenchError> {
        let (device, flags) = (&self.device.device, vk::MemoryMapFlags::empty());
        // SAFETY: the caller writes inside the buffer, whose memory is visible to the host and mapped only here.
        unsafe {
            let map = device.map_memory(self.memory, offset, contents.len() as u64, flags);
            let mapped = map.map_err(BenchError::hand_written("vkMapMemory"))?;
            mapped.cast::<u8>().copy_from_nonoverlapping(contents.as_ptr(), contents.len());
            device.unmap_memory(self.memory);
        }
        Ok(())
    }

    fn create(
        device: &Rc<RawDevice>,
        bytes: u64,
        usage: vk::BufferUsageFlags,
        wanted: vk::MemoryPropertyFlags,
    ) -> Result<Self, BenchError> {
        let usage = usage | vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS;
        let info = vk::BufferCreateInfo::default().size(bytes.max(1)).usage(usage);
        // SAFETY: the description is valid and its usage belongs to features that are on.
        let raw = unsafe { device.device.create_buffer(&info, None) }
            .map_err(BenchError::hand_written("vkCreateBuffer"))?;
        let mut buffer =
            Self { raw, address: 0, memory: vk::DeviceMemory::null(), device: Rc::clone(device) };
        buffer.allocate(wanted)?;
        let info = vk::BufferDeviceAddressInfo::default().buffer(raw);
        // SAFETY: the buffer has memory and the usage.
        buffer.address = unsafe { device.device.get_buffer_device_address(&info) };
        Ok(buffer)
    }

    fn allocate(&mut self, wanted: vk::MemoryPropertyFlags) -> Result<(), BenchError> {
        let device = &self.device.device;
        // SAFETY: the buffer is alive.
        let needed = unsafe { device.get_buffer_memory_requirements(self.raw) };
        let none =
            || BenchError::hand_written("choosing a memory type")(vk::Result::ERROR_FEATURE_NOT_PRESENT);
        let memory_type = self.device.memory_type(needed.memory_type_bits, wanted).ok_or_else(none)?;
        let mut flags = vk::MemoryAllocateFlagsInfo::default().flags(vk::MemoryAllocateFlags::DEVICE_ADDRESS);
        let info = vk::MemoryAllocateInfo::default()
            .allocation_size(needed.size)
            .memory_type_index(memory_type)
            .push_next(&mut flags);
        // SAFETY: the type exists, and the size is what the buffer needs.
        self.memory = unsafe { device.allocate_memory(&info, None) }
            .map_err(BenchError::hand_written("vkAllocateMemory"))?;
        // SAFETY: the memory is new and fits the buffer.
        unsafe { device.bind_buffer_memory(self.raw, self.memory, 0) }
            .map_err(BenchError::hand_written("vkBindBufferMemory"))
    }
}

impl Drop for RawBuffer {
    fn drop(&mut self) {
        // SAFETY: every submission of the benchmarks is waited for, so the GPU is done with both.
        unsafe {
            self.device.device.destroy_buffer(self.raw, None);
            self.device.device.free_memory(self.memory, None);
        }
    }
}
