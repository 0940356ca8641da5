//! Acquisition and submission of command buffers, and waits for submissions.

use ash::vk;

use super::Context;
use crate::command::{CommandBuffer, FinishedRecording};
use crate::cpu_scope::cpu_scope;
use crate::error::{Error, Result};
use crate::queue::Queue;
use crate::submit::{Recording, Submission, SubmitHandle};

impl Context {
    /// Starts recording a command buffer for the graphics queue, which supports every command. Any number of command
    /// buffers may be recorded at once, on any threads.
    pub fn acquire_command_buffer(&self) -> Result<CommandBuffer> {
        self.acquire_command_buffer_on(Queue::Graphics)
    }

    /// Starts recording a command buffer for a queue, like [`acquire_command_buffer`](Self::acquire_command_buffer).
    ///
    /// All queues exist on every device. [`Capabilities::queue`](crate::Capabilities::queue) returns which have
    /// hardware of their own. Work for the other queues runs on the graphics queue, one command buffer after the other.
    /// A submission waits for the resources that the command buffer uses and transfers them between queues; see the
    /// manual's page on [queues](crate::manual::queues_and_uploads).
    pub fn acquire_command_buffer_on(&self, queue: Queue) -> Result<CommandBuffer> {
        let shared = self.device_state();
        let (finished, recording) = shared.submitter.collect_and_acquire(queue)?;
        let cmd = recording.map(|recording| self.new_command_buffer(queue, recording));
        shared.release_finished(finished)?;
        cmd
    }

    /// Returns a command buffer without commands.
    pub(super) fn new_command_buffer(&self, queue: Queue, recording: Box<Recording>) -> CommandBuffer {
        CommandBuffer::new(self.device_state(), queue, recording, self.inner.recording_states.acquire())
    }

    /// Submits a command buffer to its queue, after all earlier uploads and builds (`vkQueueSubmit2`). Does not wait.
    ///
    /// # Errors
    /// [`InvalidUsage`](Error::InvalidUsage) if the command buffer
    /// - belongs to another context,
    /// - refits a TLAS whose number of instances another submission has changed since recording,
    /// - refits or references a software-traced BLAS that another submission has rebuilt since recording,
    /// - leaves a query open, or writes a query that was written and not reset,
    /// - uses an image of a swapchain that is not [acquired](Self::next_image),
    /// - is for another queue than the graphics queue, and uses an image of a window or an object that was
    ///   [imported](Self::import_texture) without being concurrent.
    ///
    /// A failure of Vulkan itself leaves the context in an unknown state. This and every later submission returns it,
    /// and the application needs a new context.
    pub fn submit(&self, cmd: CommandBuffer) -> Result<SubmitHandle> {
        self.submit_with_semaphores(cmd, Submission::default())
    }

    /// Submits like [`submit`](Self::submit), but [`next_frame`](Self::next_frame) never waits for the submission. Use
    /// it for work on other queues that takes several frames. Such work must not use buffers that belong to a
    /// [`Frame::index`](crate::Frame::index).
    pub fn submit_in_background(&self, cmd: CommandBuffer) -> Result<SubmitHandle> {
        self.submit_with_semaphores(cmd, Submission { in_background: true, ..Submission::default() })
    }

    /// Submits like [`submit`](Self::submit), with the semaphores and flags of `more`. Its recordings are ignored.
    pub(super) fn submit_with_semaphores(
        &self,
        cmd: CommandBuffer,
        more: Submission,
    ) -> Result<SubmitHandle> {
        cpu_scope!("submit");
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
            // Uploads must wait as well, whichever stages the caller named.
            let all = vk::PipelineStageFlags2::ALL_COMMANDS;
            more.waits.iter_mut().for_each(|wait| wait.stage_mask = all);
        }
        if cmd.queue_index() == 0 {
            return self.send_to_queue(prelude, Some(cmd), more);
        }
        if prelude.is_some() {
            // Only the first submission has the waits. The main submission runs after it.
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

    /// Submits pending uploads and builds, if there are any, to the graphics queue. Returns the last submission of that
    /// queue.
    pub fn flush(&self) -> Result<SubmitHandle> {
        self.advance_compactions();
        // Destroyed textures without contents then need no submission.
        self.device_state().collect_known()?;
        let mut pending = self.lock_prologue();
        let Some(cmd) = self.take_prologue(&mut pending)? else {
            return Ok(self.submit_handle(self.device_state().submitter.last_of_queues()[0]));
        };
        let flushed = self.send_to_queue(Some(cmd), None, Submission::default())?;
        // Acquiring a command buffer collects finished work; this one was not acquired.
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

    /// Returns true if a submission is done. Does not wait.
    pub fn is_done(&self, submission: SubmitHandle) -> Result<bool> {
        self.check_submitted(submission)?;
        self.device_state().submitter.is_done(submission.value)
    }

    /// Submits pending work, and waits until the GPU is idle. [`last_profile`](Self::last_profile) then covers all of it.
    /// The driver then uses none of the semaphores of [`submit_with`](Self::submit_with).
    pub fn wait_idle(&self) -> Result<()> {
        self.flush()?;
        self.wait_submitted()?;
        self.device_state().submitter.wait_for_semaphores()?;
        self.device_state().profiler.publish_open();
        Ok(())
    }

    /// Waits for everything submitted so far, on all queues.
    pub(super) fn wait_submitted(&self) -> Result<()> {
        let submitter = &self.device_state().submitter;
        submitter.wait_for_queues(&submitter.last_of_queues())?;
        self.device_state().collect_known()
    }

    /// Returns the handle of the submission with this timeline value.
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
