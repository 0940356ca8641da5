//! The real-time method with its radiance cache: light that is neither lost nor doubled, whatever the table holds.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use glam::Vec3;
use image::RgbaImage;
use lvk::Context;
use lvk_gltf::{Light, LightKind, Model};
use lvk_samples::app::headless;
use lvk_samples::app::sample::Sample as _;
use lvk_samples::hybrid::RayPath;
use lvk_samples::scene::Camera;
use lvk_tests::device;
use lvk_tests::image_comparison::{Tolerance, assert_similar};
use lvk_tests::rtx_sample::{contexts_and_paths, software_device};
use lvk_viewer::light::Environment;
use lvk_viewer::{IndirectLight, Method, Viewer, ViewerConfig};

use crate::moving_model::moving_model;
use crate::paths::assert_alike;
use crate::scenes::{Builder, View, assert_close, config, configured_viewer, matte, mean, viewer};
use crate::still_life::still_life;

const SIZE: [u32; 2] = [96, 64];

/// Configurations of the radiance cache, each with its name.
const TABLES: [(&str, IndirectLight, u32); 4] = [
    ("a table for all cells", IndirectLight::Cache, ViewerConfig::DEFAULT_CACHE_ENTRIES),
    ("a table that is full", IndirectLight::Cache, 256),
    ("a table of one bucket", IndirectLight::Cache, 1),
    ("paths alone", IndirectLight::Paths, 1),
];

/// No light from outside.
pub fn dark() -> Environment {
    Environment::uniform([0.0; 3])
}

/// A white lamp that shines to all sides.
pub fn lamp(intensity: f32) -> Light {
    Light { name: None, color: [1.0; 3], intensity, range: None, kind: LightKind::Point }
}

/// Walls around a space, seen from inside.
pub fn walls(builder: Builder, low: Vec3, high: Vec3, color: [f32; 3]) -> Builder {
    let [x, y, z] = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| axis * (high - low).dot(axis));
    let sides = [(low, x, y), (low, y, z), (low, z, x), (high, -y, -x), (high, -z, -y), (high, -x, -z)];
    sides.into_iter().fold(builder, |builder, (corner, u, v)| builder.quad(corner, u, v, matte(color)))
}

/// A pale interior with two boxes and a lamp: much of its light has met several surfaces.
fn interior() -> Model {
    walls(Builder::default(), Vec3::new(-2.0, 0.0, -2.0), Vec3::new(2.0, 2.5, 2.0), [0.75, 0.72, 0.65])
        .cuboid(Vec3::new(-1.4, 0.0, -1.2), Vec3::new(-0.5, 1.5, -0.4), &matte([0.7, 0.2, 0.15]))
        .cuboid(Vec3::new(0.4, 0.0, -0.9), Vec3::new(1.3, 0.7, 0.1), &matte([0.2, 0.4, 0.7]))
        .lamp(lamp(3.0), Vec3::new(0.2, 1.8, 0.0))
        .model()
}

fn inside(samples: u32) -> View {
    View { camera: Camera::looking_at([0.9, 1.3, 1.7], [-0.4, 0.8, -0.8], 65.0), size: SIZE, samples }
}

fn cached(
    (ctx, path): (&Context, RayPath),
    (model, environment): (&Model, &Environment),
    view: &View,
    (_, indirect, cache_entries): (&str, IndirectLight, u32),
) -> Viewer {
    let config = ViewerConfig { indirect, cache_entries, ..config((Method::Hybrid, path), view) };
    configured_viewer(ctx, &config, model, environment, view)
}

fn picture(viewer: &mut Viewer) -> RgbaImage {
    RgbaImage::from_raw(SIZE[0], SIZE[1], headless::picture(viewer).unwrap()).unwrap()
}

fn radiance(viewer: &mut Viewer) -> Vec<[f32; 3]> {
    headless::picture(viewer).unwrap();
    viewer.radiance().unwrap()
}

