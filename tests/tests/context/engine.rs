//! An engine in plain Vulkan, whose device a context shares.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::ffi::CStr;

use lvk::ash::{self, vk};
use lvk::{
    BufferHandle, BufferUsage, Context, ContextDesc, FeatureSet, Holder, ImportedBuffer, OptionalFeature,
    RawContext,
};
use lvk_tests::guest_engine::GuestInstance;

/// Width and height of its images.
pub(super) const SIDE: u32 = 4;
/// Bytes of its images and buffers.
pub(super) const BYTES: u64 = (SIDE * SIDE * 4) as u64;
pub(super) const LOCAL_READ: [&CStr; 1] = [ash::khr::dynamic_rendering_local_read::NAME];
pub(super) const ALL: vk::PipelineStageFlags2 = vk::PipelineStageFlags2::ALL_COMMANDS;

const WHOLE: vk::ImageSubresourceRange = vk::ImageSubresourceRange {
    aspect_mask: vk::ImageAspectFlags::COLOR,
    base_mip_level: 0,
    level_count: 1,
    base_array_layer: 0,
    layer_count: 1,
};

/// An engine that knows nothing of the library.
pub(super) struct Engine {
    pub(super) physical: vk::PhysicalDevice,
    pub(super) device: ash::Device,
    pub(super) queue: vk::Queue,
    pool: vk::CommandPool,
    /// True if the extension and the feature are on.
    pub(super) local_read: bool,
    /// Declared last, so that it is destroyed after the device.
    pub(super) instance: GuestInstance,
}

impl Engine {
    /// `None`, loudly, without a driver.
    pub(super) fn new() -> Option<Self> {
        let instance = GuestInstance::new(&ContextDesc::default())?;
        let (raw, physical) = (&instance.raw, instance.physical_device());
        // SAFETY: plain Vulkan by the book, as the layer confirms.
        unsafe {
            let mut v11 = vk::PhysicalDeviceVulkan11Features::default();
            let mut v12 = vk::PhysicalDeviceVulkan12Features::default();
            let mut v13 = vk::PhysicalDeviceVulkan13Features::default();
            let mut all = vk::PhysicalDeviceFeatures2::default()
                .push_next(&mut v11)
                .push_next(&mut v12)
                .push_next(&mut v13);
            raw.get_physical_device_features2(physical, &mut all);
            // Not every device has it together with descriptors that are updated after they are bound.
            all.features.robust_buffer_access = vk::FALSE;
            let there = raw.enumerate_device_extension_properties(physical).unwrap();
            let local_read = there.iter().any(|known| known.extension_name_as_c_str() == Ok(LOCAL_READ[0]));
            let extensions = if local_read { &LOCAL_READ[..] } else { &[] };
            let extensions: Vec<_> = extensions.iter().map(|name| name.as_ptr()).collect();
            let mut reads = vk::PhysicalDeviceDynamicRenderingLocalReadFeaturesKHR::default()
                .dynamic_rendering_local_read(true);
            let queue = vk::DeviceQueueCreateInfo::default().queue_family_index(0).queue_priorities(&[1.0]);
            let mut info = vk::DeviceCreateInfo::default()
                .queue_create_infos(std::slice::from_ref(&queue))
                .enabled_extension_names(&extensions)
                .push_next(&mut all);
            if local_read {
                info = info.push_next(&mut reads);
            }
            let device = raw.create_device(physical, &info, None).unwrap();
            let queue = device.get_device_queue(0, 0);
            let pool = device.create_command_pool(&vk::CommandPoolCreateInfo::default(), None).unwrap();
            Some(Self { physical, device, queue, pool, local_read, instance })
        }
    }

    pub(super) fn has_extension(&self, name: &CStr) -> bool {
        // SAFETY: the physical device belongs to the instance.
        let all = unsafe { self.instance.raw.enumerate_device_extension_properties(self.physical) }.unwrap();
        all.iter().any(|known| known.extension_name_as_c_str() == Ok(name))
    }

