//! Textures of the floor, painted by code: slabs of stone with joints.

use std::sync::Arc;

use glam::{Vec2, Vec3};
use lvk_gltf::{ColorSpace, Image, ImageData, MipLevel, TexelFormat};

/// Places in [`images`].
pub(super) const FLOOR_COLOR: usize = 0;
pub(super) const FLOOR_ROUGHNESS: usize = 1;
pub(super) const FLOOR_NORMALS: usize = 2;

/// Texels on an edge.
const SIZE: u32 = 512;
/// Slabs along an edge of the image.
const SLABS: u32 = 2;
/// Width of the slope beside a joint, in slabs.
const BEVEL: f32 = 0.02;

/// Colour, roughness and normals of the floor.
pub(super) fn images() -> Vec<Image> {
    let image = |name: &str, color_space, texel: fn(Vec2) -> [f32; 4]| {
        let bytes = (0..SIZE * SIZE).flat_map(|index| {
            let place = Vec2::new((index % SIZE) as f32 + 0.5, (index / SIZE) as f32 + 0.5) / SIZE as f32;
            texel(place).map(|channel| (channel.clamp(0.0, 1.0) * 255.0).round() as u8)
        });
        let level = MipLevel { width: SIZE, height: SIZE, bytes: bytes.collect() };
        let data = Arc::new(ImageData { format: TexelFormat::Rgba8, mips: vec![level] });
        Image { name: Some(name.into()), source: 0, color_space, data }
    };
    vec![
        image("floor color", ColorSpace::Srgb, color),
        image("floor roughness", ColorSpace::Linear, roughness),
        image("floor normals", ColorSpace::Linear, normals),
    ]
}

/// Distance from the nearest joint in slabs, and the slab.
fn slab(place: Vec2) -> (Vec2, [u32; 2]) {
    let scaled = place * SLABS as f32;
    let inside = scaled.fract_gl();
    let number = [scaled.x as u32 % SLABS, scaled.y as u32 % SLABS];
    (inside.min(1.0 - inside), number)
}

fn color(place: Vec2) -> [f32; 4] {
    let (edge, [x, y]) = slab(place);
    let is_dark = (x + y) % 2 == 1;
    let base = if is_dark { Vec3::new(0.36, 0.35, 0.37) } else { Vec3::new(0.68, 0.66, 0.63) };
    let cloudy = 0.05 * grain(place, 8.0) + 0.04 * grain(place, 24.0);
    let joint = (edge.min_element() / (0.5 * BEVEL)).clamp(0.0, 1.0);
    let [red, green, blue] = ((base + cloudy) * (0.45 + 0.55 * joint)).to_array();
    [red, green, blue, 1.0]
}

fn roughness(place: Vec2) -> [f32; 4] {
    let (edge, [x, y]) = slab(place);
    let polished = if (x + y) % 2 == 1 { 0.16 } else { 0.34 };
    let joint = (edge.min_element() / BEVEL).clamp(0.0, 1.0);
    [1.0, 0.8 + joint * (polished + 0.06 * grain(place, 12.0) - 0.8), 1.0, 1.0]
}

fn normals(place: Vec2) -> [f32; 4] {
    let step = 0.5 / SIZE as f32;
    let height = |offset: Vec2| {
        let (edge, _) = slab((place + offset).fract_gl());
        let slope = (edge / BEVEL).clamp(Vec2::ZERO, Vec2::ONE).min_element();
        slope * slope * (3.0 - 2.0 * slope)
    };
    let along = |axis: Vec2| height(axis * step) - height(-axis * step);
    // Green points up in the image, where its rows run down.
    let normal = Vec3::new(-along(Vec2::X), along(Vec2::Y), 1.2).normalize();
    let [red, green, blue] = (0.5 + 0.5 * normal).to_array();
    [red, green, blue, 1.0]
}

/// A soft pattern from -1 to 1 that repeats with the image.
fn grain(place: Vec2, waves: f32) -> f32 {
    let turn = std::f32::consts::TAU * waves;
    let bent = place + 0.05 * Vec2::new((place.y * turn * 0.5).sin(), (place.x * turn * 0.5).cos());
    // Whole numbers of waves along each edge, as `waves` is even.
    let waves = [(1.0, 0.5), (0.5, -1.0), (-0.5, 1.0)];
    let sum: f32 = waves.iter().map(|(x, y)| (turn * (x * bent.x + y * bent.y) + 3.0 * x).sin()).sum();
    sum / 3.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_are_of_unit_length_and_flat_in_the_middle_of_a_slab() {
        let images = images();
        let normals = &images[FLOOR_NORMALS].data.mips[0].bytes;
        let at = |x: u32, y: u32| {
            let first = 4 * (y * SIZE + x) as usize;
            Vec3::from(std::array::from_fn(|i| f32::from(normals[first + i]) / 127.5 - 1.0))
        };
        assert!(at(SIZE / 4, SIZE / 4).distance(Vec3::Z) < 0.02);
        for x in 0..SIZE {
            assert!((at(x, 3).length() - 1.0).abs() < 0.02);
        }
        assert!(at(1, SIZE / 4).x < -0.1, "the slope beside a joint faces it");
    }
}
