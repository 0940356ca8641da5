//! Creates and destroys buffers and images by the minimal Vulkan calls.

use std::cell::Cell;
use std::time::Instant;

use gpu_allocator::vulkan::{
    Allocation, AllocationCreateDesc, AllocationScheme, Allocator, AllocatorCreateDesc,
};
use gpu_allocator::{AllocationSizes, AllocatorDebugSettings, MemoryLocation};
use lvk::Context;
use lvk::ash::{self, vk};

use crate::error::BenchError;
use crate::measure::elapsed_ms;

/// Objects that exist before all of them are destroyed: as many as the library's deferred free list holds.
const AT_ONCE: usize = 256;

/// Memory of the objects.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Memory {
    /// A suballocation per object.
    Allocated,
    /// One preallocated suballocation for all objects: the driver's part remains.
    Preallocated,
}

/// Creates and destroys objects.
pub(crate) struct RawObjects {
    /// Memory of objects with [`Memory::Preallocated`].
    preallocated: Allocation,
    allocator: Allocator,
    descriptors: Descriptors,
    device: ash::Device,
    /// Keeps the device alive.
    _ctx: Context,
}

/// An object to destroy.
enum RawObject {
    Buffer(vk::Buffer),
    TracedImage(vk::Image, vk::ImageView),
}

impl RawObjects {
    pub(crate) fn new(ctx: &Context) -> Result<Self, BenchError> {
        let mut debug_settings = AllocatorDebugSettings::default();
        debug_settings.log_leaks_on_shutdown = false;
        let mut allocator = Allocator::new(&AllocatorCreateDesc {
            instance: ctx.raw_instance().clone(),
            device: ctx.raw_device().clone(),
            physical_device: ctx.raw_physical_device(),
            debug_settings,
            buffer_device_address: true,
            allocation_sizes: AllocationSizes::default(),
        })
        .map_err(no_memory)?;
        let preallocated =
            vk::MemoryRequirements { size: 1 << 20, alignment: 1 << 16, memory_type_bits: u32::MAX };
        let preallocated = allocate(&mut allocator, preallocated, true)?;
        let device = ctx.raw_device().clone();
        let descriptors = Descriptors::new(&device)?;
        Ok(Self { preallocated, allocator, descriptors, device, _ctx: ctx.clone() })
    }

    /// Returns the milliseconds to create and destroy `count` buffers of `bytes` bytes.
    pub(crate) fn buffers(&mut self, count: u32, bytes: u64, memory: Memory) -> Result<f64, BenchError> {
        self.create_and_destroy(count, |objects| objects.buffer(bytes, memory))
    }

    /// Returns the milliseconds to create and destroy `count` sampled images of 4 x 4 texels with their views.
    pub(crate) fn textures(&mut self, count: u32, memory: Memory) -> Result<f64, BenchError> {
        self.create_and_destroy(count, |objects| objects.texture(memory))
    }

    /// As [`textures`](Self::textures), each with a descriptor.
    pub(crate) fn written_textures(&mut self, count: u32, memory: Memory) -> Result<f64, BenchError> {
        self.create_and_destroy(count, |objects| {
            let made = objects.texture(memory)?;
            if let RawObject::TracedImage(_, view) = made.0 {
                objects.descriptors.write(view);
            }
            Ok(made)
        })
    }

    fn create_and_destroy(
        &mut self,
        count: u32,
        make: impl Fn(&mut Self) -> Result<(RawObject, Option<Allocation>), BenchError>,
    ) -> Result<f64, BenchError> {
        let start = Instant::now();
        let mut made = Vec::with_capacity(AT_ONCE);
        for _ in 0..count {
            made.push(make(self)?);
            if made.len() == AT_ONCE {
                self.destroy(&mut made)?;
            }
        }
        self.destroy(&mut made)?;
        Ok(elapsed_ms(start))
    }

