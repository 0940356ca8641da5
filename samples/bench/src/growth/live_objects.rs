//! Measurements that groups of live objects share.

use std::time::Instant;

use lvk::Context;

use super::effort::Effort;
use crate::error::BenchError;
use crate::measure::elapsed_ms;

/// Objects that are created and destroyed at once, beside those that live. The time is divided by their number.
pub(super) const AT_ONCE: u32 = 100;

/// Empty submissions of one sample.
const SUBMISSIONS: u32 = 20;

/// Returns the milliseconds to create one more object, and to destroy it, with the submission that frees it.
pub(super) fn create_and_destroy<T>(
    ctx: &Context,
    effort: Effort,
    create: impl Fn() -> lvk::Result<T>,
) -> Result<[f64; 2], BenchError> {
    let one = |which: usize| {
        effort.median(|| {
            let start = Instant::now();
            let made: lvk::Result<Vec<T>> = (0..AT_ONCE).map(|_| create()).collect();
            let created = elapsed_ms(start);
            let made = made?;
            submit_empty(ctx)?;
            let start = Instant::now();
            drop(made);
            submit_empty(ctx)?;
            let destroyed = elapsed_ms(start);
            Ok([created, destroyed][which] / f64::from(AT_ONCE))
        })
    };
    Ok([one(0)?, one(1)?])
}

/// Returns the milliseconds of `submit`, an empty submission and the wait for it.
pub(super) fn empty_submission(
    effort: Effort,
    submit: impl Fn() -> Result<(), BenchError>,
) -> Result<f64, BenchError> {
    effort.median(|| {
        let start = Instant::now();
        (0..SUBMISSIONS).try_for_each(|_| submit())?;
        Ok(elapsed_ms(start) / f64::from(SUBMISSIONS))
    })
}

pub(super) fn submit_empty(ctx: &Context) -> lvk::Result<()> {
    ctx.wait(ctx.submit(ctx.acquire_command_buffer()?)?)
}

/// Returns `count` indices below `length`, scattered evenly and without order.
pub(super) fn scattered(count: usize, length: usize) -> Vec<usize> {
    // Odd, so that it has no factor in common with powers of two, and near the golden ratio of 32 bits.
    const STEP: u64 = 0x9e37_79b1;
    (0..count as u64)
        .map(|number| ((number.wrapping_mul(STEP) % (1 << 32) * length as u64) >> 32) as usize)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scattered_indices_cover_the_range() {
        for length in [1, 16, 1_000, 1_000_000] {
            let found = scattered(64, length);
            assert!(found.iter().all(|index| *index < length));
            let mut quarters = [0; 4];
            found.iter().for_each(|index| quarters[index * 4 / length] += 1);
            assert!(length == 1 || quarters.iter().all(|count| *count >= 8), "{length}: {quarters:?}");
        }
    }
}
