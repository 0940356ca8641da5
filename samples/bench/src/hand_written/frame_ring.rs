//! Frames with the calls of the library's own frames: the next command buffer is begun behind each submission, while the device
//! works, and a submission has a command buffer of barriers before its own.

use std::cell::Cell;
use std::rc::Rc;
use std::time::Instant;

use lvk::ash::vk;

use super::RawDevice;
use super::command_pool::RawCommandPool;
use super::timeline::RawTimeline;
use crate::error::BenchError;
use crate::measure::{FrameParts, elapsed_ms};

/// Command buffers of frames, of which one is submitted while the next one is begun.
pub(crate) struct RawFrameRing {
    slots: [RawSlot; 2],
    /// The slot of the next submission, which is begun.
    next: Cell<usize>,
    timeline: RawTimeline,
    device: Rc<RawDevice>,
}

/// Command buffers of a frame, with a pool of their own.
struct RawSlot {
    pool: RawCommandPool,
    barriers: vk::CommandBuffer,
    commands: vk::CommandBuffer,
}

impl RawSlot {
    fn new(device: &Rc<RawDevice>) -> Result<Self, BenchError> {
        let pool = RawCommandPool::new(device)?;
        Ok(Self { barriers: pool.allocate()?, commands: pool.allocate()?, pool })
    }

    /// Begins the commands. The slot's last submission was waited for.
    fn begin(&self) -> Result<(), BenchError> {
        self.pool.reset()?;
        self.pool.begin(self.commands)
    }
}

impl RawFrameRing {
    pub(crate) fn new(device: &Rc<RawDevice>) -> Result<Self, BenchError> {
        let slots = [RawSlot::new(device)?, RawSlot::new(device)?];
        slots[0].begin()?;
        let (timeline, device) = (RawTimeline::new(device)?, Rc::clone(device));
        Ok(Self { slots, next: Cell::new(0), timeline, device })
    }

    /// Submits the commands that `record` records and waits for them. Returns the time before the wait, by its parts.
    pub(crate) fn frame(&self, record: impl FnOnce(vk::CommandBuffer)) -> Result<FrameParts, BenchError> {
        let start = Instant::now();
        let slot = self.next.get();
        record(self.slots[slot].commands);
        let recorded = elapsed_ms(start);
        self.submit(&self.slots[slot])?;
        self.next.set(1 - slot);
        let begun = self.slots[1 - slot].begin();
        let submitted = elapsed_ms(start);
        // The slot is in use until the wait, whatever became of the other one.
        self.timeline.wait()?;
        begun?;
        Ok(FrameParts { begin: 0.0, record: recorded, submit: submitted - recorded })
    }

    /// Submits a slot with barriers before its commands, and the next value of the timeline.
    fn submit(&self, slot: &RawSlot) -> Result<(), BenchError> {
        let device = &self.device.device;
        slot.pool.end(slot.commands)?;
        slot.pool.begin(slot.barriers)?;
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
        slot.pool.end(slot.barriers)?;
        let commands = [slot.barriers, slot.commands]
            .map(|commands| vk::CommandBufferSubmitInfo::default().command_buffer(commands));
        let signals = [self.timeline.signal()];
        let submit = vk::SubmitInfo2::default().command_buffer_infos(&commands);
        let submits = [submit.signal_semaphore_infos(&signals)];
        // SAFETY: both command buffers were ended; the context holds the queue's lock for the call.
        let submit = |queue| unsafe { device.queue_submit2(queue, &submits, vk::Fence::null()) };
        self.device.ctx.with_raw_queue(submit).map_err(BenchError::hand_written("vkQueueSubmit2"))
    }
}
