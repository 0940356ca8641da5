//! Cost of a draw beside many others in one pass.

use std::time::Instant;

use lvk::Context;

use super::curve::{Curve, Expected, Unit};
use super::effort::Effort;
use super::group::{Group, GroupKey};
use crate::cpu_overhead::{DrawScene, draw_many, record_draws, record_draws_by_hand};
use crate::error::BenchError;
use crate::hand_written::{RawDevice, RawRecorder};
use crate::measure::elapsed_ms;
use crate::setup::Setup;

pub(super) fn measure(setup: &Setup, ctx: &Context, effort: Effort) -> Result<Group, BenchError> {
    let silent = setup.open_null_device()?;
    let (scene, silent_scene) = (DrawScene::new(ctx)?, DrawScene::new(&silent)?);
    let by_hand = RawRecorder::new(&RawDevice::new(ctx))?;
    let mut curves: Vec<_> = [
        ("push constants and draw, recorded, each", Expected::Constant),
        // Of a driver whose commands do nothing.
        ("of it the library, each", Expected::Constant),
        // Of a command buffer that is never submitted, so that the driver keeps its memory.
        ("the same by hand, recorded, each", Expected::Grows("the driver")),
        ("the same, recorded, submitted and done, each", Expected::Constant),
    ]
    .map(|(name, expected)| Curve::new(name, Unit::Milliseconds, expected))
    .into();
    let sizes = GroupKey::Draws.sizes(effort.quick).to_vec();
    for &size in &sizes {
        let count = size as u32;
        let costs = [
            effort.median(|| Ok(pass(ctx, &scene, count)?.0))?,
            effort.median(|| Ok(record_draws(&silent, &silent_scene, count)?))?,
            effort.median(|| record_draws_by_hand(ctx, &by_hand, &scene, count))?,
            effort.median(|| Ok(pass(ctx, &scene, count)?.1))?,
        ];
        curves.iter_mut().zip(costs).for_each(|(curve, cost)| curve.push(size, cost / f64::from(count)));
    }
    Ok(Group { key: GroupKey::Draws, sizes, curves, notes: Vec::new() })
}

/// Returns the milliseconds to record a pass with `count` draws, and those until the GPU is done.
fn pass(ctx: &Context, scene: &DrawScene, count: u32) -> lvk::Result<(f64, f64)> {
    let start = Instant::now();
    let mut cmd = ctx.acquire_command_buffer()?;
    let mut pass = scene.pass(&mut cmd)?;
    draw_many(&mut pass, count)?;
    drop(pass);
    let recorded = elapsed_ms(start);
    ctx.wait(ctx.submit(cmd)?)?;
    Ok((recorded, elapsed_ms(start)))
}
