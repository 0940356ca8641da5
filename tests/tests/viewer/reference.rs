//! The path tracer against the one in double precision.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use glam::{DVec3, Vec3};
use lvk_gltf::{Light, LightKind, Material, Model};
use lvk_samples::hybrid::RayPath;
use lvk_samples::scene::Camera;
use lvk_tests::random::Random;
use lvk_tests::rtx_sample::software_device;
use lvk_viewer::light::{Environment, Sun};

use crate::reference_tracer::ReferenceTracer;
use crate::scenes::{Builder, View, assert_close, colored, mean, radiance};

/// Pixels of a block that is compared.
const BLOCK: u32 = 8;
const SIZE: [u32; 2] = [32, 24];
const GPU_SAMPLES: u32 = 512;
const CPU_SAMPLES: u32 = 600;

/// A corner of two walls with a metal block, a lamp and a plate that glows.
fn corner() -> Model {
    let block = colored([0.95, 0.75, 0.4], 1.0, 0.5);
    let glowing =
        Material { emissive: [1.0, 0.6, 0.3], emissive_strength: 2.0, ..colored([0.2; 3], 0.0, 0.8) };
    let lamp =
        Light { name: None, color: [0.6, 0.8, 1.0], intensity: 2.5, range: None, kind: LightKind::Point };
    let half_metal = colored([0.3, 0.7, 0.5], 0.5, 0.6);
    Builder::default()
        .quad(Vec3::ZERO, Vec3::Z * 4.0, Vec3::X * 4.0, colored([0.7, 0.7, 0.68], 0.0, 0.55))
        .quad(Vec3::ZERO, Vec3::X * 4.0, Vec3::Y * 3.0, colored([0.75, 0.15, 0.1], 0.0, 0.9))
        .quad(Vec3::ZERO, Vec3::Y * 3.0, Vec3::Z * 4.0, half_metal)
        .quad(Vec3::new(0.01, 1.8, 1.0), Vec3::Y * 0.8, Vec3::Z * 1.2, glowing)
        .cuboid(Vec3::new(1.2, 0.0, 0.9), Vec3::new(2.2, 1.3, 1.9), &block)
        .lamp(lamp, Vec3::new(2.6, 2.2, 2.6))
        .model()
}

fn by_reference(model: &Model, environment: &Environment, view: &View) -> Vec<[f32; 3]> {
    let tracer = ReferenceTracer::new(model, environment);
    let [right, up, forward] = view.camera.frame().map(|axis| Vec3::from(axis).as_dvec3());
    let half = (0.5 * f64::from(view.camera.vertical_fov_degrees).to_radians()).tan();
    let [width, height] = view.size;
    let aspect = f64::from(width) / f64::from(height);
    let mut random = Random::new(30);
    let mut pixel = |index: u32| {
        let mut sum = DVec3::ZERO;
        for _ in 0..view.samples {
            let mut unit = || (random.bits() >> 11) as f64 / (1_u64 << 53) as f64;
            let x = 2.0 * (f64::from(index % width) + unit()) / f64::from(width) - 1.0;
            let y = 1.0 - 2.0 * (f64::from(index / width) + unit()) / f64::from(height);
            let direction = (forward + x * half * aspect * right + y * half * up).normalize();
            sum += tracer.sample(Vec3::from(view.camera.eye).as_dvec3(), direction, &mut random);
        }
        (sum / f64::from(view.samples)).as_vec3().to_array()
    };
    (0..width * height).map(&mut pixel).collect()
}

/// The pixels of a block, by its column and row.
fn block(pixels: &[[f32; 3]], column: u32, row: u32) -> Vec<[f32; 3]> {
    let first = (row * BLOCK * SIZE[0] + column * BLOCK) as usize;
    let rows = (0..BLOCK).map(|y| first + (y * SIZE[0]) as usize);
    rows.flat_map(|first| pixels[first..first + BLOCK as usize].to_vec()).collect()
}

#[test]
fn a_lit_corner_is_as_bright_as_in_double_precision() {
    let Some(ctx) = software_device() else { return };
    let direction = Vec3::new(0.5, 0.7, 0.6).normalize().to_array();
    let sun = Sun { direction, irradiance: [2.5, 2.2, 1.8], radius: 0.5 };
    let environment = Environment { sun: Some(sun), ..Environment::uniform([0.25, 0.35, 0.5]) };
    let camera = Camera::looking_at([4.6, 2.6, 4.8], [1.1, 0.9, 1.1], 42.0);
    let model = corner();
    let view = |samples| View { camera, size: SIZE, samples };
    let actual = radiance(&ctx, RayPath::Query, &model, &environment, &view(GPU_SAMPLES));
    let expected = by_reference(&model, &environment, &view(CPU_SAMPLES));
    assert_close("the whole picture", mean(&actual), mean(&expected), 0.015);
    for row in 0..SIZE[1] / BLOCK {
        for column in 0..SIZE[0] / BLOCK {
            let [actual, expected] = [&actual, &expected].map(|pixels| mean(&block(pixels, column, row)));
            assert_close(&format!("block {column} {row}"), actual, expected, 0.06);
        }
    }
}
