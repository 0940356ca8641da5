//! Textures made by formulas.

use glam::Vec3;

use crate::scene::{encode_srgb, noise};

/// A texture of `size` x `size` texels.
pub(super) struct Picture {
    pub(super) size: u32,
    /// Red, green and blue by sRGB, and alpha, linear.
    pub(super) pixels: Vec<u8>,
}

impl Picture {
    fn new(size: u32, texel: impl Fn(f32, f32) -> ([f32; 3], f32)) -> Self {
        let pixels = (0..size * size).flat_map(|i| {
            let [u, v] = [i % size, i / size].map(|k| (k as f32 + 0.5) / size as f32);
            let (color, alpha) = texel(u, v);
            let [r, g, b] = color.map(encode_srgb);
            [r, g, b, (alpha.clamp(0.0, 1.0) * 255.0 + 0.5) as u8]
        });
        Self { size, pixels: pixels.collect() }
    }

    /// Four tiles of polished marble, dark and light. Alpha is roughness: dark tiles are mirrors, light ones gloss, worn
    /// places and joints are dull.
    pub(super) fn marble_floor() -> Self {
        Self::new(512, |u, v| {
            let (x, y) = (2.0 * u, 2.0 * v);
            let is_dark = (x as i32 + y as i32) % 2 == 0;
            let warp = noise::tiled(4.0 * u, 4.0 * v, [4, 4], 5);
            let vein =
                (8.0 * noise::tiled(4.0 * u + 3.0 * warp, 4.0 * v, [4, 4], 4) + 3.0 * warp).sin().abs();
            let vein = 1.0 - (vein * 5.0).min(1.0);
            let cloud = noise::tiled(8.0 * u, 8.0 * v, [8, 8], 4);
            let worn = ((noise::tiled(2.0 * u, 2.0 * v, [2, 2], 5) - 0.52) * 5.0).clamp(0.0, 1.0);
            let joint = [x, y].iter().any(|k| (k - k.round()).abs() < 0.012);
            let (base, streak, roughness) = match is_dark {
                true => (Vec3::new(0.030, 0.040, 0.045), Vec3::new(0.28, 0.27, 0.24), 0.06 + 0.24 * worn),
                false => (Vec3::new(0.135, 0.105, 0.08), Vec3::new(0.34, 0.28, 0.22), 0.09 + 0.26 * worn),
            };
            if joint {
                return ([0.05, 0.045, 0.04], 0.8);
            }
            let color = base * (0.75 + 0.5 * cloud) + (streak - base) * (0.6 * vein);
            (color.to_array(), roughness + 0.04 * vein)
        })
    }

    /// Stone blocks for walls, and their roughness.
    pub(super) fn stone() -> Self {
        Self::new(256, |u, v| {
            let row = (4.0 * v) as i32;
            let x = 2.0 * u + 0.5 * (row % 2) as f32;
            let (dx, dy) = ((x - x.round()).abs() / 2.0, (4.0 * v - (4.0 * v).round()).abs() / 4.0);
            let joint = (dx.min(dy) / 0.01).min(1.0);
            let grain = noise::tiled(16.0 * u, 16.0 * v, [16, 16], 4);
            let tone = (0.72 + 0.4 * grain) * (0.55 + 0.45 * joint);
            ([0.50 * tone, 0.43 * tone, 0.34 * tone], 0.75 + 0.2 * grain)
        })
    }

    /// Small tiles of a basin.
    pub(super) fn mosaic() -> Self {
        Self::new(256, |u, v| {
            let (x, y) = (12.0 * u, 12.0 * v);
            let shade = noise::lattice(x as i32, y as i32, 5);
            let joint = [x, y].iter().any(|k| (k - k.round()).abs() < 0.06);
            let color = Vec3::new(0.04, 0.22, 0.26).lerp(Vec3::new(0.10, 0.40, 0.40), shade);
            if joint { ([0.25, 0.24, 0.2], 0.8) } else { (color.to_array(), 0.3) }
        })
    }

    /// A leaf with a rib; alpha is 1 on it and 0 beside it.
    pub(super) fn leaf() -> Self {
        Self::new(64, |u, v| {
            let (x, y) = (2.0 * u - 1.0, 2.0 * v - 1.0);
            let lobes = 0.06 * (14.0 * y).sin();
            let half = 0.55 * (1.0 - y * y).max(0.0) * (1.0 - 0.45 * y) + lobes * (1.0 - y.abs());
            let stalk = x.abs() < 0.05 && y > 0.6;
            let rib = x.abs() < 0.05 || ((x.abs() * 0.8 + y) * 5.0).fract().abs() < 0.12;
            let tone = if rib { 0.65 } else { 1.0 };
            ([0.95 * tone, 0.9 * tone, 0.8 * tone], if x.abs() < half || stalk { 1.0 } else { 0.0 })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_leaf_has_an_inside_and_an_outside() {
        let leaf = Picture::leaf();
        let solid = leaf.pixels.chunks(4).filter(|texel| texel[3] == 255).count();
        let empty = leaf.pixels.chunks(4).filter(|texel| texel[3] == 0).count();
        assert_eq!(solid + empty, 64 * 64);
        assert!(solid > 1000 && empty > 1000, "{solid} {empty}");
    }

    #[test]
    fn the_floor_has_mirrors_and_dull_places() {
        let floor = Picture::marble_floor();
        let roughness: Vec<u8> = floor.pixels.chunks(4).map(|texel| texel[3]).collect();
        assert!(roughness.iter().filter(|r| **r < 20).count() > 10_000);
        assert!(roughness.iter().filter(|r| **r > 90).count() > 2_000);
    }
}
