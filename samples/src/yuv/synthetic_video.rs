//! The moving picture: a card as stations once sent it, by formulas.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};

/// Radius of the disc in the middle, of half the picture's height.
const DISC: f32 = 0.86;

/// The video at one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SyntheticVideo {
    /// Columns and rows.
    pub size: [u32; 2],
    /// Phase of the animation's round, 0 to 1.
    pub phase: f32,
}

impl SyntheticVideo {
    /// Red, green and blue of a pixel, encoded, 0 to 1.
    #[must_use]
    pub fn color(&self, column: u32, row: u32) -> Vec3 {
        let [width, height] = self.size.map(|side| side as f32);
        let place = Vec2::new(column as f32 + 0.5 - 0.5 * width, row as f32 + 0.5 - 0.5 * height);
        let at = 2.0 / height * place;
        let blur = 2.0 / height;
        let radius = at.length();
        let disc = self.disc(at).lerp(Vec3::splat(0.92), inside(DISC - 0.025 - radius, -blur));
        let mut color = self.backdrop(at, blur).lerp(disc, inside(DISC - radius, blur));
        color = color.lerp(Vec3::splat(0.05), inside(0.016 - self.beside_hand(at), blur));
        self.ball(color, at, blur).clamp(Vec3::ZERO, Vec3::ONE)
    }

    /// Slow waves behind a grid.
    fn backdrop(&self, at: Vec2, blur: f32) -> Vec3 {
        let sway = TAU * self.phase;
        let wave = (1.4 * at.x + sway.sin()).sin() + (1.9 * at.y + sway.cos()).cos();
        let color = 0.42 * hue(0.57 + 0.09 * wave) + Vec3::splat(0.06);
        let aside = ((at / 0.2 - 0.5).fract_gl() - 0.5).abs() * 0.2;
        color.lerp(Vec3::splat(0.75), 0.6 * inside(0.006 - aside.min_element(), blur))
    }

    /// Bars that pass, hues that turn, steps and a slope of grey.
    fn disc(&self, at: Vec2) -> Vec3 {
        const BARS: [[f32; 3]; 7] = [
            [1.0, 1.0, 1.0],
            [1.0, 1.0, 0.0],
            [0.0, 1.0, 1.0],
            [0.0, 1.0, 0.0],
            [1.0, 0.0, 1.0],
            [1.0, 0.0, 0.0],
            [0.0, 0.0, 1.0],
        ];
        let along = 0.5 + 0.5 * at.x / DISC;
        match at.y {
            ..-0.28 => 0.75 * Vec3::from(BARS[(7.0 * (along + self.phase).fract()) as usize % 7]),
            -0.28..0.22 => {
                let strength = 0.5 + (at.y + 0.28);
                hue(along + 2.0 * self.phase).lerp(Vec3::ONE, (1.0 - 2.0 * strength).max(0.0))
                    * (1.4 - strength)
            }
            0.22..0.5 => Vec3::splat((11.0 * along).floor() / 10.0),
            _ => Vec3::splat(0.5 - 0.5 * (TAU * (along - self.phase)).cos()),
        }
    }

    /// Distance from the hand that goes round once.
    fn beside_hand(&self, at: Vec2) -> f32 {
        let tip = 0.78 * Vec2::from_angle(TAU * self.phase - 0.25 * TAU);
        let along = (at.dot(tip) / tip.length_squared()).clamp(0.0, 1.0);
        at.distance(along * tip)
    }

    /// A ball in front of all, which swings from side to side.
    fn ball(&self, behind: Vec3, at: Vec2, blur: f32) -> Vec3 {
        let (sine, cosine) = (TAU * self.phase).sin_cos();
        let middle = Vec2::new(1.25 * sine, 0.62 - 0.5 * (2.0 * cosine * cosine - 1.0).abs());
        let (out, radius) = ((at - middle) / 0.2, 0.2 - at.distance(middle));
        let height = (1.0 - out.length_squared()).max(0.0).sqrt();
        let light = (out.extend(height).dot(Vec3::new(-0.5, -0.62, 0.6))).max(0.0);
        let color = Vec3::new(0.95, 0.42, 0.1) * (0.25 + 0.75 * light) + Vec3::splat(0.6 * light.powi(24));
        behind.lerp(color, inside(radius, blur))
    }
}

/// 1 where `depth` is above 0, and 0 below, with an edge as wide as `blur`; the other way round where that is below 0.
fn inside(depth: f32, blur: f32) -> f32 {
    (0.5 + depth / blur).clamp(0.0, 1.0)
}

/// Colours all round the wheel, once for each unit.
fn hue(turn: f32) -> Vec3 {
    let channel = |offset: f32| (((turn + offset).rem_euclid(1.0) * 6.0 - 3.0).abs() - 1.0).clamp(0.0, 1.0);
    Vec3::new(channel(0.0), channel(2.0 / 3.0), channel(1.0 / 3.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_are_in_range_and_most_of_them_are_there() {
        let video = SyntheticVideo { size: [64, 36], phase: 0.3 };
        let all: Vec<_> = (0..64 * 36).map(|i| video.color(i % 64, i / 64)).collect();
        assert!(all.iter().all(|color| color.min_element() >= 0.0 && color.max_element() <= 1.0));
        for channel in 0..3 {
            let others = [1, 2].map(|step| (channel + step) % 3);
            assert!(all.iter().any(|c| others.iter().all(|other| c[channel] > c[*other] + 0.5)), "{channel}");
        }
    }

    #[test]
    fn a_round_has_no_seam() {
        let color = |phase, i: u32| SyntheticVideo { size: [40, 24], phase }.color(i % 40, i / 40);
        let far = (0_u32..40 * 24).filter(|i| color(0.0, *i).distance(color(1.0, *i)) > 0.01).count();
        assert!(far < 5, "{far}");
        assert!((0..40 * 24).any(|i| color(0.0, i).distance(color(0.3, i)) > 0.3));
    }
}
