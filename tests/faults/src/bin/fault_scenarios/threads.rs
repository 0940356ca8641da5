//! Eight threads that record and submit side by side.

use lvk::{ComputePipelineHandle, Context, ContextDesc};

use crate::compute::{read_words, record_step, step_pipeline, words_buffer};
use crate::{Failure, context};

/// Rounds of each thread.
const ROUNDS: u32 = 3;

/// Runs eight threads. Returns the words of each in turn.
pub(crate) fn eight() -> Result<Vec<u8>, Failure> {
    let ctx = context(ContextDesc::default())?;
    let pipeline = step_pipeline(&ctx)?;
    let results: Vec<Result<Vec<u8>, Failure>> = std::thread::scope(|scope| {
        let (ctx, pipeline) = (&ctx, *pipeline);
        let threads: Vec<_> = (0..8).map(|thread| scope.spawn(move || work(ctx, pipeline, thread))).collect();
        let join = |thread: std::thread::ScopedJoinHandle<'_, _>| {
            thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
        };
        threads.into_iter().map(join).collect()
    });
    let parts = results.into_iter().collect::<Result<Vec<_>, _>>()?;
    ctx.wait_idle()?;
    Ok(parts.concat())
}

fn work(ctx: &Context, pipeline: ComputePipelineHandle, thread: u32) -> Result<Vec<u8>, Failure> {
    let (from, to) = (words_buffer(ctx, 100 * thread)?, words_buffer(ctx, 0)?);
    for round in 0..ROUNDS {
        let mut cmd = ctx.acquire_command_buffer()?;
        record_step(ctx, &mut cmd, pipeline, [*from, *to], round)?;
        record_step(ctx, &mut cmd, pipeline, [*to, *from], thread)?;
        let done = ctx.submit(cmd)?;
        if round == 1 {
            ctx.wait(done)?;
        }
    }
    Ok(read_words(ctx, *from)?)
}
