//! Measures the recording of commands: by the library, by hand, and by the library with empty command functions.

use std::rc::Rc;

use lvk::Context;

use super::each_ns;
use super::row::{Limit, OverheadRow};
use super::scene::Scene;
use crate::error::BenchError;
use crate::hand_written::{RawDevice, RawRecorder};
use crate::measure::{interleave, median_of};

/// Limits of the library.
pub(super) struct Limits {
    /// Maximum ratio to the time of hand-written code.
    pub(super) ratio: f64,
    /// Maximum library share per command, in nanoseconds.
    pub(super) library_ns: f64,
}

/// Returns the milliseconds to record a number of commands by the library.
type Ours = fn(&Context, &Scene, u32) -> lvk::Result<f64>;
/// Returns the milliseconds to record a number of commands by hand.
type ByHand = fn(&Context, &Rc<RawRecorder>, &Scene, u32) -> Result<f64, BenchError>;

/// Returns the rows of `count` commands, by the medians of `runs`.
pub(super) fn measure_recording(
    ctx: &Context,
    silent: &Context,
    (runs, count): (u32, u32),
    (ours, by_hand): (Ours, ByHand),
    (name, limits): (String, Limits),
) -> Result<Vec<OverheadRow>, BenchError> {
    let (scene, silent_scene) = (Scene::new(ctx)?, Scene::new(silent)?);
    let raw = RawRecorder::new(&RawDevice::new(ctx))?;
    let samples: [Vec<f64>; 3] = interleave(runs, |which| match which {
        0 => Ok(ours(ctx, &scene, count)?),
        1 => by_hand(ctx, &raw, &scene, count),
        _ => Ok(ours(silent, &silent_scene, count)?),
    })?;
    let [ours, by_hand, own] = samples.map(|samples| each_ns(median_of(&samples, |ms| *ms), count));
    let limit = Limit::AtMost(limits.library_ns);
    Ok(vec![
        OverheadRow::new(name, ours, "ns", Limit::RatioAtMost(limits.ratio)).compared_with(by_hand),
        OverheadRow::new("- library share", own, "ns", limit),
    ])
}
