//! Objects in the courtyard: statues, mirrors, glass, plants.

use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3};

use super::materials as of;
use super::solid::{Solids, arc, smooth_profile};
use crate::scene::noise;

/// Everything that stands in the courtyard.
pub(super) fn build(solids: &mut Solids) {
    fountain(solids);
    flame(solids);
    carved_ball(solids);
    mirrors(solids);
    glasses(solids);
    for (position, height) in [
        ([-4.7, 0.0, -3.4], 2.7),
        ([7.0, 0.0, -3.6], 3.0),
        ([-4.7, 0.0, 4.6], 2.2),
        ([6.2, 0.0, 5.6], 2.4),
        ([-2.6, 0.0, 9.6], 2.6),
        ([2.8, 0.0, 9.6], 2.3),
    ] {
        cypress(solids, position, height);
    }
}

/// A golden knot on a plinth in the middle of the pool.
fn fountain(solids: &mut Solids) {
    plinth(solids, [0.0, -0.75, 0.0], 0.42, 1.55);
    solids.at([0.0, 1.62, 0.0], 18.0).material(of::GOLD);
    knot(solids, 0.62, 0.135);
}

/// A trefoil knot around the origin, its plane facing local z.
pub(super) fn knot(solids: &mut Solids, radius: f32, thickness: f32) {
    const ALONG: u32 = 420;
    const AROUND: u32 = 36;
    let line = |t: f32| {
        let r = 1.0 + 0.42 * (3.0 * t).cos();
        0.72 * radius * Vec3::new(r * (2.0 * t).cos(), r * (2.0 * t).sin(), 0.62 * (3.0 * t).sin())
    };
    solids.patch(ALONG, AROUND, |i, j| {
        let t = (i % ALONG) as f32 / ALONG as f32 * TAU;
        let tangent = (line(t + 1e-3) - line(t - 1e-3)).normalize();
        let side = tangent.cross(Vec3::Z).normalize();
        let up = side.cross(tangent);
        let angle = (j % AROUND) as f32 / AROUND as f32 * TAU;
        let rope = thickness * (1.0 + 0.05 * (5.0 * angle + 24.0 * t).cos());
        (
            line(t) + rope * (angle.cos() * side - angle.sin() * up),
            Vec2::new(i as f32 * 0.05, j as f32 * 0.05),
        )
    });
}

/// A twisted marble flame, taller than a person.
fn flame(solids: &mut Solids) {
    plinth(solids, [-3.55, 0.0, 1.7], 0.46, 0.8);
    solids.at([-3.55, 0.8, 1.7], 20.0).material(of::MARBLE);
    let profile: Vec<(f32, f32)> = (0..=150)
        .map(|i| {
            let t = i as f32 / 150.0;
            let body = 0.40 * (PI * (0.12 + 0.88 * t)).sin().max(0.0).powf(0.75) * (1.0 - 0.30 * t);
            (if i == 150 { 0.0 } else { body }, 1.75 * t)
        })
        .collect();
    solids.lathe(&profile, 120, |angle, height| {
        let twist = angle + 1.9 * height;
        1.0 + 0.24 * (3.0 * twist).cos() + 0.035 * (12.0 * twist).cos()
    });
}

/// A ball of blue lacquer with spiral furrows.
fn carved_ball(solids: &mut Solids) {
    plinth(solids, [2.75, 0.0, -3.1], 0.5, 0.75);
    solids.at([2.75, 1.33, -3.1], 0.0).material(of::LACQUER);
    solids.lathe(&arc(0.6, 96), 144, |angle, height| {
        let polar = (height / 0.6).clamp(-1.0, 1.0).acos();
        let edge = polar.sin();
        1.0 + 0.06 * edge * (9.0 * angle + 6.0 * polar).sin()
    });
}

/// Three metal balls on the floor and a curved wall of mirrors.
fn mirrors(solids: &mut Solids) {
    solids.at([1.95, 0.46, 3.55], 0.0).material(of::CHROME).sphere(0.46, 72);
    solids.at([-1.55, 0.3, 3.9], 0.0).material(of::COPPER).sphere(0.3, 64);
    solids.at([-0.85, 0.16, 4.55], 0.0).material(of::CHROME).sphere(0.16, 48);
    mirror_wall(solids);
}

