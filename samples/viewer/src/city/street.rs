//! Objects on streets: cars, lamps, benches; and the ground.

use glam::{Vec2, Vec3};

use super::random::Random;
use super::solid::Solid;
use super::surfaces::Surface;

/// Kinds of cars.
pub(super) const CARS: usize = 10;
/// Side of a block with its pavement, in metres.
pub(super) const BLOCK: f32 = 84.0;
/// Width of a street between kerbs.
pub(super) const STREET: f32 = 13.0;
/// From the middle of a block to that of the next.
pub(super) const PITCH: f32 = BLOCK + STREET;
/// Height of pavements over streets.
pub(super) const KERB: f32 = 0.14;
/// Width of pavements.
pub(super) const PAVEMENT: f32 = 6.0;

/// The pavement of a block, or a park with paths where `is_park`.
pub(super) fn block(is_park: bool) -> Solid {
    let mut solid = Solid::default();
    let half = 0.5 * BLOCK;
    solid.cuboid(Surface::Kerb, [-half, 0.0, -half], [half, KERB, half]);
    let paved = half - 0.3;
    let slab = |solid: &mut Solid, surface, low: [f32; 2], high: [f32; 2], lift: f32| {
        let (corner, size) = (Vec2::from(low), Vec2::from(high) - Vec2::from(low));
        let corner = Vec3::new(corner.x, KERB + lift, corner.y);
        solid.quad(surface, corner, Vec3::Z * size.y, Vec3::X * size.x);
    };
    slab(&mut solid, Surface::Paving, [-paved; 2], [paved; 2], 0.012);
    let inner = half - PAVEMENT;
    if is_park {
        slab(&mut solid, Surface::Grass, [-inner; 2], [inner; 2], 0.03);
        for [low, high] in [[[-inner, -2.0], [inner, 2.0]], [[-2.0, -inner], [2.0, inner]]] {
            slab(&mut solid, Surface::Gravel, low, high, 0.045 + 0.01 * low[0].abs() / inner);
        }
        solid.disc(Surface::Gravel, Vec3::new(0.0, KERB + 0.07, 0.0), Vec3::Y, 9.0, 48);
        fountain(&mut solid);
    } else {
        let court = inner - 24.0;
        slab(&mut solid, Surface::Grass, [-court; 2], [court; 2], 0.03);
    }
    solid
}

fn fountain(solid: &mut Solid) {
    let at = |y: f32| Vec3::new(0.0, KERB + y, 0.0);
    solid.ring(Surface::Limestone, [at(0.0), at(0.7)], [3.2, 3.0], 64);
    solid.disc(Surface::Glass, at(0.7), Vec3::Y, 3.0, 64);
    solid.ring(Surface::Limestone, [at(0.7), at(2.2)], [0.5, 0.25], 32);
    solid.ring(Surface::Limestone, [at(2.2), at(2.6)], [0.3, 1.2], 32);
    solid.disc(Surface::Limestone, at(2.6), Vec3::Y, 1.2, 32);
}

/// The markings of a street along x beside a block, and of the crossing after it.
pub(super) fn markings() -> Solid {
    let mut solid = Solid::default();
    let mark = |solid: &mut Solid, x: [f32; 2], z: [f32; 2]| {
        let corner = Vec3::new(x[0], 0.012, z[0]);
        solid.quad(Surface::Marking, corner, Vec3::Z * (z[1] - z[0]), Vec3::X * (x[1] - x[0]));
    };
    let half = 0.5 * BLOCK;
    let mut x = -half + 6.0;
    while x < half - 8.0 {
        mark(&mut solid, [x, x + 3.0], [-0.07, 0.07]);
        x += 6.0;
    }
    for side in [-1.0, 1.0] {
        // Bars of a crossing for those who walk, and the line before it.
        let mut z = -0.5 * STREET + 0.5;
        while z < 0.5 * STREET - 0.5 {
            let start = side * (half - 2.2);
            mark(&mut solid, [start - 1.5, start + 1.5], [z, z + 0.5]);
            z += 1.1;
        }
        let stop = side * (half - 4.6);
        let lane = if side > 0.0 { [0.2, 4.2] } else { [-4.2, -0.2] };
        mark(&mut solid, [stop - 0.15, stop + 0.15], lane);
        let edge = side * (0.5 * STREET - 2.3);
        mark(&mut solid, [-half + 6.0, half - 6.0], [edge - 0.05, edge + 0.05]);
    }
    solid
}

/// The streets between blocks, and the land around, of a city of so many metres on each side.
pub(super) fn ground(side: f32) -> Solid {
    let mut solid = Solid::default();
    let flat = |solid: &mut Solid, surface, half: f32, y: f32| {
        solid.quad(surface, Vec3::new(-half, y, -half), Vec3::Z * (2.0 * half), Vec3::X * (2.0 * half));
    };
    flat(&mut solid, Surface::Asphalt, 0.5 * side + STREET, 0.0);
    flat(&mut solid, Surface::Grass, 0.5 * side + 1_500.0, -0.4);
    solid
}

