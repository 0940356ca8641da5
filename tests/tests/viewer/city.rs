//! The city: culled or not, and on a device with the limits of a phone, it is the same picture.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use glam::{Quat, Vec3};
use lvk::{Context, DeviceProfile, RayQueryPath, RayQueryRequest, RayTracingPipelineRequest};
use lvk_gltf::{LoadOptions, Model};
use lvk_samples::app::headless;
use lvk_samples::app::sample::Sample as _;
use lvk_samples::hybrid::RayPath;
use lvk_samples::scene::Camera;
use lvk_tests::hybrid::paths;
use lvk_tests::{device, device_with};
use lvk_viewer::city::{CityConfig, city};
use lvk_viewer::light::{Environment, SunSetting};
use lvk_viewer::{Method, Viewer, ViewerConfig};

use crate::moving_model::{DURATION, moving_model};
use crate::paths::assert_alike;
use crate::scenes::{View, viewer};

/// Triangles of a structure on the phone of these tests.
const PHONE_TRIANGLES: u64 = 2_000;

fn tiny_city(blocks: u32, kinds: u32) -> Model {
    let city = city(&CityConfig { blocks, kinds, seed: 3 }).unwrap();
    Model::from_bytes(&city.glb, None, &LoadOptions::default()).unwrap()
}

fn environment() -> Environment {
    Environment::day(&SunSetting::default())
}

fn hybrid(ctx: &Context, path: RayPath, model: &Model, view: &View) -> Viewer {
    viewer(ctx, (Method::Hybrid, path), model, &environment(), view)
}

/// The radiance of a frame, bit by bit, and the number of instances that were rasterised.
fn frame(viewer: &mut Viewer, culls: bool) -> (Vec<[u32; 3]>, Option<u32>) {
    viewer.configure(&ViewerConfig { culls, ..*viewer.config() }).unwrap();
    headless::picture(viewer).unwrap();
    let bits = viewer.radiance().unwrap().iter().map(|pixel| pixel.map(f32::to_bits)).collect();
    (bits, viewer.drawn_instances().unwrap())
}

#[test]
fn a_camera_that_moves_through_the_city_sees_the_same_with_culling() {
    let Some(ctx) = device() else { return };
    let model = tiny_city(2, 5);
    let start = Camera::looking_at([4.6, 1.75, 60.0], [-9.0, 10.0, -20.0], 57.0);
    let view = View { camera: start, size: [72, 40], samples: 1 };
    let [mut culled, mut whole] = [0, 1].map(|_| {
        let mut viewer = hybrid(&ctx, RayPath::Query, &model, &view);
        viewer.configure(&ViewerConfig { is_progressive: true, ..*viewer.config() }).unwrap();
        viewer
    });
    let all = culled.counts().1;
    let mut fewest = all;
    for step in 0..8_u8 {
        // Forward while it turns once around, up and down.
        let turn = Quat::from_rotation_y(std::f32::consts::TAU * f32::from(step) / 8.0);
        let eye = Vec3::from(start.eye) - Vec3::Z * 6.0 * f32::from(step);
        let ahead = turn * (Vec3::from(start.target) - Vec3::from(start.eye));
        let target = eye + Vec3::new(ahead.x, ahead.y * (3.0 - f32::from(step)), ahead.z);
        let camera = Camera { eye: eye.to_array(), target: target.to_array(), ..start };
        culled.set_view(&camera);
        whole.set_view(&camera);
        let ((picture, drawn), (expected, none)) = (frame(&mut culled, true), frame(&mut whole, false));
        assert!(picture == expected, "step {step}");
        assert_eq!(none, None);
        fewest = fewest.min(drawn.unwrap());
    }
    eprintln!("{fewest} of {all} instances");
    assert!(0 < fewest && 2 * fewest < all, "{fewest} of {all} instances are drawn");
}

#[test]
fn nothing_is_drawn_of_what_lies_behind_and_all_of_what_lies_ahead() {
    let Some(ctx) = device() else { return };
    let model = tiny_city(2, 2);
    let far = Camera::looking_at([0.0, 60.0, 1300.0], [0.0, 20.0, 0.0], 40.0);
    let view = View { camera: far, size: [48, 32], samples: 1 };
    let mut viewer = hybrid(&ctx, RayPath::Query, &model, &view);
    // The ground reaches behind the camera.
    for (target, expected) in [([0.0, 20.0, 0.0], viewer.counts().1), ([0.0, 60.0, 2100.0], 1)] {
        viewer.set_view(&Camera { target, ..far });
        assert_eq!(frame(&mut viewer, true).1, Some(expected));
    }
}

#[test]
fn meshes_that_deform_and_nodes_that_move_look_the_same_with_culling() {
    let Some(ctx) = device() else { return };
    let model = moving_model();
    for (eye, target) in [
        ([1.5, 1.7, 4.5], [-0.2, 0.5, 0.0]),
        ([0.2, 0.6, 0.9], [1.4, 0.6, 0.1]),
        ([-1.1, 1.7, 0.2], [-1.5, 1.6, -0.4]),
    ] {
        let view = View { camera: Camera::looking_at(eye, target, 35.0), size: [64, 48], samples: 2 };
        let mut viewer = hybrid(&ctx, RayPath::Query, &model, &view);
        for step in 0..4_u8 {
            viewer.play(Some(0), DURATION * f32::from(step) / 4.0);
            viewer.set_view(&view.camera);
            let ((culled, _), (whole, _)) = (frame(&mut viewer, true), frame(&mut viewer, false));
            assert!(culled == whole, "from {eye:?} at step {step}");
        }
    }
}

#[test]
fn a_phone_splits_its_structures_and_shows_the_same() {
    let Some(whole) = device() else { return };
    let model = tiny_city(1, 2);
    let camera = Camera::looking_at([44.0, 1.75, 70.0], [20.0, 12.0, 0.0], 57.0);
    let view = View { camera, size: [48, 27], samples: 1 };
    let picture = |ctx: &Context, path| {
        let mut viewer = hybrid(ctx, path, &model, &view);
        headless::picture(&mut viewer).unwrap();
        let parts = ctx.accel_memory().structures.iter().map(|structure| structure.parts).max();
        (viewer.radiance().unwrap(), parts.unwrap())
    };
    let (expected, whole_parts) = picture(&whole, RayPath::Query);
    let phone = DeviceProfile { max_blas_primitives: PHONE_TRIANGLES, ..DeviceProfile::mali_g715() };
    let hardware = device_with(|desc| desc.profile = Some(&phone));
    let software = device_with(|desc| {
        desc.profile = Some(&phone);
        (desc.ray_tracing_pipeline, desc.ray_query) =
            (RayTracingPipelineRequest::Off, RayQueryRequest::Software);
    });
    for ctx in hardware.iter().chain(&software) {
        for path in paths(ctx) {
            let (alike, parts) = picture(ctx, path);
            let is_split = ctx.capabilities().ray_query_path == RayQueryPath::Hardware;
            assert_eq!((whole_parts, parts > 1), (1, is_split), "{parts} parts by {path:?}");
            assert_alike(&format!("a phone by {path:?}"), &expected, &alike);
        }
    }
}
