//! A columned atrium of two storeys around a paved court, for rasterisers: many columns, arches and curtains.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};

use super::architecture::{self, BAY};
use super::materials::{self as of};
use super::sculpture;
use super::solid::{Solids, smooth_profile};
use crate::scene::noise::lattice;
use crate::scene::setting::Setting;
use crate::scene::{Ambient, Camera, DirectionalLight, Material, PointLight, Scene, Sky, normals};

/// Bays along the court.
const BAYS: u32 = 9;
/// Half the width of the court between the rows of columns, and from there to the wall behind.
const HALF_COURT: f32 = 0.5 * END_BAYS as f32 * BAY;
const END_BAYS: u32 = 3;
/// Sides of columns.
const SIDES: u32 = 60;
const AISLE: f32 = 2.8;
/// Height of a storey.
const STOREY: f32 = 4.62;
const STOREYS: u32 = 2;
/// Number of the first cloth among the materials, which lie behind the courtyard's.
const CLOTH: u32 = of::LEAVES + 1;
const CLOTHS: [[f32; 3]; 3] = [[0.45, 0.05, 0.04], [0.06, 0.20, 0.08], [0.07, 0.10, 0.34]];

/// Implements [`Scene::atrium`].
pub(in crate::scene) fn atrium() -> Scene {
    let mut solids = Solids::new();
    for storey in 0..STOREYS {
        storey_of_arcades(&mut solids, storey as f32 * STOREY);
    }
    walls(&mut solids);
    ground(&mut solids);
    curtains(&mut solids);
    furniture(&mut solids);
    let mut mesh = solids.mesh;
    mesh.drop_degenerate();
    normals::complete(&mut mesh);
    let mut materials = of::all();
    let cloth = |color: &[f32; 3]| Material {
        specular: [0.05; 3],
        shininess: 8.0,
        ..Material::matte("cloth", *color)
    };
    materials.extend(CLOTHS.iter().map(cloth));
    mesh.arrange(&materials);
    let scene = setting().into_scene("atrium".to_owned(), mesh, materials);
    Scene { textures: of::textures(), ..scene }
}

fn half_length() -> f32 {
    0.5 * BAYS as f32 * BAY
}

/// A row of arches along each side, and one across each end.
fn storey_of_arcades(solids: &mut Solids, floor: f32) {
    let start = -half_length();
    architecture::arcade(solids, [start, floor, -HALF_COURT], 0.0, [BAYS, SIDES], true);
    architecture::arcade(solids, [start, floor, HALF_COURT], 0.0, [BAYS, SIDES], true);
    for x in [start, -start] {
        architecture::arcade(solids, [x, floor, HALF_COURT], 90.0, [END_BAYS, SIDES], false);
    }
    let (x, near, far) = (half_length() + AISLE, HALF_COURT + 0.2, HALF_COURT + AISLE);
    solids.at([0.0, floor + STOREY - 0.14, 0.0], 0.0).material(of::WOOD);
    for side in [-1.0_f32, 1.0] {
        let [low, high] = if side > 0.0 { [near, far] } else { [-far, -near] };
        solids.block([-x, 0.0, low], [x, 0.13, high]);
        let [low, high] = if side > 0.0 { [half_length() + 0.2, x] } else { [-x, -half_length() - 0.2] };
        solids.block([low, 0.0, -near], [high, 0.13, near]);
        for beam in 0..2 * BAYS {
            let at = -half_length() + (beam as f32 + 0.5) * 0.5 * BAY;
            let [low, high] = if side > 0.0 { [near, far] } else { [-far, -near] };
            solids.block([at - 0.07, -0.16, low], [at + 0.07, 0.0, high]);
        }
    }
}

