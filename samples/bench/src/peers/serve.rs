//! The child process: it opens one peer, prepares one row, and takes samples when its parent asks.

use std::io::{BufRead, Write, stdin, stdout};
use std::time::Instant;

use lvk::ash;
use lvk_dev_driver::{DriverRequest, prepare};

use super::answer::Answer;
use super::gpu_timer::take_busy_time;
use super::peer::{Failure, PeerEntry, RowRun, Sample};
use super::row::Row;
use super::workload::Workload;
use crate::cpu_overhead::resident_mb;
use crate::measure::elapsed_ms;

/// Requests of the parent, a line each.
pub(super) const SAMPLE: &str = "sample";
pub(super) const RESULT: &str = "result";
pub(super) const MEMORY: &str = "memory";
pub(super) const GPU_TIME: &str = "gpu-time";

/// Serves the parent until it closes the process's standard input. Ends the process, as libraries may leave objects behind.
pub(super) fn serve(entry: &PeerEntry, row: Row, workload: &Workload) -> Result<(), Failure> {
    let mut run = match open(entry, row, workload) {
        Ok(run) => run,
        Err(reason) => {
            answer(&Answer::Cannot(reason.to_string()))?;
            std::process::exit(0);
        }
    };
    answer(&Answer::Ready)?;
    for line in stdin().lock().lines() {
        let found = match line?.trim() {
            SAMPLE => sample(&mut *run, row.frames(workload)).map(Answer::Times),
            RESULT => run.result().map(Answer::Result),
            MEMORY => Ok(Answer::Memory(resident_mb())),
            GPU_TIME => take_busy_time().map(Answer::GpuTime),
            other => Err(format!("unknown request '{other}'").into()),
        };
        answer(&found.unwrap_or_else(|reason| Answer::Cannot(reason.to_string())))?;
    }
    std::process::exit(0);
}

/// Does the work `frames` times. Returns the sum of the times.
fn sample(run: &mut dyn RowRun, frames: u32) -> Result<Sample, Failure> {
    (0..frames).try_fold(Sample::default(), |sum, _| Ok(sum + run.sample()?))
}

fn open(entry: &PeerEntry, row: Row, workload: &Workload) -> Result<Box<dyn RowRun>, Failure> {
    if let Some(loader) = prepare(&DriverRequest::default())?.loader {
        // SAFETY: the library is a Vulkan loader. Peers open it by its bare name, which finds the open library.
        std::mem::forget(unsafe { ash::Entry::load_from(loader) }?);
    }
    let start = Instant::now();
    let peer = (entry.open)()?;
    let milliseconds = elapsed_ms(start);
    answer(&Answer::Opened { milliseconds, device: peer.device() })?;
    peer.prepare(row, workload)
}

fn answer(answer: &Answer) -> Result<(), Failure> {
    let mut out = stdout().lock();
    writeln!(out, "{answer}")?;
    Ok(out.flush()?)
}