    pub(super) fn raw(&self) -> RawContext<'_> {
        RawContext {
            entry: self.instance.entry.clone(),
            instance: self.instance.raw.clone(),
            instance_extensions: self.instance.extensions,
            physical_device: self.physical,
            device: self.device.clone(),
            device_extensions: &[],
            features: FeatureSet::NONE.with(OptionalFeature::FullDrawIndex),
            ray_tracing_pipeline: false,
            trace_rays_indirect: false,
            primitive_culling: false,
            ray_query: false,
            position_fetch: false,
            mesh_shader: false,
            queue: self.queue,
            queue_family: 0,
            compute_queue: None,
            transfer_queue: None,
        }
    }

    pub(super) fn context(&self) -> Context {
        self.context_with(&ContextDesc::default())
    }

    pub(super) fn context_with(&self, desc: &ContextDesc<'_>) -> Context {
        // SAFETY: all of it belongs together, every feature is on, and the engine outlives the context in every test.
        unsafe { Context::from_raw(self.raw(), desc).unwrap() }
    }

    /// Imports a buffer of the engine, which lives on.
    pub(super) fn import(&self, ctx: &Context, buffer: vk::Buffer) -> Holder<BufferHandle> {
        let imported = ImportedBuffer {
            buffer,
            size_bytes: BYTES,
            usage: BufferUsage::STORAGE,
            concurrent: false,
            debug_name: "the engine's buffer",
        };
        // SAFETY: `buffer` made it as described.
        unsafe { ctx.import_buffer(&imported).unwrap() }
    }

    pub(super) fn memory(
        &self,
        needed: vk::MemoryRequirements,
        wish: vk::MemoryPropertyFlags,
        flags: vk::MemoryAllocateFlags,
    ) -> vk::DeviceMemory {
        // SAFETY: as above.
        unsafe {
            let types = self.instance.raw.get_physical_device_memory_properties(self.physical);
            let fits = |index: &u32| {
                needed.memory_type_bits & 1 << index != 0
                    && types.memory_types[*index as usize].property_flags.contains(wish)
            };
            let index = (0..types.memory_type_count).find(fits).unwrap();
            let mut flags = vk::MemoryAllocateFlagsInfo::default().flags(flags);
            let info = vk::MemoryAllocateInfo::default()
                .allocation_size(needed.size)
                .memory_type_index(index)
                .push_next(&mut flags);
            self.device.allocate_memory(&info, None).unwrap()
        }
    }

    /// A texture of words that can be sampled, cleared and read.
    pub(super) fn image(&self) -> (vk::Image, vk::DeviceMemory) {
        let info = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(vk::Format::R32_UINT)
            .extent(vk::Extent3D { width: SIDE, height: SIDE, depth: 1 })
            .mip_levels(1)
            .array_layers(1)
            .samples(vk::SampleCountFlags::TYPE_1)
            .usage(
                vk::ImageUsageFlags::SAMPLED
                    | vk::ImageUsageFlags::TRANSFER_SRC
                    | vk::ImageUsageFlags::TRANSFER_DST,
            );
        // SAFETY: as above.
        unsafe {
            let image = self.device.create_image(&info, None).unwrap();
            let needed = self.device.get_image_memory_requirements(image);
            let memory = self.memory(needed, vk::MemoryPropertyFlags::DEVICE_LOCAL, Default::default());
            self.device.bind_image_memory(image, memory, 0).unwrap();
            (image, memory)
        }
    }

    /// A mapped buffer with an address.
    pub(super) fn buffer(&self) -> (vk::Buffer, vk::DeviceMemory) {
        self.buffer_of(BYTES)
    }

    /// As [`buffer`](Self::buffer), of some bytes.
    pub(super) fn buffer_of(&self, bytes: u64) -> (vk::Buffer, vk::DeviceMemory) {
        let usage = vk::BufferUsageFlags::STORAGE_BUFFER
            | vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS
            | vk::BufferUsageFlags::TRANSFER_SRC
            | vk::BufferUsageFlags::TRANSFER_DST;
        // SAFETY: as above.
        unsafe {
            let info = vk::BufferCreateInfo::default().size(bytes).usage(usage);
            let buffer = self.device.create_buffer(&info, None).unwrap();
            let wish = vk::MemoryPropertyFlags::HOST_VISIBLE | vk::MemoryPropertyFlags::HOST_COHERENT;
            let needed = self.device.get_buffer_memory_requirements(buffer);
            let memory = self.memory(needed, wish, vk::MemoryAllocateFlags::DEVICE_ADDRESS);
            self.device.bind_buffer_memory(buffer, memory, 0).unwrap();
            (buffer, memory)
        }
    }

    pub(super) fn words(&self, memory: vk::DeviceMemory) -> Vec<u32> {
        // SAFETY: the memory is mapped for the copy alone, and the GPU is done with it.
        unsafe {
            let start = self.device.map_memory(memory, 0, BYTES, Default::default()).unwrap();
            let words = std::slice::from_raw_parts(start.cast::<u32>(), BYTES as usize / 4).to_vec();
            self.device.unmap_memory(memory);
            words
        }
    }

    pub(super) fn semaphore(&self, kind: vk::SemaphoreType) -> vk::Semaphore {
        let mut kind = vk::SemaphoreTypeCreateInfo::default().semaphore_type(kind);
        let info = vk::SemaphoreCreateInfo::default().push_next(&mut kind);
        // SAFETY: as above.
        unsafe { self.device.create_semaphore(&info, None).unwrap() }
    }

    /// Records, and submits between semaphores.
    pub(super) fn submit(
        &self,
        queue: vk::Queue,
        waits: &[(vk::Semaphore, u64)],
        signals: &[(vk::Semaphore, u64)],
        record: impl FnOnce(vk::CommandBuffer),
    ) {
        let raw = |all: &[(vk::Semaphore, u64)]| {
            let of = |(semaphore, value): &(vk::Semaphore, u64)| {
                vk::SemaphoreSubmitInfo::default().semaphore(*semaphore).value(*value).stage_mask(ALL)
            };
            all.iter().map(of).collect::<Vec<_>>()
        };
        let (waits, signals) = (raw(waits), raw(signals));
        // SAFETY: as above.
        unsafe {
            let info =
                vk::CommandBufferAllocateInfo::default().command_pool(self.pool).command_buffer_count(1);
            let commands = self.device.allocate_command_buffers(&info).unwrap()[0];
            self.device.begin_command_buffer(commands, &vk::CommandBufferBeginInfo::default()).unwrap();
            record(commands);
            self.device.end_command_buffer(commands).unwrap();
            let commands = [vk::CommandBufferSubmitInfo::default().command_buffer(commands)];
            let submit = vk::SubmitInfo2::default()
                .wait_semaphore_infos(&waits)
                .command_buffer_infos(&commands)
                .signal_semaphore_infos(&signals);
            self.device.queue_submit2(queue, &[submit], vk::Fence::null()).unwrap();
        }
    }

    /// Moves the image from a layout into another.
    pub(super) fn change(
        &self,
        commands: vk::CommandBuffer,
        image: vk::Image,
        old: vk::ImageLayout,
        new: vk::ImageLayout,
    ) {
        let all = vk::AccessFlags2::MEMORY_READ | vk::AccessFlags2::MEMORY_WRITE;
        let barrier = [vk::ImageMemoryBarrier2::default()
            .src_stage_mask(ALL)
            .src_access_mask(all)
            .dst_stage_mask(ALL)
            .dst_access_mask(all)
            .old_layout(old)
            .new_layout(new)
            .image(image)
            .subresource_range(WHOLE)];
        let info = vk::DependencyInfo::default().image_memory_barriers(&barrier);
        // SAFETY: as above.
        unsafe { self.device.cmd_pipeline_barrier2(commands, &info) };
    }

    /// Fills the image with a word; it is in the layout TRANSFER_DST_OPTIMAL then.
    pub(super) fn clear(&self, commands: vk::CommandBuffer, image: vk::Image, word: u32) {
        let layout = vk::ImageLayout::TRANSFER_DST_OPTIMAL;
        self.change(commands, image, vk::ImageLayout::UNDEFINED, layout);
        let color = vk::ClearColorValue { uint32: [word; 4] };
        // SAFETY: as above.
        unsafe { self.device.cmd_clear_color_image(commands, image, layout, &color, &[WHOLE]) };
    }

    /// Records the copy of an image that the library has released.
    pub(super) fn copy(&self, commands: vk::CommandBuffer, image: vk::Image, copy: vk::Buffer) {
        let region = vk::BufferImageCopy::default()
            .image_subresource(vk::ImageSubresourceLayers {
                aspect_mask: vk::ImageAspectFlags::COLOR,
                layer_count: 1,
                ..Default::default()
            })
            .image_extent(vk::Extent3D { width: SIDE, height: SIDE, depth: 1 });
        let source = vk::ImageLayout::TRANSFER_SRC_OPTIMAL;
        // SAFETY: the image was released in that layout.
        unsafe { self.device.cmd_copy_image_to_buffer(commands, image, source, copy, &[region]) };
    }

    /// Waits until the timelines reach these values.
    pub(super) fn wait(&self, timelines: &[(vk::Semaphore, u64)]) {
        let (semaphores, values): (Vec<_>, Vec<_>) = timelines.iter().copied().unzip();
        let info = vk::SemaphoreWaitInfo::default().semaphores(&semaphores).values(&values);
        // SAFETY: the semaphores are alive, and signals of these values are under way.
        unsafe { self.device.wait_semaphores(&info, u64::MAX).unwrap() };
    }

    /// Destroys objects of the engine, which live as long as its device, after all work is done.
    pub(super) fn destroy(
        &self,
        semaphores: &[vk::Semaphore],
        image: vk::Image,
        buffers: &[vk::Buffer],
        memory: &[vk::DeviceMemory],
    ) {
        // SAFETY: the engine's own, once each.
        unsafe {
            self.device.device_wait_idle().unwrap();
            semaphores.iter().for_each(|semaphore| self.device.destroy_semaphore(*semaphore, None));
            self.device.destroy_image(image, None);
            buffers.iter().for_each(|buffer| self.device.destroy_buffer(*buffer, None));
            memory.iter().for_each(|memory| self.device.free_memory(*memory, None));
        }
    }
}

impl Drop for Engine {
    /// The layer tells of everything that is left of the device.
    fn drop(&mut self) {
        // SAFETY: contexts and objects are gone.
        unsafe {
            self.device.destroy_command_pool(self.pool, None);
            self.device.destroy_device(None);
        }
    }
}
