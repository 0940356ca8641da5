//! The choice of the rasteriser that finds visible triangles.

use std::fmt;

use super::config::Raster;

/// A rasteriser and the reason for it; displayed as part of the summary.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RasterChoice {
    /// The rasteriser.
    pub raster: Raster,
    /// The reason for the choice.
    pub why: String,
}

impl RasterChoice {
    /// Compute, whose picture is that of rays, with the milliseconds of some frames of each in the reason. Hardware
    /// may be faster, but misses what shows through gaps narrower than a pixel, so it is taken only by wish or where
    /// nothing else can.
    pub(super) fn compute(compute_ms: &[f64], hardware_ms: &[f64]) -> Self {
        let best = |times: &[f64]| times.iter().copied().filter(|ms| *ms > 0.0).min_by(f64::total_cmp);
        let why = match (best(compute_ms), best(hardware_ms)) {
            (Some(compute), Some(hardware)) => {
                format!("exact; {compute:.3} ms beside {hardware:.3} ms by hardware")
            }
            _ => "exact; the device has no timestamps to measure by".to_owned(),
        };
        Self { raster: Raster::Compute, why }
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
    fn the_exact_one_is_taken_and_the_reason_says_both_times() {
        let choice = RasterChoice::compute(&[0.3, 0.2, 9.0], &[0.7, 0.15]);
        assert_eq!(choice.to_string(), "compute rasteriser (exact; 0.200 ms beside 0.150 ms by hardware)");
        for (compute, hardware) in [(&[][..], &[][..]), (&[0.0], &[0.5]), (&[0.5], &[])] {
            let choice = RasterChoice::compute(compute, hardware);
            assert_eq!(choice.raster, Raster::Compute);
            assert!(choice.why.contains("no timestamps"), "{choice}");
        }
    }
}
