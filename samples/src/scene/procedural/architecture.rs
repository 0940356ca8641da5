//! The building: floor, pool, arcades, walls.

use std::f32::consts::PI;

use glam::{Vec2, Vec3};

use super::materials as of;
use super::solid::{Solids, smooth_profile};

/// Distance between the axes of neighbouring columns, in metres.
pub(super) const BAY: f32 = 2.4;

/// Sides of columns that show every flute.
const FLUTED: u32 = 120;

/// Height of the column axis's top, where the arches spring.
const SPRING: f32 = 2.75;

/// Top of the wall over the arches.
const PARAPET: f32 = 4.35;

/// Half the thickness of the wall over the arches.
const HALF_WALL: f32 = 0.24;

/// Half the size of the pool along x and z.
const POOL: (f32, f32) = (2.5, 1.7);

/// Everything that does not stand on a plinth.
pub(super) fn build(solids: &mut Solids) {
    floor(solids);
    pool(solids);
    // The back arcade runs along x, the left one along z; they share the column in the corner.
    arcade(solids, [-6.0, 0.0, -4.8], 0.0, [6, FLUTED], true);
    arcade(solids, [-6.0, 0.0, 4.8], 90.0, [4, FLUTED], false);
    walls(solids);
    lantern(solids, [0.0, 2.55, -6.1]);
    lantern_chain(solids, [0.0, 2.55, -6.1]);
}

fn floor(solids: &mut Solids) {
    solids.at([0.0; 3], 0.0).material(of::PAVING);
    let (x, z) = (POOL.0 + 0.15, POOL.1 + 0.15);
    let far = 13.0;
    for [x0, z0, x1, z1] in [[-far, z, far, far], [-far, -far, far, -z], [-far, -z, -x, z], [x, -z, far, z]] {
        let scale = 1.0 / 4.8;
        solids.patch(1, 1, |i, j| {
            let p = Vec3::new(if i == 0 { x0 } else { x1 }, 0.0, if j == 0 { z1 } else { z0 });
            (p, Vec2::new(p.x, p.z) * scale)
        });
    }
}

fn pool(solids: &mut Solids) {
    let (x, z) = POOL;
    let (bottom, rim, edge) = (-0.75, 0.28, 0.32);
    solids.at([0.0; 3], 0.0).material(of::MOSAIC);
    // The tiles stand off the rim's blocks: faces in one plane have no order that a ray and a rasteriser share.
    let tile = 0.006;
    let corner = |sx: f32, y: f32, sz: f32| Vec3::new(sx * (x - tile), y, sz * (z - tile));
    solids.quad([
        corner(-1.0, bottom, 1.0),
        corner(1.0, bottom, 1.0),
        corner(1.0, bottom, -1.0),
        corner(-1.0, bottom, -1.0),
    ]);
    for [(ax, az), (bx, bz)] in [
        [(-1.0, -1.0), (1.0, -1.0)],
        [(1.0, 1.0), (-1.0, 1.0)],
        [(-1.0, 1.0), (-1.0, -1.0)],
        [(1.0, -1.0), (1.0, 1.0)],
    ] {
        let top = rim - 0.02;
        solids.quad([
            corner(ax, bottom, az),
            corner(bx, bottom, bz),
            corner(bx, top, bz),
            corner(ax, top, az),
        ]);
    }
    solids.material(of::SANDSTONE);
    let (out_x, out_z) = (x + edge, z + edge);
    solids.block([-out_x, 0.0, z], [out_x, rim, out_z]);
    solids.block([-out_x, 0.0, -out_z], [out_x, rim, -z]);
    solids.block([-out_x, 0.0, -z], [-x, rim, z]);
    solids.block([x, 0.0, -z], [out_x, rim, z]);
    water(solids);
}

/// A rippled sheet: rings around the plinth in the middle, and a slight breeze.
fn water(solids: &mut Solids) {
    let (x, z) = POOL;
    solids.material(of::WATER);
    solids.patch(120, 84, |i, j| {
        let p = Vec2::new(x * (i as f32 / 60.0 - 1.0), z * (1.0 - j as f32 / 42.0));
        let rings = (p.length() * 14.0).sin() * (-0.9 * p.length()).exp();
        let breeze = (3.1 * p.x + 1.7 * p.y).sin() + (2.3 * p.y - 4.2 * p.x).sin();
        (Vec3::new(p.x, 0.12 + 0.006 * rings + 0.0018 * breeze, p.y), p)
    });
}