#[test]
fn light_of_many_surfaces_is_that_of_the_reference_with_any_table() {
    let Some(ctx) = software_device() else { return };
    let (model, environment) = (interior(), dark());
    let mut reference = viewer(&ctx, (Method::PathTrace, RayPath::Query), &model, &environment, &inside(256));
    let expected = picture(&mut reference);
    let expected_mean = mean(&reference.radiance().unwrap());
    for table in TABLES {
        let mut viewer = cached((&ctx, RayPath::Query), (&model, &environment), &inside(48), table);
        let near = Tolerance { psnr: 28.0, ssim: 0.8, flip: 0.1, ..Tolerance::default() };
        assert_similar(table.0, &picture(&mut viewer), &expected, &near);
        assert_close(table.0, mean(&viewer.radiance().unwrap()), expected_mean, 0.04);
    }
}

#[test]
fn no_light_comes_into_a_closed_interior() {
    let Some(ctx) = software_device() else { return };
    let white = [0.9; 3];
    let model =
        walls(Builder::default(), Vec3::new(-2.0, 0.0, -2.0), Vec3::new(2.0, 2.5, 2.0), white).model();
    let sky = Environment::uniform([5.0; 3]);
    let mut viewer = cached((&ctx, RayPath::Query), (&model, &sky), &inside(16), TABLES[0]);
    let brightest = radiance(&mut viewer).into_iter().flatten().fold(0.0, f32::max);
    assert_eq!(brightest, 0.0);
}

/// Two halves of an open box, seen from above, with a lamp in one: a wall between them keeps the other dark.
#[test]
fn light_does_not_leak_through_a_wall() {
    let Some(ctx) = software_device() else { return };
    let pale = matte([0.8; 3]);
    let wall = |low: [f32; 3], high: [f32; 3]| (Vec3::from(low), Vec3::from(high));
    let model = [
        wall([-2.2, -0.2, -1.2], [2.2, 0.0, 1.2]),
        wall([-2.2, 0.0, -1.2], [-2.0, 1.5, 1.2]),
        wall([2.0, 0.0, -1.2], [2.2, 1.5, 1.2]),
        wall([-2.0, 0.0, -1.2], [2.0, 1.5, -1.0]),
        wall([-2.0, 0.0, 1.0], [2.0, 1.5, 1.2]),
        wall([-0.1, 0.0, -1.0], [0.1, 1.5, 1.0]),
    ]
    .into_iter()
    .fold(Builder::default(), |builder, (low, high)| builder.cuboid(low, high, &pale))
    .lamp(lamp(4.0), Vec3::new(1.0, 0.5, 0.0))
    .model();
    let camera = Camera::looking_at([0.0, 7.0, 0.3], [0.0; 3], 36.0);
    let view = View { camera, size: SIZE, samples: 32 };
    let mut viewer = cached((&ctx, RayPath::Query), (&model, &dark()), &view, TABLES[0]);
    let all = radiance(&mut viewer);
    let bright = |from: u32, to: u32| {
        let rows = SIZE[1] * 2 / 5..SIZE[1] * 3 / 5;
        let part: Vec<_> =
            rows.flat_map(|y| (from..to).map(move |x| all_at(x, y))).map(|at| all[at]).collect();
        mean(&part)[1]
    };
    let (unlit, lit) = (bright(SIZE[0] / 4, SIZE[0] * 2 / 5), bright(SIZE[0] * 3 / 5, SIZE[0] * 3 / 4));
    eprintln!("{unlit} behind the wall, {lit} before it");
    assert!(lit > 0.5 && unlit < 1e-3 * lit, "{unlit} behind the wall, {lit} before it");
}

fn all_at(x: u32, y: u32) -> usize {
    (SIZE[0] * y + x) as usize
}

