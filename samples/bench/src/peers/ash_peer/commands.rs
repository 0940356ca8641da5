//! A command buffer that is recorded, submitted and waited for again and again.

use lvk::ash::vk;

use super::device::Device;
use crate::peers::peer::Failure;

/// A command buffer with its pool, and a timeline.
pub(super) struct Commands {
    pool: vk::CommandPool,
    list: vk::CommandBuffer,
    timeline: vk::Semaphore,
    value: u64,
}

impl Commands {
    pub(super) fn new(device: &Device) -> Result<Self, Failure> {
        let info = vk::CommandPoolCreateInfo::default()
            .flags(vk::CommandPoolCreateFlags::TRANSIENT)
            .queue_family_index(device.family);
        let mut ty = vk::SemaphoreTypeCreateInfo::default().semaphore_type(vk::SemaphoreType::TIMELINE);
        let timeline = vk::SemaphoreCreateInfo::default().push_next(&mut ty);
        // SAFETY: the descriptions are valid.
        unsafe {
            let pool = device.raw.create_command_pool(&info, None)?;
            let info = vk::CommandBufferAllocateInfo::default().command_pool(pool).command_buffer_count(1);
            let list = device.raw.allocate_command_buffers(&info)?[0];
            let timeline = device.raw.create_semaphore(&timeline, None)?;
            Ok(Self { pool, list, timeline, value: 0 })
        }
    }

    /// Begins the recording. The last submission was waited for.
    pub(super) fn begin(&mut self, device: &Device) -> Result<vk::CommandBuffer, Failure> {
        let info = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // SAFETY: the GPU has finished with the command buffer.
        unsafe {
            device.raw.reset_command_pool(self.pool, vk::CommandPoolResetFlags::empty())?;
            device.raw.begin_command_buffer(self.list, &info)?;
        }
        Ok(self.list)
    }

    /// Submits what was recorded.
    pub(super) fn submit(&mut self, device: &Device) -> Result<(), Failure> {
        self.value += 1;
        let lists = [vk::CommandBufferSubmitInfo::default().command_buffer(self.list)];
        let signal = [vk::SemaphoreSubmitInfo::default()
            .semaphore(self.timeline)
            .value(self.value)
            .stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)];
        let submit =
            [vk::SubmitInfo2::default().command_buffer_infos(&lists).signal_semaphore_infos(&signal)];
        // SAFETY: the command buffer was recorded, and only this thread uses the queue.
        unsafe {
            device.raw.end_command_buffer(self.list)?;
            Ok(device.raw.queue_submit2(device.queue, &submit, vk::Fence::null())?)
        }
    }

    /// Waits for the last submission.
    pub(super) fn wait(&self, device: &Device) -> Result<(), Failure> {
        let (semaphores, values) = ([self.timeline], [self.value]);
        let info = vk::SemaphoreWaitInfo::default().semaphores(&semaphores).values(&values);
        // SAFETY: the semaphore is a timeline, and its value was submitted.
        Ok(unsafe { device.raw.wait_semaphores(&info, u64::MAX) }?)
    }
}

/// Records a barrier for memory.
pub(super) fn memory_barrier(
    device: &Device,
    list: vk::CommandBuffer,
    from: (vk::PipelineStageFlags2, vk::AccessFlags2),
    to: (vk::PipelineStageFlags2, vk::AccessFlags2),
) {
    let barrier = [vk::MemoryBarrier2::default()
        .src_stage_mask(from.0)
        .src_access_mask(from.1)
        .dst_stage_mask(to.0)
        .dst_access_mask(to.1)];
    let info = vk::DependencyInfo::default().memory_barriers(&barrier);
    // SAFETY: the command buffer is being recorded.
    unsafe { device.raw.cmd_pipeline_barrier2(list, &info) };
}

/// Records a change of an image's layout, after and before everything else.
pub(super) fn layout_barrier(
    device: &Device,
    list: vk::CommandBuffer,
    image: vk::Image,
    from: vk::ImageLayout,
    to: vk::ImageLayout,
) {
    let all = (
        vk::PipelineStageFlags2::ALL_COMMANDS,
        vk::AccessFlags2::MEMORY_READ | vk::AccessFlags2::MEMORY_WRITE,
    );
    let barrier = [vk::ImageMemoryBarrier2::default()
        .src_stage_mask(all.0)
        .src_access_mask(all.1)
        .dst_stage_mask(all.0)
        .dst_access_mask(all.1)
        .old_layout(from)
        .new_layout(to)
        .image(image)
        .subresource_range(super::memory::COLOR)];
    let info = vk::DependencyInfo::default().image_memory_barriers(&barrier);
    // SAFETY: the command buffer is being recorded, and the image has the old layout.
    unsafe { device.raw.cmd_pipeline_barrier2(list, &info) };
}
