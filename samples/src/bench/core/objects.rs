//! Objects that come and go.

use std::time::Instant;

use lvk::{BufferDesc, Context, Format, TextureDesc, TextureUsage};

use super::row::{Limit, Row};
use super::{Amount, each_ns};
use crate::bench::error::BenchError;
use crate::bench::measure::{median_of, since, take_turns};
use crate::bench::setup::Setup;

const AT_ONCE: u32 = 1_000;
const FEW: u32 = 10;

pub(super) fn measure(setup: &Setup, ctx: &Context, amount: Amount) -> Result<Vec<Row>, BenchError> {
    let [buffers, textures, thousand] = take_turns(amount.runs, |which| match which {
        0 => come_and_go(ctx, || buffer(ctx).map(drop)),
        1 => come_and_go(ctx, || texture(ctx).map(drop)),
        _ => many_buffers(ctx),
    })?;
    let each = |samples: &[f64]| each_ns(median_of(samples, |ms| *ms), AT_ONCE) * 1e-3;
    let row =
        |what: &str, ours: f64, unit, limit| Row { what: what.to_owned(), ours, other: None, unit, limit };
    let mut rows = vec![
        row("buffer created + destroyed, frees included", each(&buffers), "us", Limit::Most(0.6)),
        row("texture created + destroyed, frees included", each(&textures), "us", Limit::Most(1.8)),
        row(
            "1,000 buffers of 256 B, without a submission",
            median_of(&thousand, |ms| *ms),
            "ms",
            Limit::None,
        ),
    ];
    rows.extend(crowded(setup, amount)?);
    Ok(rows)
}

fn buffer(ctx: &Context) -> lvk::Result<lvk::Holder<lvk::BufferHandle>> {
    ctx.create_buffer(&BufferDesc { size_bytes: 256, ..BufferDesc::default() })
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
