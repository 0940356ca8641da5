//! Pictures whose radiance is known without a computer.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::f64::consts::PI;

use glam::Vec3;
use lvk_gltf::{AlphaMode, Light, LightKind, Material, Model, Transmission, Volume};
use lvk_samples::scene::Camera;
use lvk_tests::rtx_sample::software_device;
use lvk_viewer::light::{Environment, Sun};

use crate::scenes::{Builder, PathTracer, View, assert_close, colored, matte, mean};

/// Looks at the origin from above, a little from the side, at an area small enough to be evenly lit.
fn above(height: f32) -> View {
    View { camera: Camera::looking_at([0.02, height, 0.01], [0.0; 3], 0.2), size: [8, 8], samples: 256 }
}

fn floor(material: Material) -> Builder {
    Builder::default().quad(Vec3::new(-40.0, 0.0, -40.0), Vec3::Z * 80.0, Vec3::X * 80.0, material)
}

fn seen(tracer: &mut PathTracer<'_>, model: &Model, environment: &Environment, view: &View) -> [f64; 3] {
    mean(&tracer.radiance(model, environment, view))
}

fn lit_by_sun(radius: f32) -> Environment {
    let direction = Vec3::new(0.6, 0.8, 0.0);
    let sun = Sun { direction: direction.to_array(), irradiance: [3.0, 2.0, 1.0], radius };
    Environment { sun: Some(sun), ..Environment::uniform([0.1, 0.2, 0.3]) }
}

#[test]
fn sun_and_sky_light_a_matte_floor() {
    let Some(ctx) = software_device() else { return };
    let mut tracer = PathTracer::new(&ctx);
    let model = floor(matte([0.5, 0.4, 0.25])).model();
    for radius in [0.004, 0.3] {
        let actual = seen(&mut tracer, &model, &lit_by_sun(radius), &above(5.0));
        // A disc gives its irradiance to a surface that faces it, and the cosine of its middle to another.
        let expected = [(0.5, 3.0, 0.1), (0.4, 2.0, 0.2), (0.25, 1.0, 0.3)]
            .map(|(albedo, sun, sky)| albedo * (sun * 0.8 / PI + sky));
        assert_close(&format!("sun of radius {radius}"), actual, expected, 0.01);
    }
}

#[test]
fn light_goes_straight_on_through_a_pane() {
    let Some(ctx) = software_device() else { return };
    let mut tracer = PathTracer::new(&ctx);
    let color = [0.9, 0.6, 0.3];
    let transmission = Some(Transmission { factor: 1.0, texture: None });
    let pane = Material { transmission, roughness: 0.0, ..matte(color) };
    let model = floor(matte([0.5; 3]))
        .quad(Vec3::new(-40.0, 3.0, -40.0), Vec3::Z * 80.0, Vec3::X * 80.0, pane)
        .model();
    let actual = seen(&mut tracer, &model, &lit_by_sun(0.1), &above(2.5));
    // A pane without a highlight reflects nothing, so that no light comes back to the floor.
    let expected = [(0.9, 3.0, 0.1), (0.6, 2.0, 0.2), (0.3, 1.0, 0.3)]
        .map(|(color, sun, sky)| 0.5 * color * (sun * 0.8 / PI + sky));
    assert_close("below a pane", actual, expected, 0.015);
}

#[test]
fn lamps_follow_the_inverse_square() {
    let Some(ctx) = software_device() else { return };
    let mut tracer = PathTracer::new(&ctx);
    let lamp = |kind| Light { name: None, color: [1.0, 0.5, 0.25], intensity: 12.0, range: None, kind };
    let wide = LightKind::Spot { inner_cone_angle: 0.3, outer_cone_angle: 0.5 };
    for kind in [LightKind::Point, wide] {
        let model = floor(matte([0.8; 3])).lamp(lamp(kind), Vec3::new(0.0, 2.0, 0.0)).model();
        let actual = seen(&mut tracer, &model, &Environment::uniform([0.0; 3]), &above(1.5));
        let expected = [1.0, 0.5, 0.25].map(|color| 0.8 / PI * 12.0 * color / 4.0);
        assert_close(&format!("{kind:?}"), actual, expected, 0.01);
    }
    // A lamp beside the axis is outside of a narrow cone.
    let narrow = LightKind::Spot { inner_cone_angle: 0.1, outer_cone_angle: 0.2 };
    let model = floor(matte([0.8; 3])).lamp(lamp(narrow), Vec3::new(1.0, 2.0, 0.0)).model();
    let actual = seen(&mut tracer, &model, &Environment::uniform([0.0; 3]), &above(1.5));
    assert_eq!(actual, [0.0; 3]);
}

#[test]
fn alpha_is_the_share_of_light_that_meets_a_surface() {
    let Some(ctx) = software_device() else { return };
    let mut tracer = PathTracer::new(&ctx);
    let shown = |alpha, alpha_mode| {
        let unlit = Material { unlit: true, alpha_mode, ..colored([0.2, 0.4, 0.8], 0.0, 1.0) };
        Material { base_color: [0.2, 0.4, 0.8, alpha], ..unlit }
    };
    let cases = [
        (shown(0.3, AlphaMode::Blend), 0.3),
        (shown(0.3, AlphaMode::Mask { cutoff: 0.5 }), 0.0),
        (shown(0.7, AlphaMode::Mask { cutoff: 0.5 }), 1.0),
        (shown(0.3, AlphaMode::Opaque), 1.0),
    ];
    for (material, alpha) in cases {
        let what = format!("{:?}", material.alpha_mode);
        let actual =
            seen(&mut tracer, &floor(material).model(), &Environment::uniform([2.0; 3]), &above(5.0));
        let expected = [0.2, 0.4, 0.8].map(|color| alpha * color + (1.0 - alpha) * 2.0);
        assert_close(&what, actual, expected, 0.01);
    }
}

