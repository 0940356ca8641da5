//! A clear sky: sunlight that air scatters once, with a share for what it scatters more often.
//!
//! Coefficients are those of Hillaire, "A Scalable and Production Ready Sky and Atmosphere Rendering Technique", 2020. Lengths are
//! in metres, y is up.

use glam::DVec3;

const GROUND_RADIUS: f64 = 6_360e3;
const TOP_RADIUS: f64 = 6_460e3;
/// Height of the eye above the ground.
const EYE_HEIGHT: f64 = 200.0;
/// Scattering of air a metre at the ground, for red, green and blue light.
const AIR: DVec3 = DVec3::new(5.802e-6, 13.558e-6, 33.1e-6);
const AIR_SCALE_HEIGHT: f64 = 8e3;
/// Scattering and extinction of haze a metre at the ground.
const HAZE_SCATTERING: f64 = 0.7 * 3.996e-6;
const HAZE_EXTINCTION: f64 = 0.7 * 4.44e-6;
const HAZE_SCALE_HEIGHT: f64 = 1.2e3;
/// Asymmetry of the light that haze scatters.
const HAZE_ASYMMETRY: f64 = 0.8;
/// Absorption of ozone a metre in the middle of its layer.
const OZONE: DVec3 = DVec3::new(0.650e-6, 1.881e-6, 0.085e-6);
const OZONE_HEIGHT: f64 = 25e3;
const OZONE_HALF_WIDTH: f64 = 15e3;
/// Light that was scattered before, over that which comes from the sun. It comes from everywhere, and is bluer. The numbers are
/// chosen by eye, for a horizon that is nearly white.
const SCATTERED_BEFORE: DVec3 = DVec3::new(1.8, 1.8, 3.2);
/// Steps along a view, and along a way to the sun.
const VIEW_STEPS: u32 = 24;
const SUN_STEPS: u32 = 32;
/// Entries of the table of transmittances along each axis.
const TABLE_SIDE: usize = 64;

/// The air above the eye, lit by a sun.
pub(super) struct Atmosphere {
    to_sun: DVec3,
    /// Transmittance from a height (rows) to the sun at a cosine from the zenith (columns).
    table: Vec<DVec3>,
}

impl Atmosphere {
    /// `to_sun` has unit length.
    pub(super) fn new(to_sun: DVec3) -> Self {
        let table = (0..TABLE_SIDE * TABLE_SIDE).map(|entry| {
            let part = |index: usize| index as f64 / (TABLE_SIDE - 1) as f64;
            let height = part(entry / TABLE_SIDE).powi(2) * (TOP_RADIUS - GROUND_RADIUS);
            transmittance(height, 2.0 * part(entry % TABLE_SIDE) - 1.0)
        });
        Self { to_sun, table: table.collect() }
    }

    /// Share of the sun's light that reaches the eye.
    pub(super) fn sun_transmittance(&self) -> DVec3 {
        transmittance(EYE_HEIGHT, self.to_sun.y)
    }

    /// Radiance of the sky for a sun of irradiance 1 outside of the air. `direction` has unit length and does not point below the
    /// horizon.
    pub(super) fn radiance(&self, direction: DVec3) -> DVec3 {
        let origin = DVec3::Y * (GROUND_RADIUS + EYE_HEIGHT);
        let length = distance_to_top(origin, direction);
        let cosine = direction.dot(self.to_sun);
        let (air_phase, haze_phase) = (rayleigh(cosine), henyey_greenstein(cosine));
        let (mut light, mut left) = (DVec3::ZERO, DVec3::ONE);
        let mut start = 0.0;
        for step in 1..=VIEW_STEPS {
            // Steps are short where the air is dense.
            let end = length * (f64::from(step) / f64::from(VIEW_STEPS)).powi(2);
            let (width, point) = (end - start, origin + direction * (0.5 * (start + end)));
            start = end;
            let height = point.length() - GROUND_RADIUS;
            let (air, haze) = (
                AIR * (-height / AIR_SCALE_HEIGHT).exp(),
                HAZE_SCATTERING * (-height / HAZE_SCALE_HEIGHT).exp(),
            );
            let through = (-extinction(height) * width).exp();
            let sun = self.to_sun_from(height, point.normalize().dot(self.to_sun));
            let before = SCATTERED_BEFORE / (4.0 * std::f64::consts::PI);
            let source = sun * (air * (air_phase + before) + haze * (haze_phase + before));
            light += left * source * width * 0.5 * (DVec3::ONE + through);
            left *= through;
        }
        light
    }

