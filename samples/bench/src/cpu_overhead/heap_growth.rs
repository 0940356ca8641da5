//! Repeats the same frame, and measures heap allocations and the growth of resident memory.

use lvk::{Context, Dependencies};

use super::Workload;
use super::allocations::allocation_count;
use super::row::{Limit, OverheadRow};
use super::scene::{Push, Scene};
use super::start::resident_mb;
use crate::error::BenchError;

const DRAWS: u32 = 100;

pub(super) fn measure(silent: &Context, workload: Workload) -> Result<Vec<OverheadRow>, BenchError> {
    let scene = Scene::new(silent)?;
    let warm_up = (workload.many / 10).max(1);
    frames(silent, &scene, warm_up, DRAWS)?;
    let (before, memory) = (allocation_count(), resident_mb());
    frames(silent, &scene, workload.many, DRAWS)?;
    let (middle, after) = (allocation_count(), resident_mb());
    frames(silent, &scene, workload.many, 0)?;
    let each = |from: u64, to: u64| (to - from) as f64 / f64::from(workload.many);
    let (full, empty) = (each(before, middle), each(middle, allocation_count()));
    let mut rows = vec![
        OverheadRow::new(
            "heap allocations per draw",
            (full - empty) / f64::from(DRAWS),
            "",
            Limit::AtMost(0.005),
        ),
        OverheadRow::new(
            "heap allocations per frame of one pass and one dispatch",
            empty,
            "",
            Limit::AtMost(0.005),
        ),
    ];
    let grown = memory.zip(after).map(|(before, after)| after - before);
    let name = format!("resident memory growth over {} frames", workload.many);
    rows.extend(grown.map(|grown| OverheadRow::new(name, grown, "MB", Limit::AtMost(0.5))));
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
