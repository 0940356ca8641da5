//! Commands recorded through the library, by hand, and through the library to a driver that does nothing.

use std::rc::Rc;

use lvk::Context;

use super::each_ns;
use super::row::{Limit, Row};
use super::scene::Scene;
use crate::error::BenchError;
use crate::hand_written::{RawDevice, RawRecorder};
use crate::measure::{median_of, take_turns};

/// What the library is to keep.
pub(super) struct Limits {
    /// Its time over that by hand.
    pub(super) ratio: f64,
    /// Its own share of a command.
    pub(super) own_ns: f64,
}

/// Milliseconds to record so many through the library.
type Ours = fn(&Context, &Scene, u32) -> lvk::Result<f64>;
/// The same by hand.
type ByHand = fn(&Context, &Rc<RawRecorder>, &Scene, u32) -> Result<f64, BenchError>;

/// The rows of `count` commands, by the medians of `runs`.
pub(super) fn recorded(
    ctx: &Context,
    silent: &Context,
    (runs, count): (u32, u32),
    (ours, by_hand): (Ours, ByHand),
    (what, limits): (String, Limits),
) -> Result<Vec<Row>, BenchError> {
    let (scene, silent_scene) = (Scene::new(ctx)?, Scene::new(silent)?);
    let raw = RawRecorder::new(&RawDevice::new(ctx))?;
    let samples: [Vec<f64>; 3] = take_turns(runs, |which| match which {
        0 => Ok(ours(ctx, &scene, count)?),
        1 => by_hand(ctx, &raw, &scene, count),
        _ => Ok(ours(silent, &silent_scene, count)?),
    })?;
    let [ours, by_hand, own] = samples.map(|samples| each_ns(median_of(&samples, |ms| *ms), count));
    let limit = Limit::Most(limits.own_ns);
    Ok(vec![
        Row { what, ours, other: Some(by_hand), unit: "ns", limit: Limit::Ratio(limits.ratio) },
        Row { what: "- own share".to_owned(), ours: own, other: None, unit: "ns", limit },
    ])
}
