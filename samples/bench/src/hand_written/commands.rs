//! A command buffer that is recorded, submitted and waited for repeatedly, with timestamps.

use std::rc::Rc;
use std::time::Instant;

use lvk::ash::vk;

use super::RawDevice;
use super::command_pool::RawCommandPool;
use super::timeline::RawTimeline;
use crate::error::BenchError;
use crate::measure::{FrameParts, SubmissionTimes, elapsed_ms};

/// A command buffer that is recorded, submitted and waited for repeatedly.
pub(crate) struct RawCommands {
    pool: RawCommandPool,
    commands: vk::CommandBuffer,
    fence: vk::Fence,
    timeline: RawTimeline,
    queries: vk::QueryPool,
    device: Rc<RawDevice>,
}

impl RawCommands {
    pub(crate) fn new(device: &Rc<RawDevice>) -> Result<Self, BenchError> {
        let pool = RawCommandPool::new(device)?;
        let mut made = Self {
            commands: pool.allocate()?,
            pool,
            fence: vk::Fence::null(),
            timeline: RawTimeline::new(device)?,
            queries: vk::QueryPool::null(),
            device: Rc::clone(device),
        };
        made.create()?;
        Ok(made)
    }

    fn create(&mut self) -> Result<(), BenchError> {
        let device = &self.device.device;
        let fence = vk::FenceCreateInfo::default();
        let queries = vk::QueryPoolCreateInfo::default().query_type(vk::QueryType::TIMESTAMP).query_count(2);
        // SAFETY: the descriptions are valid.
        unsafe {
            self.fence =
                device.create_fence(&fence, None).map_err(BenchError::hand_written("vkCreateFence"))?;
            let made = device.create_query_pool(&queries, None);
            self.queries = made.map_err(BenchError::hand_written("vkCreateQueryPool"))?;
        }
        Ok(())
    }

    /// Submits the commands that `record` records, between timestamps, and waits for them.
    pub(crate) fn time(&self, record: impl FnOnce(vk::CommandBuffer)) -> Result<SubmissionTimes, BenchError> {
        let start = Instant::now();
        self.begin()?;
        let before = Instant::now();
        record(self.commands);
        let record = elapsed_ms(before);
        self.end_and_submit()?;
        let cpu = elapsed_ms(start);
        self.wait()?;
        let total = elapsed_ms(start);
        Ok(SubmissionTimes { gpu: self.read_timestamps_ms()?, cpu, record, total })
    }

    /// Submits an empty command buffer and waits for a fence.
    pub(crate) fn submit_empty(&self) -> Result<(), BenchError> {
        self.begin_bare()?;
        self.submit()?;
        self.wait()
    }

    /// Submits an empty command buffer and waits for a timeline semaphore.
    pub(crate) fn submit_empty_on_timeline(&self) -> Result<(), BenchError> {
        self.begin_bare()?;
        self.submit_on_timeline()?;
        self.timeline.wait()
    }

    /// Submits the commands that `record` records and waits for a timeline semaphore. Returns the time before the wait, by its parts.
    pub(crate) fn frame(&self, record: impl FnOnce(vk::CommandBuffer)) -> Result<FrameParts, BenchError> {
        let start = Instant::now();
        self.begin_bare()?;
        let begin = elapsed_ms(start);
        record(self.commands);
        let recorded = elapsed_ms(start);
        self.submit_on_timeline()?;
        let submitted = elapsed_ms(start);
        self.timeline.wait()?;
        Ok(FrameParts { begin, record: recorded - begin, submit: submitted - recorded })
    }

    /// Submits the command buffer with the next value of the timeline.
    fn submit_on_timeline(&self) -> Result<(), BenchError> {
        self.submit_with(&[self.timeline.signal()], vk::Fence::null())
    }

    fn begin(&self) -> Result<(), BenchError> {
        self.begin_bare()?;
        // SAFETY: the command buffer is being recorded, and the last submission was waited for.
        unsafe { self.device.device.cmd_reset_query_pool(self.commands, self.queries, 0, 2) };
        self.write_timestamp(0);
        Ok(())
    }

    fn begin_bare(&self) -> Result<(), BenchError> {
        self.pool.reset()?;
        self.pool.begin(self.commands)
    }

    fn write_timestamp(&self, query: u32) {
        let stage = vk::PipelineStageFlags2::ALL_COMMANDS;
        // SAFETY: the command buffer is being recorded, and the query was reset in it.
        unsafe { self.device.device.cmd_write_timestamp2(self.commands, stage, self.queries, query) };
    }

    fn end_and_submit(&self) -> Result<(), BenchError> {
        self.write_timestamp(1);
        self.submit()
    }

    fn submit(&self) -> Result<(), BenchError> {
        self.submit_with(&[], self.fence)
    }

    fn submit_with(
        &self,
        signals: &[vk::SemaphoreSubmitInfo<'_>],
        fence: vk::Fence,
    ) -> Result<(), BenchError> {
        let device = &self.device.device;
        let commands = [vk::CommandBufferSubmitInfo::default().command_buffer(self.commands)];
        let submit = vk::SubmitInfo2::default().command_buffer_infos(&commands);
        let submits = [submit.signal_semaphore_infos(signals)];
        self.pool.end(self.commands)?;
        // SAFETY: recording has ended; the fence is not signalled; the context holds the queue's lock for the call.
        let submit = |queue| unsafe { device.queue_submit2(queue, &submits, fence) };
        self.device.ctx.with_raw_queue(submit).map_err(BenchError::hand_written("vkQueueSubmit2"))
    }

    fn wait(&self) -> Result<(), BenchError> {
        let fences = [self.fence];
        // SAFETY: the fence was submitted, and once it is signalled nothing uses it.
        unsafe {
            let waited = self.device.device.wait_for_fences(&fences, true, u64::MAX);
            waited.map_err(BenchError::hand_written("vkWaitForFences"))?;
            self.device.device.reset_fences(&fences).map_err(BenchError::hand_written("vkResetFences"))
        }
    }

    /// Returns the milliseconds between the timestamps.
    fn read_timestamps_ms(&self) -> Result<f64, BenchError> {
        let mut ticks = [0_u64; 2];
        let flags = vk::QueryResultFlags::TYPE_64;
        // SAFETY: both queries were written by the submission that was waited for.
        unsafe { self.device.device.get_query_pool_results(self.queries, 0, &mut ticks, flags) }
            .map_err(BenchError::hand_written("vkGetQueryPoolResults"))?;
        let limits = &self.device.ctx.capabilities().limits;
        let mask = u64::MAX >> (64 - limits.timestamp_bits.clamp(1, 64));
        let passed = ticks[1].wrapping_sub(ticks[0]) & mask;
        Ok(passed as f64 * f64::from(limits.timestamp_period_ns) * 1e-6)
    }
}

impl Drop for RawCommands {
    fn drop(&mut self) {
        let device = &self.device.device;
        // SAFETY: the last submission was waited for; objects that were never created are null, which is allowed.
        unsafe {
            device.destroy_query_pool(self.queries, None);
            device.destroy_fence(self.fence, None);
        }
    }
}
