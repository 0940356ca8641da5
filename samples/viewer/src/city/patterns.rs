//! Patterns of the city's surfaces, painted by code: bricks, blocks, slabs, tiles, and ground. All of them repeat without a seam.

use glam::{FloatExt as _, UVec2, Vec2, Vec3};
use image::{ImageFormat, RgbImage};
use lvk_samples::scene::encode_srgb;
use lvk_samples::scene::noise::{lattice, tiled};

/// A pattern. Its texels are factors of the colour of the material that has it, so that several materials share one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Pattern {
    Asphalt,
    Paving,
    Grass,
    Gravel,
    Bricks,
    Blocks,
    Plaster,
    Concrete,
    Tiles,
}

/// Texels along a side that a mean is taken of at least: those of smaller images may all lie in joints.
const LEAST_FOR_MEAN: u32 = 64;

/// A pattern as an image.
pub(super) struct PaintedPattern {
    /// A PNG file, with sRGB colours.
    pub(super) png: Vec<u8>,
    /// Linear mean of the pattern.
    pub(super) mean: Vec3,
}

impl Pattern {
    /// All of them, in the order of their places in the file.
    pub(super) const ALL: [Self; 9] = [
        Self::Asphalt,
        Self::Paving,
        Self::Grass,
        Self::Gravel,
        Self::Bricks,
        Self::Blocks,
        Self::Plaster,
        Self::Concrete,
        Self::Tiles,
    ];

    /// Name of the image.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Asphalt => "asphalt",
            Self::Paving => "paving",
            Self::Grass => "grass",
            Self::Gravel => "gravel",
            Self::Bricks => "bricks",
            Self::Blocks => "blocks",
            Self::Plaster => "plaster",
            Self::Concrete => "concrete",
            Self::Tiles => "tiles",
        }
    }

    /// Metres after which the pattern repeats, along each axis.
    pub(super) fn period(self) -> f32 {
        match self {
            Self::Asphalt | Self::Grass => 6.0,
            Self::Paving => 4.8,
            Self::Gravel => 2.5,
            Self::Bricks => 1.92,
            Self::Blocks => 3.6,
            Self::Plaster | Self::Concrete => 4.0,
            Self::Tiles => 3.0,
        }
    }

    /// Paints the pattern with `size` x `size` texels.
    ///
    /// # Errors
    /// Those of the PNG encoder.
    pub(super) fn paint(self, size: u32) -> image::ImageResult<PaintedPattern> {
        let image = RgbImage::from_fn(size, size, |column, row| {
            image::Rgb(self.texel(UVec2::new(column, row), size).to_array().map(encode_srgb))
        });
        let mut png = Vec::new();
        image.write_to(&mut std::io::Cursor::new(&mut png), ImageFormat::Png)?;
        Ok(PaintedPattern { png, mean: self.mean(size.max(LEAST_FOR_MEAN)) })
    }

    /// Linear mean of `size` x `size` texels.
    fn mean(self, size: u32) -> Vec3 {
        let places = (0..size * size).map(|place| UVec2::new(place % size, place / size));
        let sum: glam::DVec3 = places.map(|texel| self.texel(texel, size).as_dvec3()).sum();
        (sum / f64::from(size * size)).as_vec3()
    }

    /// Linear factor of a texel of `size` x `size`.
    fn texel(self, texel: UVec2, size: u32) -> Vec3 {
        self.factor((texel.as_vec2() + 0.5) / size as f32).clamp(Vec3::ZERO, Vec3::ONE)
    }

    /// Linear factor of the colour at a place, which goes from 0 to 1 along both axes.
    fn factor(self, place: Vec2) -> Vec3 {
        match self {
            Self::Asphalt => asphalt(place),
            Self::Paving => paving(place),
            Self::Grass => grass(place),
            Self::Gravel => gravel(place),
            Self::Bricks => bricks(place),
            Self::Blocks => blocks(place),
            Self::Plaster => plaster(place),
            Self::Concrete => concrete(place),
            Self::Tiles => tiles(place),
        }
    }
}

/// Noise from about -0.5 to 0.5 with `cells` cells along both axes.
fn noise(place: Vec2, cells: i32, octaves: u32) -> f32 {
    let at = place * cells as f32;
    tiled(at.x, at.y, [cells; 2], octaves) - 0.5
}

/// A random number from 0 to 1 of a cell.
fn of_cell(cell: Vec2, seed: u32) -> f32 {
    lattice(cell.x as i32, cell.y as i32, seed)
}

