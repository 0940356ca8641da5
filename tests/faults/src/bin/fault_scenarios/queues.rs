//! Work that goes from queue to queue.

use lvk::{ContextDesc, Queue, QueueRequest};

use crate::compute::{WORDS, read_words, record_step, step_pipeline, words_buffer};
use crate::{Failure, context};

/// Work on three queues that share one of Vulkan's, which any driver has.
pub(crate) fn emulated() -> Result<Vec<u8>, Failure> {
    three(QueueRequest::Emulated)
}

/// Work on the queues that the device has.
pub(crate) fn own() -> Result<Vec<u8>, Failure> {
    three(QueueRequest::OwnHardware)
}

/// Steps on the graphics and the compute queue, copies on the transfer queue. Returns the words of three buffers.
fn three(queues: QueueRequest) -> Result<Vec<u8>, Failure> {
    let ctx = context(ContextDesc { queues, ..Default::default() })?;
    let pipeline = step_pipeline(&ctx)?;
    let buffers = [words_buffer(&ctx, 1)?, words_buffer(&ctx, 2)?, words_buffer(&ctx, 3)?];
    for round in 0..3 {
        for (place, queue) in (0..).zip(Queue::ALL) {
            let pair = [*buffers[place % 3], *buffers[(place + 1) % 3]];
            let mut cmd = ctx.acquire_command_buffer_on(queue)?;
            match queue {
                Queue::Transfer => cmd.copy_buffer(pair[0], 0, pair[1], 0, 4 * WORDS as u64)?,
                _ => record_step(&ctx, &mut cmd, *pipeline, pair, round)?,
            }
            ctx.submit(cmd)?;
        }
    }
    let mut bytes = Vec::new();
    for buffer in &buffers {
        bytes.extend(read_words(&ctx, **buffer)?);
    }
    ctx.wait_idle()?;
    Ok(bytes)
}
