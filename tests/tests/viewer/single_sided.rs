//! Single-sided materials: the eye does not see their backs, all other rays do.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use glam::{Mat4, Vec3};
use lvk::Context;
use lvk_gltf::{AlphaMode, Material, Model, Transform};
use lvk_samples::app::headless;
use lvk_samples::hybrid::RayPath;
use lvk_samples::scene::Camera;
use lvk_tests::device;
use lvk_tests::rtx_sample::{contexts_and_paths, software_device};
use lvk_viewer::light::{Environment, Sun};
use lvk_viewer::model::{cameras, showcase};
use lvk_viewer::{Content, Method, PrimaryVisibility, ViewerConfig};

use crate::city::tiny_city;
use crate::scenes::{
    Builder, PathTracer, View, assert_close, colored, config, configured_viewer, matte, mean,
};

const COLOR: [f32; 3] = [0.2, 0.4, 0.8];
const SKY: [f32; 3] = [2.0, 1.0, 0.5];

/// Pixels from the middle of a square to that of the next.
const STEP: usize = 10;

/// A row of squares before the sky, and whether the eye sees each.
fn row() -> (Model, Vec<(&'static str, bool)>) {
    let single = Material { unlit: true, ..colored(COLOR, 0.0, 1.0) };
    let double = Material { double_sided: true, ..single.clone() };
    let mask = Material { alpha_mode: AlphaMode::Mask { cutoff: 0.5 }, ..single.clone() };
    let veil = Material { alpha_mode: AlphaMode::Blend, ..single.clone() };
    let mirrored = |x, y, z| Some(Mat4::from_scale(Vec3::new(x, y, z)));
    // Whether the square is modelled to face the eye, the transform of its node, and whether it is seen.
    let squares = [
        ("a front", &single, true, None, true),
        ("a back", &single, false, None, false),
        ("the back of a double-sided material", &double, false, None, true),
        ("a front, mirrored from left to right", &single, true, mirrored(-1.0, 1.0, 1.0), true),
        ("a back, mirrored from left to right", &single, false, mirrored(-1.0, 1.0, 1.0), false),
        ("a front, turned away by a mirror", &single, true, mirrored(1.0, 1.0, -1.0), false),
        ("a back, turned to the eye by a mirror", &single, false, mirrored(1.0, 1.0, -1.0), true),
        ("the back of a mask", &mask, false, None, false),
        ("the front of a mask", &mask, true, None, true),
        ("the back of a veil", &veil, false, None, false),
        ("a back in a mesh with double-sided surfaces", &single, false, None, false),
        ("a double-sided back in that mesh", &double, false, None, true),
        ("a front in that mesh", &single, true, None, true),
        ("a front in the place of a back in that mesh", &single, true, None, true),
        ("a back in the place of a front in that mesh", &single, false, None, true),
    ];
    let middle = 0.5 * (squares.len() as f32 - 1.0);
    let mut builder = Builder::default();
    let corner = |x: f32| Vec3::new(x - 0.4, -0.4, 0.0);
    let sides = |faces_eye: bool| if faces_eye { [Vec3::X, Vec3::Y] } else { [Vec3::Y, Vec3::X] };
    for (place, (_, material, faces_eye, transform, _)) in squares.iter().enumerate() {
        let across = if transform.is_some_and(|transform| transform.x_axis.x < 0.0) { -1.0 } else { 1.0 };
        let [u, v] = sides(*faces_eye);
        builder =
            builder.quad(corner(across * (place as f32 - middle)), 0.8 * u, 0.8 * v, (*material).clone());
    }
    // The other sides of the last two squares.
    for (place, faces_eye) in [(squares.len() - 2, false), (squares.len() - 1, true)] {
        let [u, v] = sides(faces_eye);
        builder = builder.quad(corner(place as f32 - middle), 0.8 * u, 0.8 * v, single.clone());
    }
    let mut model = builder.model();
    for (node, (.., transform, _)) in model.nodes.iter_mut().zip(&squares) {
        if let Some(transform) = transform {
            node.transform = Transform::Matrix(*transform);
        }
    }
    // The last squares become one mesh.
    let first = squares.len() - 5;
    for place in first + 1..model.meshes.len() {
        let primitives = std::mem::take(&mut model.meshes[place].primitives);
        model.meshes[first].primitives.extend(primitives);
        model.nodes[place].mesh = None;
    }
    (model, squares.map(|(what, .., is_seen)| (what, is_seen)).to_vec())
}

fn assert_eye_sees(ctx: &Context, config: &ViewerConfig, view: &View) {
    let (model, squares) = row();
    let mut viewer = configured_viewer(ctx, config, &model, &Environment::uniform(SKY), view);
    headless::picture(&mut viewer).unwrap();
    let radiance = viewer.radiance().unwrap();
    let width = view.size[0] as usize;
    for (place, (what, is_seen)) in squares.into_iter().enumerate() {
        let actual = radiance[width * STEP / 2 + place * STEP + STEP / 2];
        let expected = if is_seen { COLOR } else { SKY };
        let by = format!("{:?}, {:?}, {:?}", config.method, config.path, config.primary);
        let is_close = actual.iter().zip(expected).all(|(actual, expected)| (actual - expected).abs() < 1e-3);
        assert!(is_close, "{what} by {by}: {actual:?}, not {expected:?}");
    }
}

#[test]
fn the_eye_sees_no_backs_of_single_sided_surfaces() {
    let Some(ctx) = device() else { return };
    let software = software_device();
    let count = row().1.len() as u32;
    let size = [STEP as u32 * count, STEP as u32];
    // Far away, so that a pixel column is a tenth of a unit wide everywhere.
    let height_degrees = 2.0 * (0.5_f32 / 50.0).atan().to_degrees();
    let camera = Camera::looking_at([0.0, 0.0, 50.0], [0.0; 3], height_degrees);
    let view = View { camera, size, samples: 1 };
    for (ctx, path) in contexts_and_paths(&ctx, software.as_deref()) {
        assert_eye_sees(ctx, &config((Method::PathTrace, path), &view), &view);
        for primary in [PrimaryVisibility::Rays, PrimaryVisibility::Raster] {
            let config = ViewerConfig { primary, ..config((Method::Hybrid, path), &view) };
            assert_eye_sees(ctx, &config, &view);
        }
    }
}

/// Surfaces of the models that code makes face outwards, or are double-sided: no eye sees through a back, but for a few pixels where tubes of
/// the city are open.
#[test]
fn models_made_by_code_show_no_backs() {
    let Some(ctx) = software_device() else { return };
    for (what, model) in [("showcase", showcase()), ("city", tiny_city(3, 3))] {
        let bounds = model.bounds(0, &model.pose(None, 0.0)).unwrap();
        let (middle, size) = (0.5 * (bounds.min + bounds.max), bounds.min.distance(bounds.max));
        let around = [(Vec3::new(0.6, 0.5, 1.0), 0.7), (Vec3::new(-1.0, 0.2, -0.7), 0.5), (Vec3::Y, 0.8)];
        let around = around.map(|(direction, away)| {
            let eye = middle + away * size * direction.normalize();
            Camera::looking_at((eye + 1e-3 * Vec3::Z).to_array(), middle.to_array(), 40.0)
        });
        let own = cameras(&model, 0, &model.pose(None, 0.0)).into_iter().map(|camera| camera.camera);
        for (number, camera) in own.chain(around).enumerate() {
            let view = View { camera, size: [240, 160], samples: 1 };
            let usual = config((Method::Hybrid, RayPath::Query), &view);
            let config = ViewerConfig { content: Content::Normals, ..usual };
            let normals = |model: &Model| {
                let mut viewer = configured_viewer(&ctx, &config, model, &Environment::uniform(SKY), &view);
                headless::picture(&mut viewer).unwrap();
                viewer.radiance().unwrap()
            };
            let mut double = model.clone();
            double.materials.iter_mut().for_each(|material| material.double_sided = true);
            let (seen, expected) = (normals(&model), normals(&double));
            let differing = seen.iter().zip(&expected).filter(|(seen, expected)| seen != expected).count();
            eprintln!("{what}, camera {number}: {differing} pixels differ");
            assert!(differing * 2_000 < seen.len(), "{what}, camera {number}: {differing} pixels show backs");
        }
    }
}

/// Seen from above through its back, a roof keeps the sun and half of the sky from the floor below it.
#[test]
fn backs_that_the_eye_does_not_see_keep_light_away() {
    let Some(ctx) = software_device() else { return };
    let mut tracer = PathTracer::new(&ctx);
    let sun = Sun { direction: [0.0, 1.0, 0.0], irradiance: [3.0, 2.0, 1.0], radius: 0.01 };
    let environment = Environment { sun: Some(sun), ..Environment::uniform([0.1, 0.2, 0.3]) };
    let half = 1.0;
    let model = Builder::default()
        .quad(Vec3::new(-40.0, 0.0, -40.0), Vec3::Z * 80.0, Vec3::X * 80.0, matte([0.5; 3]))
        .quad(Vec3::new(-half, 1.0, -half), Vec3::X * 2.0, Vec3::Z * 2.0, matte([0.0; 3]))
        .model();
    let camera = Camera::looking_at([0.02, 5.0, 0.01], [0.0; 3], 0.2);
    let view = View { camera, size: [8, 8], samples: 256 };
    let actual = mean(&tracer.radiance(&model, &environment, &view));
    // Form factor of a square above its middle, four times that of a quarter above its corner.
    let edge = 1.0 / 2.0_f64.sqrt();
    let factor = 4.0 / std::f64::consts::PI * edge * edge.atan();
    let expected = [0.1, 0.2, 0.3].map(|sky| 0.5 * sky * (1.0 - factor));
    assert_close("under a roof", actual, expected, 0.01);
    let below = Camera::looking_at([0.02, 0.5, 0.01], [0.0; 3], 0.2);
    let same = mean(&tracer.radiance(&model, &environment, &View { camera: below, ..view }));
    assert_close("the same floor, seen from below the roof", same, expected, 0.01);
}
