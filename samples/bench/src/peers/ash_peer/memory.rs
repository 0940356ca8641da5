//! Buffers and images with memory of `gpu-allocator`.

use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme};
use lvk::ash::vk;

use super::commands::Commands;
use super::device::Device;
use crate::peers::peer::Failure;

/// A buffer and its memory.
pub(super) struct Buffer {
    pub(super) raw: vk::Buffer,
    pub(super) address: u64,
    memory: Allocation,
}

impl Buffer {
    /// Creates a buffer. Its address is taken.
    pub(super) fn new(
        device: &Device,
        bytes: u64,
        usage: vk::BufferUsageFlags,
        location: MemoryLocation,
    ) -> Result<Self, Failure> {
        let usage = usage | vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS;
        let info = vk::BufferCreateInfo::default().size(bytes).usage(usage);
        // SAFETY: the description is valid; the memory fits the buffer and is bound once.
        unsafe {
            let raw = device.raw.create_buffer(&info, None)?;
            let memory = allocate(device, device.raw.get_buffer_memory_requirements(raw), true, location)?;
            device.raw.bind_buffer_memory(raw, memory.memory(), memory.offset())?;
            let info = vk::BufferDeviceAddressInfo::default().buffer(raw);
            Ok(Self { raw, address: device.raw.get_buffer_device_address(&info), memory })
        }
    }

    /// Creates a buffer that the host has written.
    pub(super) fn with_bytes(
        device: &Device,
        bytes: &[u8],
        usage: vk::BufferUsageFlags,
    ) -> Result<Self, Failure> {
        let mut made = Self::new(device, bytes.len() as u64, usage, MemoryLocation::CpuToGpu)?;
        made.mapped()?[..bytes.len()].copy_from_slice(bytes);
        Ok(made)
    }

    /// Returns the bytes that the host sees.
    pub(super) fn mapped(&mut self) -> Result<&mut [u8], Failure> {
        self.memory.mapped_slice_mut().ok_or_else(|| "memory that the host does not see".into())
    }

    /// Destroys the buffer. The GPU has finished with it.
    pub(super) fn destroy(self, device: &Device) -> Result<(), Failure> {
        // SAFETY: the GPU has finished with the buffer, and nothing else names it.
        unsafe { device.raw.destroy_buffer(self.raw, None) };
        Ok(device.allocator.borrow_mut().free(self.memory)?)
    }

    /// Copies the first `bytes` bytes to the host.
    pub(super) fn read(
        &self,
        device: &Device,
        commands: &mut Commands,
        bytes: usize,
    ) -> Result<Vec<u8>, Failure> {
        let usage = vk::BufferUsageFlags::TRANSFER_DST;
        let mut copy = Self::new(device, bytes as u64, usage, MemoryLocation::GpuToCpu)?;
        let list = commands.begin(device)?;
        let region = [vk::BufferCopy::default().size(bytes as u64)];
        // SAFETY: both buffers hold as many bytes, and earlier writes were waited for.
        unsafe { device.raw.cmd_copy_buffer(list, self.raw, copy.raw, &region) };
        commands.submit(device)?;
        commands.wait(device)?;
        let found = copy.mapped()?[..bytes].to_vec();
        copy.destroy(device)?;
        Ok(found)
    }
}

/// A 2D image of one mip with its view and memory.
pub(super) struct Image {
    pub(super) raw: vk::Image,
    pub(super) view: vk::ImageView,
    memory: Allocation,
}

impl Image {
    /// Creates an image of `side` x `side` texels of four bytes.
    pub(super) fn new(device: &Device, side: u32, usage: vk::ImageUsageFlags) -> Result<Self, Failure> {
        let info = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(vk::Format::R8G8B8A8_UNORM)
            .extent(vk::Extent3D { width: side, height: side, depth: 1 })
            .mip_levels(1)
            .array_layers(1)
            .samples(vk::SampleCountFlags::TYPE_1)
            .usage(usage);
        let view = vk::ImageViewCreateInfo::default()
            .view_type(vk::ImageViewType::TYPE_2D)
            .format(vk::Format::R8G8B8A8_UNORM)
            .subresource_range(COLOR);
        // SAFETY: every device has images of this format; the memory fits the image and is bound once.
        unsafe {
            let raw = device.raw.create_image(&info, None)?;
            let needed = device.raw.get_image_memory_requirements(raw);
            let memory = allocate(device, needed, false, MemoryLocation::GpuOnly)?;
            device.raw.bind_image_memory(raw, memory.memory(), memory.offset())?;
            let view = device.raw.create_image_view(&view.image(raw), None)?;
            Ok(Self { raw, view, memory })
        }
    }

    /// Destroys the image. The GPU has finished with it.
    pub(super) fn destroy(self, device: &Device) -> Result<(), Failure> {
        // SAFETY: the GPU has finished with both, and nothing else names them.
        unsafe {
            device.raw.destroy_image_view(self.view, None);
            device.raw.destroy_image(self.raw, None);
        }
        Ok(device.allocator.borrow_mut().free(self.memory)?)
    }
}

/// The only mip and layer of a colour image.
pub(super) const COLOR: vk::ImageSubresourceRange = vk::ImageSubresourceRange {
    aspect_mask: vk::ImageAspectFlags::COLOR,
    base_mip_level: 0,
    level_count: 1,
    base_array_layer: 0,
    layer_count: 1,
};

fn allocate(
    device: &Device,
    requirements: vk::MemoryRequirements,
    linear: bool,
    location: MemoryLocation,
) -> Result<Allocation, Failure> {
    let allocation_scheme = AllocationScheme::GpuAllocatorManaged;
    let desc = AllocationCreateDesc { name: "", requirements, location, linear, allocation_scheme };
    Ok(device.allocator.borrow_mut().allocate(&desc)?)
}
