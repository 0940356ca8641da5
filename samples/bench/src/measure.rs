//! Times of commands, on the GPU and on the host.

use std::time::Instant;

use lvk::{CommandBuffer, Context, Holder, QueryPoolDesc, QueryPoolHandle};

use super::error::BenchError;
use lvk_samples::app::timings;

/// What one submission took, in milliseconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Timed {
    /// On the GPU, between the timestamps around what was recorded.
    pub(super) gpu: f64,
    /// On the host, from taking a command buffer until it was submitted.
    pub(super) cpu: f64,
    /// On the host, what the caller records alone.
    pub(super) record: f64,
    /// From taking a command buffer until the GPU was done.
    pub(super) total: f64,
}

/// Times command buffers of one context.
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

    /// Submits what `record` records, with nothing else under way, and waits for it.
    pub(super) fn time(
        &self,
        record: impl FnOnce(&mut CommandBuffer) -> lvk::Result<()>,
    ) -> Result<Timed, BenchError> {
        let start = Instant::now();
        let mut cmd = self.ctx.acquire_command_buffer()?;
        cmd.reset_queries(*self.pool, 0..2)?;
        cmd.write_timestamp(*self.pool, 0)?;
        let before = Instant::now();
        record(&mut cmd)?;
        let record = since(before);
        cmd.write_timestamp(*self.pool, 1)?;
        let submission = self.ctx.submit(cmd)?;
        let cpu = since(start);
        self.ctx.wait(submission)?;
        let total = since(start);
        Ok(Timed { gpu: self.read()?, cpu, record, total })
    }

    fn read(&self) -> Result<f64, BenchError> {
        match self.ctx.timestamps_ms(*self.pool, 0, 2)?[..] {
            [Some(begin), Some(end)] => Ok(end - begin),
            _ => Err(BenchError::NoTimestamp { device: self.ctx.capabilities().device_name.clone() }),
        }
    }
}

/// Milliseconds since `start`.
pub(super) fn since(start: Instant) -> f64 {
    start.elapsed().as_secs_f64() * 1e3
}

/// The median of one number of each sample; not a number when there are none.
pub(super) fn median_of<T>(samples: &[T], number: impl Fn(&T) -> f64) -> f64 {
    timings::spread(samples.iter().map(number).collect()).map_or(f64::NAN, |spread| spread.median)
}

/// The medians of all of a submission.
pub(super) fn median(samples: &[Timed]) -> Timed {
    Timed {
        gpu: median_of(samples, |timed| timed.gpu),
        cpu: median_of(samples, |timed| timed.cpu),
        record: median_of(samples, |timed| timed.record),
        total: median_of(samples, |timed| timed.total),
    }
}

/// Runs that do not count, so that clocks are up and memory is there.
const WARM_UP_RUNS: u32 = 3;

/// Lets `N` things take turns, `runs` times after a warm-up, the first to go changing from round to round. Answers the
/// samples of each.
pub(super) fn take_turns<T, const N: usize>(
    runs: u32,
    run: impl FnMut(usize) -> Result<T, BenchError>,
) -> Result<[Vec<T>; N], BenchError> {
    let mut samples = std::array::from_fn(|_| Vec::with_capacity(runs as usize));
    in_turns(runs, &mut samples, run)?;
    Ok(samples)
}

/// As [`take_turns`], for any number of things.
pub(super) fn all_take_turns<T>(
    count: usize,
    runs: u32,
    run: impl FnMut(usize) -> Result<T, BenchError>,
) -> Result<Vec<Vec<T>>, BenchError> {
    let mut samples: Vec<_> = (0..count).map(|_| Vec::with_capacity(runs as usize)).collect();
    in_turns(runs, &mut samples, run)?;
    Ok(samples)
}

fn in_turns<T>(
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
    fn everyone_has_as_many_turns_and_the_warm_up_does_not_count() {
        let mut order = Vec::new();
        let [a, b] = take_turns(4, |which| {
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
