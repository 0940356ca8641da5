//! Hands command buffers to the GPU and waits for them.

use ash::vk;

use super::Context;
use crate::command::{CommandBuffer, FinishedRecording};
use crate::error::{Error, Result};
use crate::queue::Queue;
use crate::submit::{Recording, Submission, SubmitHandle};

impl Context {
    /// Starts recording a command buffer for the graphics queue, which takes every command. Any number may be recorded at once, on
    /// any threads.
    pub fn acquire_command_buffer(&self) -> Result<CommandBuffer> {
        self.acquire_command_buffer_on(Queue::Graphics)
    }

    /// As [`acquire_command_buffer`](Self::acquire_command_buffer), for a queue.
    ///
    /// All queues exist on every device. [`Capabilities::queue`](crate::Capabilities::queue) says which have hardware of their
    /// own; what goes to the others runs on the graphics queue, one after the other. What a command buffer uses is waited for
    /// and moved between queues when it is submitted; see the manual's page on
    /// [queues](crate::manual::queues_and_uploads).
    pub fn acquire_command_buffer_on(&self, queue: Queue) -> Result<CommandBuffer> {
        let shared = self.device_state();
        let (finished, recording) = shared.submitter.collect_and_acquire(queue)?;
        let cmd = recording.map(|recording| self.new_command_buffer(queue, recording));
        shared.release_finished(finished)?;
        cmd
    }

    /// A command buffer without commands.
    pub(super) fn new_command_buffer(&self, queue: Queue, recording: Box<Recording>) -> CommandBuffer {
        CommandBuffer::new(self.device_state(), queue, recording, self.inner.recording_states.acquire())
    }

    /// Submits a command buffer to the queue it was acquired for, after uploads and builds made before (`vkQueueSubmit2`). Does
    /// not wait.
    ///
    /// # Errors
    /// [`InvalidUsage`](Error::InvalidUsage) if the command buffer belongs to another context, refits a top-level
    /// structure whose number of instances another submission changed meanwhile, refits or shows what software traces and
    /// another submission rebuilt meanwhile, left a query open, writes one that was
    /// written and not reset, or uses an image of a swapchain that is not [taken](Self::next_image); and on other queues
    /// than the graphics queue for images of windows, and for what was [imported](Self::import_texture) without being concurrent. A failure of Vulkan
    /// itself leaves the context without a known state: this and every later submission answers it, and a new context is
    /// needed.
    pub fn submit(&self, cmd: CommandBuffer) -> Result<SubmitHandle> {
        self.submit_with_semaphores(cmd, Submission::default())
    }

    /// As [`submit`](Self::submit), but [`next_frame`](Self::next_frame) never waits for it: for work on other queues that goes on
    /// over several frames. Buffers for each [`Frame::index`](crate::Frame::index) are not for such work.
    pub fn submit_in_background(&self, cmd: CommandBuffer) -> Result<SubmitHandle> {
        self.submit_with_semaphores(cmd, Submission { in_background: true, ..Submission::default() })
    }

    /// As [`submit`](Self::submit), with what `more` has besides recordings.
    pub(super) fn submit_with_semaphores(
        &self,
        cmd: CommandBuffer,
        more: Submission,
    ) -> Result<SubmitHandle> {
        self.check_same_context(&cmd)?;
        let queue_index = cmd.queue_index();
        self.advance_compactions();
        let submitted = self.submit_after_prologue(cmd, more)?;
        self.device_state().submitter.begin_ahead(queue_index);
        Ok(submitted)
    }

    fn submit_after_prologue(&self, mut cmd: CommandBuffer, mut more: Submission) -> Result<SubmitHandle> {
        let mut pending = self.lock_prologue();
        cmd.check_submittable()?;
        cmd.check_queries()?;
        cmd.check_images()?;
        let entries = cmd.entries_without_hit_table();
        if !entries.is_empty() || !self.device_state().freed_tlas_slots().is_empty() {
            let before = self.prologue_command_buffer(&mut pending)?;
            entries.into_iter().for_each(|(slot, entry)| before.write_tlas_table(slot, entry));
        }
        let prelude = self.take_prologue(&mut pending)?;
        if prelude.is_some() {
            // Uploads wait as well, whichever stages were named.
            let all = vk::PipelineStageFlags2::ALL_COMMANDS;
            more.waits.iter_mut().for_each(|wait| wait.stage_mask = all);
        }
        if cmd.queue_index() == 0 {
            return self.send_to_queue(prelude, Some(cmd), more);
        }
        if prelude.is_some() {
            // The first of it all waits, and the rest behind it.
            let waits = std::mem::take(&mut more.waits);
            let before = self.send_to_queue(prelude, None, Submission { waits, ..Submission::default() })?;
            cmd.wait_for_all_writes(before.value);
        }
        self.send_to_queue(None, Some(cmd), more)
    }

