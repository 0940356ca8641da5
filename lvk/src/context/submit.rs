//! Hands command buffers to the GPU and waits for them.

use super::Context;
use crate::command::CommandBuffer;
use crate::error::{Error, Result};
use crate::submit::{Submission, SubmitHandle};

impl Context {
    /// Starts recording a command buffer. Any number may be recorded at once, on any threads.
    pub fn acquire_command_buffer(&self) -> Result<CommandBuffer> {
        self.shared().collect()?;
        CommandBuffer::new(self.shared())
    }

    /// Submits a command buffer, after uploads and builds made before (`vkQueueSubmit2`). Does not wait.
    ///
    /// # Errors
    /// [`InvalidUsage`](Error::InvalidUsage) if the command buffer belongs to another context, refits a top-level
    /// structure whose number of instances another submission changed meanwhile, left a query open, writes one that was
    /// written and not reset, or uses an image of a swapchain that is not [taken](Self::next_image). A failure of Vulkan
    /// itself leaves the context without a known state: this and every later submission answers it, and a new context is
    /// needed.
    pub fn submit(&self, cmd: CommandBuffer) -> Result<SubmitHandle> {
        self.submit_between(cmd, Submission::default())
    }

    /// As [`submit`](Self::submit), with what `more` has besides recordings.
    pub(super) fn submit_between(&self, cmd: CommandBuffer, more: Submission) -> Result<SubmitHandle> {
        self.check_own(&cmd)?;
        self.advance_compactions();
        let mut pending = self.pending();
        cmd.check_tlas_updates()?;
        cmd.check_queries()?;
        cmd.check_images()?;
        if !self.shared().freed_tlas().is_empty() {
            self.open(&mut pending)?;
        }
        let before = self.take_pending(&mut pending)?;
        self.send(before.into_iter().chain([cmd]), more)
    }

    /// Fails for a command buffer of another context.
    pub(super) fn check_own(&self, cmd: &CommandBuffer) -> Result<()> {
        if cmd.belongs_to(self.shared()) {
            return Ok(());
        }
        Err(Error::usage("submit", "the command buffer belongs to another context"))
    }

    fn send(&self, commands: impl Iterator<Item = CommandBuffer>, more: Submission) -> Result<SubmitHandle> {
        let (recordings, mut outcomes): (Vec<_>, Vec<_>) = commands.map(CommandBuffer::finish).unzip();
        let shared = self.shared();
        let submission = Submission { recordings, ..more };
        let value = shared.submitter.submit(submission, || shared.bindless.flush())?;
        let scopes = outcomes.iter_mut().filter_map(|outcome| outcome.scopes.take());
        shared.profiler.submit(value, scopes.map(|scopes| *scopes).collect());
        outcomes.into_iter().for_each(|outcome| outcome.submit(shared, value));
        shared.collect()?;
        Ok(self.submission(value))
    }

    /// Submits uploads and builds that wait for the next submission, if there are any.
    pub fn flush(&self) -> Result<SubmitHandle> {
        self.advance_compactions();
        let mut pending = self.pending();
        let Some(cmd) = self.take_pending(&mut pending)? else { return Ok(self.last_submission()) };
        self.send([cmd].into_iter(), Submission::default())
    }

    /// Waits until a submission is done (`vkWaitSemaphores`).
    ///
    /// # Errors
    /// [`InvalidUsage`](Error::InvalidUsage) if the handle belongs to another context.
    pub fn wait(&self, submission: SubmitHandle) -> Result<()> {
        self.check_submitted(submission)?;
        self.shared().submitter.timeline.wait(submission.value)?;
        self.shared().collect()
    }

    /// Whether a submission is done. Does not wait.
    pub fn is_done(&self, submission: SubmitHandle) -> Result<bool> {
        self.check_submitted(submission)?;
        Ok(self.shared().submitter.timeline.completed()? >= submission.value)
    }

    /// Submits what waits for the next submission, and waits until the GPU has nothing left to do.
    pub fn wait_idle(&self) -> Result<()> {
        self.flush()?;
        self.wait_submitted()
    }

    /// Waits for everything submitted so far.
    pub(super) fn wait_submitted(&self) -> Result<()> {
        self.wait(self.last_submission())
    }

    /// Names the submission with this value of the timeline.
    pub(super) fn submission(&self, value: u64) -> SubmitHandle {
        SubmitHandle { value, context: self.shared().store.context_id }
    }

    fn last_submission(&self) -> SubmitHandle {
        self.submission(self.shared().submitter.submitted())
    }

    fn check_submitted(&self, submission: SubmitHandle) -> Result<()> {
        if submission == SubmitHandle::default() || submission.context == self.shared().store.context_id {
            return Ok(());
        }
        Err(Error::usage("wait", "the submission belongs to another context"))
    }
}
