//! Time and resident memory of a context creation.

use std::time::Instant;

use super::row::{Limit, OverheadRow};
use crate::error::BenchError;
use crate::measure::{elapsed_ms, median_of};
use crate::setup::Setup;

pub(super) fn measure(setup: &Setup) -> Result<Vec<OverheadRow>, BenchError> {
    const RUNS: u32 = 9;
    let ctx = setup.open()?;
    ctx.wait_idle()?;
    let resident = resident_mb();
    drop(ctx);
    let mut samples = Vec::new();
    for _ in 0..RUNS {
        let start = Instant::now();
        let ctx = setup.open()?;
        samples.push(elapsed_ms(start));
        drop(ctx);
    }
    let created =
        OverheadRow::new("context created", median_of(&samples, |ms| *ms), "ms", Limit::AtMost(60.0));
    let held = resident
        .map(|mb| OverheadRow::new("resident memory with the first context", mb, "MB", Limit::AtMost(80.0)));
    Ok(std::iter::once(created).chain(held).collect())
}

/// Returns the resident memory of the process in megabytes; `None` without `/proc/self/status`.
pub(crate) fn resident_mb() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmRSS:"))?;
    let kilobytes: f64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kilobytes * 1.024e-3)
}
