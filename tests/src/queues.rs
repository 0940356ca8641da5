//! Tests of queues: each runs with the device's own queues, with emulated queues, and with one queue for all.
#![expect(clippy::unwrap_used, reason = "a test whose set-up fails has failed")]

use lvk::{
    BufferHandle, CommandBuffer, ComputePipelineHandle, Context, Dependencies, Holder, Queue, QueueRequest,
    SubmitHandle,
};

use crate::compute::compute_pipeline;
use crate::{TestDevice, device_with};

/// Every queue request.
pub const REQUESTS: [QueueRequest; 3] =
    [QueueRequest::OwnHardware, QueueRequest::Emulated, QueueRequest::Shared];
/// Words of the buffers of steps.
pub const WORDS: usize = 64;

/// Returns the queues of `soak`: emulated ones, which any device has, or the device's own where `LVK_TEST_QUEUES` is `own`.
pub fn long_run_queues() -> QueueRequest {
    match std::env::var("LVK_TEST_QUEUES").as_deref() {
        Ok("own") => QueueRequest::OwnHardware,
        _ => QueueRequest::Emulated,
    }
}

/// Runs a test with each request, and prints which hardware the queues have.
pub fn for_each_queue_request(test: impl Fn(&TestDevice)) {
    for queues in REQUESTS {
        let Some(ctx) = device_with(|desc| desc.queues = queues) else { return };
        describe(&ctx, queues);
        test(&ctx);
    }
}

fn describe(ctx: &Context, queues: QueueRequest) {
    let caps = ctx.capabilities();
    for queue in Queue::ALL {
        let info = caps.queue(queue);
        let real = if info.own_hardware { "has hardware of its own" } else { "shares the graphics queue's" };
        eprintln!("{} {queues:?}: {queue:?} {real}, family {}", caps.device_name, info.family);
    }
}

/// Records a command buffer and submits it to a queue.
///
/// # Panics
/// When anything is refused.
pub fn submit_on(ctx: &Context, queue: Queue, record: impl FnOnce(&mut CommandBuffer)) -> SubmitHandle {
    let mut cmd = ctx.acquire_command_buffer_on(queue).unwrap();
    assert_eq!(cmd.queue(), queue);
    record(&mut cmd);
    ctx.submit(cmd).unwrap()
}

/// `to[i] = 3 * from[i + 1] + number` for 64 words in a ring.
pub fn step_pipeline(ctx: &Context) -> Holder<ComputePipelineHandle> {
    compute_pipeline(
        ctx,
        "layout(local_size_x = 8) in;
         layout(buffer_reference, scalar) buffer Words { uint at[]; };
         layout(push_constant, scalar) uniform Push { Words from; Words to; uint number; };
         void main() {
             uint i = gl_GlobalInvocationID.x;
             to.at[i] = 3 * from.at[(i + 1) % 64] + number;
         }",
    )
}

#[repr(C)]
#[derive(Clone, Copy, bytemuck::NoUninit)]
struct Push {
    addresses: [u64; 2],
    number: u32,
    pad: u32,
}

/// Records a step without declaring its buffers.
///
/// # Panics
/// When it is refused.
pub fn bare_step(
    ctx: &Context,
    cmd: &mut CommandBuffer,
    pipeline: ComputePipelineHandle,
    [from, to]: [BufferHandle; 2],
    (number, deps): (u32, &Dependencies<'_>),
) {
    let addresses = [from, to].map(|buffer| ctx.buffer_address(buffer).unwrap());
    cmd.bind_compute_pipeline(pipeline).unwrap();
    cmd.push_constants(&Push { addresses, number, pad: 0 }).unwrap();
    cmd.dispatch([8, 1, 1], deps).unwrap();
}

/// Records a step.
///
/// # Panics
/// When it is refused.
pub fn step(
    ctx: &Context,
    cmd: &mut CommandBuffer,
    pipeline: ComputePipelineHandle,
    [from, to]: [BufferHandle; 2],
    number: u32,
) {
    let deps = Dependencies { buffers: &[to], read_buffers: &[from], ..Default::default() };
    bare_step(ctx, cmd, pipeline, [from, to], (number, &deps));
}

/// Returns the words after a step.
pub fn stepped(words: &[u32], number: u32) -> Vec<u32> {
    (0..WORDS).map(|i| words[(i + 1) % WORDS].wrapping_mul(3).wrapping_add(number)).collect()
}
