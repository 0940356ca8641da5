//! What the bindless core costs the host: recording, objects, submissions, uploads, the start.
//!
//! The library's own share is measured on a second context whose recorded commands do nothing, so that only what the
//! library does itself is left.

mod allocations;
mod dispatches;
mod draws;
mod objects;
mod recorded;
mod row;
mod scene;
mod start;
mod steady;
mod submits;
mod tlas_updates;

pub use allocations::CountingAllocator;

use super::error::BenchError;
use super::setup::{Choice, Setup};
use super::table::Table;
use row::Row;

/// How much to measure.
#[derive(Clone, Copy)]
struct Amount {
    /// Rounds of which the median counts.
    runs: u32,
    /// Draws, or dispatches times ten, in one command buffer.
    draws: u32,
    /// Uploads, and frames of the steady loop.
    many: u32,
    /// Textures to crowd the bindless set with.
    crowd: u32,
}

/// Measures everything.
pub(super) fn measure(setup: &Setup) -> Result<Table, BenchError> {
    let mut rows = start::measure(setup)?;
    let ctx = setup.open()?;
    let silent = setup.open_silent()?;
    let full = Amount { runs: 15, draws: 100_000, many: 10_000, crowd: 50_000 };
    let quick = Amount { runs: 1, draws: 200, many: 50, crowd: 60 };
    let amount = setup.choose(&ctx, Choice { quick, cpu: full, gpu: full });
    let amount = Amount { runs: setup.runs(&ctx, Choice { quick: 1, cpu: 15, gpu: 31 }), ..amount };
    rows.extend(draws::measure(&ctx, &silent, amount)?);
    rows.extend(dispatches::measure(&ctx, &silent, amount)?);
    rows.extend(tlas_updates::measure(&silent, amount)?);
    rows.extend(objects::measure(setup, &ctx, amount)?);
    rows.extend(submits::measure(&ctx, amount)?);
    rows.extend(steady::measure(&silent, amount)?);
    let columns = ["", "lvk", "compared with", "ratio", "limit", ""];
    let mut table = Table::new(setup.headline(&ctx, "core: what the library costs the host"), &columns);
    rows.iter().for_each(|row: &Row| row.print(&mut table));
    table.note(format!(
        "medians of {} rounds, the ways taken in turns; by hand: the same calls in ash",
        amount.runs
    ));
    table.note("own share of what is recorded: with every vkCmd* replaced by an empty function");
    table.note(
        "objects by hand: with memory from gpu-allocator; own share: without the driver's part, which is the same with memory \
         that is there already",
    );
    Ok(table)
}

/// Nanoseconds of one of `count`, of milliseconds for all.
fn each_ns(milliseconds: f64, count: u32) -> f64 {
    milliseconds * 1e6 / f64::from(count.max(1))
}
