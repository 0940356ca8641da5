//! Which rasteriser finds the visible triangles.

use std::fmt;

use super::config::Raster;

/// A rasteriser and the reason for it; displayed as part of the headline.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RasterChoice {
    /// The rasteriser.
    pub raster: Raster,
    /// Why it was taken.
    pub why: String,
}

impl RasterChoice {
    /// The faster one by the milliseconds of some frames of each; compute where they are equal or were not measured.
    pub(super) fn by_time(compute_ms: &[f64], hardware_ms: &[f64]) -> Self {
        let best = |times: &[f64]| times.iter().copied().filter(|ms| *ms > 0.0).min_by(f64::total_cmp);
        let (Some(compute), Some(hardware)) = (best(compute_ms), best(hardware_ms)) else {
            let why = "the device has no timestamps to measure by".to_owned();
            return Self { raster: Raster::Compute, why };
        };
        let (raster, taken, other, name) = if compute <= hardware {
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
        let choice = RasterChoice::by_time(&[0.3], &[0.7, 0.25]);
        assert_eq!(choice.to_string(), "hardware rasteriser (measured: 0.250 ms, compute 0.300 ms)");
    }

    #[test]
    fn without_times_the_choice_is_always_the_same() {
        for (compute, hardware) in [(&[][..], &[][..]), (&[0.0], &[0.5]), (&[0.5], &[])] {
            assert_eq!(RasterChoice::by_time(compute, hardware).raster, Raster::Compute);
        }
    }
}
