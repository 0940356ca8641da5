//! The same frame again and again: what it takes from the heap, and whether memory grows.

use lvk::{Context, Dependencies};

use super::Amount;
use super::allocations::count;
use super::row::{Limit, Row};
use super::scene::{Push, Scene};
use super::start::resident_mb;
use crate::error::BenchError;

const DRAWS: u32 = 100;

pub(super) fn measure(silent: &Context, amount: Amount) -> Result<Vec<Row>, BenchError> {
    let scene = Scene::new(silent)?;
    let warm_up = (amount.many / 10).max(1);
    frames(silent, &scene, warm_up, DRAWS)?;
    let (before, memory) = (count(), resident_mb());
    frames(silent, &scene, amount.many, DRAWS)?;
    let (middle, after) = (count(), resident_mb());
    frames(silent, &scene, amount.many, 0)?;
    let each = |from: u64, to: u64| (to - from) as f64 / f64::from(amount.many);
    let (full, empty) = (each(before, middle), each(middle, count()));
    let row = |what: &str, ours, unit, limit| Row { what: what.to_owned(), ours, other: None, unit, limit };
    let mut rows = vec![
        row("heap allocations a draw", (full - empty) / f64::from(DRAWS), "", Limit::Most(0.005)),
        row("heap allocations a frame of one pass and one dispatch", empty, "", Limit::None),
    ];
    let grown = memory.zip(after).map(|(before, after)| after - before);
    let what = format!("resident memory grown over {} frames", amount.many);
    rows.extend(grown.map(|grown| row(&what, grown, "MB", Limit::Most(0.5))));
    Ok(rows)
}

fn frames(ctx: &Context, scene: &Scene, frames: u32, draws: u32) -> lvk::Result<()> {
    let images = [*scene.image];
    let mut push: Push = [scene.image.index(); 16];
    for _ in 0..frames {
        ctx.next_frame()?;
        let mut cmd = ctx.acquire_command_buffer()?;
        cmd.bind_compute_pipeline(*scene.compute)?;
        cmd.push_constants(&push)?;
        cmd.dispatch([1, 1, 1], &Dependencies { storage_images: &images, ..Dependencies::default() })?;
        let mut pass = scene.pass(&mut cmd)?;
        for number in 0..draws {
            push[1] = number;
            pass.push_constants(&push)?;
            pass.draw(0..3, 0..1)?;
        }
        drop(pass);
        ctx.submit(cmd)?;
    }
    ctx.wait_idle()
}
