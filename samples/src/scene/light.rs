//! Lights, and the conversion of light to a displayed colour.

use glam::Vec3;

/// A lamp that shines equally in all directions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointLight {
    /// Position in scene units.
    pub position: [f32; 3],
    /// Irradiance at the lamp itself, linear RGB; about 1 to 3 lights a room well.
    pub color: [f32; 3],
    /// Distance in scene units at which half of `color` is left; positive.
    pub reach: f32,
}

impl PointLight {
    /// Irradiance of a surface that faces the lamp at `point`: `color / (1 + (distance / reach)^2)`. Unlike the
    /// inverse square it stays finite next to the lamp.
    pub fn irradiance(&self, point: [f32; 3]) -> [f32; 3] {
        let squared = Vec3::from(self.position).distance_squared(Vec3::from(point));
        let left = 1.0 / (1.0 + squared / (self.reach * self.reach));
        self.color.map(|c| c * left)
    }
}

/// A light so far away that it is the same everywhere, such as the sun.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DirectionalLight {
    /// Unit vector from the scene towards the light.
    pub direction: [f32; 3],
    /// Irradiance of a surface that faces the light, linear RGB.
    pub color: [f32; 3],
}

/// Light that comes from everywhere: one colour from above, one from below.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ambient {
    /// Reflected by surfaces that face up, linear RGB.
    pub above: [f32; 3],
    /// Reflected by surfaces that face down, linear RGB.
    pub below: [f32; 3],
}

impl Ambient {
    /// Blend of the two for a surface with unit normal `normal`: `below` to `above` linear in `normal.y`.
    pub fn evaluate(&self, normal: [f32; 3]) -> [f32; 3] {
        let weight = 0.5 + 0.5 * normal[1];
        Vec3::from(self.below).lerp(Vec3::from(self.above), weight).to_array()
    }
}

/// The displayed 8-bit sRGB colour of a linear radiance: `sRGB(1 - exp(-radiance))`, which never clips abruptly.
pub fn display(radiance: [f32; 3]) -> [u8; 3] {
    radiance.map(|c| encode_srgb(1.0 - (-c.max(0.0)).exp()))
}

/// IEC 61966-2-1 encoding of a linear value. What is below 0 is taken as 0, and what is above 1 as 1.
#[must_use]
pub fn encode_srgb(linear: f32) -> u8 {
    let encoded = if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
    (encoded.clamp(0.0, 1.0) * 255.0 + 0.5) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_of_the_lamp_is_left_at_its_reach() {
        let lamp = PointLight { position: [0.0; 3], color: [2.0, 4.0, 6.0], reach: 3.0 };
        assert_eq!(lamp.irradiance([0.0, 3.0, 0.0]), [1.0, 2.0, 3.0]);
        assert_eq!(lamp.irradiance([0.0; 3]), [2.0, 4.0, 6.0]);
    }

    #[test]
    fn ambient_light_follows_the_normal() {
        let ambient = Ambient { above: [1.0; 3], below: [0.0; 3] };
        assert_eq!(ambient.evaluate([0.0, 1.0, 0.0]), [1.0; 3]);
        assert_eq!(ambient.evaluate([0.0, -1.0, 0.0]), [0.0; 3]);
        assert_eq!(ambient.evaluate([1.0, 0.0, 0.0]), [0.5; 3]);
    }

    #[test]
    fn display_is_monotonic_and_spans_the_range() {
        assert_eq!(display([0.0, -1.0, f32::INFINITY]), [0, 0, 255]);
        assert!(display([0.5; 3]) < display([0.6; 3]));
        assert_eq!(encode_srgb(0.5), 188);
    }
}
