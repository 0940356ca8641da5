//! Hooks for tests outside the crate. Not part of the library's interface.

#![allow(missing_docs, reason = "only tests see it")]

use std::sync::atomic::{AtomicBool, Ordering};

use ash::vk;

use crate::context::Context;
use crate::context::config::ContextDesc;
use crate::error::Result;
use crate::kernels::Kernel;
use crate::test_support::fault_injection;
use crate::test_support::null_commands::with_null_commands;
#[cfg(feature = "test-hooks")]
pub use crate::test_support::outside_bytes;
#[cfg(all(feature = "glsl", feature = "test-hooks"))]
pub use crate::test_support::outside_pipelines;
#[cfg(feature = "software-ray-query")]
pub use crate::test_support::software_ray_query::hooks::*;
use crate::test_support::submit_hook;
#[cfg(feature = "window")]
pub use crate::test_support::window::*;

/// Creates a context whose recorded commands do nothing, to measure the library's own recording time.
pub fn null_command_context(desc: &ContextDesc<'_>) -> Result<Context> {
    with_null_commands(|| Context::new(desc))
}

/// Runs `make`. The queues of contexts that it creates run late and interleaved, in an order that `seed` and chance decide, as far as
/// submissions do not wait for each other. A context with [`QueueRequest::Emulated`](crate::QueueRequest::Emulated) has three such queues on any
/// device. Contexts of [`with_fault_injection`] have none.
pub fn with_unordered_queues<T>(seed: u64, make: impl FnOnce() -> T) -> T {
    crate::test_support::unordered_queues::with_unordered_queues(seed, make)
}

static OBSERVES_ONE_QUEUE: AtomicBool = AtomicBool::new(false);

/// From now on, the host observes each timeline value once where a context has the validation layer, with one Vulkan queue too: synchronization
/// validation then finds hazards of work that the host has asked for.
pub fn observe_values_once() {
    OBSERVES_ONE_QUEUE.store(true, Ordering::Relaxed);
}

pub(crate) fn observes_one_queue() -> bool {
    OBSERVES_ONE_QUEUE.load(Ordering::Relaxed)
}

/// Returns the number of live parts that graphics pipelines are linked from.
pub fn graphics_part_count(ctx: &Context) -> usize {
    ctx.device_state().graphics_parts.count()
}

/// Runs `make`. Submissions and allocations can fail for the context that it creates, as long as this thread uses it.
pub fn with_fault_injection<T>(make: impl FnOnce() -> T) -> T {
    fault_injection::with_failing_device(make)
}

/// Makes one submission of this thread fail, after `submissions` queue submissions that succeed. The context must be
/// created by [`with_fault_injection`].
pub fn fail_submission_after(submissions: u32) {
    fault_injection::fail_after(submissions, vk::Result::ERROR_OUT_OF_DEVICE_MEMORY);
}

/// As [`fail_submission_after`], but the device runs the submission all the same.
pub fn refuse_and_run_submission_after(submissions: u32) {
    fail_submission_after(submissions);
    fault_injection::run_refused();
}

/// Makes all waits of this thread for the GPU end by a timeout, or succeed again. The context must be created by
/// [`with_fault_injection`].
pub fn set_waits_time_out(times_out: bool) {
    fault_injection::set_times_out(times_out);
}

/// As [`fail_submission_after`], but the submission reports that the device is lost. It is not: the GPU runs what was
/// submitted before.
pub fn lose_device_after(submissions: u32) {
    fault_injection::fail_after(submissions, vk::Result::ERROR_DEVICE_LOST);
}

/// Makes all allocations of device memory by this thread fail, or succeed again. The context must be created by
/// [`with_fault_injection`].
pub fn set_out_of_memory(is_out_of_memory: bool) {
    fault_injection::set_out_of_memory(is_out_of_memory);
}

/// Emulates one heap of `heap_bytes` bytes of device memory, which all contexts of this thread share that
/// [`with_fault_injection`] creates. Allocations beyond it fail; `u64::MAX` emulates none.
pub fn set_heap_bytes(heap_bytes: u64) {
    fault_injection::set_heap_bytes(heap_bytes);
}

/// Returns the bytes of device memory that those contexts have allocated, on the thread that created them.
pub fn allocated_bytes() -> u64 {
    fault_injection::allocated_bytes()
}

/// Runs `hook` on this thread right before it acquires its next command buffer, in place of another thread.
///
/// Locks may be held then: `hook` may destroy objects, but must not submit.
pub fn before_next_command_buffer(hook: impl FnOnce() + 'static) {
    submit_hook::before_next_command_buffer(Box::new(hook));
}

/// Runs `hook` on this thread each time that [`Context::serialize_blas`] knows the sizes of a BLAS and has not copied it yet, in place of
/// another thread; `None` ends that.
pub fn before_serialize_copies(hook: Option<Box<dyn FnMut()>>) {
    submit_hook::before_serialize_copies(hook);
}

/// Returns the number of submissions so far.
pub fn submissions(ctx: &Context) -> u64 {
    ctx.device_state().submitter.value_count()
}

/// Returns the bytes of all staging memory.
pub fn staging_bytes(ctx: &Context) -> u64 {
    ctx.device_state().staging.total_bytes()
}

/// Returns the number of objects in the deferred-free queue.
pub fn waiting_objects(ctx: &Context) -> Result<usize> {
    ctx.device_state().collect()?;
    Ok(ctx.device_state().submitter.deferred_count())
}

/// Returns the numbers of bindless slots that are taken by textures, samplers, TLAS and Y'CbCr textures.
pub fn descriptor_slots(ctx: &Context) -> [usize; 4] {
    ctx.device_state().bindless.taken_counts()
}

/// Returns the number of live `VkDeviceMemory` objects of the allocator and their bytes.
pub fn memory_blocks(ctx: &Context) -> (usize, u64) {
    ctx.device_state().gpu.memory_blocks()
}

/// Compiles every kernel. Calls `on_kernel` with the kernel's name first.
pub fn compile_kernels(ctx: &Context, on_kernel: &mut dyn FnMut(&str)) -> Result<()> {
    let shared = ctx.device_state();
    for kernel in Kernel::ALL {
        on_kernel(kernel.name());
        shared.kernels.pipeline_of(&shared.gpu, &shared.layout, shared.pipeline_base().cache, *kernel)?;
    }
    Ok(())
}
