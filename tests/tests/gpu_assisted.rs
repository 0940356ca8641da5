//! Whether validation in shaders sees anything: its silence elsewhere says nothing where it does not.

use lvk::{Dependencies, Result, Validation};
use lvk_tests::compute::{compute_pipeline, words_buffer};
use lvk_tests::device_with;

/// Writes the word of one buffer at a place to another.
const COPY: &str = r#"
    layout(local_size_x = 1) in;
    layout(buffer_reference, scalar) buffer Words { uint at[]; };
    layout(push_constant, scalar) uniform Push { Words from; Words to; uint place; };
    void main() { to.at[0] = from.at[place]; }"#;

#[repr(C)]
#[derive(Clone, Copy, bytemuck::NoUninit)]
struct Push {
    from: u64,
    to: u64,
    place: u32,
    unused: u32,
}

#[test]
fn a_read_beyond_a_buffer_is_a_message() -> Result<()> {
    let Some(ctx) = device_with(|desc| desc.validation = Validation::GpuAssisted) else { return Ok(()) };
    let (from, to) = (words_buffer(&ctx, &[7; 16]), words_buffer(&ctx, &[0; 16]));
    let pipeline = compute_pipeline(&ctx, COPY);
    for (place, messages) in [(15, false), (16, true), (1000, true)] {
        let (from, target) = (ctx.buffer_address(*from)?, ctx.buffer_address(*to)?);
        let mut cmd = ctx.acquire_command_buffer()?;
        cmd.bind_compute_pipeline(*pipeline)?;
        cmd.push_constants(&Push { from, to: target, place, unused: 0 })?;
        cmd.dispatch([1, 1, 1], &Dependencies { buffers: &[*to], ..Default::default() })?;
        ctx.submit(cmd)?;
        ctx.wait_idle()?;
        let found = ctx.take_messages();
        assert_eq!(!found.is_empty(), messages, "{found:?}");
    }
    Ok(())
}
