//! Cost of a draw beside many others in one pass.

use std::time::Instant;

use lvk::Context;

use super::curve::{Curve, Expected, Unit};
use super::effort::Effort;
use super::group::{Group, GroupKey};
use crate::cpu_overhead::{DrawScene, Push};
use crate::error::BenchError;
use crate::measure::elapsed_ms;

pub(super) fn measure(ctx: &Context, effort: Effort) -> Result<Group, BenchError> {
    let scene = DrawScene::new(ctx)?;
    let curve = |name| Curve::new(name, Unit::Milliseconds, Expected::Constant);
    let mut recorded = curve("push constants and draw, recorded, each");
    let mut done = curve("the same, recorded, submitted and done, each");
    let sizes = GroupKey::Draws.sizes(effort.quick).to_vec();
    for &count in &sizes {
        let record = effort.median(|| Ok(pass(ctx, &scene, count)?.0 / count as f64))?;
        recorded.push(count, record);
        done.push(count, effort.median(|| Ok(pass(ctx, &scene, count)?.1 / count as f64))?);
    }
    let curves = vec![recorded, done];
    Ok(Group { key: GroupKey::Draws, sizes, curves, notes: Vec::new() })
}

/// Returns the milliseconds to record a pass with `count` draws, and those until the GPU is done.
fn pass(ctx: &Context, scene: &DrawScene, count: u64) -> lvk::Result<(f64, f64)> {
    let start = Instant::now();
    let mut cmd = ctx.acquire_command_buffer()?;
    let mut pass = scene.pass(&mut cmd)?;
    let mut push: Push = [1; 16];
    for number in 0..count {
        push[0] = number as u32;
        pass.push_constants(&push)?;
        pass.draw(0..3, 0..1)?;
    }
    drop(pass);
    let recorded = elapsed_ms(start);
    ctx.wait(ctx.submit(cmd)?)?;
    Ok((recorded, elapsed_ms(start)))
}
