//! Rays in the layout that shaders read.

use bytemuck::{Pod, Zeroable};
use lvk::glam::Vec3;

use crate::random::Random;

/// A ray: points `origin + t * direction` with `t_min < t < t_max`. The direction need not have unit length.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct Ray {
    /// Origin.
    pub origin: [f32; 3],
    /// Least distance, as a multiple of the direction.
    pub t_min: f32,
    /// Direction.
    pub direction: [f32; 3],
    /// Largest distance, as a multiple of the direction.
    pub t_max: f32,
}

impl Ray {
    /// Returns a ray that is long enough for every scene of the tests.
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        Self { origin: origin.into(), t_min: 0.0, direction: direction.into(), t_max: 1e4 }
    }
}

/// Returns one ray through each pixel of a `side` by `side` image of a camera at `eye` that looks at `target`.
pub fn camera_rays(side: u32, eye: Vec3, target: Vec3) -> Vec<Ray> {
    let forward = (target - eye).normalize();
    let right = forward.cross(Vec3::Y).normalize();
    let up = right.cross(forward);
    let offset = |pixel: u32| (pixel as f32 + 0.5) / side as f32 - 0.5;
    let pixels = (0..side * side).map(|index| (offset(index % side), -offset(index / side)));
    pixels.map(|(x, y)| Ray::new(eye, (forward + right * x + up * y).normalize())).collect()
}

/// Returns rays from around and inside of an AABB towards points of it. Their directions have half to twice unit
/// length. A third each start late, end early, and do neither. Those that do not end early leave the AABB.
pub fn random_rays(seed: u64, count: usize, low: Vec3, high: Vec3) -> Vec<Ray> {
    let mut random = Random::new(seed);
    let (center, reach) = ((low + high) * 0.5, (high - low).length());
    let mut ray = |kind: usize| {
        let origin = center + random.direction() * random.between(0.1, 1.2) * reach;
        let way = random.point(low, high) - origin;
        let ray = Ray::new(origin, way.normalize_or(Vec3::X) * random.between(0.5, 2.0));
        let ray = Ray { t_max: ray.t_max.max(4.0 * reach), ..ray };
        let limit = random.between(0.1, 1.0) * reach;
        match kind % 3 {
            0 => Ray { t_min: limit, ..ray },
            1 => Ray { t_max: limit, ..ray },
            _ => ray,
        }
    };
    (0..count).map(&mut ray).collect()
}
