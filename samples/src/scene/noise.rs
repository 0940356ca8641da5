//! Repeatable noise for painted surfaces, displaced shapes and clouds.

use glam::FloatExt;

/// A number from 0 to 1 that looks random, the same for the same lattice point everywhere.
#[must_use]
pub fn lattice(x: i32, y: i32, seed: u32) -> f32 {
    let mut h = (x as u32).wrapping_mul(0x9e37_79b1) ^ (y as u32).wrapping_mul(0x85eb_ca77) ^ seed;
    h = (h ^ (h >> 15)).wrapping_mul(0x2c1b_3c6d);
    h = (h ^ (h >> 12)).wrapping_mul(0x297a_2d39);
    ((h ^ (h >> 15)) >> 8) as f32 / 16_777_216.0
}

/// Smooth noise from 0 to 1 that repeats every `period` units of `x` and `y` (0 for never).
#[must_use]
pub fn smooth(x: f32, y: f32, period: [i32; 2], seed: u32) -> f32 {
    let (cell_x, cell_y) = (x.floor(), y.floor());
    let (fx, fy) = (fade(x - cell_x), fade(y - cell_y));
    let corners = |cell: f32, period: i32| {
        [0, 1].map(|by| match (cell as i32).wrapping_add(by) {
            k if period == 0 => k,
            k => k.rem_euclid(period),
        })
    };
    let (xs, ys) = (corners(cell_x, period[0]), corners(cell_y, period[1]));
    let at = |i: usize, j: usize| lattice(xs[i], ys[j], seed);
    at(0, 0).lerp(at(1, 0), fx).lerp(at(0, 1).lerp(at(1, 1), fx), fy)
}

/// Sum of `octaves` of [`smooth`] noise, each twice as fine and half as strong; about 0 to 1.
#[must_use]
pub fn fractal(x: f32, y: f32, octaves: u32) -> f32 {
    tiled(x, y, [0, 0], octaves)
}

/// [`fractal`] that repeats every `period` units of `x` and `y` (0 for never).
#[must_use]
pub fn tiled(x: f32, y: f32, period: [i32; 2], octaves: u32) -> f32 {
    let (mut sum, mut weight, mut frequency) = (0.0, 0.5, 1);
    for octave in 0..octaves {
        let scale = frequency as f32;
        sum += weight * smooth(x * scale, y * scale, period.map(|p| p * frequency), octave);
        (weight, frequency) = (weight * 0.5, frequency * 2);
    }
    sum
}

fn fade(t: f32) -> f32 {
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_repeats_after_its_period_and_stays_in_range() {
        for i in 0..500 {
            let (x, y) = (i as f32 * 0.173 - 20.0, i as f32 * 0.311);
            let value = tiled(x, y, [8, 4], 4);
            assert!((0.0..1.0).contains(&value));
            assert!((value - tiled(x + 8.0, y - 12.0, [8, 4], 4)).abs() < 1e-3);
        }
    }

    #[test]
    fn lattice_points_are_spread_evenly() {
        let mean = (0..10_000).map(|i| lattice(i % 100, i / 100, 7)).sum::<f32>() / 10_000.0;
        assert!((mean - 0.5).abs() < 0.02, "{mean}");
    }
}
