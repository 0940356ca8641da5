//! The models of the hall.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};

use super::scene::{Model, material};
use crate::scene::noise;
use crate::shapes::Mesh;

/// Texture coordinates of the floor repeat after this many scene units.
const FLOOR_TILE: f32 = 4.0;
const STONE_TILE: f32 = 2.0;
/// Half the width of the hall, and where it begins and ends.
const HALF_WIDTH: f32 = 6.5;
const FRONT: f32 = 7.0;
const BACK: f32 = -33.0;
/// The basin in the floor.
const BASIN: [f32; 4] = [-1.5, 1.5, -15.5, -4.5];
const BASIN_DEPTH: f32 = 0.55;
const WATER_LEVEL: f32 = -0.06;

fn model(name: &'static str, parts: Vec<(Mesh, u32)>) -> Model {
    Model { name, parts, is_transparent: false }
}

/// Floor, basin, walls and beams.
pub(super) fn hall() -> Model {
    let parts = vec![
        (floor(), material::FLOOR),
        (basin(), material::MOSAIC),
        (walls(), material::STONE),
        (beams(), material::MARBLE),
        (trim(), material::GOLD),
    ];
    model("hall", parts)
}

fn floor() -> Mesh {
    let [x0, x1, z0, z1] = BASIN;
    let pieces = [
        (-HALF_WIDTH, HALF_WIDTH, z1, FRONT),
        (-HALF_WIDTH, HALF_WIDTH, BACK, z0),
        (-HALF_WIDTH, x0, z0, z1),
        (x1, HALF_WIDTH, z0, z1),
    ];
    pieces.into_iter().fold(Mesh::default(), |mesh, (left, right, far, near)| {
        let (u, v) = (Vec3::Z * (near - far), Vec3::X * (right - left));
        mesh.quad(Vec3::new(left, 0.0, far), u, v, FLOOR_TILE)
    })
}

fn basin() -> Mesh {
    let [x0, x1, z0, z1] = BASIN;
    let (wide, long, deep) = (Vec3::X * (x1 - x0), Vec3::Z * (z1 - z0), Vec3::Y * BASIN_DEPTH);
    let low = Vec3::new(x0, -BASIN_DEPTH, z0);
    Mesh::default()
        .quad(low, long, wide, 2.0)
        .quad(low, wide, deep, 2.0)
        .quad(low, deep, long, 2.0)
        .quad(low + wide, long, deep, 2.0)
        .quad(low + long, deep, wide, 2.0)
}

fn walls() -> Mesh {
    let wall = Mesh::default()
        .cuboid([-HALF_WIDTH - 0.4, 0.0, BACK], [-HALF_WIDTH, 0.9, FRONT], STONE_TILE)
        .cuboid([HALF_WIDTH, 0.0, BACK], [HALF_WIDTH + 0.4, 0.9, FRONT], STONE_TILE);
    let uv = wall.vertices.len();
    let mut wall = round_opening(wall);
    for vertex in &mut wall.vertices[uv..] {
        vertex.texcoord = Vec2::new(vertex.position.x, vertex.position.y) / STONE_TILE;
    }
    wall
}

/// The wall at the end, between a circle and a rectangle.
fn round_opening(mesh: Mesh) -> Mesh {
    mesh.grid(96, 1, |u, v| {
        let (sine, cosine) = (-u * TAU).sin_cos();
        let circle = ROUND_MIDDLE + ROUND_RADIUS * Vec3::new(cosine, sine, 0.0);
        let scale = (1.0 / cosine.abs().max(1e-6)).min(1.0 / sine.abs().max(1e-6));
        let edge = Vec3::new(cosine * scale * (HALF_WIDTH + 0.4), sine * scale * 3.5 + 3.5, BACK);
        circle.lerp(edge, v)
    })
}

const ROUND_MIDDLE: Vec3 = Vec3::new(0.0, 3.1, BACK);
const ROUND_RADIUS: f32 = 2.4;