#[test]
fn a_volume_without_a_boundary_takes_light_by_its_depth() {
    let Some(ctx) = software_device() else { return };
    let mut tracer = PathTracer::new(&ctx);
    let color = [0.9, 0.5, 0.2];
    let volume = Volume {
        thickness: 1.0,
        thickness_texture: None,
        attenuation_distance: 2.0,
        attenuation_color: color,
    };
    let transmission = Some(Transmission { factor: 1.0, texture: None });
    let fog = Material { ior: 1.0, transmission, volume: Some(volume), ..colored([1.0; 3], 0.0, 0.0) };
    let model =
        Builder::default().cuboid(Vec3::new(-9.0, -1.5, -9.0), Vec3::new(9.0, 1.5, 9.0), &fog).model();
    let actual = seen(&mut tracer, &model, &Environment::uniform([1.0; 3]), &above(5.0));
    let expected = color.map(|color| f64::from(color).powf(3.0 / 2.0));
    assert_close("three units of fog", actual, expected, 0.01);
}

#[test]
fn a_lamp_of_triangles_lights_as_its_solid_angle() {
    let Some(ctx) = software_device() else { return };
    let mut tracer = PathTracer::new(&ctx);
    // A ceiling that glows and reflects nothing, seen from the floor below its middle.
    let glowing = Material { emissive: [1.0, 2.0, 3.0], double_sided: true, ..matte([0.0; 3]) };
    let half = 2.0;
    let model = floor(matte([0.6; 3]))
        .quad(Vec3::new(-half, 1.0, -half), Vec3::X * 2.0 * half, Vec3::Z * 2.0 * half, glowing)
        .model();
    let view = View { samples: 128, ..above(0.9) };
    let actual = seen(&mut tracer, &model, &Environment::uniform([0.0; 3]), &view);
    // Form factor of a square above its middle, four times that of a quarter above its corner.
    let side = f64::from(half);
    let edge = side / (1.0 + side * side).sqrt();
    let factor = 4.0 / PI * edge * edge.atan();
    assert_close("a glowing ceiling", actual, [1.0, 2.0, 3.0].map(|light| 0.6 * factor * light), 0.02);
}

/// A file with light from a tenth of all directions, around +x and above the horizon, lights walls as its pixels say, turned or not.
#[test]
fn an_environment_file_lights_from_its_directions() {
    let Some(ctx) = software_device() else { return };
    let mut tracer = PathTracer::new(&ctx);
    const SIZE: [u32; 2] = [64, 32];
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("sky.hdr");
    let is_bright = |column: u32, row: u32| (26..38).contains(&column) && (6..16).contains(&row);
    let pixels: Vec<_> = (0..SIZE[0] * SIZE[1])
        .map(|index| image::Rgb(if is_bright(index % 64, index / 64) { [8.0, 4.0, 2.0] } else { [0.125; 3] }))
        .collect();
    let file = std::fs::File::create(&path).unwrap();
    image::codecs::hdr::HdrEncoder::new(file).encode(&pixels, 64, 32).unwrap();
    // Irradiance of a surface with this normal: the middle of the picture lies in +x, and columns go on towards +z.
    let irradiance = |normal: [f64; 3], turned: f64| {
        let mut sums = [0.0; 3];
        for (index, pixel) in (0_u32..).zip(&pixels) {
            let (around, down) = (
                (f64::from(index % 64) + 0.5) / 64.0 * 2.0 * PI - PI,
                (f64::from(index / 64) + 0.5) / 32.0 * PI,
            );
            let around = around - turned.to_radians();
            let direction = [down.sin() * around.cos(), down.cos(), down.sin() * around.sin()];
            let cosine: f64 = direction.iter().zip(normal).map(|(a, b)| a * b).sum();
            let angle = down.sin() * (PI / 32.0) * (2.0 * PI / 64.0);
            let light = cosine.max(0.0) * angle;
            sums.iter_mut().zip(pixel.0).for_each(|(sum, channel)| *sum += light * f64::from(channel));
        }
        sums
    };
    let wall = |normal: Vec3| {
        let side = normal.cross(Vec3::Y);
        let corner = -40.0 * (side + Vec3::Y);
        Builder::default().quad(corner, Vec3::Y * 80.0, side * 80.0, matte([0.5; 3])).model()
    };
    for (normal, turned) in
        [(Vec3::X, 0.0), (Vec3::NEG_X, 0.0), (Vec3::Z, 0.0), (Vec3::X, 90.0), (Vec3::NEG_Z, 90.0)]
    {
        let environment = Environment::from_hdr(&path, turned).unwrap();
        let eye = normal * 5.0 + Vec3::new(0.02, 0.01, 0.02);
        let view =
            View { camera: Camera::looking_at(eye.to_array(), [0.0; 3], 0.2), size: [8, 8], samples: 256 };
        let actual = seen(&mut tracer, &wall(normal), &environment, &view);
        let expected = irradiance(normal.as_dvec3().to_array(), turned.into()).map(|sum| 0.5 / PI * sum);
        assert_close(&format!("wall towards {normal}, turned by {turned}"), actual, expected, 0.02);
    }
}
