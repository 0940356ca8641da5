//! A town of paper around a square with a carousel: a scene of plain surfaces for light and shade.

use glam::Vec3;

use super::solid::{Solids, arc};
use crate::scene::mesh::Mesh;
use crate::scene::noise::lattice;
use crate::scene::setting::Setting;
use crate::scene::{Ambient, Camera, DirectionalLight, Material, PointLight, Scene, Sky, normals};

const PAPER: u32 = 0;
const CREAM: u32 = 1;
const ROOF: u32 = 2;
const SLATE: u32 = 3;
const MINT: u32 = 4;

/// Houses in a row, and from one to the next.
const ROW: i32 = 9;
const STREET: f32 = 2.0;
/// Houses around the middle that make way for the square.
const SQUARE: i32 = 1;

/// The town, without what turns in its middle.
pub(crate) fn town() -> Scene {
    let mut solids = Solids::new();
    ground(&mut solids);
    let half = ROW / 2;
    for (x, z) in (-half..=half).flat_map(|z| (-half..=half).map(move |x| (x, z))) {
        if x.abs() > SQUARE || z.abs() > SQUARE {
            house(&mut solids, x, z);
        }
    }
    for corner in 0..4 {
        arcade(&mut solids, 90.0 * corner as f32);
    }
    finish("town", solids)
}

/// The carousel, which turns around the vertical in the middle of the town.
pub(crate) fn carousel() -> Scene {
    let mut solids = Solids::new();
    solids.at([0.0, 0.14, 0.0], 0.0).material(CREAM);
    solids.lathe(&[(0.0, -0.07), (1.5, -0.07), (1.55, 0.0), (1.5, 0.07), (0.0, 0.07)], 48, |_, _| 1.0);
    solids.material(ROOF).lathe(&[(0.0, 1.6), (1.75, 1.55), (1.75, 1.68), (0.0, 2.45)], 12, |_, _| 1.0);
    solids.material(PAPER).lathe(&[(0.28, 0.05), (0.28, 1.65)], 24, |_, _| 1.0);
    for number in 0..8 {
        let turn = 45.0 * number as f32;
        let place = glam::Quat::from_rotation_y(turn.to_radians()) * Vec3::new(0.0, 0.14, 1.2);
        solids.at(place.into(), turn).material(PAPER).lathe(&[(0.04, 0.05), (0.04, 1.6)], 8, |_, _| 1.0);
        solids.place.translation.y += 0.5 + 0.25 * (number % 2) as f32;
        solids.material(if number % 2 == 0 { MINT } else { ROOF }).sphere(0.22, 20);
    }
    finish("carousel", solids)
}

fn ground(solids: &mut Solids) {
    let [far, near] = [-60.0, 60.0];
    solids.at([0.0; 3], 0.0).material(PAPER).quad([
        Vec3::new(far, 0.0, near),
        Vec3::new(near, 0.0, near),
        Vec3::new(near, 0.0, far),
        Vec3::new(far, 0.0, far),
    ]);
    for step in 0..3 {
        let (radius, height) = (2.5 - 0.25 * step as f32, 0.03 * (step + 1) as f32);
        solids.material(CREAM).lathe(&[(radius, 0.0), (radius, height), (0.0, height)], 48, |_, _| 1.0);
    }
}