fn beams() -> Mesh {
    let mut mesh = Mesh::default().cuboid([-4.95, 4.85, BACK], [-4.25, 5.4, 3.0], STONE_TILE).cuboid(
        [4.25, 4.85, BACK],
        [4.95, 5.4, 3.0],
        STONE_TILE,
    );
    for number in 0..9 {
        let z = 1.0 - 4.0 * number as f32;
        mesh = mesh.cuboid([-5.6, 5.4, z - 0.16], [5.6, 5.75, z + 0.16], STONE_TILE);
    }
    mesh
}

fn trim() -> Mesh {
    let [x0, x1, z0, z1] = BASIN;
    let rim = 0.14;
    let mesh = Mesh::default()
        .cuboid([x0 - rim, 0.0, z0 - rim], [x0, 0.06, z1 + rim], 1.0)
        .cuboid([x1, 0.0, z0 - rim], [x1 + rim, 0.06, z1 + rim], 1.0)
        .cuboid([x0, 0.0, z0 - rim], [x1, 0.06, z0], 1.0)
        .cuboid([x0, 0.0, z1], [x1, 0.06, z1 + rim], 1.0);
    mesh.grid(96, 12, |u, v| {
        let (sine, cosine) = (u * TAU).sin_cos();
        let out = Vec3::new(cosine, sine, 0.0);
        let (across, away) = (v * TAU).sin_cos();
        ROUND_MIDDLE + (ROUND_RADIUS + 0.12 * across) * out + Vec3::Z * (0.12 * away)
    })
}

/// The land around the hall, and hills at the horizon.
pub(super) fn ground() -> Model {
    let corner = Vec3::new(-100.0, -0.8, -100.0);
    let plain = Mesh::default().quad(corner, Vec3::Z * 200.0, Vec3::X * 200.0, 4.0);
    let hills = Mesh::default().grid(320, 24, |u, v| {
        let (sine, cosine) = (-u * TAU).sin_cos();
        let radius = 62.0 + 34.0 * v;
        let rough = noise::tiled(14.0 * u, 2.0 * v, [14, 0], 3);
        let height = (18.0 * rough * (0.5 * std::f32::consts::PI * v).sin() - 0.5).max(-1.0);
        Vec3::new(radius * cosine, height, radius * sine)
    });
    model("ground", vec![(plain, material::SAND), (hills, material::HILLS)])
}

/// A column on a base, with a gilded capital.
pub(super) fn column() -> Model {
    let shaft = Mesh::default().grid(192, 6, |u, v| {
        let angle = u * TAU;
        let radius = 0.36 - 0.06 * v - 0.016 * (16.0 * angle).cos().abs();
        Vec3::new(radius * angle.cos(), 0.42 + 3.95 * v, radius * angle.sin())
    });
    let base = Mesh::default()
        .cuboid([-0.55, 0.0, -0.55], [0.55, 0.22, 0.55], STONE_TILE)
        .lathe(&[[0.52, 0.22], [0.52, 0.32], [0.40, 0.42], [0.36, 0.42]], 32)
        .cuboid([-0.5, 4.68, -0.5], [0.5, 4.85, 0.5], STONE_TILE);
    let capital = Mesh::default().lathe(&[[0.30, 4.37], [0.36, 4.40], [0.32, 4.45], [0.48, 4.68]], 32);
    model("column", vec![(shaft, material::MARBLE), (base, material::STONE), (capital, material::GOLD)])
}

fn pedestal() -> Mesh {
    Mesh::default()
        .cuboid([-0.42, 0.0, -0.42], [0.42, 0.12, 0.42], STONE_TILE)
        .cuboid([-0.34, 0.12, -0.34], [0.34, 0.85, 0.34], STONE_TILE)
        .cuboid([-0.40, 0.85, -0.40], [0.40, 0.95, 0.40], STONE_TILE)
}

/// A mirroring ball on a pedestal.
pub(super) fn mirror_ball() -> Model {
    let ball = Mesh::default().ball(Vec3::new(0.0, 1.42, 0.0), Vec3::splat(0.42), 64);
    let ring = Mesh::default().lathe(&[[0.24, 0.95], [0.24, 1.0], [0.16, 1.05]], 32);
    model(
        "mirror ball",
        vec![(pedestal(), material::MARBLE), (ball, material::MIRROR), (ring, material::GOLD)],
    )
}