    /// Reads the table between its entries.
    fn to_sun_from(&self, height: f64, cosine: f64) -> DVec3 {
        let last = (TABLE_SIDE - 1) as f64;
        let row = (height.max(0.0) / (TOP_RADIUS - GROUND_RADIUS)).sqrt().min(1.0) * last;
        let column = (0.5 + 0.5 * cosine).clamp(0.0, 1.0) * last;
        let at = |row: usize, column: usize| {
            self.table[row.min(TABLE_SIDE - 1) * TABLE_SIDE + column.min(TABLE_SIDE - 1)]
        };
        let (y, x) = (row as usize, column as usize);
        let (v, u) = (row.fract(), column.fract());
        at(y, x).lerp(at(y, x + 1), u).lerp(at(y + 1, x).lerp(at(y + 1, x + 1), u), v)
    }
}

fn extinction(height: f64) -> DVec3 {
    let ozone = (1.0 - (height - OZONE_HEIGHT).abs() / OZONE_HALF_WIDTH).max(0.0);
    AIR * (-height / AIR_SCALE_HEIGHT).exp()
        + DVec3::splat(HAZE_EXTINCTION * (-height / HAZE_SCALE_HEIGHT).exp())
        + OZONE * ozone
}

/// Share of light that comes from outside of the air, along a direction with this cosine from the zenith: none from below the
/// horizon.
fn transmittance(height: f64, cosine: f64) -> DVec3 {
    let origin = DVec3::Y * (GROUND_RADIUS + height);
    let direction = DVec3::new((1.0 - cosine * cosine).max(0.0).sqrt(), cosine, 0.0);
    let to_ground = origin.length_squared() - GROUND_RADIUS * GROUND_RADIUS;
    let half = origin.dot(direction);
    if half < 0.0 && half * half > to_ground {
        return DVec3::ZERO;
    }
    let step = distance_to_top(origin, direction) / f64::from(SUN_STEPS);
    let depth: DVec3 = (0..SUN_STEPS)
        .map(|number| {
            let point = origin + direction * (step * (f64::from(number) + 0.5));
            extinction(point.length() - GROUND_RADIUS) * step
        })
        .sum();
    (-depth).exp()
}

fn distance_to_top(origin: DVec3, direction: DVec3) -> f64 {
    let half = origin.dot(direction);
    let inside = half * half - origin.length_squared() + TOP_RADIUS * TOP_RADIUS;
    -half + inside.max(0.0).sqrt()
}

/// Share of light that air scatters into a direction, per solid angle.
fn rayleigh(cosine: f64) -> f64 {
    3.0 / (16.0 * std::f64::consts::PI) * (1.0 + cosine * cosine)
}

/// As [`rayleigh`], for haze.
fn henyey_greenstein(cosine: f64) -> f64 {
    let g = HAZE_ASYMMETRY;
    (1.0 - g * g) / (4.0 * std::f64::consts::PI * (1.0 + g * g - 2.0 * g * cosine).powf(1.5))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scattered_light_is_shared_over_all_directions() {
        for phase in [rayleigh, henyey_greenstein] {
            let steps = 100_000;
            let sum: f64 =
                (0..steps).map(|k| phase(-1.0 + 2.0 * (f64::from(k) + 0.5) / f64::from(steps))).sum();
            assert!((sum * 4.0 * std::f64::consts::PI / f64::from(steps) - 1.0).abs() < 1e-4);
        }
    }

    #[test]
    fn a_high_sun_is_white_and_its_sky_blue_and_a_low_sun_is_red() {
        let [high, low] = [60.0_f64, 3.0].map(|degrees| {
            let (sine, cosine) = degrees.to_radians().sin_cos();
            Atmosphere::new(DVec3::new(cosine, sine, 0.0))
        });
        let sun = high.sun_transmittance();
        assert!(sun.x > 0.85 && sun.z > 0.6 && sun.x > sun.z, "{sun}");
        let zenith = high.radiance(DVec3::Y);
        assert!(zenith.z > 2.0 * zenith.x && zenith.x > 0.0, "{zenith}");
        let evening = low.sun_transmittance();
        assert!(evening.x > 2.5 * evening.z && evening.x < sun.x, "{evening}");
    }

    #[test]
    fn the_ground_hides_the_sun() {
        assert_eq!(transmittance(0.0, -0.1), DVec3::ZERO);
        assert!(transmittance(0.0, 1.0).min_element() > 0.6);
    }
}
