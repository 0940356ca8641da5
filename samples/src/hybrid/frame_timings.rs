//! GPU times of the passes of a frame.

use crate::app::pass_times::PassTimes;

/// Names of the passes.
pub(super) const GEOMETRY: &str = "geometry pass";
pub(super) const RAYS: &str = "ray pass";

/// GPU milliseconds of one frame; 0 where the device has no timestamps.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FrameTimings {
    /// The geometry pass; 0 where the method has none.
    pub geometry_ms: f64,
    /// The ray pass, all launch_tiles together.
    pub rays_ms: f64,
    /// Time from the begin of the first pass to the end of the last, with the gaps between passes. If the frame is cut
    /// into steps, gaps between steps do not count.
    pub span_ms: f64,
}

impl FrameTimings {
    pub(super) fn from_pass_times(times: &PassTimes) -> Self {
        Self { geometry_ms: times.ms(&[GEOMETRY]), rays_ms: times.ms(&[RAYS]), span_ms: times.span_ms() }
    }

    /// Both passes together.
    pub fn total_ms(&self) -> f64 {
        self.geometry_ms + self.rays_ms
    }
}
