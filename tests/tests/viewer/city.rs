//! The city: culled or not, with all of its textures or those that a budget leaves, and on a device with the limits of a phone, it is the
//! same picture.
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
use lvk_viewer::{CullingMode, Method, Viewer, ViewerConfig, ViewerScene};

use crate::moving_model::{DURATION, moving_model};
use crate::occlusion::frame;
use crate::paths::assert_alike;
use crate::scenes::{View, viewer};

/// Triangles of a structure on the phone of these tests.
const PHONE_TRIANGLES: u64 = 2_000;

pub fn tiny_city(blocks: u32, kinds: u32) -> Model {
    let city = city(&CityConfig { blocks, kinds, seed: 3, texture_size: 64 }).unwrap();
    Model::from_bytes(&city.glb, None, &LoadOptions::default()).unwrap()
}

fn environment() -> Environment {
    Environment::day(&SunSetting::default())
}

fn hybrid(ctx: &Context, path: RayPath, model: &Model, view: &View) -> Viewer {
    viewer(ctx, (Method::Hybrid, path), model, &environment(), view)
}

#[test]
fn a_camera_that_moves_through_the_city_sees_the_same_with_culling() {
    let Some(ctx) = device() else { return };
    let model = tiny_city(2, 5);
    let start = Camera::looking_at([4.6, 1.75, 60.0], [-9.0, 10.0, -20.0], 57.0);
    let view = View { camera: start, size: [72, 40], samples: 1 };
    let [mut culled, mut occluded, mut whole] = [0; 3].map(|_| {
        let mut viewer = hybrid(&ctx, RayPath::Query, &model, &view);
        viewer.configure(&ViewerConfig { is_progressive: true, ..*viewer.config() }).unwrap();
        viewer
    });
    let all = culled.counts().1;
    let (mut fewest, mut visible) = (all, 0);
    for step in 0..8_u8 {
        // Forward while it turns once around, up and down.
        let turn = Quat::from_rotation_y(std::f32::consts::TAU * f32::from(step) / 8.0);
        let eye = Vec3::from(start.eye) - Vec3::Z * 6.0 * f32::from(step);
        let ahead = turn * (Vec3::from(start.target) - Vec3::from(start.eye));
        let target = eye + Vec3::new(ahead.x, ahead.y * (3.0 - f32::from(step)), ahead.z);
        let camera = Camera { eye: eye.to_array(), target: target.to_array(), ..start };
        let shown = |viewer: &mut Viewer, mode| {
            viewer.set_view(&camera);
            frame(viewer, mode)
        };
        let (expected, none) = shown(&mut whole, CullingMode::None);
        let (picture, by_frustum) = shown(&mut culled, CullingMode::Frustum);
        assert!(picture == expected, "step {step}");
        let (picture, by_occlusion) = shown(&mut occluded, CullingMode::Occlusion);
        assert!(picture == expected, "step {step} with occlusion");
        let (by_frustum, by_occlusion) = (by_frustum.unwrap(), by_occlusion.unwrap());
        eprintln!("step {step}: {by_frustum:?}, {by_occlusion:?}");
        assert_eq!(none, None);
        assert_eq!(by_frustum.count, by_frustum.in_frustum);
        assert_eq!(by_frustum.in_frustum, by_occlusion.in_frustum);
        fewest = fewest.min(by_frustum.count);
        visible += by_occlusion.count;
    }
    assert!(0 < fewest && 2 * fewest < all, "{fewest} of {all} instances are drawn");
    assert!(visible < 4 * all, "{visible} instances are drawn in eight frames");
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
        assert_eq!(frame(&mut viewer, CullingMode::Frustum).1.unwrap().count, expected);
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
            let (whole, _) = frame(&mut viewer, CullingMode::None);
            for mode in [CullingMode::Frustum, CullingMode::Occlusion] {
                assert!(frame(&mut viewer, mode).0 == whole, "{mode:?} from {eye:?} at step {step}");
            }
        }
    }
}

#[test]
fn a_street_needs_few_levels_of_the_citys_textures() {
    let Some(ctx) = device() else { return };
    let config = CityConfig { blocks: 1, kinds: 2, seed: 3, texture_size: 256 };
    let city = city(&config).unwrap();
    let picture = |texture_budget: Option<u64>| {
        let model = Model::from_bytes(&city.glb, None, &LoadOptions::default()).unwrap();
        let scene =
            ViewerScene { name: "city".to_owned(), model, environment: environment(), disc_radius: 0.01 };
        let usual = ViewerConfig::new(RayPath::Query, 64, 36);
        let config = ViewerConfig { samples: 2, bounces: 4, texture_budget, ..usual };
        let mut viewer = Viewer::new(&ctx, scene, &config).unwrap();
        viewer.set_view(&Camera::looking_at([44.0, 1.75, 70.0], [20.0, 12.0, 0.0], 57.0));
        headless::picture(&mut viewer).unwrap();
        (viewer.radiance().unwrap(), viewer.texture_memory())
    };
    // With its smaller levels a texture has four thirds of the texels of its largest one, and each has four bytes.
    let whole = city.texture_count as u64 * 4 * 4 * u64::from(config.texture_size).pow(2) / 3;
    let (expected, _) = picture(None);
    let (found, memory) = picture(Some(whole / 4));
    let memory = memory.unwrap();
    assert!(found == expected, "{memory:?} of {whole}");
    assert!(memory.coarse_count == 0 && memory.resident <= whole / 4, "{memory:?} of {whole}");
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