/// A house, taller farther from the square, under one of four roofs.
fn house(solids: &mut Solids, x: i32, z: i32) {
    let chance = |seed| lattice(x, z, seed);
    let far = (x.abs().max(z.abs()) - SQUARE) as f32;
    let height = 0.9 + 0.45 * far + 1.3 * chance(1);
    let half = 0.6 + 0.2 * chance(2);
    solids.at([STREET * x as f32, 0.0, STREET * z as f32], 8.0 * (chance(3) - 0.5));
    solids.material(if chance(4) < 0.5 { PAPER } else { CREAM });
    solids.block([-half, 0.0, -half], [half, height, half]);
    solids.block([-half - 0.07, height, -half - 0.07], [half + 0.07, height + 0.09, half + 0.07]);
    solids.block([-0.16, 0.0, half], [0.16, 0.5, half + 0.18]);
    solids.place.translation.y += height + 0.09;
    match (chance(5) * 4.0) as u32 {
        0 => hip(solids.material(ROOF), half),
        1 => hip(solids.material(SLATE), 0.8 * half),
        2 => solids.material(MINT).lathe(&arc(0.8 * half, 16)[8..], 32, |_, _| 1.0),
        _ => {
            solids.block([-0.7 * half, 0.0, -0.7 * half], [0.7 * half, 0.5, 0.7 * half]);
            solids.block([-0.35 * half, 0.5, -0.35 * half], [0.35 * half, 0.9, 0.35 * half]);
        }
    }
}

/// Four slopes over a square.
fn hip(solids: &mut Solids, half: f32) {
    let top = Vec3::Y * 0.9 * half;
    let corner = |number: u32| {
        let (x, z) = [(-1.0, 1.0), (1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)][number as usize % 4];
        Vec3::new(x * (half + 0.07), 0.0, z * (half + 0.07))
    };
    for side in 0..4 {
        solids.quad([corner(side), corner(side + 1), top, top]);
    }
}

/// Columns with a beam on them, along one side of the square.
fn arcade(solids: &mut Solids, turn: f32) {
    let out = glam::Quat::from_rotation_y(turn.to_radians());
    for number in 0..7 {
        let place = out * Vec3::new(0.8 * number as f32 - 2.4, 0.0, 2.95);
        solids.at(place.into(), turn).material(PAPER);
        solids.lathe(&[(0.12, 0.0), (0.12, 0.08), (0.07, 0.12), (0.07, 0.9), (0.12, 0.95)], 16, |_, _| 1.0);
    }
    solids.at([0.0; 3], turn).material(CREAM).block([-2.6, 0.95, 2.8], [2.6, 1.1, 3.1]);
}

fn finish(name: &str, solids: Solids) -> Scene {
    let materials = vec![
        Material::matte("paper", [0.84, 0.82, 0.78]),
        Material::matte("cream", [0.80, 0.70, 0.55]),
        Material::matte("roof", [0.72, 0.28, 0.17]),
        Material::matte("slate", [0.26, 0.33, 0.42]),
        Material::matte("mint", [0.35, 0.62, 0.52]),
    ];
    let mut mesh: Mesh = solids.mesh;
    mesh.drop_degenerate();
    normals::complete(&mut mesh);
    mesh.arrange(&materials);
    setting().into_scene(name.to_owned(), mesh, materials)
}

/// Sunshine from the left, and five places around the town.
fn setting() -> Setting {
    let around = |number: usize| {
        let angle = 0.55 + number as f32 / 5.0 * std::f32::consts::TAU;
        Camera::looking_at([10.5 * angle.sin(), 7.2, 10.5 * angle.cos()], [0.0, 0.3, 0.0], 42.0)
    };
    let direction = Vec3::new(-0.62, 0.66, 0.42).normalize().to_array();
    Setting {
        light: PointLight { position: [0.0, 3.0, 0.0], color: [0.0; 3], reach: 1.0 },
        sun: Some(DirectionalLight { direction, color: [1.75, 1.48, 1.12] }),
        ambient: Ambient { above: [0.46, 0.55, 0.72], below: [0.34, 0.28, 0.23] },
        sky: Sky::day(),
        cameras: std::array::from_fn(around),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_are_a_few_thousand_triangles_and_all_are_opaque() {
        for (scene, most) in [(town(), 20_000), (carousel(), 12_000)] {
            let count = scene.triangles.len();
            assert!((1_000..most).contains(&count), "{}: {count}", scene.name);
            assert_eq!(scene.opaque_triangle_count as usize, count);
        }
    }

    #[test]
    fn the_carousel_stays_in_the_square() {
        let scene = carousel();
        assert!(scene.positions.iter().all(|[x, y, z]| x.hypot(*z) < 2.0 && *y > 0.05));
    }
}