    fn buffer(&mut self, bytes: u64, memory: Memory) -> Result<(RawObject, Option<Allocation>), BenchError> {
        use vk::BufferUsageFlags as Usage;
        let usage = Usage::TRANSFER_SRC | Usage::TRANSFER_DST | Usage::STORAGE_BUFFER;
        let info = vk::BufferCreateInfo::default().size(bytes).usage(usage | Usage::SHADER_DEVICE_ADDRESS);
        // SAFETY: the description is valid and its usage belongs to features that are on.
        let raw = unsafe { self.device.create_buffer(&info, None) }
            .map_err(BenchError::hand_written("vkCreateBuffer"))?;
        // SAFETY: the buffer is alive.
        let needed = unsafe { self.device.get_buffer_memory_requirements(raw) };
        let own = self.memory(needed, true, memory)?;
        let place = own.as_ref().unwrap_or(&self.preallocated);
        // SAFETY: the memory fits the buffer, is bound once, and no command uses either.
        unsafe {
            let bound = self.device.bind_buffer_memory(raw, place.memory(), place.offset());
            bound.map_err(BenchError::hand_written("vkBindBufferMemory"))?;
            let info = vk::BufferDeviceAddressInfo::default().buffer(raw);
            std::hint::black_box(self.device.get_buffer_device_address(&info));
        }
        Ok((RawObject::Buffer(raw), own))
    }

    fn texture(&mut self, memory: Memory) -> Result<(RawObject, Option<Allocation>), BenchError> {
        use vk::ImageUsageFlags as Usage;
        let info = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(vk::Format::R8G8B8A8_UNORM)
            .extent(vk::Extent3D { width: 4, height: 4, depth: 1 })
            .mip_levels(1)
            .array_layers(1)
            .samples(vk::SampleCountFlags::TYPE_1)
            .usage(Usage::TRANSFER_SRC | Usage::TRANSFER_DST | Usage::SAMPLED);
        // SAFETY: every device has sampled images of this format.
        let raw = unsafe { self.device.create_image(&info, None) }
            .map_err(BenchError::hand_written("vkCreateImage"))?;
        // SAFETY: the image is alive.
        let needed = unsafe { self.device.get_image_memory_requirements(raw) };
        let own = self.memory(needed, false, memory)?;
        let place = own.as_ref().unwrap_or(&self.preallocated);
        let view = vk::ImageViewCreateInfo::default()
            .image(raw)
            .view_type(vk::ImageViewType::TYPE_2D)
            .format(info.format)
            .subresource_range(vk::ImageSubresourceRange {
                aspect_mask: vk::ImageAspectFlags::COLOR,
                level_count: 1,
                layer_count: 1,
                ..Default::default()
            });
        // SAFETY: the memory fits the image, is bound once, and no command uses either; the view covers the whole image.
        let view = unsafe {
            let bound = self.device.bind_image_memory(raw, place.memory(), place.offset());
            bound.map_err(BenchError::hand_written("vkBindImageMemory"))?;
            self.device
                .create_image_view(&view, None)
                .map_err(BenchError::hand_written("vkCreateImageView"))?
        };
        Ok((RawObject::TracedImage(raw, view), own))
    }

    fn memory(
        &mut self,
        needed: vk::MemoryRequirements,
        linear: bool,
        memory: Memory,
    ) -> Result<Option<Allocation>, BenchError> {
        match memory {
            Memory::Allocated => allocate(&mut self.allocator, needed, linear).map(Some),
            Memory::Preallocated => Ok(None),
        }
    }

    fn destroy(&mut self, made: &mut Vec<(RawObject, Option<Allocation>)>) -> Result<(), BenchError> {
        for (object, own) in made.drain(..) {
            // SAFETY: nothing was ever submitted that uses the objects.
            unsafe {
                match object {
                    RawObject::Buffer(raw) => self.device.destroy_buffer(raw, None),
                    RawObject::TracedImage(raw, view) => {
                        self.device.destroy_image_view(view, None);
                        self.device.destroy_image(raw, None);
                    }
                }
            }
            if let Some(own) = own {
                self.allocator.free(own).map_err(no_memory)?;
            }
        }
        Ok(())
    }
}

/// A set with descriptors of sampled images, which may change at any time.
struct Descriptors {
    layout: vk::DescriptorSetLayout,
    pool: vk::DescriptorPool,
    set: vk::DescriptorSet,
    /// The descriptor to write next.
    next: Cell<u32>,
    device: ash::Device,
}