/// Brick behind the aisles, with a band of sandstone on top.
fn walls(solids: &mut Solids) {
    let (x, z) = (half_length() + AISLE, HALF_COURT + AISLE);
    let height = STOREYS as f32 * STOREY;
    solids.at([0.0; 3], 0.0).material(of::BRICK);
    let corner = |sx: f32, sz: f32| Vec3::new(sx * x, 0.0, sz * z);
    for (from, to) in [
        (corner(-1.0, -1.0), corner(1.0, -1.0)),
        (corner(1.0, 1.0), corner(-1.0, 1.0)),
        (corner(-1.0, 1.0), corner(-1.0, -1.0)),
        (corner(1.0, -1.0), corner(1.0, 1.0)),
    ] {
        wall(solids, from, to, height);
    }
    solids.material(of::SANDSTONE);
    for side in [-1.0_f32, 1.0] {
        let (a, b) = (side * z, side * (z + 0.4));
        solids.block([-x - 0.4, 0.0, a.min(b)], [x + 0.4, height + 0.5, a.max(b)]);
        let (a, b) = (side * x, side * (x + 0.4));
        solids.block([a.min(b), 0.0, -z], [a.max(b), height + 0.5, z]);
    }
}

/// A wall in pieces as large as bays, so that each can be left out.
fn wall(solids: &mut Solids, from: Vec3, to: Vec3, height: f32) {
    let pieces = (from.distance(to) / BAY).ceil() as u32;
    // Off the stone behind, as faces in one plane have no order.
    let off = 0.01 * (to - from).cross(Vec3::Y).normalize();
    solids.patch(pieces, 4, |i, j| {
        let (along, up) = (i as f32 / pieces as f32, j as f32 / 4.0 * height);
        let point = from.lerp(to, along) + up * Vec3::Y + off;
        (point, Vec2::new(along * from.distance(to), -up) / 1.5)
    });
}

/// Paving, and a long carpet of tiles along the middle.
fn ground(solids: &mut Solids) {
    let (x, z) = (half_length() + AISLE, HALF_COURT + AISLE);
    solids.at([0.0; 3], 0.0).material(of::PAVING);
    floor(solids, [24, 12], [x, z], 0.0, 4.8);
    solids.material(of::MOSAIC);
    floor(solids, [24, 3], [half_length() - 1.6, 0.8], 0.012, 1.6);
}

fn floor(solids: &mut Solids, [columns, rows]: [u32; 2], [x, z]: [f32; 2], height: f32, texture: f32) {
    solids.patch(columns, rows, |i, j| {
        let at = |i: u32, count: u32, half: f32| half * (2.0 * i as f32 / count as f32 - 1.0);
        let point = Vec3::new(at(i, columns, x), height, -at(j, rows, z));
        (point, Vec2::new(point.x, point.z) / texture)
    });
}

/// Cloth that hangs between the columns of the upper storey.
fn curtains(solids: &mut Solids) {
    for bay in 0..BAYS {
        for (row, side) in [-1.0_f32, 1.0].into_iter().enumerate() {
            let chance = |seed| lattice(bay as i32, row as i32, seed);
            if chance(41) < 0.35 {
                continue;
            }
            let x = -half_length() + (bay as f32 + 0.5) * BAY;
            solids.at([x, STOREY, side * (HALF_COURT + 0.02)], 0.0).material(CLOTH + (bay + row as u32) % 3);
            let (half, top, long) = (0.5 * BAY - 0.36, 2.72, 1.5 + 1.0 * chance(42));
            solids.patch(48, 24, |i, j| {
                let (across, up) = (i as f32 / 24.0 - 1.0, j as f32 / 24.0);
                let gathered = 1.0 - 0.12 * (1.0 - up) * (1.0 + (5.0 * up).sin());
                let fold = 0.07 * (1.2 - 0.4 * up) * (across * 17.0 + 3.0 * chance(43)).sin();
                let p = Vec3::new(half * across * gathered, top - long * (1.0 - up), fold);
                (p, Vec2::new(across, -up))
            });
        }
    }
}

/// A golden knot in the middle, vases along the court, and bushes in pots.
fn furniture(solids: &mut Solids) {
    sculpture::plinth(solids, [0.0; 3], 0.45, 1.1);
    solids.at([0.0, 1.86, 0.0], 24.0).material(of::GOLD);
    sculpture::knot(solids, 0.68, 0.15);
    for number in 0..BAYS - 1 {
        let x = -half_length() + (number as f32 + 1.0) * BAY;
        for side in [-1.0_f32, 1.0] {
            let is_bush = (number + u32::from(side > 0.0)).is_multiple_of(2);
            let at = [x, 0.0, side * (HALF_COURT - 1.0)];
            if is_bush { bush(solids, at, number) } else { vase(solids, at) }
        }
    }
}

