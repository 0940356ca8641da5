//! The sky as light from all around: nine spherical harmonics.

use std::f32::consts::{PI, TAU};

use glam::Vec3;

use crate::scene::Sky;

/// Directions along the equator of the sphere that the sky is asked in.
const STEPS: u32 = 96;

/// Coefficients of the radiance of `sky` without its sun, in the order of `shaders/reflections/ambient.glsl`: the
/// bands 0, 1 (y, z, x) and 2 (xy, yz, 3zz - 1, xz, xx - yy).
pub(super) fn harmonics(sky: &Sky) -> [[f32; 3]; 9] {
    let sky = Sky { sun_color: [0.0; 3], ..*sky };
    project(|direction| sky.radiance(direction.to_array()).into())
}

fn project(radiance: impl Fn(Vec3) -> Vec3) -> [[f32; 3]; 9] {
    let mut sums = [Vec3::ZERO; 9];
    let rows = STEPS / 2;
    for row in 0..rows {
        let (ring, height) = (PI * (row as f32 + 0.5) / rows as f32).sin_cos();
        let solid_angle = ring * (PI / rows as f32) * (TAU / STEPS as f32);
        for step in 0..STEPS {
            let (sine, cosine) = (TAU * (step as f32 + 0.5) / STEPS as f32).sin_cos();
            let d = Vec3::new(ring * cosine, height, ring * sine);
            let light = radiance(d) * solid_angle;
            for (sum, value) in sums.iter_mut().zip(basis(d)) {
                *sum += light * value;
            }
        }
    }
    sums.map(|sum| sum.to_array())
}

fn basis(d: Vec3) -> [f32; 9] {
    let [x, y, z] = d.to_array();
    [
        0.282_095,
        0.488_603 * y,
        0.488_603 * z,
        0.488_603 * x,
        1.092_548 * x * y,
        1.092_548 * y * z,
        0.315_392 * (3.0 * z * z - 1.0),
        1.092_548 * x * z,
        0.546_274 * (x * x - y * y),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(harmonics: &[[f32; 3]; 9], d: Vec3) -> f32 {
        harmonics.iter().zip(basis(d)).map(|(c, value)| c[0] * value).sum()
    }

    #[test]
    fn harmonics_reproduce_low_frequencies() {
        let radiance = |d: Vec3| Vec3::splat(1.0 + 0.5 * d.y - 0.25 * d.x * d.z);
        let harmonics = project(radiance);
        for d in [Vec3::X, Vec3::Y, Vec3::NEG_Y, Vec3::new(0.6, 0.0, 0.8), Vec3::new(-0.48, 0.6, 0.64)] {
            assert!((value(&harmonics, d) - radiance(d).x).abs() < 5e-3, "{d}");
        }
    }

    #[test]
    fn a_day_is_brighter_above_than_below_and_has_no_sun_in_it() {
        let day = Sky::day();
        let harmonics = harmonics(&day);
        assert!(value(&harmonics, Vec3::Y) > value(&harmonics, Vec3::NEG_Y));
        assert!(value(&harmonics, day.sun_direction.into()) < 1.5);
    }
}
