//! Creation and destruction of buffers and textures.

use std::time::Instant;

use lvk::{BufferDesc, Context, Format, TextureDesc, TextureUsage};

use super::row::{Limit, OverheadRow};
use super::{Workload, each_ns};
use crate::error::BenchError;
use crate::hand_written::{Memory, RawObjects};
use crate::measure::{elapsed_ms, interleave, median_of};
use crate::setup::Setup;

const AT_ONCE: u32 = 1_000;
const BUFFER_BYTES: u64 = 256;
const FEW: u32 = 10;

pub(super) fn measure(
    setup: &Setup,
    ctx: &Context,
    workload: Workload,
) -> Result<Vec<OverheadRow>, BenchError> {
    let mut raw = RawObjects::new(ctx)?;
    let buffers = interleave(workload.runs, |which| match which {
        0 => create_and_destroy(ctx, || buffer(ctx).map(drop)),
        1 => raw.buffers(AT_ONCE, BUFFER_BYTES, Memory::Allocated),
        _ => raw.buffers(AT_ONCE, BUFFER_BYTES, Memory::Preallocated),
    })?;
    let [ours, by_hand, driver, written] = interleave(workload.runs, |which| match which {
        0 => create_and_destroy(ctx, || texture(ctx).map(drop)),
        1 => raw.textures(AT_ONCE, Memory::Allocated),
        2 => raw.textures(AT_ONCE, Memory::Preallocated),
        _ => raw.written_textures(AT_ONCE, Memory::Preallocated),
    })?;
    let descriptor = each_us(&written) - each_us(&driver);
    let textures = [ours, by_hand, driver];
    let [thousand] = interleave(workload.runs, |_| many_buffers(ctx))?;
    let mut rows = Vec::new();
    rows.extend(comparison_rows("buffer created + destroyed, with frees", &buffers, 0.6));
    rows.extend(comparison_rows("texture created + destroyed, with frees", &textures, 1.8));
    rows.push(OverheadRow::new("- of it what a descriptor takes by hand", descriptor, "us", Limit::None));
    let name = "1,000 buffers of 256 B created, without a submission";
    rows.push(OverheadRow::new(name, median_of(&thousand, |ms| *ms), "ms", Limit::None));
    rows.extend(crowded_rows(setup, workload)?);
    Ok(rows)
}

/// Returns the rows of the library, compared with hand-written Vulkan. The third sample uses preallocated memory and so
/// measures the driver's part.
fn comparison_rows(name: &str, samples: &[Vec<f64>; 3], limit: f64) -> [OverheadRow; 2] {
    let [ours, by_hand, driver] = samples.each_ref().map(|samples| each_us(samples));
    [
        OverheadRow::new(name, ours, "us", Limit::AtMost(limit)).compared_with(by_hand),
        OverheadRow::new("- library share", ours - driver, "us", Limit::None),
    ]
}

/// Returns the microseconds of one object, from milliseconds of all.
fn each_us(samples: &[f64]) -> f64 {
    each_ns(median_of(samples, |ms| *ms), AT_ONCE) * 1e-3
}

fn buffer(ctx: &Context) -> lvk::Result<lvk::Holder<lvk::BufferHandle>> {
    ctx.create_buffer(&BufferDesc { size_bytes: BUFFER_BYTES, ..BufferDesc::default() })
}

fn texture(ctx: &Context) -> lvk::Result<lvk::Holder<lvk::TextureHandle>> {
    ctx.create_texture(&TextureDesc {
        format: Format::Rgba8Unorm,
        extent: [4, 4],
        usage: TextureUsage::SAMPLED,
        ..TextureDesc::default()
    })
}

/// Returns the milliseconds to create and destroy a thousand objects and their memory.
fn create_and_destroy(ctx: &Context, each: impl Fn() -> lvk::Result<()>) -> Result<f64, BenchError> {
    ctx.wait_idle()?;
    let start = Instant::now();
    for _ in 0..AT_ONCE {
        each()?;
    }
    ctx.wait(ctx.flush()?)?;
    Ok(elapsed_ms(start))
}

/// Returns the milliseconds to create a thousand buffers.
fn many_buffers(ctx: &Context) -> Result<f64, BenchError> {
    let before = ctx.flush()?;
    let start = Instant::now();
    let buffers: lvk::Result<Vec<_>> = (0..AT_ONCE).map(|_| buffer(ctx)).collect();
    let taken = elapsed_ms(start);
    drop(buffers?);
    assert_eq!(ctx.flush()?, before, "creating a buffer submitted something");
    Ok(taken)
}

/// Returns the row of a texture creation with few and with many live textures.
fn crowded_rows(setup: &Setup, workload: Workload) -> Result<Vec<OverheadRow>, BenchError> {
    let (few, many) =
        (setup.open_for_textures(workload.crowd + 100)?, setup.open_for_textures(workload.crowd + 100)?);
    let crowd = |ctx: &Context, count| (0..count).map(|_| texture(ctx)).collect::<lvk::Result<Vec<_>>>();
    let held = (crowd(&few, FEW)?, crowd(&many, workload.crowd)?);
    few.wait_idle()?;
    many.wait_idle()?;
    let samples: [Vec<f64>; 2] = interleave(workload.runs * 10, |which| {
        let ctx = [&many, &few][which];
        let start = Instant::now();
        let one = texture(ctx)?;
        let taken = elapsed_ms(start);
        drop(one);
        ctx.wait(ctx.flush()?)?;
        Ok(taken)
    })?;
    drop(held);
    let [ours, reference] = samples.map(|samples| median_of(&samples, |ms| *ms) * 1e3);
    let name = format!("texture created among {}, compared with among {FEW}", workload.crowd);
    Ok(vec![OverheadRow::new(name, ours, "us", Limit::RatioAtMost(1.10)).compared_with(reference)])
}