/// A row of `bays` arches that starts at `origin` and runs along local x, turned by `turn` degrees; columns have so many
/// `sides`.
pub(super) fn arcade(
    solids: &mut Solids,
    origin: [f32; 3],
    turn: f32,
    [bays, sides]: [u32; 2],
    has_last_column: bool,
) {
    let local = |x: f32| {
        let (sin, cos) = turn.to_radians().sin_cos();
        [origin[0] + x * cos, origin[1], origin[2] - x * sin]
    };
    for i in 0..bays + u32::from(has_last_column) {
        solids.at(local(i as f32 * BAY), turn);
        column(solids, sides);
    }
    for i in 0..bays {
        solids.at(local((i as f32 + 0.5) * BAY), turn).material(of::SANDSTONE);
        arch(solids);
    }
    let length = bays as f32 * BAY;
    solids.at(local(0.0), turn).material(of::SANDSTONE);
    for (from, to) in [(-0.36, 0.0), (length, length + 0.36)] {
        solids.block([from, SPRING, -HALF_WALL], [to, PARAPET, HALF_WALL]);
    }
    solids.at(local(-0.5), turn);
    cornice(solids, length + 1.0);
}

fn column(solids: &mut Solids, sides: u32) {
    solids.material(of::SANDSTONE);
    solids.block([-0.34, 0.0, -0.34], [0.34, 0.12, 0.34]);
    solids.block([-0.36, SPRING - 0.12, -0.36], [0.36, SPRING, 0.36]);
    let base = smooth_profile(
        &[(0.34, 0.12), (0.36, 0.17), (0.33, 0.22), (0.285, 0.25), (0.30, 0.29), (0.31, 0.32), (0.26, 0.36)],
        18,
    );
    solids.material(of::MARBLE).lathe(&base, sides / 3, |_, _| 1.0);
    let capital = smooth_profile(
        &[(0.20, 2.28), (0.235, 2.31), (0.205, 2.35), (0.21, 2.42), (0.28, 2.55), (0.34, SPRING - 0.12)],
        18,
    );
    solids.lathe(&capital, sides / 3, |_, _| 1.0);
    let shaft: Vec<(f32, f32)> = (0..=14)
        .map(|i| {
            let t = i as f32 / 14.0;
            (0.262 - 0.055 * t - 0.02 * t * (1.0 - t), 0.34 + 1.98 * t)
        })
        .collect();
    solids.lathe(&shaft, sides, |angle, height| {
        let fade = ((height - 0.34) * 8.0).min((2.32 - height) * 8.0).clamp(0.0, 1.0);
        1.0 - 0.075 * fade * (10.0 * angle).sin().abs().sqrt()
    });
}

/// The wall over one bay, centred at local x = 0, with a round arch and its mouldings.
fn arch(solids: &mut Solids) {
    const STEPS: u32 = 32;
    let (half, radius) = (0.5 * BAY, 0.5 * BAY - 0.3);
    let rim = |i: u32, r: f32| {
        let angle = PI * (1.0 - i as f32 / STEPS as f32);
        Vec3::new(r * angle.cos(), SPRING + r * angle.sin(), 0.0)
    };
    let texcoord = |p: Vec3| 0.5 * Vec2::new(p.x, -p.y);
    for side in [1.0, -1.0] {
        let z = Vec3::Z * HALF_WALL * side;
        solids.patch(STEPS, 1, |i, j| {
            let i = if side > 0.0 { i } else { STEPS - i };
            let low = rim(i, radius);
            let p = if j == 0 { low } else { Vec3::new(low.x, PARAPET, 0.0) };
            (p + z, texcoord(p))
        });
        for x in [-half, radius] {
            let (a, b) = if side > 0.0 { (x, x + half - radius) } else { (x + half - radius, x) };
            solids.patch(1, 1, |i, j| {
                let p = Vec3::new([a, b][i as usize], [SPRING, PARAPET][j as usize], 0.0);
                (p + z, texcoord(p))
            });
        }
        archivolt(solids, side);
    }
    solids.patch(STEPS, 1, |i, j| {
        let z = if j == 0 { -HALF_WALL } else { HALF_WALL };
        (rim(i, radius) + Vec3::Z * z, 0.5 * Vec2::new(i as f32 * 0.1, z))
    });
}