/// A bulging mirror, a piece of a cylinder that stands on a base of stone, framed in bronze.
fn mirror_wall(solids: &mut Solids) {
    const STEPS: u32 = 48;
    const RADIUS: f32 = 3.4;
    let sweep = 0.55;
    let at = |i: u32, r: f32, y: f32| {
        let angle = sweep * (i as f32 / STEPS as f32 * 2.0 - 1.0);
        Vec3::new(r * angle.sin(), y, r * angle.cos() - RADIUS)
    };
    solids.at([5.3, 0.0, -1.0], -42.0);
    let band = |solids: &mut Solids, outer: f32, inner: f32, low: f32, high: f32| {
        let ring = [(outer, low), (outer, high), (inner, high), (inner, low), (outer, low)];
        solids.patch(STEPS, 4, |i, j| {
            let (r, y) = ring[j as usize];
            (at(i, r, y), Vec2::new(i as f32 * 0.1, y + r))
        });
        for (i, corners) in [
            (0, [(inner, low), (outer, low), (outer, high), (inner, high)]),
            (STEPS, [(outer, low), (inner, low), (inner, high), (outer, high)]),
        ] {
            solids.quad(corners.map(|(r, y)| at(i, r, y)));
        }
    };
    solids.material(of::MARBLE);
    band(solids, RADIUS + 0.14, RADIUS - 0.2, 0.0, 0.3);
    solids.material(of::MIRROR);
    band(solids, RADIUS, RADIUS - 0.05, 0.3, 2.5);
    solids.material(of::BRONZE);
    band(solids, RADIUS + 0.05, RADIUS - 0.1, 2.5, 2.6);
    for i in [0, STEPS] {
        let Vec3 { x, z, .. } = at(i, RADIUS, 0.0);
        solids.block([x - 0.05, 0.3, z - 0.05], [x + 0.05, 2.5, z + 0.05]);
    }
}

/// A ball, a bowl and a block of glass.
fn glasses(solids: &mut Solids) {
    plinth(solids, [3.3, 0.0, 2.3], 0.36, 0.5);
    solids.at([3.3, 0.96, 2.3], 0.0).material(of::GLASS).sphere(0.46, 96);
    solids
        .at([0.62, 0.292, 4.25], 28.0)
        .material(of::GREEN_GLASS)
        .rounded_block(Vec3::new(0.22, 0.29, 0.22), 0.035);
    solids.at([-2.3, 0.282, 1.86], 0.0).material(of::AMBER_GLASS);
    let bowl = smooth_profile(
        &[
            (0.0, 0.0),
            (0.14, 0.0),
            (0.15, 0.03),
            (0.06, 0.07),
            (0.22, 0.16),
            (0.30, 0.30),
            (0.33, 0.40),
            (0.315, 0.405),
            (0.285, 0.31),
            (0.2, 0.19),
            (0.05, 0.125),
            (0.0, 0.12),
        ],
        60,
    );
    solids.lathe(&bowl, 72, |_, _| 1.0);
}

pub(super) fn plinth(solids: &mut Solids, position: [f32; 3], half: f32, height: f32) {
    solids.at(position, 0.0).material(of::SANDSTONE);
    solids.block([-half, 0.0, -half], [half, 0.12, half]);
    let inner = half - 0.05;
    solids.block([-inner, 0.12, -inner], [inner, height - 0.1, inner]);
    solids.material(of::MARBLE).block([-half, height - 0.1, -half], [half, height, half]);
}

/// A clipped tree in a terracotta pot.
fn cypress(solids: &mut Solids, position: [f32; 3], height: f32) {
    const CROWN: u32 = 60;
    solids.at(position, 0.0).material(of::TERRACOTTA);
    let pot = smooth_profile(
        &[
            (0.0, 0.0),
            (0.22, 0.0),
            (0.27, 0.2),
            (0.33, 0.42),
            (0.37, 0.46),
            (0.37, 0.53),
            (0.32, 0.53),
            (0.28, 0.45),
            (0.0, 0.44),
        ],
        22,
    );
    solids.lathe(&pot, 36, |_, _| 1.0);
    solids.material(of::LEAVES);
    let top = height - 0.5;
    let crown: Vec<(f32, f32)> = (0..=CROWN)
        .map(|i| {
            let t = i as f32 / CROWN as f32;
            let body = 0.36 * (1.0 - t).powf(0.8) * (0.55 + 2.2 * t * (1.0 - t)).min(1.0);
            (if i == 0 || i == CROWN { 0.0 } else { body }, 0.46 + top * t)
        })
        .collect();
    solids.lathe(&crown, 56, |angle, y| {
        let around = angle / TAU;
        let tufts = noise::tiled(around * 24.0, y * 12.0, [24, 0], 2);
        let rough = noise::smooth(around * 64.0, y * 30.0, [64, 0], 9);
        0.78 + 0.42 * tufts + 0.12 * rough
    });
}
