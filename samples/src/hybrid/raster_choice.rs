//! Which rasteriser finds the visible triangles.

use std::fmt;

use super::config::Raster;

/// How many times as fast as compute the hardware rasteriser must be to make up for its edges, which are a little
/// beside those of rays.
const HARDWARE_GAIN: f64 = 1.5;

/// A rasteriser and the reason for it; displayed as part of the headline.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RasterChoice {
    /// The rasteriser.
    pub raster: Raster,
    /// Why it was taken.
    pub why: String,
}

impl RasterChoice {
    /// By the milliseconds of some frames of each: compute, whose picture is that of rays, unless hardware is faster by
    /// [`HARDWARE_GAIN`]; compute too where they were not measured.
    pub(super) fn by_time(compute_ms: &[f64], hardware_ms: &[f64]) -> Self {
        let best = |times: &[f64]| times.iter().copied().filter(|ms| *ms > 0.0).min_by(f64::total_cmp);
        let (Some(compute), Some(hardware)) = (best(compute_ms), best(hardware_ms)) else {
            let why = "the device has no timestamps to measure by".to_owned();
            return Self { raster: Raster::Compute, why };
        };
        let (raster, taken, other, name) = if compute <= hardware * HARDWARE_GAIN {
            (Raster::Compute, compute, hardware, "hardware")
        } else {
            (Raster::Hardware, hardware, compute, "compute")
        };
        Self { raster, why: format!("measured: {taken:.3} ms, {name} {other:.3} ms") }
    }
}

impl fmt::Display for RasterChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = match self.raster {
            Raster::Compute => "compute",
            Raster::Hardware => "hardware",
        };
        write!(f, "{name} rasteriser ({})", self.why)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_faster_one_is_taken_and_the_reason_says_both_times() {
        let choice = RasterChoice::by_time(&[0.3, 0.2, 9.0], &[0.7, 0.25]);
        assert_eq!(choice.to_string(), "compute rasteriser (measured: 0.200 ms, hardware 0.250 ms)");
        let choice = RasterChoice::by_time(&[0.4], &[0.7, 0.25]);
        assert_eq!(choice.to_string(), "hardware rasteriser (measured: 0.250 ms, compute 0.400 ms)");
        let close = RasterChoice::by_time(&[0.3], &[0.25]);
        assert_eq!(close.raster, Raster::Compute, "a small gain is not worth other edges");
    }

    #[test]
    fn without_times_the_choice_is_always_the_same() {
        for (compute, hardware) in [(&[][..], &[][..]), (&[0.0], &[0.5]), (&[0.5], &[])] {
            assert_eq!(RasterChoice::by_time(compute, hardware).raster, Raster::Compute);
        }
    }
}
