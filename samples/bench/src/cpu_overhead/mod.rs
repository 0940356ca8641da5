//! `bench core`: CPU overhead of recording, objects, submissions, uploads and start-up.
//!
//! The library share is measured on a second context whose command functions do nothing, so that the time of the driver is
//! excluded.

mod allocations;
mod dispatches;
mod draws;
mod frames;
mod heap_growth;
mod objects;
mod recording;
mod row;
mod scene;
mod start;
mod submits;
mod tlas_updates;

pub use allocations::CountingAllocator;
pub(super) use allocations::{peak_bytes, restart_peak};
pub(super) use draws::{draw_many, record_draws, record_draws_by_hand};
pub(super) use scene::{Push, Scene as DrawScene};
pub(super) use start::resident_mb;

use super::error::BenchError;
use super::setup::{DefaultBy, Setup};
use super::table::Table;
use row::OverheadRow;

/// Amount of work to measure.
#[derive(Clone, Copy)]
struct Workload {
    /// Rounds; the median counts.
    runs: u32,
    /// Draws in one command buffer, and ten times its dispatches.
    draws: u32,
    /// Uploads, and frames of the heap growth loop.
    many: u32,
    /// Textures that occupy the bindless set.
    crowd: u32,
}

/// Runs all measurements.
pub(super) fn measure(setup: &Setup) -> Result<Table, BenchError> {
    let mut rows = start::measure(setup)?;
    let ctx = setup.open()?;
    let silent = setup.open_null_device()?;
    let full = Workload { runs: 15, draws: 100_000, many: 10_000, crowd: 50_000 };
    let quick = Workload { runs: 1, draws: 200, many: 50, crowd: 60 };
    let workload = setup.default_for(&ctx, DefaultBy { quick, cpu: full, gpu: full });
    let workload = Workload { runs: setup.runs(&ctx, DefaultBy { quick: 1, cpu: 15, gpu: 31 }), ..workload };
    rows.extend(draws::measure(&ctx, &silent, workload)?);
    rows.extend(dispatches::measure(&ctx, &silent, workload)?);
    rows.extend(tlas_updates::measure(&silent, workload)?);
    rows.extend(objects::measure(setup, &ctx, workload)?);
    rows.extend(frames::measure(&ctx, workload)?);
    rows.extend(submits::measure(&ctx, workload)?);
    rows.extend(heap_growth::measure(&silent, workload)?);
    let columns = ["", "lvk", "compared with", "ratio", "limit", ""];
    let mut table = Table::new(setup.title(&ctx, "core: CPU overhead of the library"), &columns);
    rows.iter().for_each(|row: &OverheadRow| row.print(&mut table));
    table
        .add_note(format!("medians of {} interleaved rounds; by hand: the same calls in ash", workload.runs));
    table.add_note("library share of recording: every vkCmd* function is replaced by an empty function");
    table.add_note(
        "objects by hand: memory from gpu-allocator; library share: without the driver's part, which is measured with \
         preallocated memory",
    );
    Ok(table)
}

/// Returns the nanoseconds per item, from the milliseconds of all `count` items.
fn each_ns(milliseconds: f64, count: u32) -> f64 {
    milliseconds * 1e6 / f64::from(count.max(1))
}
