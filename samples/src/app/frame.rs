//! A frame while it is recorded.

use lvk::{CommandBuffer, Context};

use super::pass_times::PassTimes;

/// A frame under way: the commands so far, and where it is cut into submissions.
///
/// A sample needs no buffer of constants: [`CommandBuffer::upload`] returns the address of a copy, which is good until the
/// GPU is done with the step. A frame of several steps uploads the constants for each.
pub struct Frame<'a> {
    /// The command buffer of the frame.
    pub cmd: CommandBuffer,
    ctx: Context,
    pace: Pace<'a>,
}

/// The action between the steps of a frame.
enum Pace<'a> {
    /// The host waits for each, tells how many are done, and asks what its passes took.
    Waited { done: u64, after_step: &'a mut dyn FnMut(u64), times: PassTimes },
    /// Nothing.
    Free,
}

impl<'a> Frame<'a> {
    /// A frame whose steps are waited for and whose passes are measured; `after_step` is told how many steps are done.
    ///
    /// # Errors
    /// Errors of Vulkan.
    pub fn waited(ctx: &Context, after_step: &'a mut dyn FnMut(u64)) -> lvk::Result<Self> {
        ctx.set_profiling(ctx.capabilities().limits.timestamp_bits > 0)?;
        Self::with_pace(ctx, Pace::Waited { done: 0, after_step, times: PassTimes::default() })
    }

    /// A frame that the host does not wait for.
    ///
    /// # Errors
    /// Errors of Vulkan.
    pub fn free(ctx: &Context) -> lvk::Result<Self> {
        Self::with_pace(ctx, Pace::Free)
    }

    fn with_pace(ctx: &Context, pace: Pace<'a>) -> lvk::Result<Self> {
        Ok(Self { cmd: ctx.acquire_command_buffer()?, ctx: ctx.clone(), pace })
    }

    /// Records a pass that is known by `name` in debuggers and in the times.
    ///
    /// # Errors
    /// That of `record`.
    pub fn pass(
        &mut self,
        name: &str,
        record: impl FnOnce(&mut CommandBuffer) -> lvk::Result<()>,
    ) -> lvk::Result<()> {
        self.cmd.push_label(name);
        record(&mut self.cmd)?;
        self.cmd.pop_label();
        Ok(())
    }

    /// Ends a step of a frame that has several, so that no submission takes long: submits what is recorded. Not called after
    /// the last step.
    ///
    /// # Errors
    /// Errors of Vulkan.
    pub fn next_step(&mut self) -> lvk::Result<()> {
        let next = self.ctx.acquire_command_buffer()?;
        let step = std::mem::replace(&mut self.cmd, next);
        self.pace.submit(&self.ctx, step)
    }

    /// Ends the last step: submits it, and answers what the passes took if the frame was waited for.
    ///
    /// # Errors
    /// Errors of Vulkan.
    pub fn finish(mut self) -> lvk::Result<PassTimes> {
        self.pace.submit(&self.ctx, self.cmd)?;
        Ok(match self.pace {
            Pace::Waited { times, .. } => times,
            Pace::Free => PassTimes::default(),
        })
    }

    /// Returns the commands of the last step, for callers that submit them otherwise, as to present them.
    #[must_use]
    pub fn into_commands(self) -> CommandBuffer {
        self.cmd
    }
}

impl Pace<'_> {
    fn submit(&mut self, ctx: &Context, step: CommandBuffer) -> lvk::Result<()> {
        let submitted = ctx.submit(step)?;
        let Self::Waited { done, after_step, times } = self else { return Ok(()) };
        ctx.wait(submitted)?;
        *done += 1;
        after_step(*done);
        times.steps.extend(ctx.last_profile()?);
        Ok(())
    }
}
