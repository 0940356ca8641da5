//! The sky that rays meet when they leave the scene.

use glam::Vec3;

/// A clear or cloudy sky over a plain ground, computed from a direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sky {
    /// Radiance straight up, linear RGB.
    pub zenith: [f32; 3],
    /// Radiance at the horizon.
    pub horizon: [f32; 3],
    /// Radiance below the horizon.
    pub ground: [f32; 3],
    /// Unit vector towards the sun.
    pub sun_direction: [f32; 3],
    /// Radiance of the sun's disc, which is 2.5 degrees wide: larger than the real one, so that it survives in
    /// a cube map.
    pub sun_color: [f32; 3],
    /// Share of the sky that clouds cover, 0 to 1.
    pub clouds: f32,
}

/// Cosine of half the angle that the sun covers.
const SUN_COSINE: f32 = 0.999_76;

impl Sky {
    /// A bright day with a few clouds.
    pub fn day() -> Self {
        Self {
            zenith: [0.16, 0.34, 0.78],
            horizon: [0.75, 0.85, 0.98],
            ground: [0.26, 0.24, 0.22],
            sun_direction: Vec3::new(0.5, 0.7, 0.5).normalize().to_array(),
            sun_color: [12.0, 11.0, 9.0],
            clouds: 0.35,
        }
    }

    /// Radiance from `direction` (any length), linear RGB; that of the horizon for a zero vector.
    pub fn radiance(&self, direction: [f32; 3]) -> [f32; 3] {
        let direction = Vec3::from(direction).normalize_or_zero();
        let horizon = Vec3::from(self.horizon);
        if direction.y < 0.0 {
            let depth = (-direction.y * 25.0).min(1.0);
            return horizon.lerp(Vec3::from(self.ground), depth.sqrt()).to_array();
        }
        let clear = horizon.lerp(Vec3::from(self.zenith), direction.y.powf(0.55));
        let facing = direction.dot(Vec3::from(self.sun_direction)).max(0.0);
        let sun = Vec3::from(self.sun_color);
        let glow = sun * (0.02 * facing.powi(8) + 0.06 * facing.powi(200));
        let disc = if facing > SUN_COSINE { sun } else { Vec3::ZERO };
        let cover = self.cloud_cover(direction);
        let cloud = Vec3::splat(0.9) + sun * (0.02 + 0.03 * facing.powi(16));
        ((clear + disc).lerp(cloud, cover) + glow).to_array()
    }

    /// The sky as the six faces of a cube map, `size` texels on an edge, each texel being R, G, B, 1. Faces and
    /// orientation are Vulkan's: +X -X +Y -Y +Z -Z, rows from the top. A thread bakes each face.
    pub fn bake_cube(&self, size: u32) -> [Vec<[f32; 4]>; 6] {
        let bake = |face| -> Vec<_> {
            let texel = |i: u32| {
                let [s, t] = [i % size, i / size].map(|k| (2 * k + 1) as f32 / size as f32 - 1.0);
                let [r, g, b] = self.radiance(cube_direction(face, s, t));
                [r, g, b, 1.0]
            };
            (0..size * size).map(texel).collect()
        };
        std::thread::scope(|scope| {
            let faces: [_; 6] = std::array::from_fn(|face| scope.spawn(move || bake(face)));
            faces.map(|face| face.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
        })
    }

    fn cloud_cover(&self, direction: Vec3) -> f32 {
        if self.clouds <= 0.0 {
            return 0.0;
        }
        let height = direction.y + 0.12;
        let (x, z) = (1.6 * direction.x / height, 1.6 * direction.z / height);
        let density =
            super::noise::fractal(x, z, 5) + 0.25 * super::noise::fractal(3.1 * x + 7.0, 3.1 * z, 3);
        let edge = 1.05 - 0.9 * self.clouds;
        let cover = ((density - edge) / 0.45).clamp(0.0, 1.0);
        let haze = (direction.y * 6.0).min(1.0);
        0.9 * cover * cover * (3.0 - 2.0 * cover) * haze
    }
}

/// Direction of a point on a cube face, `s` to the right and `t` down, both from -1 to 1 (Vulkan's table of
/// cube map face selection, read backwards).
fn cube_direction(face: usize, s: f32, t: f32) -> [f32; 3] {
    match face {
        0 => [1.0, -t, -s],
        1 => [-1.0, -t, s],
        2 => [s, 1.0, t],
        3 => [s, -1.0, -t],
        4 => [s, -t, 1.0],
        _ => [-s, -t, -1.0],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sun_is_where_it_should_be() {
        let sky = Sky { clouds: 0.0, ..Sky::day() };
        let brightness = |d: [f32; 3]| Vec3::from(sky.radiance(d)).length();
        let away = sky.sun_direction.map(|x| -x);
        assert!(brightness(sky.sun_direction) > 10.0 * brightness([-0.5, 0.7, -0.5]));
        assert!(brightness(away) < 1.0);
        assert!(sky.radiance([0.0; 3]).iter().all(|x| x.is_finite()));
    }

    #[test]
    fn the_faces_of_the_cube_point_where_vulkan_says() {
        let sky = Sky::day();
        let axes = [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]];
        let cube = sky.bake_cube(3);
        for (face, axis) in axes.iter().enumerate() {
            let [r, g, b] = sky.radiance(axis.map(|x| x as f32));
            assert_eq!(cube[face][4], [r, g, b, 1.0], "face {face}");
        }
        let top_of_x = cube_direction(0, 0.0, -0.9);
        assert!(top_of_x[1] > 0.0, "the first row of a side face is up");
        assert_eq!(
            cube_direction(4, 0.9, 0.0)[0],
            0.9,
            "seen from inside, +X is right of +Z in Vulkan's left-handed cube"
        );
    }

    #[test]
    fn neighbouring_faces_agree_along_their_edge() {
        assert_eq!(cube_direction(4, 1.0, 0.3), cube_direction(0, -1.0, 0.3));
        assert_eq!(cube_direction(0, 1.0, 0.3), cube_direction(5, -1.0, 0.3));
        assert_eq!(cube_direction(2, 0.3, 1.0), cube_direction(4, 0.3, -1.0));
    }
}