/// The course that a place is in and the place in it, of `count` cells along each axis. Odd rows are moved by half a cell.
fn bond(place: Vec2, count: Vec2) -> (Vec2, Vec2) {
    let row = (place.y * count.y).floor();
    let scaled = place * count + Vec2::new(0.5 * (row % 2.0), 0.0);
    let cell = scaled.floor();
    (Vec2::new(cell.x.rem_euclid(count.x), cell.y), scaled - cell)
}

/// 0 in the joints between cells, 1 in their middle. `cell` is the size of a cell, `width` that of a joint, in metres.
fn inside(place_in_cell: Vec2, cell: Vec2, width: f32) -> f32 {
    let distance = (place_in_cell.min(1.0 - place_in_cell) * cell).min_element();
    ((distance - 0.35 * width) / (0.3 * width)).clamp(0.0, 1.0)
}

/// Grains of stone in tar, with patches where wheels have polished it.
fn asphalt(place: Vec2) -> Vec3 {
    let grain = of_cell((place * 256.0).floor(), 1) - 0.5;
    Vec3::splat(0.62 + 0.5 * noise(place, 3, 4) + 0.35 * grain * grain.abs() + 0.25 * noise(place, 96, 2))
}

/// Square slabs.
fn paving(place: Vec2) -> Vec3 {
    const COUNT: f32 = 8.0;
    let scaled = place * COUNT;
    let (cell, at) = (scaled.floor(), scaled.fract_gl());
    let tone = 0.72 + 0.22 * (of_cell(cell, 3) - 0.5) + 0.3 * noise(place, 40, 3) + 0.2 * noise(place, 4, 3);
    let warmth = 0.05 * (of_cell(cell, 4) - 0.5);
    let slab = tone * Vec3::new(1.0 + warmth, 1.0, 1.0 - warmth);
    slab * (0.45 + 0.55 * inside(at, Vec2::splat(Pattern::Paving.period() / COUNT), 0.012))
}

/// Blades, in clumps of several greens.
fn grass(place: Vec2) -> Vec3 {
    let clumps = noise(place, 5, 4);
    let blades = tiled(place.x * 160.0, place.y * 80.0, [160, 80], 2) - 0.4;
    let dry = (0.5 + 1.6 * noise(place + 0.37, 7, 3)).clamp(0.0, 1.0);
    let green = Vec3::new(0.50, 0.62, 0.42).lerp(Vec3::new(0.74, 0.66, 0.50), dry);
    green * (1.0 + 0.8 * clumps + 0.9 * blades)
}

/// Pebbles of several greys.
fn gravel(place: Vec2) -> Vec3 {
    let pebble = |cells: f32, seed| {
        let scaled = place * cells;
        let shift = 0.4 * (of_cell(scaled.floor(), seed) - 0.5);
        let reach = (scaled.fract_gl() - 0.5 + shift).length();
        (of_cell(scaled.floor(), seed + 1), (1.0 - 1.7 * reach).clamp(0.0, 1.0))
    };
    let ((tone, top), (fine, fine_top)) = (pebble(40.0, 5), pebble(75.0, 7));
    Vec3::splat(0.32 + (0.30 + 0.3 * tone) * top + (0.15 + 0.15 * fine) * fine_top)
}

/// Bricks in running bond. Red is what clay and mortar share.
fn bricks(place: Vec2) -> Vec3 {
    let count = Vec2::new(8.0, 24.0);
    let (cell, at) = bond(place, count);
    let (own, burnt) = (of_cell(cell, 9), of_cell(cell, 10));
    let clay = Vec3::new(0.86, 0.40, 0.36).lerp(Vec3::new(0.62, 0.34, 0.32), own);
    let clay = clay * if burnt > 0.9 { 0.62 } else { 1.0 } * (1.0 + 0.5 * noise(place, 64, 2));
    let mortar = Vec3::new(0.86, 0.92, 0.92) * (0.95 + 0.4 * noise(place, 90, 2));
    mortar.lerp(clay, inside(at, Pattern::Bricks.period() / count, 0.014))
}