    /// Fails for a command buffer of another context.
    pub(super) fn check_same_context(&self, cmd: &CommandBuffer) -> Result<()> {
        if cmd.belongs_to(self.device_state()) {
            return Ok(());
        }
        Err(Error::usage("submit", "the command buffer belongs to another context"))
    }

    fn send_to_queue(
        &self,
        prelude: Option<CommandBuffer>,
        main: Option<CommandBuffer>,
        more: Submission,
    ) -> Result<SubmitHandle> {
        let shared = self.device_state();
        let (prelude, before) = prelude.map(CommandBuffer::finish).unzip();
        let (main, own) = main.map(CommandBuffer::finish).unzip();
        let submission = Submission { prelude, main, ..more };
        let (values, sent) = shared.submitter.submit(submission, || shared.bindless.flush());
        let mut outcomes = [(before, values.prelude), (own, values.main)];
        let scopes = outcomes.iter_mut().filter_map(|(outcome, _)| outcome.as_mut()?.scopes.take());
        shared.profiler.submit(values.last(), scopes.map(|scopes| *scopes).collect());
        for (outcome, value) in outcomes {
            let Some(FinishedRecording { state: mut notes, .. }) = outcome else { continue };
            if value > 0 {
                notes.apply_submission(shared, value);
            }
            self.inner.recording_states.recycle(notes);
        }
        sent?;
        Ok(self.submit_handle(values.last()))
    }

    /// Submits uploads and builds that wait for the next submission, if there are any, to the graphics queue. Answers the last
    /// submission there.
    pub fn flush(&self) -> Result<SubmitHandle> {
        self.advance_compactions();
        // Textures without contents that are gone by now need nothing submitted.
        self.device_state().collect_known()?;
        let mut pending = self.lock_prologue();
        let Some(cmd) = self.take_prologue(&mut pending)? else {
            return Ok(self.submit_handle(self.device_state().submitter.last_of_queues()[0]));
        };
        let flushed = self.send_to_queue(Some(cmd), None, Submission::default())?;
        // Command buffers that are acquired ask how far the GPU is; this one was not.
        self.device_state().collect()?;
        Ok(flushed)
    }

    /// Waits until a submission is done (`vkWaitSemaphores`).
    ///
    /// # Errors
    /// [`InvalidUsage`](Error::InvalidUsage) if the handle belongs to another context.
    pub fn wait(&self, submission: SubmitHandle) -> Result<()> {
        self.check_submitted(submission)?;
        self.device_state().submitter.wait(submission.value)?;
        self.device_state().collect_known()
    }

    /// Whether a submission is done. Does not wait.
    pub fn is_done(&self, submission: SubmitHandle) -> Result<bool> {
        self.check_submitted(submission)?;
        self.device_state().submitter.is_done(submission.value)
    }

    /// Submits what waits for the next submission, and waits until the GPU has nothing left to do.
    pub fn wait_idle(&self) -> Result<()> {
        self.flush()?;
        self.wait_submitted()
    }

    /// Waits for everything submitted so far, on all queues.
    pub(super) fn wait_submitted(&self) -> Result<()> {
        let submitter = &self.device_state().submitter;
        submitter.wait_for_queues(&submitter.last_of_queues())?;
        self.device_state().collect_known()
    }

    /// Names the submission with this value of the timeline.
    pub(super) fn submit_handle(&self, value: u64) -> SubmitHandle {
        SubmitHandle { value, context: self.device_state().store.context_id }
    }

    fn check_submitted(&self, submission: SubmitHandle) -> Result<()> {
        if submission == SubmitHandle::default() || submission.context == self.device_state().store.context_id
        {
            return Ok(());
        }
        Err(Error::usage("wait", "the submission belongs to another context"))
    }
}