impl Descriptors {
    const COUNT: u32 = 1024;

    fn new(device: &ash::Device) -> Result<Self, BenchError> {
        let null = (vk::DescriptorSetLayout::null(), vk::DescriptorPool::null(), vk::DescriptorSet::null());
        let (layout, pool, set) = null;
        let mut made = Self { layout, pool, set, next: Cell::new(0), device: device.clone() };
        made.create()?;
        Ok(made)
    }

    fn create(&mut self) -> Result<(), BenchError> {
        let kind = vk::DescriptorType::SAMPLED_IMAGE;
        let binding = vk::DescriptorSetLayoutBinding::default().descriptor_type(kind);
        let binding = [binding.descriptor_count(Self::COUNT).stage_flags(vk::ShaderStageFlags::ALL)];
        let flags =
            [vk::DescriptorBindingFlags::UPDATE_AFTER_BIND | vk::DescriptorBindingFlags::PARTIALLY_BOUND];
        let mut flags = vk::DescriptorSetLayoutBindingFlagsCreateInfo::default().binding_flags(&flags);
        let layout = vk::DescriptorSetLayoutCreateInfo::default()
            .flags(vk::DescriptorSetLayoutCreateFlags::UPDATE_AFTER_BIND_POOL)
            .bindings(&binding)
            .push_next(&mut flags);
        let sizes = [vk::DescriptorPoolSize { ty: kind, descriptor_count: Self::COUNT }];
        let pool = vk::DescriptorPoolCreateInfo::default()
            .flags(vk::DescriptorPoolCreateFlags::UPDATE_AFTER_BIND)
            .max_sets(1)
            .pool_sizes(&sizes);
        // SAFETY: the descriptions are valid, and the library turns on the features that they need.
        unsafe {
            let made = self.device.create_descriptor_set_layout(&layout, None);
            self.layout = made.map_err(BenchError::hand_written("vkCreateDescriptorSetLayout"))?;
            let made = self.device.create_descriptor_pool(&pool, None);
            self.pool = made.map_err(BenchError::hand_written("vkCreateDescriptorPool"))?;
            let layouts = [self.layout];
            let info = vk::DescriptorSetAllocateInfo::default().descriptor_pool(self.pool);
            let made = self.device.allocate_descriptor_sets(&info.set_layouts(&layouts));
            self.set = made.map_err(BenchError::hand_written("vkAllocateDescriptorSets"))?[0];
        }
        Ok(())
    }

    /// Writes one descriptor after the other, and begins anew behind the last.
    fn write(&self, view: vk::ImageView) {
        let number = self.next.get();
        self.next.set((number + 1) % Self::COUNT);
        let layout = vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL;
        let image = [vk::DescriptorImageInfo::default().image_view(view).image_layout(layout)];
        let write = vk::WriteDescriptorSet::default().dst_set(self.set).dst_array_element(number);
        let writes = [write.descriptor_type(vk::DescriptorType::SAMPLED_IMAGE).image_info(&image)];
        // SAFETY: the set and the view are alive, and no command uses the set.
        unsafe { self.device.update_descriptor_sets(&writes, &[]) };
    }
}

impl Drop for Descriptors {
    fn drop(&mut self) {
        // SAFETY: no command ever used the set; objects that were never created are null, which is allowed.
        unsafe {
            self.device.destroy_descriptor_pool(self.pool, None);
            self.device.destroy_descriptor_set_layout(self.layout, None);
        }
    }
}

fn allocate(
    allocator: &mut Allocator,
    requirements: vk::MemoryRequirements,
    linear: bool,
) -> Result<Allocation, BenchError> {
    let desc = AllocationCreateDesc {
        name: "",
        requirements,
        location: MemoryLocation::GpuOnly,
        linear,
        allocation_scheme: AllocationScheme::GpuAllocatorManaged,
    };
    allocator.allocate(&desc).map_err(no_memory)
}

fn no_memory(_: gpu_allocator::AllocationError) -> BenchError {
    BenchError::hand_written("allocating memory")(vk::Result::ERROR_OUT_OF_DEVICE_MEMORY)
}
