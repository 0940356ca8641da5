//! Frames with the calls of the library's own frames: the next command buffer is begun behind each submission, while the device
//! works, and a submission has a command buffer of barriers before its own.

use std::cell::Cell;
use std::rc::Rc;
use std::time::Instant;

use lvk::ash::vk;

use super::RawDevice;
use crate::error::BenchError;
use crate::measure::{FrameParts, elapsed_ms};

/// Command buffers of frames, of which one is submitted while the next one is begun.
pub(crate) struct RawFrameRing {
    slots: [RawSlot; 2],
    timeline: vk::Semaphore,
    /// Last value of the timeline semaphore.
    reached: Cell<u64>,
    device: Rc<RawDevice>,
}

/// Command buffers of a frame, with a pool of their own.
#[derive(Clone, Copy, Default)]
struct RawSlot {
    pool: vk::CommandPool,
    barriers: vk::CommandBuffer,
    commands: vk::CommandBuffer,
}

impl RawFrameRing {
    pub(crate) fn new(device: &Rc<RawDevice>) -> Result<Self, BenchError> {
        let mut made = Self {
            slots: [RawSlot::default(); 2],
            timeline: vk::Semaphore::null(),
            reached: Cell::new(0),
            device: Rc::clone(device),
        };
        made.create()?;
        made.begin_next()?;
        Ok(made)
    }

    fn create(&mut self) -> Result<(), BenchError> {
        let device = &self.device.device;
        let pool = vk::CommandPoolCreateInfo::default()
            .flags(vk::CommandPoolCreateFlags::TRANSIENT)
            .queue_family_index(self.device.ctx.raw_queue_family());
        let mut kind = vk::SemaphoreTypeCreateInfo::default().semaphore_type(vk::SemaphoreType::TIMELINE);
        let timeline = vk::SemaphoreCreateInfo::default().push_next(&mut kind);
        // SAFETY: the descriptions are valid; the queue family is that of the device.
        unsafe {
            let semaphore = device.create_semaphore(&timeline, None);
            self.timeline = semaphore.map_err(BenchError::hand_written("vkCreateSemaphore"))?;
            for slot in &mut self.slots {
                let pool = device.create_command_pool(&pool, None);
                slot.pool = pool.map_err(BenchError::hand_written("vkCreateCommandPool"))?;
                let info =
                    vk::CommandBufferAllocateInfo::default().command_pool(slot.pool).command_buffer_count(2);
                let allocated = device.allocate_command_buffers(&info);
                let allocated = allocated.map_err(BenchError::hand_written("vkAllocateCommandBuffers"))?;
                (slot.barriers, slot.commands) = (allocated[0], allocated[1]);
            }
        }
        Ok(())
    }

    /// Submits the commands that `record` records and waits for them. Returns the time before the wait, by its parts.
    pub(crate) fn frame(&self, record: impl FnOnce(vk::CommandBuffer)) -> Result<FrameParts, BenchError> {
        let start = Instant::now();
        let slot = self.slot();
        record(slot.commands);
        let recorded = elapsed_ms(start);
        self.submit(slot)?;
        self.begin_next()?;
        let submitted = elapsed_ms(start);
        self.wait()?;
        Ok(FrameParts { begin: 0.0, record: recorded, submit: submitted - recorded })
    }

    /// Returns the slot of the next submission.
    fn slot(&self) -> RawSlot {
        self.slots[(self.reached.get() % 2) as usize]
    }

    /// Begins the command buffer of the next submission.
    fn begin_next(&self) -> Result<(), BenchError> {
        let slot = self.slot();
        // SAFETY: the slot's last submission was waited for.
        unsafe {
            let reset = self.device.device.reset_command_pool(slot.pool, vk::CommandPoolResetFlags::empty());
            reset.map_err(BenchError::hand_written("vkResetCommandPool"))?;
        }
        self.begin(slot.commands)
    }

    fn begin(&self, commands: vk::CommandBuffer) -> Result<(), BenchError> {
        let info = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // SAFETY: the pool of the command buffer was reset.
        unsafe { self.device.device.begin_command_buffer(commands, &info) }
            .map_err(BenchError::hand_written("vkBeginCommandBuffer"))
    }

    fn end(&self, commands: vk::CommandBuffer) -> Result<(), BenchError> {
        // SAFETY: the command buffer is being recorded.
        unsafe { self.device.device.end_command_buffer(commands) }
            .map_err(BenchError::hand_written("vkEndCommandBuffer"))
    }

    /// Submits a slot with barriers before its commands, and the next value of the timeline.
    fn submit(&self, slot: RawSlot) -> Result<(), BenchError> {
        let device = &self.device.device;
        self.end(slot.commands)?;
        self.begin(slot.barriers)?;
        let all = vk::PipelineStageFlags2::ALL_COMMANDS;
        let written = vk::AccessFlags2::SHADER_STORAGE_WRITE;
        let barriers = [vk::MemoryBarrier2::default()
            .src_stage_mask(all)
            .src_access_mask(written)
            .dst_stage_mask(all)
            .dst_access_mask(written | vk::AccessFlags2::SHADER_STORAGE_READ)];
        let dependency = vk::DependencyInfo::default().memory_barriers(&barriers);
        // SAFETY: the command buffer is being recorded.
        unsafe { device.cmd_pipeline_barrier2(slot.barriers, &dependency) };
        self.end(slot.barriers)?;
        let commands = [slot.barriers, slot.commands]
            .map(|commands| vk::CommandBufferSubmitInfo::default().command_buffer(commands));
        let next = self.reached.get() + 1;
        let signal = vk::SemaphoreSubmitInfo::default().semaphore(self.timeline).value(next);
        let signals = [signal.stage_mask(all)];
        let submit = vk::SubmitInfo2::default().command_buffer_infos(&commands);
        let submits = [submit.signal_semaphore_infos(&signals)];
        // SAFETY: both command buffers were ended; the context holds the queue's lock for the call.
        let submit = |queue| unsafe { device.queue_submit2(queue, &submits, vk::Fence::null()) };
        self.device.ctx.with_raw_queue(submit).map_err(BenchError::hand_written("vkQueueSubmit2"))?;
        self.reached.set(next);
        Ok(())
    }

    fn wait(&self) -> Result<(), BenchError> {
        let (semaphores, values) = ([self.timeline], [self.reached.get()]);
        let wait = vk::SemaphoreWaitInfo::default().semaphores(&semaphores).values(&values);
        // SAFETY: the semaphore is a timeline, and its value was submitted.
        unsafe { self.device.device.wait_semaphores(&wait, u64::MAX) }
            .map_err(BenchError::hand_written("vkWaitSemaphores"))
    }
}

impl Drop for RawFrameRing {
    fn drop(&mut self) {
        let device = &self.device.device;
        // SAFETY: the last submission was waited for; objects that were never created are null, which is allowed.
        unsafe {
            device.destroy_semaphore(self.timeline, None);
            self.slots.iter().for_each(|slot| device.destroy_command_pool(slot.pool, None));
        }
    }
}
