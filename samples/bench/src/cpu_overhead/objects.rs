//! Objects that come and go.

use std::time::Instant;

use lvk::{BufferDesc, Context, Format, TextureDesc, TextureUsage};

use super::row::{Limit, Row};
use super::{Amount, each_ns};
use crate::error::BenchError;
use crate::hand_written::{Memory, RawObjects};
use crate::measure::{median_of, since, take_turns};
use crate::setup::Setup;

const AT_ONCE: u32 = 1_000;
const BUFFER_BYTES: u64 = 256;
const FEW: u32 = 10;

pub(super) fn measure(setup: &Setup, ctx: &Context, amount: Amount) -> Result<Vec<Row>, BenchError> {
    let mut raw = RawObjects::new(ctx)?;
    let buffers = take_turns(amount.runs, |which| match memory(which) {
        None => come_and_go(ctx, || buffer(ctx).map(drop)),
        Some(memory) => raw.buffers(AT_ONCE, BUFFER_BYTES, memory),
    })?;
    let textures = take_turns(amount.runs, |which| match memory(which) {
        None => come_and_go(ctx, || texture(ctx).map(drop)),
        Some(memory) => raw.pictures(AT_ONCE, memory),
    })?;
    let [thousand] = take_turns(amount.runs, |_| many_buffers(ctx))?;
    let mut rows = Vec::new();
    rows.extend(beside_by_hand("buffer created + destroyed, frees included", &buffers, 0.6));
    rows.extend(beside_by_hand("texture created + destroyed, frees included", &textures, 1.8));
    rows.push(Row {
        what: "1,000 buffers of 256 B, without a submission".to_owned(),
        ours: median_of(&thousand, |ms| *ms),
        other: None,
        unit: "ms",
        limit: Limit::None,
    });
    rows.extend(crowded(setup, amount)?);
    Ok(rows)
}

/// Whose turn it is: the library's, or that of the same calls by hand with memory from there.
fn memory(turn: usize) -> Option<Memory> {
    [None, Some(Memory::Allocated), Some(Memory::There)].get(turn).copied().flatten()
}

/// A thousand by the library, by hand, and by hand without their memory: what that takes is the driver's.
fn beside_by_hand(what: &str, samples: &[Vec<f64>; 3], limit: f64) -> [Row; 2] {
    let [ours, by_hand, driver] =
        samples.each_ref().map(|samples| each_ns(median_of(samples, |ms| *ms), AT_ONCE) * 1e-3);
    let row = |what: &str, ours, other, limit| Row { what: what.to_owned(), ours, other, unit: "us", limit };
    [row(what, ours, Some(by_hand), Limit::Most(limit)), row("- own share", ours - driver, None, Limit::None)]
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

/// Milliseconds until a thousand have come and gone, their memory too.
fn come_and_go(ctx: &Context, each: impl Fn() -> lvk::Result<()>) -> Result<f64, BenchError> {
    ctx.wait_idle()?;
    let start = Instant::now();
    for _ in 0..AT_ONCE {
        each()?;
    }
    ctx.wait(ctx.flush()?)?;
    Ok(since(start))
}

/// Milliseconds to create a thousand.
fn many_buffers(ctx: &Context) -> Result<f64, BenchError> {
    let before = ctx.flush()?;
    let start = Instant::now();
    let buffers: lvk::Result<Vec<_>> = (0..AT_ONCE).map(|_| buffer(ctx)).collect();
    let taken = since(start);
    drop(buffers?);
    assert_eq!(ctx.flush()?, before, "creating a buffer submitted something");
    Ok(taken)
}

/// One more texture among few and among many.
fn crowded(setup: &Setup, amount: Amount) -> Result<Vec<Row>, BenchError> {
    let (few, many) =
        (setup.open_for_textures(amount.crowd + 100)?, setup.open_for_textures(amount.crowd + 100)?);
    let crowd = |ctx: &Context, count| (0..count).map(|_| texture(ctx)).collect::<lvk::Result<Vec<_>>>();
    let held = (crowd(&few, FEW)?, crowd(&many, amount.crowd)?);
    few.wait_idle()?;
    many.wait_idle()?;
    let samples: [Vec<f64>; 2] = take_turns(amount.runs * 10, |which| {
        let ctx = [&many, &few][which];
        let start = Instant::now();
        let one = texture(ctx)?;
        let taken = since(start);
        drop(one);
        ctx.wait(ctx.flush()?)?;
        Ok(taken)
    })?;
    drop(held);
    let [ours, other] = samples.map(|samples| median_of(&samples, |ms| *ms) * 1e3);
    let what = format!("one more texture among {}, compared with among {FEW}", amount.crowd);
    Ok(vec![Row { what, ours, other: Some(other), unit: "us", limit: Limit::Ratio(1.10) }])
}
