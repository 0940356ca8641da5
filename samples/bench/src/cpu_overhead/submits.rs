//! Empty submissions and small uploads.

use std::time::Instant;

use lvk::{BufferDesc, BufferHandle, Context};

use super::Workload;
use super::row::{Limit, OverheadRow};
use crate::error::BenchError;
use crate::hand_written::{RawCommands, RawDevice};
use crate::measure::{elapsed_ms, interleave, median_of};

const UPLOAD_BYTES: usize = 4096;

pub(super) fn measure(ctx: &Context, workload: Workload) -> Result<Vec<OverheadRow>, BenchError> {
    let raw = RawCommands::new(&RawDevice::new(ctx))?;
    let count = (workload.many / 10).max(1);
    let samples: [Vec<f64>; 3] = interleave(workload.runs, |which| {
        let start = Instant::now();
        for _ in 0..count {
            match which {
                0 => ctx.wait(ctx.submit(ctx.acquire_command_buffer()?)?)?,
                1 => raw.submit_empty()?,
                _ => raw.submit_empty_on_timeline()?,
            }
        }
        Ok(elapsed_ms(start) * 1e3 / f64::from(count))
    })?;
    let [ours, fence, timeline] = samples.map(|samples| median_of(&samples, |us| *us));
    let row = |name, reference, limit| OverheadRow::new(name, ours, "us", limit).compared_with(reference);
    Ok(vec![
        row("empty submission + wait, by hand with a fence", fence, Limit::RatioAtMost(1.0)),
        row("- by hand with a timeline semaphore", timeline, Limit::None),
        uploads(ctx, workload)?,
    ])
}

fn uploads(ctx: &Context, workload: Workload) -> Result<OverheadRow, BenchError> {
    let size_bytes = u64::from(workload.many) * UPLOAD_BYTES as u64;
    let buffer = ctx.create_buffer(&BufferDesc { size_bytes, ..BufferDesc::default() })?;
    let samples: [Vec<f64>; 2] =
        interleave(workload.runs.div_ceil(5), |which| upload(ctx, *buffer, workload.many, which == 1))?;
    let [ours, reference] = samples.map(|samples| median_of(&samples, |ms| *ms));
    let name = format!("{} uploads of 4 KiB, compared with one submission each", workload.many);
    Ok(OverheadRow::new(name, ours, "ms", Limit::FasterThan(10.0)).compared_with(reference))
}

/// Returns the milliseconds until all uploads are done.
fn upload(ctx: &Context, buffer: BufferHandle, count: u32, one_by_one: bool) -> Result<f64, BenchError> {
    let bytes = [7_u8; UPLOAD_BYTES];
    let start = Instant::now();
    for number in 0..u64::from(count) {
        ctx.upload_buffer(buffer, number * UPLOAD_BYTES as u64, &bytes)?;
        if one_by_one {
            ctx.wait(ctx.flush()?)?;
        }
    }
    ctx.wait_idle()?;
    Ok(elapsed_ms(start))
}
