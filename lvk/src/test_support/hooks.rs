//! What tests outside of the crate reach. No part of the library's interface.

#![allow(missing_docs, reason = "only tests see it")]

use crate::context::Context;
use crate::context::config::ContextDesc;
use crate::error::Result;
use crate::kernels::Kernel;
use crate::test_support::fault_injection;
use crate::test_support::null_commands::with_null_commands;
#[cfg(feature = "software-ray-query")]
pub use crate::test_support::software_ray_query::hooks::*;
use crate::test_support::submit_hook;
#[cfg(feature = "window")]
pub use crate::test_support::window::*;

/// A context whose recorded commands do nothing, to measure what the library takes to record them.
pub fn silent_context(desc: &ContextDesc<'_>) -> Result<Context> {
    with_null_commands(|| Context::new(desc))
}

/// The context that `make` makes and uses on this thread can have submissions fail.
pub fn with_fault_injection<T>(make: impl FnOnce() -> T) -> T {
    fault_injection::with_failing_queues(make)
}

/// After so many submissions to queues, one that this thread makes of a context made [`with_fault_injection`] is refused.
pub fn fail_submission_after(submissions: u32) {
    fault_injection::fail_after(submissions);
}

/// This thread does something that another might do, right before it takes its next command buffer. Locks may be held then:
/// objects may be destroyed, and nothing submitted.
pub fn before_next_command_buffer(deed: impl FnOnce() + 'static) {
    submit_hook::before_next_command_buffer(Box::new(deed));
}

/// How many submissions there were.
pub fn submissions(ctx: &Context) -> u64 {
    ctx.device_state().submitter.value_count()
}

/// Bytes of the staging memory there is.
pub fn staging_bytes(ctx: &Context) -> u64 {
    ctx.device_state().staging.total_bytes()
}

/// Objects that wait to be destroyed.
pub fn waiting_objects(ctx: &Context) -> Result<usize> {
    ctx.device_state().collect()?;
    Ok(ctx.device_state().submitter.deferred_count())
}

/// Compiles every kernel, after telling its name.
pub fn compile_kernels(ctx: &Context, tell: &mut dyn FnMut(&str)) -> Result<()> {
    let shared = ctx.device_state();
    for kernel in Kernel::ALL {
        tell(kernel.name());
        shared.kernels.pipeline_of(&shared.gpu, &shared.layout, shared.pipeline_base().cache, *kernel)?;
    }
    Ok(())
}