/// A street lamp with its arm towards +z.
pub(super) fn lamp() -> Solid {
    let mut solid = Solid::default();
    let at = |y: f32, z: f32| Vec3::new(0.0, y, z);
    solid.ring(Surface::Steel, [at(0.0, 0.0), at(0.8, 0.0)], [0.13, 0.11], 16);
    solid.ring(Surface::Steel, [at(0.8, 0.0), at(6.8, 0.0)], [0.075, 0.05], 16);
    let bend: Vec<Vec3> = (0..=6)
        .map(|step| {
            let (sine, cosine) = (std::f32::consts::FRAC_PI_2 * step as f32 / 6.0).sin_cos();
            at(6.8 + 0.8 * sine, 1.1 * (1.0 - cosine))
        })
        .collect();
    for ends in bend.windows(2) {
        solid.ring(Surface::Steel, [ends[0], ends[1]], [0.05, 0.045], 12);
    }
    solid.cuboid(Surface::Steel, [-0.16, 7.56, 1.0], [0.16, 7.68, 1.9]);
    solid.quad(Surface::Lamp, Vec3::new(-0.14, 7.56, 1.05), Vec3::X * 0.28, Vec3::Z * 0.8);
    solid
}

/// A bench that faces +z.
pub(super) fn bench() -> Solid {
    let mut solid = Solid::default();
    for number in 0..5 {
        let z = 0.11 * number as f32;
        solid.cuboid(Surface::Bark, [-0.9, 0.42, z], [0.9, 0.46, z + 0.085]);
    }
    for number in 0..4 {
        let y = 0.55 + 0.1 * number as f32;
        solid.cuboid(Surface::Bark, [-0.9, y, -0.08], [0.9, y + 0.08, -0.045]);
    }
    for x in [-0.75, 0.7] {
        solid.cuboid(Surface::Steel, [x, 0.0, 0.0], [x + 0.05, 0.42, 0.5]);
        solid.cuboid(Surface::Steel, [x, 0.42, -0.045], [x + 0.05, 0.92, -0.01]);
    }
    solid
}

/// A car that drives towards +x.
pub(super) fn car(kind: usize, seed: u64) -> Solid {
    use Surface::{BlackPaint, BluePaint, RedPaint, SilverPaint, WhitePaint};
    let mut random = Random::new(seed, 0x3000 + kind as u64);
    let paint = [SilverPaint, WhitePaint, BlackPaint, RedPaint, BluePaint][kind % 5];
    let mut solid = Solid::default();
    let (half, wide) = (random.within(2.05..2.35), random.within(0.86..0.93));
    let (belt, roof) = (random.within(0.82..0.9), random.within(1.4..1.55));
    let outline = |points: &[[f32; 2]]| points.iter().map(|point| Vec2::from(*point)).collect::<Vec<_>>();
    let body = outline(&[
        [-half + 0.1, 0.25],
        [half - 0.15, 0.25],
        [half, 0.4],
        [half - 0.03, 0.62],
        [half - 0.3, belt - 0.12],
        [0.9, belt],
        [-half + 0.25, belt + 0.03],
        [-half, belt - 0.1],
        [-half - 0.02, 0.45],
    ]);
    solid.prism(paint, &body, |point| wide - 0.12 * (point.y - 0.55).abs());
    let (front, back) = (random.within(0.85..1.0), -half + random.within(0.25..0.7));
    let narrow = |point: Vec2| wide - 0.06 - 0.32 * (point.y - belt);
    let glass =
        outline(&[[back, belt], [front, belt], [front - 0.65, roof - 0.06], [back + 0.45, roof - 0.06]]);
    solid.prism(Surface::Glass, &glass, narrow);
    let top = outline(&[
        [back + 0.4, roof - 0.07],
        [front - 0.6, roof - 0.07],
        [front - 0.8, roof],
        [back + 0.6, roof],
    ]);
    solid.prism(paint, &top, |point| narrow(point) + 0.02);
    for x in [-0.62 * half, 0.62 * half] {
        for side in [-1.0, 1.0] {
            wheel(&mut solid, Vec3::new(x, 0.32, side * (wide - 0.12)), side);
        }
    }
    for side in [-1.0, 1.0] {
        let z = side * (wide - 0.3);
        solid.cuboid(Surface::Lamp, [half - 0.1, 0.55, z - 0.17], [half + 0.005, 0.66, z + 0.17]);
        solid.cuboid(RedPaint, [-half - 0.03, 0.6, z - 0.15], [-half + 0.1, 0.72, z + 0.15]);
    }
    solid
}

/// A tyre with its rim.
fn wheel(solid: &mut Solid, middle: Vec3, side: f32) {
    let out = side * Vec3::Z;
    let face = middle + 0.13 * out;
    solid.ring(Surface::Tyre, [middle - 0.1 * out, face], [0.32, 0.32], 28);
    solid.disc(Surface::Tyre, face, out, 0.32, 28);
    solid.ring(Surface::Steel, [face, face + 0.012 * out], [0.21, 0.2], 24);
    solid.disc(Surface::Steel, face + 0.012 * out, out, 0.2, 24);
}
