//! Light of triangles that shadow rays look for, against form factors and against paths that find it by chance alone.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::f64::consts::PI;

use glam::{Mat4, Quat, Vec3};
use lvk_gltf::{AlphaMode, Material, Model, Transform};
use lvk_samples::hybrid::RayPath;
use lvk_samples::scene::Camera;
use lvk_tests::rtx_sample::software_device;
use lvk_viewer::light::Environment;

use crate::scenes::{Builder, PathTracer, View, assert_close, colored, matte, mean, radiance};

fn floor(material: Material) -> Builder {
    Builder::default().quad(Vec3::new(-40.0, 0.0, -40.0), Vec3::Z * 80.0, Vec3::X * 80.0, material)
}

/// The share of light that a point gets from a rectangle at `height` whose corner is above it.
fn corner_factor([a, b]: [f64; 2], height: f64) -> f64 {
    let part = |a: f64, b: f64| {
        let far = (a * a + height * height).sqrt();
        a / far * (b / far).atan()
    };
    (part(a, b) + part(b, a)) / (2.0 * PI)
}

#[test]
fn small_lights_light_as_their_form_factor() {
    let Some(ctx) = software_device() else { return };
    let glowing = Material { emissive: [1.0, 2.0, 3.0], emissive_strength: 50.0, ..matte([0.0; 3]) };
    // From 0.5 to 0.7 and from 0.2 to 0.3 beside the point that is seen: so few paths meet it by chance that noise would be large.
    let model =
        floor(matte([0.6; 3])).quad(Vec3::new(0.5, 2.0, 0.2), Vec3::X * 0.2, Vec3::Z * 0.1, glowing).model();
    let camera = Camera::looking_at([0.02, 1.5, 0.01], [0.0; 3], 0.2);
    let view = View { camera, size: [8, 8], samples: 64 };
    let actual = mean(&radiance(&ctx, RayPath::Query, &model, &Environment::uniform([0.0; 3]), &view));
    let corner = |a, b| corner_factor([a, b], 2.0);
    let factor = corner(0.7, 0.3) - corner(0.5, 0.3) - corner(0.7, 0.2) + corner(0.5, 0.2);
    assert_close("a small lamp", actual, [1.0, 2.0, 3.0].map(|light| 0.6 * 50.0 * factor * light), 0.01);
}

#[test]
fn a_light_just_above_the_floor_lights_it_beside_as_its_form_factor() {
    let Some(ctx) = software_device() else { return };
    let glowing = Material { emissive: [1.0, 2.0, 3.0], emissive_strength: 10.0, ..matte([0.0; 3]) };
    let mut tracer = PathTracer::new(&ctx);
    for (near, height) in [(0.05, 0.02), (0.2, 0.02), (0.5, 0.02)] {
        let lamp = Vec3::new(near, height, -0.6);
        let model = floor(matte([0.6; 3])).quad(lamp, Vec3::X * 1.2, Vec3::Z * 1.2, glowing.clone()).model();
        let camera = Camera::looking_at([0.0, 1.5, 0.0001], [0.0; 3], 0.2);
        let view = View { camera, size: [8, 8], samples: 512 };
        let actual = mean(&tracer.radiance(&model, &Environment::uniform([0.0; 3]), &view));
        let corner = |a: f32, b| corner_factor([f64::from(a), b], f64::from(height));
        let factor = 2.0 * (corner(near + 1.2, 0.6) - corner(near, 0.6));
        let expected = [1.0, 2.0, 3.0].map(|light| 0.6 * 10.0 * factor * light);
        assert_close(&format!("a lamp {near} beside and {height} above"), actual, expected, 0.02);
    }
}

/// A room of a rough mirror, a pane and fog, with lamps of several sizes, two of them in instances that stretch them.
fn room(alpha_mode: AlphaMode) -> Model {
    let glowing = |emissive| Material { emissive, emissive_strength: 4.0, alpha_mode, ..matte([0.2; 3]) };
    let transmission = Some(lvk_gltf::Transmission { factor: 1.0, texture: None });
    let pane = Material { transmission, ..colored([0.9, 0.8, 0.6], 0.0, 0.0) };
    let volume = lvk_gltf::Volume {
        thickness: 1.0,
        thickness_texture: None,
        attenuation_distance: 0.8,
        attenuation_color: [0.4, 0.7, 0.9],
    };
    let glass = Material { transmission, volume: Some(volume), ..colored([1.0; 3], 0.0, 0.3) };
    let mut model = floor(colored([0.8; 3], 1.0, 0.3))
        .cuboid(Vec3::new(-1.4, 0.0, -0.5), Vec3::new(-0.6, 0.8, 0.3), &matte([0.7; 3]))
        .cuboid(Vec3::new(0.4, 0.0, -0.4), Vec3::new(1.2, 1.0, 0.4), &glass)
        .quad(Vec3::new(-0.4, 0.0, 0.8), Vec3::X * 0.9, Vec3::Y * 0.7, pane)
        .quad(Vec3::new(0.7, 0.4, 0.0), Vec3::X * 0.3, Vec3::Z * 0.3, glowing([0.9, 0.3, 0.1]))
        .quad(Vec3::new(-0.3, 0.6, -0.9), Vec3::X * 0.6, Vec3::Y * 0.6, glowing([0.1, 0.5, 0.9]))
        .quad(Vec3::new(-0.5, 0.0, -0.5), Vec3::X, Vec3::Z, glowing([0.5, 0.6, 0.4]))
        .model();
    let last = model.nodes.len() - 1;
    let turned = Quat::from_rotation_x(0.4);
    let place =
        |scale: Vec3, at: Vec3| Transform::Matrix(Mat4::from_scale_rotation_translation(scale, turned, at));
    model.nodes[last].transform = place(Vec3::new(2.0, 1.0, 0.5), Vec3::new(0.0, 2.2, 0.0));
    let other = lvk_gltf::Node {
        transform: place(Vec3::splat(0.3), Vec3::new(-1.0, 1.3, 0.9)),
        ..model.nodes[last].clone()
    };
    model.nodes.push(other);
    model.scenes[0].roots.push(last + 1);
    model
}

#[test]
fn shadow_rays_and_paths_find_the_same_light() {
    let Some(ctx) = software_device() else { return };
    let camera = Camera::looking_at([0.6, 1.6, 3.6], [0.0, 0.5, 0.0], 45.0);
    // Shadow rays do not look for surfaces that may have holes, though these have none.
    let mut tracer = PathTracer::new(&ctx);
    let mut light = |alpha_mode, samples| {
        let view = View { camera, size: [24, 16], samples };
        tracer.radiance(&room(alpha_mode), &Environment::uniform([0.05; 3]), &view)
    };
    let by_chance = light(AlphaMode::Blend, 4096);
    let found = light(AlphaMode::Opaque, 1024);
    assert_close("the whole picture", mean(&found), mean(&by_chance), 0.01);
    for part in 0..6 {
        let rows = |pixels: &[[f32; 3]]| {
            let columns = |pixel: usize| pixel % 24 / 8 + 3 * (pixel / 24 / 8) == part;
            (0..pixels.len()).filter(|pixel| columns(*pixel)).map(|pixel| pixels[pixel]).collect::<Vec<_>>()
        };
        assert_close(&format!("part {part}"), mean(&rows(&found)), mean(&rows(&by_chance)), 0.03);
    }
}