/// A knot on a pedestal.
pub(super) fn knot() -> Model {
    let line = |t: f32| {
        let (sine, cosine) = (3.0 * t).sin_cos();
        let radius = 0.30 + 0.12 * cosine;
        Vec3::new(radius * (2.0 * t).cos(), 0.16 * sine, radius * (2.0 * t).sin())
    };
    let knot = Mesh::default().grid(240, 16, |u, v| {
        let t = u * TAU;
        let forward = (line(t + 1e-2) - line(t - 1e-2)).normalize();
        let side = forward.cross(Vec3::Y).normalize();
        let (sine, cosine) = (v * TAU).sin_cos();
        let out = side * cosine + side.cross(forward) * sine;
        let place = line(t) + 0.075 * out;
        Vec3::new(place.x, 1.42 + place.z, place.y)
    });
    model("knot", vec![(pedestal(), material::MARBLE), (knot, material::BRONZE)])
}

/// A glowing ball under a cap. Its light is that of a lamp at the same place.
pub(super) fn lantern() -> Model {
    let glow = Mesh::default().ball(Vec3::ZERO, Vec3::splat(0.13), 20);
    let cap = Mesh::default()
        .lathe(&[[0.20, 0.15], [0.05, 0.26], [0.012, 0.28], [0.012, 2.3]], 20)
        .lathe(&[[0.012, 0.15], [0.20, 0.15]], 20);
    model("lantern", vec![(glow, material::LANTERN), (cap, material::BRONZE)])
}

const SCREEN: [f32; 2] = [0.85, 2.3];

/// The frame of a glass screen.
pub(super) fn screen_frame() -> Model {
    let [half, height] = SCREEN;
    let (rail, depth) = (0.06, 0.04);
    let frame = Mesh::default()
        .cuboid([-half - rail, 0.0, -depth], [-half, height + rail, depth], 1.0)
        .cuboid([half, 0.0, -depth], [half + rail, height + rail, depth], 1.0)
        .cuboid([-half, height, -depth], [half, height + rail, depth], 1.0)
        .cuboid([-half, 0.0, -depth], [half, 0.12, depth], 1.0);
    let feet = Mesh::default().cuboid([-half - 0.1, 0.0, -0.3], [-half + 0.04, 0.08, 0.3], 1.0).cuboid(
        [half - 0.04, 0.0, -0.3],
        [half + 0.1, 0.08, 0.3],
        1.0,
    );
    model("screen frame", vec![(frame, material::BRONZE), (feet, material::MARBLE)])
}

/// The pane of the screen.
pub(super) fn pane() -> Model {
    let [half, height] = SCREEN;
    let corner = Vec3::new(-half, 0.12, 0.0);
    let pane = Mesh::default().quad(corner, Vec3::X * (2.0 * half), Vec3::Y * (height - 0.12), 1.0);
    Model { is_transparent: true, ..model("pane", vec![(pane, material::GLASS)]) }
}

/// The water of the basin.
pub(super) fn water() -> Model {
    let [x0, x1, z0, z1] = BASIN;
    let corner = Vec3::new(x0, WATER_LEVEL, z0);
    let surface = Mesh::default().quad(corner, Vec3::Z * (z1 - z0), Vec3::X * (x1 - x0), 1.0);
    Model { is_transparent: true, ..model("water", vec![(surface, material::WATER)]) }
}

/// A small oil lamp: one of hundreds of small things that are culled where they are far away.
pub(super) fn lamp() -> Model {
    let bowl = Mesh::default().lathe(&[[0.03, 0.0], [0.07, 0.05], [0.075, 0.07], [0.05, 0.06]], 12);
    let flame = Mesh::default().ball(Vec3::new(0.0, 0.1, 0.0), Vec3::new(0.022, 0.055, 0.022), 8);
    model("lamp", vec![(bowl, material::BRONZE), (flame, material::FLAME)])
}

/// A gilded stud in the floor.
pub(super) fn stud() -> Model {
    let stud = Mesh::default().lathe(&[[0.035, 0.0], [0.030, 0.015], [0.018, 0.024], [0.001, 0.027]], 10);
    model("stud", vec![(stud, material::GOLD)])
}
