//! Images painted by code: stone, brick, marble, wood, mosaic. All of them repeat without a seam.

use glam::{FloatExt, Vec3};

use crate::scene::Texture;
use crate::scene::light::encode_srgb;
use crate::scene::noise::{lattice, tiled};

/// Texels on an edge.
const SIZE: u32 = 512;

/// An image that is painted by code, and how.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Painted {
    pub(crate) name: &'static str,
    pub(crate) paint: fn() -> Texture,
}

/// All of them.
pub(crate) const PAINTED: [Painted; 7] = [
    Painted { name: "paving", paint: paving },
    Painted { name: "sandstone", paint: sandstone },
    Painted { name: "marble", paint: marble },
    Painted { name: "brick", paint: brick },
    Painted { name: "wood", paint: wood },
    Painted { name: "mosaic", paint: mosaic },
    Painted { name: "leaves", paint: leaves },
];

/// Large square slabs in two kinds of limestone, laid like a chess board.
fn paving() -> Texture {
    painted("paving", |u, v| {
        let (x, y) = (u * 4.0, v * 4.0);
        let (column, row) = (x.floor(), y.floor());
        let to_joint = edge_distance(x, 1.0).min(edge_distance(y, 1.0));
        let own = lattice(column as i32, row as i32, 3) - 0.5;
        let grain = tiled(u * 16.0, v * 16.0, [16; 2], 5) - 0.5;
        let clouds = tiled(u * 4.0 + own, v * 4.0, [4; 2], 3) - 0.45;
        let light = Vec3::new(0.62, 0.55, 0.44);
        let dark = Vec3::new(0.30, 0.25, 0.21);
        let stone = if (column + row) % 2.0 == 0.0 { light } else { dark };
        let stone = stone * (1.0 + 0.22 * own + 0.35 * grain + 0.3 * clouds);
        stone.lerp(Vec3::new(0.16, 0.14, 0.12), joint(to_joint, 0.018))
    })
}

/// Bricks in running bond.
fn brick() -> Texture {
    painted("brick", |u, v| {
        let y = v * 16.0;
        let row = y.floor();
        let x = u * 6.0 + 0.5 * (row % 2.0);
        let column = x.floor().rem_euclid(6.0);
        let to_joint = (edge_distance(x, 1.0) * 2.6).min(edge_distance(y, 1.0));
        let own = lattice(column as i32, row as i32, 11);
        let grain = tiled(u * 32.0, v * 32.0, [32; 2], 4) - 0.5;
        let clay = Vec3::new(0.42, 0.15, 0.09).lerp(Vec3::new(0.55, 0.26, 0.15), own);
        let clay = clay * (1.0 + 0.5 * grain);
        clay.lerp(Vec3::new(0.46, 0.42, 0.36) * (1.0 + 0.3 * grain), joint(to_joint, 0.07))
    })
}

/// White marble with grey veins.
fn marble() -> Texture {
    painted("marble", |u, v| {
        let bend = tiled(u * 4.0, v * 4.0, [4; 2], 5);
        let wide = vein(tiled(u * 3.0 + 0.9 * bend, v * 3.0 + 0.6 * bend, [3; 2], 4), 0.05);
        let fine = vein(tiled(u * 7.0 - 0.8 * bend, v * 7.0 + bend, [7; 2], 4), 0.025);
        let white = Vec3::new(0.80, 0.78, 0.74) * (0.86 + 0.26 * bend);
        white.lerp(Vec3::new(0.32, 0.33, 0.36), 0.75 * wide.max(0.5 * fine))
    })
}

/// Sandstone in soft layers.
fn sandstone() -> Texture {
    painted("sandstone", |u, v| {
        let warp = tiled(u * 3.0, v * 3.0, [3; 2], 4);
        let layers = tiled(u * 2.0, v * 24.0 + 2.0 * warp, [2, 24], 2);
        let grain = tiled(u * 64.0, v * 64.0, [64; 2], 3) - 0.5;
        let pale = Vec3::new(0.72, 0.60, 0.43);
        let warm = Vec3::new(0.56, 0.40, 0.25);
        pale.lerp(warm, (0.2 + 0.8 * layers * warp).clamp(0.0, 1.0)) * (1.0 + 0.28 * grain)
    })
}