/// Large blocks of stone with narrow joints.
fn blocks(place: Vec2) -> Vec3 {
    let count = Vec2::new(4.0, 8.0);
    let (cell, at) = bond(place, count);
    let tone =
        0.86 + 0.10 * (of_cell(cell, 11) - 0.5) + 0.16 * noise(place, 48, 3) + 0.10 * noise(place, 3, 3);
    let warmth = 0.03 * (of_cell(cell, 12) - 0.5);
    let stone = tone * Vec3::new(1.0 + warmth, 1.0, 1.0 - warmth);
    stone * (0.62 + 0.38 * inside(at, Pattern::Blocks.period() / count, 0.016))
}

/// Fine grain with soft stains.
fn plaster(place: Vec2) -> Vec3 {
    Vec3::splat(0.92 + 0.10 * noise(place, 3, 4) + 0.08 * noise(place, 120, 2))
}

/// Boards have left their lines, and air its pores.
fn concrete(place: Vec2) -> Vec3 {
    let board = (place.y * 8.0).fract_gl();
    let line = ((board.min(1.0 - board) - 0.008) / 0.01).clamp(0.0, 1.0);
    let is_pore = of_cell((place * 128.0).floor(), 13) > 0.994;
    let tone = 0.82
        + 0.10 * (of_cell(Vec2::new(0.0, (place.y * 8.0).floor()), 14) - 0.5)
        + 0.35 * noise(place, 4, 4);
    Vec3::splat(tone * (0.82 + 0.18 * line) * if is_pore { 0.6 } else { 1.0 })
}

/// Roof tiles, each with its shade, darker at its upper edge, where the next one lies on it.
fn tiles(place: Vec2) -> Vec3 {
    let count = Vec2::new(12.0, 8.0);
    let (cell, at) = bond(place, count);
    let tone = 0.70 + 0.35 * (of_cell(cell, 15) - 0.5) + 0.25 * noise(place, 32, 2);
    let bulge = 0.75 + 0.25 * (std::f32::consts::PI * at.x).sin();
    let warmth = 0.12 * (of_cell(cell, 16) - 0.5);
    tone * bulge * (0.7 + 0.3 * at.y.min(0.5) * 2.0) * Vec3::new(1.0 + warmth, 1.0, 1.0 - 0.5 * warmth)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patterns_repeat_without_a_seam_and_are_not_flat() {
        const SIZE: u32 = 256;
        for pattern in Pattern::ALL {
            let at = |x: u32, y: u32| pattern.factor((UVec2::new(x, y).as_vec2() + 0.5) / SIZE as f32);
            let step = |a: [u32; 2], b: [u32; 2]| (at(a[0], a[1]) - at(b[0], b[1])).abs().element_sum();
            let across = |x: u32| (0..SIZE).map(|y| step([x, y], [(x + 1) % SIZE, y])).sum::<f32>();
            let down = |y: u32| (0..SIZE).map(|x| step([x, y], [x, (y + 1) % SIZE])).sum::<f32>();
            // The seam is compared with places where cells and joints lie alike: each eighth of a pattern ends at cells or at their middles.
            let eighths = [1, 2, 3, 4, 5, 6, 7].map(|eighth| eighth * SIZE / 8 - 1);
            let [alike_across, alike_down] =
                [eighths.map(across), eighths.map(down)].map(|steps| steps.into_iter().fold(0.0, f32::max));
            assert!(across(SIZE - 1) <= 1.3 * alike_across, "{}: {}", pattern.name(), across(SIZE - 1));
            assert!(down(SIZE - 1) <= 1.3 * alike_down, "{}: {}", pattern.name(), down(SIZE - 1));
            let widest = (0..SIZE).map(across).fold(0.0, f32::max);
            assert!(widest > 1.0, "{} is flat", pattern.name());
        }
    }

    #[test]
    fn the_place_of_a_pattern_is_its_number() {
        for (place, pattern) in Pattern::ALL.into_iter().enumerate() {
            assert_eq!(pattern as usize, place);
        }
    }

    #[test]
    fn the_mean_is_that_of_the_texels() {
        for pattern in Pattern::ALL {
            let painted = pattern.paint(64).unwrap();
            let image = image::load_from_memory(&painted.png).unwrap().into_rgb8();
            assert_eq!(image.dimensions(), (64, 64));
            let decoded = |texel: u8| {
                let encoded = f32::from(texel) / 255.0;
                if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
            };
            for channel in 0..3 {
                let sum: f32 = image.pixels().map(|texel| decoded(texel.0[channel])).sum();
                let mean = sum / 4096.0;
                assert!((mean - painted.mean[channel]).abs() < 0.003, "{} {mean}", pattern.name());
            }
        }
    }
}
