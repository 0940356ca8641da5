//! Measures GPU and CPU times of command buffers.

use std::time::Instant;

use lvk::{CommandBuffer, Context, Holder, QueryPoolDesc, QueryPoolHandle};

use crate::error::BenchError;
use lvk_samples::app::timings;

/// Milliseconds of the parts of a frame.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct FrameParts {
    /// Until there is a command buffer.
    pub(super) begin: f64,
    /// Commands recorded.
    pub(super) record: f64,
    /// Commands submitted.
    pub(super) submit: f64,
}

/// Times of one submission, in milliseconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SubmissionTimes {
    /// GPU time between the timestamps around the recorded commands.
    pub(super) gpu: f64,
    /// CPU time from the acquisition of the command buffer to its submission.
    pub(super) cpu: f64,
    /// CPU time of the caller's recording alone.
    pub(super) record: f64,
    /// Time from the acquisition of the command buffer until the GPU was done.
    pub(super) total: f64,
}

/// Measures command buffers of one context.
pub(super) struct Stopwatch {
    ctx: Context,
    pool: Holder<QueryPoolHandle>,
}

impl Stopwatch {
    pub(super) fn new(ctx: &Context) -> lvk::Result<Self> {
        let pool = ctx.create_query_pool(&QueryPoolDesc {
            count: 2,
            debug_name: "stopwatch",
            ..Default::default()
        })?;
        Ok(Self { ctx: ctx.clone(), pool })
    }

    /// Submits the commands that `record` records and waits for them. No other submission may be pending.
    pub(super) fn time(
        &self,
        record: impl FnOnce(&mut CommandBuffer) -> lvk::Result<()>,
    ) -> Result<SubmissionTimes, BenchError> {
        let start = Instant::now();
        let mut cmd = self.ctx.acquire_command_buffer()?;
        cmd.reset_queries(*self.pool, 0..2)?;
        cmd.write_timestamp(*self.pool, 0)?;
        let before = Instant::now();
        record(&mut cmd)?;
        let record = elapsed_ms(before);
        cmd.write_timestamp(*self.pool, 1)?;
        let submission = self.ctx.submit(cmd)?;
        let cpu = elapsed_ms(start);
        self.ctx.wait(submission)?;
        let total = elapsed_ms(start);
        Ok(SubmissionTimes { gpu: self.read_timestamps_ms()?, cpu, record, total })
    }

    fn read_timestamps_ms(&self) -> Result<f64, BenchError> {
        match self.ctx.timestamps_ms(*self.pool, 0, 2)?[..] {
            [Some(begin), Some(end)] => Ok(end - begin),
            _ => Err(BenchError::NoTimestamp { device: self.ctx.capabilities().device_name.clone() }),
        }
    }
}

/// Returns the milliseconds since `start`.
pub(super) fn elapsed_ms(start: Instant) -> f64 {
    start.elapsed().as_secs_f64() * 1e3
}

/// Returns the median of `number` over the samples; NaN for no samples.
pub(super) fn median_of<T>(samples: &[T], number: impl Fn(&T) -> f64) -> f64 {
    timings::spread(samples.iter().map(number).collect()).map_or(f64::NAN, |spread| spread.median)
}

/// Returns the median of each time.
pub(super) fn median(samples: &[SubmissionTimes]) -> SubmissionTimes {
    SubmissionTimes {
        gpu: median_of(samples, |timed| timed.gpu),
        cpu: median_of(samples, |timed| timed.cpu),
        record: median_of(samples, |timed| timed.record),
        total: median_of(samples, |timed| timed.total),
    }
}

/// Discarded runs, which raise the clocks and allocate memory.
const WARM_UP_RUNS: u32 = 3;

/// Runs `N` variants interleaved, `runs` times each after a warm-up. Each round starts with another variant. Returns the
/// samples of each variant.
pub(super) fn interleave<T, const N: usize>(
    runs: u32,
    run: impl FnMut(usize) -> Result<T, BenchError>,
) -> Result<[Vec<T>; N], BenchError> {
    let mut samples = std::array::from_fn(|_| Vec::with_capacity(runs as usize));
    run_interleaved(runs, &mut samples, run)?;
    Ok(samples)
}

/// Like [`interleave`], for `count` variants.
pub(super) fn interleave_all<T>(
    count: usize,
    runs: u32,
    run: impl FnMut(usize) -> Result<T, BenchError>,
) -> Result<Vec<Vec<T>>, BenchError> {
    let mut samples: Vec<_> = (0..count).map(|_| Vec::with_capacity(runs as usize)).collect();
    run_interleaved(runs, &mut samples, run)?;
    Ok(samples)
}

fn run_interleaved<T>(
    runs: u32,
    samples: &mut [Vec<T>],
    mut run: impl FnMut(usize) -> Result<T, BenchError>,
) -> Result<(), BenchError> {
    let warm_up = WARM_UP_RUNS.min(runs);
    for round in 0..warm_up + runs {
        for turn in 0..samples.len() {
            let which = (turn + round as usize) % samples.len();
            let sample = run(which)?;
            if round >= warm_up {
                samples[which].push(sample);
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn variants_run_equally_often_and_the_warm_up_does_not_count() {
        let mut order = Vec::new();
        let [a, b] = interleave(4, |which| {
            order.push(which);
            Ok(order.len())
        })
        .unwrap();
        assert_eq!(order, [0, 1, 1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1]);
        assert_eq!((a, b), (vec![8, 9, 12, 13], vec![7, 10, 11, 14]));
    }

    #[test]
    fn the_median_is_the_middle() {
        assert_eq!(median_of(&[3.0, 1.0, 2.0], |x| *x), 2.0);
        assert!(median_of(&[], |x: &f64| *x).is_nan());
    }
}
