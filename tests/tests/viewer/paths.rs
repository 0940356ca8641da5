//! The same picture by each path of ray tracing.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use glam::Vec3;
use lvk_gltf::{AlphaMode, Clearcoat, Light, LightKind, Material, Model, Transmission, Volume};
use lvk_samples::scene::Camera;
use lvk_tests::device;
use lvk_tests::rtx_sample::{contexts_and_paths, software_device};
use lvk_viewer::light::{Environment, SunSetting};

use crate::scenes::{Builder, View, assert_close, colored, mean, radiance};

/// Every kind of surface that a ray treats in its own way.
fn still_life() -> Model {
    let volume = Volume {
        thickness: 1.0,
        thickness_texture: None,
        attenuation_distance: 1.0,
        attenuation_color: [0.6, 0.9, 0.7],
    };
    let transmission = Some(Transmission { factor: 1.0, texture: None });
    let glass = Material { transmission, volume: Some(volume), ..colored([1.0; 3], 0.0, 0.05) };
    let pane = Material { transmission, ..colored([0.9, 0.8, 0.5], 0.0, 0.0) };
    let veil = Material { alpha_mode: AlphaMode::Blend, ..colored([0.2, 0.3, 0.9], 0.0, 0.4) };
    let veil = Material { base_color: [0.2, 0.3, 0.9, 0.4], ..veil };
    let coat = Clearcoat {
        factor: 1.0,
        texture: None,
        roughness: 0.1,
        roughness_texture: None,
        normal_texture: None,
        normal_scale: 1.0,
    };
    let paint = Material { clearcoat: Some(coat), ..colored([0.7, 0.1, 0.1], 0.0, 0.6) };
    let lamp =
        Light { name: None, color: [1.0; 3], intensity: 3.0, range: Some(9.0), kind: LightKind::Point };
    Builder::default()
        .quad(Vec3::new(-4.0, 0.0, -4.0), Vec3::Z * 8.0, Vec3::X * 8.0, colored([0.7; 3], 0.0, 0.5))
        .cuboid(Vec3::new(-1.6, 0.0, -0.5), Vec3::new(-0.6, 1.0, 0.5), &glass)
        .cuboid(Vec3::new(0.5, 0.0, -0.6), Vec3::new(1.5, 1.2, 0.4), &paint)
        .cuboid(Vec3::new(-0.4, 0.0, -1.5), Vec3::new(0.4, 1.8, -0.9), &colored([0.9, 0.8, 0.6], 1.0, 0.15))
        .quad(Vec3::new(-0.3, 0.0, 1.0), Vec3::X * 1.2, Vec3::Y * 0.9, pane)
        .quad(Vec3::new(-2.2, 0.0, 0.9), Vec3::X * 1.2, Vec3::Y * 0.7, veil)
        .lamp(lamp, Vec3::new(-2.0, 2.5, 2.0))
        .model()
}

#[test]
fn all_paths_trace_the_same_light() {
    let Some(ctx) = device() else { return };
    let software = software_device();
    let camera = Camera::looking_at([1.5, 1.7, 4.5], [-0.2, 0.5, 0.0], 40.0);
    let view = View { camera, size: [60, 40], samples: 4 };
    let environment = Environment::day(&SunSetting::default());
    let model = still_life();
    let all: Vec<_> = contexts_and_paths(&ctx, software.as_deref())
        .into_iter()
        .map(|(ctx, path)| (path, radiance(ctx, path, &model, &environment, &view)))
        .collect();
    let (_, first) = &all[0];
    for (path, other) in &all[1..] {
        // Paths are chaotic: the last bit of a distance may send one to the other side of an edge.
        let differs = |a: &[f32; 3], b: &[f32; 3]| {
            a.iter().zip(b).any(|(a, b)| (a - b).abs() > 1e-3 * a.abs().max(b.abs()).max(0.1))
        };
        let count = first.iter().zip(other).filter(|(a, b)| differs(a, b)).count();
        eprintln!("{path:?}: {count} of {} pixels differ", first.len());
        assert!(count * 50 < first.len(), "{count} pixels differ");
        assert_close("mean", mean(other), mean(first), 0.02);
    }
}
