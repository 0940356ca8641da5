//! Measures the cost that culling by angular size saves.

use crate::app::sample_error::SampleError;
use std::fmt;

use super::renderer::{RAYS, Reflections, TLAS_BUILD};
use crate::app::timings;

/// GPU time of a sample of the image, in milliseconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RayCost {
    /// The build of the top-level structure.
    pub build_ms: f64,
    /// Both ray passes.
    pub rays_ms: f64,
}

/// GPU time of a sample of the image with and without culling by angular size: the least of several rounds, which other
/// work on the device disturbs less than a mean.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CullingCost {
    /// Cost with the instances that the configuration keeps.
    pub culled: RayCost,
    /// Cost with all instances.
    pub whole: RayCost,
}

impl CullingCost {
    /// Renders the first sample of the picture `rounds` times each way, in turns. `None` where the device has no timestamps,
    /// or for no rounds.
    ///
    /// # Errors
    /// [`SampleError::Device`].
    pub fn measure(sample: &Reflections, rounds: u32) -> Result<Option<Self>, SampleError> {
        let angles = [sample.config().min_angle, 0.0];
        let mut times = [const { (Vec::new(), Vec::new()) }; 2];
        for _ in 0..rounds {
            for (angle, (builds, rays)) in angles.into_iter().zip(&mut times) {
                let passes = sample.time_sample(angle)?;
                if passes.is_empty() {
                    return Ok(None);
                }
                builds.push(passes.ms(&[TLAS_BUILD]));
                rays.push(passes.ms(&RAYS));
            }
        }
        let [culled, whole] = times.map(|(builds, rays)| {
            let least = |values| timings::spread(values).map(|spread| spread.min);
            Some(RayCost { build_ms: least(builds)?, rays_ms: least(rays)? })
        });
        Ok(culled.zip(whole).map(|(culled, whole)| Self { culled, whole }))
    }
}

impl fmt::Display for CullingCost {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { culled, whole } = self;
        let saved = |part: f64, all: f64| 100.0 * (1.0 - part / all.max(1e-9));
        write!(
            f,
            "TLAS build {:.3} ms instead of {:.3} ({:.0} % saved), rays of a sample {:.3} ms instead of {:.3} ({:.0} %)",
            culled.build_ms,
            whole.build_ms,
            saved(culled.build_ms, whole.build_ms),
            culled.rays_ms,
            whole.rays_ms,
            saved(culled.rays_ms, whole.rays_ms),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_saving_is_told_in_shares() {
        let cost = |build_ms, rays_ms| RayCost { build_ms, rays_ms };
        let text = CullingCost { culled: cost(0.5, 9.0), whole: cost(1.0, 10.0) }.to_string();
        assert!(text.starts_with("TLAS build 0.500 ms instead of 1.000 (50 % saved)"), "{text}");
        assert!(text.ends_with("9.000 ms instead of 10.000 (10 %)"), "{text}");
    }
}