/// White surfaces under a white sky are as bright as the sky wherever light finds its way.
#[test]
fn nothing_is_brighter_than_the_furnace() {
    let Some(ctx) = software_device() else { return };
    let white = matte([1.0; 3]);
    let model = Builder::default()
        .quad(Vec3::new(-40.0, 0.0, -40.0), Vec3::Z * 80.0, Vec3::X * 80.0, white.clone())
        .cuboid(Vec3::new(-1.5, 0.0, -1.0), Vec3::new(-0.5, 1.6, 1.0), &white)
        .cuboid(Vec3::new(0.5, 0.0, -1.0), Vec3::new(1.5, 1.2, 1.0), &white)
        .model();
    let camera = Camera::looking_at([0.2, 2.2, 3.5], [0.0, 0.5, 0.0], 45.0);
    let view = View { camera, size: SIZE, samples: 24 };
    for table in &TABLES[..2] {
        let furnace = Environment::uniform([1.0; 3]);
        let mut viewer = cached((&ctx, RayPath::Query), (&model, &furnace), &view, *table);
        let all = radiance(&mut viewer);
        let brightest = all.iter().flatten().copied().fold(0.0, f32::max);
        eprintln!("{}: {brightest} at most", table.0);
        assert_close(table.0, mean(&all), [1.0; 3], 0.02);
        assert!(brightest < 1.06, "{}: {brightest}", table.0);
    }
}

#[test]
fn all_paths_update_the_cache_with_the_same_light() {
    let Some(ctx) = device() else { return };
    let software = software_device();
    let (model, environment) = (interior(), dark());
    let view = View { size: [60, 40], ..inside(12) };
    let all: Vec<_> = contexts_and_paths(&ctx, software.as_deref())
        .into_iter()
        .map(|(ctx, path)| {
            (path, radiance(&mut cached((ctx, path), (&model, &environment), &view, TABLES[0])))
        })
        .collect();
    for (path, other) in &all[1..] {
        assert_alike(&format!("{path:?}"), &all[0].1, other);
    }
}

#[test]
fn the_picture_does_not_depend_on_the_order_of_updates() {
    let Some(ctx) = software_device() else { return };
    let (model, environment) = (still_life(), Environment::uniform([1.0; 3]));
    let once =
        || radiance(&mut cached((&ctx, RayPath::Query), (&model, &environment), &inside(12), TABLES[0]));
    assert_eq!(once(), once());
}

#[test]
fn a_moving_camera_leaves_no_trail_in_an_interior() {
    let Some(ctx) = software_device() else { return };
    let (model, environment) = (interior(), dark());
    let mut reference = viewer(&ctx, (Method::PathTrace, RayPath::Query), &model, &environment, &inside(256));
    let expected = picture(&mut reference);
    let mut viewer = cached((&ctx, RayPath::Query), (&model, &environment), &inside(1), TABLES[0]);
    viewer.configure(&ViewerConfig { is_progressive: true, ..*viewer.config() }).unwrap();
    let end = inside(1).camera;
    let mut last = RgbaImage::new(SIZE[0], SIZE[1]);
    for frame in (0..32_u8).rev() {
        let [x, y, z] = end.eye;
        viewer.set_view(&Camera { eye: [x - 0.03 * f32::from(frame), y, z], ..end });
        last = picture(&mut viewer);
    }
    let moving = Tolerance { psnr: 24.0, ssim: 0.7, flip: 0.15, ..Tolerance::default() };
    assert_similar("after 32 frames of motion", &last, &expected, &moving);
}

/// Light goes with what moves: the last frame of an animation that a window plays is near the still of its time.
#[test]
fn light_of_moving_things_does_not_stay_behind() {
    let Some(ctx) = software_device() else { return };
    let (model, environment) = (moving_model(), Environment::uniform([1.0; 3]));
    let camera = Camera::looking_at([0.5, 1.6, 4.0], [0.0, 0.7, 0.0], 40.0);
    let view = |samples| View { camera, size: SIZE, samples };
    let mut reference = viewer(&ctx, (Method::PathTrace, RayPath::Query), &model, &environment, &view(512));
    reference.play(Some(0), 0.9);
    let expected = picture(&mut reference);
    let mut viewer = cached((&ctx, RayPath::Query), (&model, &environment), &view(1), TABLES[0]);
    viewer.configure(&ViewerConfig { is_progressive: true, ..*viewer.config() }).unwrap();
    let mut last = RgbaImage::new(SIZE[0], SIZE[1]);
    for frame in 0..=30_u8 {
        viewer.play(Some(0), 0.9 - f32::from(30 - frame) / 60.0);
        last = picture(&mut viewer);
    }
    let moving = Tolerance { psnr: 22.0, ssim: 0.75, flip: 0.15, ..Tolerance::default() };
    assert_similar("after half a second", &last, &expected, &moving);
}
