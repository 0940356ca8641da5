//! The white furnace: the same light from everywhere. What loses no light is as bright as that, and nothing is brighter.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use glam::Vec3;
use lvk_gltf::{Clearcoat, Material, Sheen, Transmission, Volume};
use lvk_samples::scene::Camera;
use lvk_tests::rtx_sample::software_device;
use lvk_viewer::light::Environment;

use crate::scenes::{Builder, PathTracer, View, colored, mean};

/// Angles of view from the normal in degrees.
const ANGLES: [f32; 3] = [5.0, 45.0, 75.0];

/// Brightness of a surface in the furnace, seen under each angle: the mean of a few pixels that show nothing else.
fn brightness(tracer: &mut PathTracer<'_>, material: &Material) -> [f64; 3] {
    let side = 50.0;
    let corner = Vec3::new(-side, 0.0, -side);
    let model =
        Builder::default().quad(corner, Vec3::Z * 2.0 * side, Vec3::X * 2.0 * side, material.clone()).model();
    ANGLES.map(|angle| {
        let (sine, cosine) = angle.to_radians().sin_cos();
        let camera = Camera::looking_at([4.0 * sine, 4.0 * cosine, 0.0], [0.0; 3], 1.0);
        let view = View { camera, size: [8, 8], samples: 256 };
        let [red, green, blue] = mean(&tracer.radiance(&model, &Environment::uniform([1.0; 3]), &view));
        (red + green + blue) / 3.0
    })
}

fn assert_white(tracer: &mut PathTracer<'_>, what: &str, material: &Material) {
    let all = brightness(tracer, material);
    eprintln!("{what}: {all:.4?}");
    assert!(all.iter().all(|bright| (bright - 1.0).abs() < 0.01), "{what}: {all:?}");
}

#[test]
fn metals_of_any_roughness_keep_all_light() {
    let Some(ctx) = software_device() else { return };
    let mut tracer = PathTracer::new(&ctx);
    for roughness in [0.0, 0.2, 0.5, 0.8, 1.0] {
        assert_white(
            &mut tracer,
            &format!("metal of roughness {roughness}"),
            &colored([1.0; 3], 1.0, roughness),
        );
    }
}

#[test]
fn white_dielectrics_of_any_roughness_keep_all_light() {
    let Some(ctx) = software_device() else { return };
    let mut tracer = PathTracer::new(&ctx);
    for (roughness, ior) in [(0.0, 1.5), (0.3, 1.5), (0.7, 2.2), (1.0, 1.5)] {
        let material = Material { ior, ..colored([1.0; 3], 0.0, roughness) };
        assert_white(&mut tracer, &format!("dielectric of roughness {roughness}, index {ior}"), &material);
    }
}

#[test]
fn a_clear_coat_keeps_all_light() {
    let Some(ctx) = software_device() else { return };
    let mut tracer = PathTracer::new(&ctx);
    for roughness in [0.05, 0.6] {
        let coat = Clearcoat {
            factor: 1.0,
            texture: None,
            roughness,
            roughness_texture: None,
            normal_texture: None,
            normal_scale: 1.0,
        };
        let material = Material { clearcoat: Some(coat), ..colored([1.0; 3], 0.0, 0.5) };
        assert_white(&mut tracer, &format!("coat of roughness {roughness}"), &material);
    }
}

#[test]
fn thin_glass_keeps_all_light() {
    let Some(ctx) = software_device() else { return };
    let mut tracer = PathTracer::new(&ctx);
    for roughness in [0.0, 0.3, 0.4, 0.9] {
        let transmission = Some(Transmission { factor: 1.0, texture: None });
        let material = Material { transmission, ..colored([1.0; 3], 0.0, roughness) };
        assert_white(&mut tracer, &format!("thin glass of roughness {roughness}"), &material);
    }
}

/// A slab, through which paths go on.
fn slab(tracer: &mut PathTracer<'_>, roughness: f32) -> f64 {
    let volume = Volume {
        thickness: 1.0,
        thickness_texture: None,
        attenuation_distance: f32::INFINITY,
        attenuation_color: [1.0; 3],
    };
    let transmission = Some(Transmission { factor: 1.0, texture: None });
    let glass = Material { transmission, volume: Some(volume), ..colored([1.0; 3], 0.0, roughness) };
    let model =
        Builder::default().cuboid(Vec3::new(-30.0, -1.0, -30.0), Vec3::new(30.0, 0.0, 30.0), &glass).model();
    let camera = Camera::looking_at([3.0, 3.0, 0.5], [0.0; 3], 2.0);
    let view = View { camera, size: [8, 8], samples: 256 };
    mean(&tracer.radiance(&model, &Environment::uniform([1.0; 3]), &view))[1]
}

#[test]
fn smooth_glass_keeps_all_light_and_rough_glass_gains_none() {
    let Some(ctx) = software_device() else { return };
    let mut tracer = PathTracer::new(&ctx);
    let smooth = slab(&mut tracer, 0.0);
    assert!((smooth - 1.0).abs() < 0.01, "{smooth}");
    // Light that microfacets of glass scatter twice is lost, as the model says.
    for (roughness, least) in [(0.3, 0.95), (0.6, 0.6)] {
        let rough = slab(&mut tracer, roughness);
        eprintln!("glass of roughness {roughness}: {rough:.4}");
        assert!((least..1.01).contains(&rough), "roughness {roughness}: {rough}");
    }
}

#[test]
fn nothing_is_brighter_than_the_light_on_it() {
    let Some(ctx) = software_device() else { return };
    let mut tracer = PathTracer::new(&ctx);
    for roughness in [0.3, 1.0] {
        let sheen = Sheen { color: [1.0; 3], color_texture: None, roughness, roughness_texture: None };
        let cloth = Material { sheen: Some(sheen), ..colored([1.0; 3], 0.0, 1.0) };
        for (what, material) in [("cloth", cloth), ("half metal", colored([1.0; 3], 0.5, roughness))] {
            let all = brightness(&mut tracer, &material);
            eprintln!("{what} of roughness {roughness}: {all:.4?}");
            assert!(all.iter().all(|bright| (0.8..1.01).contains(bright)), "{what}: {all:?}");
        }
    }
}