/// The raised ring around an arch, on the front (1) or the back (-1).
fn archivolt(solids: &mut Solids, side: f32) {
    const STEPS: u32 = 32;
    let radius = 0.5 * BAY - 0.3;
    let profile = [(0.0, 0.0), (0.0, 0.05), (0.09, 0.05), (0.11, 0.03), (0.2, 0.03), (0.2, 0.0)];
    solids.patch(STEPS, profile.len() as u32 - 1, |i, j| {
        let (out, depth) = profile[j as usize];
        let i = if side > 0.0 { i } else { STEPS - i };
        let angle = PI * (1.0 - i as f32 / STEPS as f32);
        let r = radius + out;
        let p = Vec3::new(r * angle.cos(), SPRING + r * angle.sin(), side * (HALF_WALL + depth));
        (p, 0.5 * Vec2::new(i as f32 * 0.1, out))
    });
}

fn cornice(solids: &mut Solids, length: f32) {
    let profile = [
        (HALF_WALL, PARAPET - 0.30),
        (HALF_WALL + 0.05, PARAPET - 0.26),
        (HALF_WALL + 0.05, PARAPET - 0.14),
        (HALF_WALL + 0.16, PARAPET - 0.04),
        (HALF_WALL + 0.16, PARAPET + 0.10),
        (-HALF_WALL - 0.10, PARAPET + 0.10),
        (-HALF_WALL - 0.10, PARAPET - 0.04),
        (-HALF_WALL, PARAPET - 0.10),
    ];
    solids.moulding(length, &profile);
    let middle = Vec3::new(0.0, PARAPET - 0.12, 0.0);
    for pair in profile.windows(2) {
        let [a, b] = [pair[0], pair[1]].map(|(z, y)| Vec3::new(0.0, y, z));
        solids.quad([middle, a, b, b]);
        let across = Vec3::X * length;
        solids.quad([middle + across, b + across, a + across, a + across]);
    }
}

/// Brick behind the arcades, a wooden ceiling over them, and low walls at the open sides.
fn walls(solids: &mut Solids) {
    solids.at([0.0; 3], 0.0).material(of::BRICK);
    let (back, left) = (-7.4, -8.6);
    brick_wall(solids, Vec3::new(left, 0.0, back), Vec3::new(9.0, 0.0, back), 4.3);
    brick_wall(solids, Vec3::new(left, 0.0, 9.0), Vec3::new(left, 0.0, back), 4.3);
    solids.material(of::WOOD);
    solids.block([left - 0.2, 4.2, back - 0.2], [9.2, 4.28, -4.9]);
    solids.block([left - 0.2, 4.2, -4.9], [-6.1, 4.28, 5.2]);
    for i in 0..22 {
        let x = left + 0.4 + 0.8 * i as f32;
        solids.block([x - 0.07, 4.02, back], [x + 0.07, 4.2, -4.9]);
    }
    for i in 0..12 {
        let z = -4.4 + 0.8 * i as f32;
        solids.block([left, 4.02, z - 0.07], [-6.1, 4.2, z + 0.07]);
    }
    solids.material(of::SANDSTONE);
    solids.block([6.9, 0.0, -4.4], [7.3, 1.1, 11.0]);
    solids.block([6.8, 1.1, -4.4], [7.4, 1.22, 11.0]);
    solids.block([-8.6, 0.0, 10.6], [7.3, 1.1, 11.0]);
    solids.block([-8.6, 1.1, 10.5], [7.4, 1.22, 11.1]);
}

/// A wall that is seen from its front: the side from which `from` is left of `to`.
fn brick_wall(solids: &mut Solids, from: Vec3, to: Vec3, height: f32) {
    let length = from.distance(to);
    solids.patch(1, 1, |i, j| {
        let (u, v) = (i as f32, j as f32);
        (from.lerp(to, u) + Vec3::Y * (height * v), Vec2::new(u * length, -v * height) / 1.5)
    });
}

/// A glass globe in a metal cap and ring. The lamp shines from its middle: glass casts no shadow.
fn lantern(solids: &mut Solids, position: [f32; 3]) {
    solids.at(position, 0.0).material(of::GLOW).sphere(0.19, 48);
    solids.material(of::BRONZE);
    let cap = smooth_profile(
        &[(0.17, 0.13), (0.18, 0.16), (0.12, 0.22), (0.05, 0.26), (0.02, 0.34), (0.0, 0.36)],
        20,
    );
    solids.lathe(&cap, 32, |_, _| 1.0);
}

fn lantern_chain(solids: &mut Solids, position: [f32; 3]) {
    let top = 4.2 - position[1];
    solids.at(position, 0.0).lathe(&[(0.012, 0.34), (0.012, top)], 8, |_, _| 1.0);
}
