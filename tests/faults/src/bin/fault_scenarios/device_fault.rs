//! A device that tells why it was lost.

use std::collections::BTreeSet;

use lvk::{BufferDesc, BufferHandle, Context, ContextDesc, Error, OptionalFeature};

use crate::compute::{WORDS, read_words, record_step, step_pipeline, words_buffer};
use crate::{Failure, context};

/// Runs a step from one buffer to another. Returns the words of the other. An error has the names of the buffers at the
/// addresses of the fault.
pub(crate) fn explained() -> Result<Vec<u8>, Failure> {
    let required_features = &[OptionalFeature::DeviceFault];
    let ctx = context(ContextDesc { required_features, ..Default::default() })?;
    let from = words_buffer(&ctx, 1)?;
    // The fault is at the address that is asked for last.
    let desc =
        BufferDesc { size_bytes: 4 * WORDS as u64, debug_name: "target of the step", ..Default::default() };
    let to = ctx.create_buffer(&desc)?;
    step(&ctx, [*from, *to]).map_err(|error| with_buffers(&ctx, error))
}

fn step(ctx: &Context, buffers: [BufferHandle; 2]) -> lvk::Result<Vec<u8>> {
    let pipeline = step_pipeline(ctx)?;
    let mut cmd = ctx.acquire_command_buffer()?;
    record_step(ctx, &mut cmd, *pipeline, buffers, 1)?;
    ctx.wait(ctx.submit(cmd)?)?;
    read_words(ctx, buffers[1])
}

fn with_buffers(ctx: &Context, error: Error) -> Failure {
    let Error::DeviceLost { report } = &error else { return error.into() };
    let addresses = report.fault.iter().flat_map(|fault| &fault.addresses);
    let objects = addresses.flat_map(|address| ctx.buffers_at(&address.range));
    let names: BTreeSet<String> = objects.map(|object| object.name).collect();
    let names = names.into_iter().collect::<Vec<_>>().join(", ");
    format!("{error}; buffers at these addresses: {names}").into()
}