/// Planks whose grain runs along `u`.
fn wood() -> Texture {
    painted("wood", |u, v| {
        let y = v * 6.0;
        let plank = y.floor();
        let own = lattice(0, plank as i32, 5);
        let wave = tiled(u * 2.0 + 7.0 * own, v * 6.0, [2, 6], 3);
        let rings = (38.0 * (y - plank) + 9.0 * wave + 20.0 * own).sin() * 0.5 + 0.5;
        let fibre = tiled(u * 8.0, v * 256.0, [8, 256], 2) - 0.4;
        let timber = Vec3::new(0.36, 0.20, 0.10).lerp(Vec3::new(0.20, 0.10, 0.05), 0.6 * rings + 0.3 * own);
        timber.lerp(Vec3::ZERO, joint(edge_distance(y, 1.0), 0.03)) * (1.0 + 0.45 * fibre)
    })
}

/// Small glazed tiles in blue and green.
fn mosaic() -> Texture {
    painted("mosaic", |u, v| {
        let (x, y) = (u * 16.0, v * 16.0);
        let own = lattice(x as i32, y as i32, 21);
        let other = lattice(x as i32, y as i32, 22);
        let glaze = Vec3::new(0.02, 0.22, 0.36).lerp(Vec3::new(0.10, 0.52, 0.52), own) * (0.75 + 0.5 * other);
        let to_joint = edge_distance(x, 1.0).min(edge_distance(y, 1.0));
        glaze.lerp(Vec3::new(0.55, 0.58, 0.55), joint(to_joint, 0.06))
    })
}

/// Clipped leaves in many greens.
fn leaves() -> Texture {
    painted("leaves", |u, v| {
        let clumps = tiled(u * 12.0, v * 12.0, [12; 2], 3);
        let blades = tiled(u * 90.0, v * 45.0, [90, 45], 2);
        let green = Vec3::new(0.02, 0.07, 0.02).lerp(Vec3::new(0.16, 0.32, 0.06), blades);
        green * (0.35 + 1.1 * clumps)
    })
}

fn painted(name: &str, color: impl Fn(f32, f32) -> Vec3) -> Texture {
    let texel = |i: u32| {
        let [u, v] = [i % SIZE, i / SIZE].map(|k| (k as f32 + 0.5) / SIZE as f32);
        let [r, g, b] = color(u, v).to_array().map(encode_srgb);
        [r, g, b, 255]
    };
    let pixels = (0..SIZE * SIZE).flat_map(texel).collect();
    Texture { name: name.to_owned(), width: SIZE, height: SIZE, pixels }
}

/// Distance of `x` to the nearest multiple of `step`.
fn edge_distance(x: f32, step: f32) -> f32 {
    let within = x.rem_euclid(step);
    within.min(step - within)
}

/// 1 inside a joint of half width `width`, falling to 0 just beside it.
fn joint(distance: f32, width: f32) -> f32 {
    1.0 - ((distance - width) / (0.6 * width)).clamp(0.0, 1.0)
}

/// 1 where `noise` crosses its middle, falling to 0 at `width` from it.
fn vein(noise: f32, width: f32) -> f32 {
    let off = ((noise - 0.45).abs() / width).min(1.0);
    0.0f32.lerp(1.0, (1.0 - off) * (1.0 - off))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_repeat_without_a_seam() {
        for Painted { name, paint } in PAINTED {
            let texture = paint();
            assert_eq!(texture.name, name);
            assert_eq!(texture.pixels.len(), (SIZE * SIZE * 4) as usize);
            let texel = |x: u32, y: u32| &texture.pixels[4 * (y * SIZE + x) as usize..][..3];
            let step =
                |a: &[u8], b: &[u8]| a.iter().zip(b).map(|(a, b)| u32::from(a.abs_diff(*b))).sum::<u32>();
            let across =
                |x: u32, next: u32| (0..SIZE).map(|y| step(texel(x, y), texel(next, y))).sum::<u32>();
            let down = |y: u32, next: u32| (0..SIZE).map(|x| step(texel(x, y), texel(x, next))).sum::<u32>();
            // Steps along the seam are compared with the largest ones of the picture, which joints cause.
            let widest = (0..SIZE - 1).map(|x| across(x, x + 1)).max().unwrap();
            let tallest = (0..SIZE - 1).map(|y| down(y, y + 1)).max().unwrap();
            assert!(across(SIZE - 1, 0) <= widest, "{}", texture.name);
            assert!(down(SIZE - 1, 0) <= tallest, "{}", texture.name);
            assert!(widest > 0, "{} is not flat", texture.name);
        }
    }
}
