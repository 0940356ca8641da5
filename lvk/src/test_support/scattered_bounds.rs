//! Bounds of made-up primitives.

use glam::Vec3;

use crate::accel::primitive_bounds::Bounds;

/// Returns the bounds of cubes of side length `size` at places without a pattern in the unit cube, the same in each run.
pub(crate) fn scattered_bounds(count: u32, size: f32) -> Vec<Bounds> {
    let noise =
        |i: u32, k: u32| (i.wrapping_mul(2_654_435_761).rotate_left(7 * k) >> 8) as f32 / 16_777_216.0;
    let cube = |i| {
        let low = Vec3::new(noise(i, 0), noise(i, 1), noise(i, 2));
        Bounds { low, high: low + size }
    };
    (0..count).map(cube).collect()
}