fn vase(solids: &mut Solids, at: [f32; 3]) {
    solids.at(at, 0.0).material(of::MARBLE).block([-0.26, 0.0, -0.26], [0.26, 0.3, 0.26]);
    let body = smooth_profile(
        &[
            (0.0, 0.3),
            (0.16, 0.3),
            (0.13, 0.38),
            (0.28, 0.62),
            (0.30, 0.80),
            (0.16, 1.02),
            (0.22, 1.12),
            (0.19, 1.12),
        ],
        36,
    );
    solids.material(of::LACQUER).lathe(&body, 48, |_, _| 1.0);
}

fn bush(solids: &mut Solids, at: [f32; 3], seed: u32) {
    let pot = smooth_profile(
        &[(0.0, 0.0), (0.24, 0.0), (0.34, 0.46), (0.38, 0.50), (0.36, 0.56), (0.30, 0.50), (0.0, 0.48)],
        24,
    );
    solids.at(at, 0.0).material(of::TERRACOTTA).lathe(&pot, 32, |_, _| 1.0);
    solids.material(of::LEAVES);
    let crown: Vec<(f32, f32)> = (0..=40)
        .map(|i| {
            let t = i as f32 / 40.0;
            (0.46 * (0.5 * TAU * t).sin().powf(0.7), 0.5 + 1.1 * t)
        })
        .collect();
    solids.lathe(&crown, 64, |angle, height| {
        let bumps = (7.0 * angle + seed as f32).sin() * (11.0 * height).sin()
            + 0.6 * (13.0 * angle - 9.0 * height).sin();
        1.0 + 0.07 * bumps
    });
}

/// A high sun that reaches one side of the court.
fn setting() -> Setting {
    let sun_direction = Vec3::new(0.34, 0.80, 0.42).normalize().to_array();
    let end = half_length();
    Setting {
        light: PointLight { position: [0.0, 6.0, 0.0], color: [0.0; 3], reach: 1.0 },
        sun: Some(DirectionalLight { direction: sun_direction, color: [3.0, 2.6, 2.0] }),
        ambient: Ambient { above: [0.30, 0.34, 0.42], below: [0.26, 0.22, 0.17] },
        sky: Sky { sun_direction, ..Sky::day() },
        cameras: [
            Camera::looking_at([-end + 1.4, 1.9, 0.9], [end, 3.0, -0.6], 58.0),
            Camera::looking_at([-end - 1.2, 1.7, -HALF_COURT - 1.4], [end, 1.6, -HALF_COURT - 1.0], 55.0),
            Camera::looking_at([end - 2.0, STOREY + 1.8, HALF_COURT + 1.2], [-3.0, 2.2, -2.4], 60.0),
            Camera::looking_at([1.9, 1.3, 2.2], [-0.6, 1.9, -0.8], 55.0),
            Camera::looking_at([end - 0.8, 7.6, 1.4], [-end, 1.0, -0.8], 55.0),
        ],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_atrium_is_large_and_the_same_every_time() {
        let scene = atrium();
        assert!((100_000..600_000).contains(&scene.triangles.len()), "{}", scene.triangles.len());
        assert_eq!(
            scene.opaque_triangle_count as usize,
            scene.triangles.len(),
            "a rasteriser bends no light"
        );
        assert!(scene.normals.iter().all(|&n| (Vec3::from(n).length() - 1.0).abs() < 1e-3));
        let used = |material: u32| scene.triangle_materials.contains(&material);
        assert!((CLOTH..CLOTH + 3).chain([of::MARBLE, of::PAVING, of::GOLD, of::LEAVES]).all(used));
        let again = atrium();
        assert_eq!((scene.positions, scene.triangles), (again.positions, again.triangles));
    }
}
