//! Animations that the GPU plays, against poses of the CPU.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use glam::Vec3;
use lvk::Context;
use lvk_gltf::{Animation, Channel, ChannelPath, Interpolation, Keyframes, Model};
use lvk_samples::app::headless;
use lvk_samples::app::sample::{FrameTime, Sample as _};
use lvk_samples::hybrid::RayPath;
use lvk_samples::scene::Camera;
use lvk_tests::device;
use lvk_tests::rtx_sample::{contexts_and_paths, software_device};
use lvk_viewer::light::{Environment, SunSetting};
use lvk_viewer::model::posed;
use lvk_viewer::{Content, LightRate, Method, Viewer, ViewerConfig};

use crate::moving_model::{DURATION, moving_model};
use crate::paths::assert_alike;
use crate::scenes::{Builder, View, colored, viewer};

fn view(samples: u32) -> View {
    View { camera: Camera::looking_at([0.4, 1.4, 4.2], [-0.1, 0.7, 0.0], 40.0), size: [60, 40], samples }
}

fn shown(ctx: &Context, by: (Method, RayPath), model: &Model, samples: u32) -> Viewer {
    viewer(ctx, by, model, &Environment::day(&SunSetting::default()), &view(samples))
}

/// Frame times of 10 a second.
fn tenths(frame: u32) -> FrameTime {
    FrameTime { frame, frames_per_round: 1000, frames_per_second: 10 }
}

/// The vertices of the tube at a time, as the CPU has them.
fn tube_positions(model: &Model, seconds: f32) -> Vec<Vec3> {
    let pose = model.pose(Some(0), seconds);
    let tube = model.nodes.iter().position(|node| node.skin.is_some()).unwrap();
    let primitive = &model.meshes[model.nodes[tube].mesh.unwrap()].primitives[0];
    let count = primitive.vertex_count();
    (0..count).map(|vertex| primitive.position_at(vertex, &pose.weights[tube], &pose.joints[0])).collect()
}

#[test]
fn vertices_are_where_the_cpu_has_them() {
    let Some(ctx) = software_device() else { return };
    let model = moving_model();
    let mut viewer = shown(&ctx, (Method::Hybrid, RayPath::Query), &model, 1);
    viewer.play(Some(0), 0.0);
    for frame in [0, 3, 10, 17, 20] {
        viewer.update(tenths(frame));
        headless::picture(&mut viewer).unwrap();
        let moved = viewer.moved_positions().unwrap();
        let expected = tube_positions(&model, 0.1 * frame as f32);
        assert_eq!((moved.len(), moved[0].len()), (1, expected.len()));
        let extent = expected.iter().map(|position| position.length()).fold(0.0, f32::max);
        let pairs = moved[0].iter().zip(&expected);
        let error = pairs.map(|(moved, expected)| Vec3::from(*moved).distance(*expected)).fold(0.0, f32::max);
        assert!(error < 1e-5 * extent, "frame {frame}: {error} of {extent}");
    }
}

#[test]
fn pictures_are_those_of_scenes_that_the_cpu_has_posed() {
    let Some(ctx) = device() else { return };
    let software = software_device();
    let model = moving_model();
    let seconds = 0.7 * DURATION;
    let still = posed(model.clone(), Some(0), seconds);
    for method in [Method::PathTrace, Method::Hybrid] {
        for (ctx, path) in contexts_and_paths(&ctx, software.as_deref()) {
            let mut expected = shown(ctx, (method, path), &still, 4);
            headless::picture(&mut expected).unwrap();
            // The structures are built for another time, and come to this one by refits.
            let mut played = shown(ctx, (method, path), &model, 4);
            played.play(Some(0), seconds - 0.5);
            let camera = view(4).camera;
            for frame in [0, 3, 5] {
                played.update(tenths(frame));
                played.set_view(&camera);
                headless::picture(&mut played).unwrap();
            }
            assert_alike(
                &format!("{method:?} by {path:?}"),
                &expected.radiance().unwrap(),
                &played.radiance().unwrap(),
            );
        }
    }
}

#[test]
fn a_structure_is_refitted_in_each_frame_that_moves_and_never_built_anew() {
    let Some(ctx) = software_device() else { return };
    let mut viewer = shown(&ctx, (Method::Hybrid, RayPath::Query), &moving_model(), 1);
    let refits = || {
        let structures = ctx.accel_memory().structures;
        structures.iter().map(|structure| structure.refits).filter(|refits| *refits > 0).collect::<Vec<_>>()
    };
    assert_eq!(refits(), [0; 0]);
    viewer.play(Some(0), 0.0);
    for frame in [0, 1, 2, 3, 3, 3, 4] {
        viewer.update(tenths(frame));
        headless::picture(&mut viewer).unwrap();
    }
    assert_eq!(refits(), [5], "one structure, of five poses");
}

/// The eye stands still, and things move and turn, with their shadows: the picture is as of a still of the same instant, not of a few frames
/// before.
#[test]
fn moving_things_leave_no_trail_under_a_still_eye() {
    let Some(ctx) = software_device() else { return };
    let model = moving_model();
    let view = |samples| View { size: [120, 80], ..view(samples) };
    let shown = |model: &Model, samples| {
        let environment = Environment::day(&SunSetting::default());
        viewer(&ctx, (Method::Hybrid, RayPath::Query), model, &environment, &view(samples))
    };
    let time = |frame| FrameTime { frame, frames_per_round: 1000, frames_per_second: 30 };
    let still = |frame| {
        let still = posed(model.clone(), Some(0), time(frame).seconds() as f32);
        headless::picture(&mut shown(&still, 64)).unwrap()
    };
    let (now, before) = (still(23), still(17));
    let difference =
        |a: &[u8], b: &[u8]| a.iter().zip(b).map(|(a, b)| u32::from(a.abs_diff(*b))).sum::<u32>();
    for light_rate in [LightRate::Full, LightRate::Quarter] {
        let mut played = shown(&model, 1);
        played.configure(&ViewerConfig { is_progressive: true, light_rate, ..*played.config() }).unwrap();
        played.play(Some(0), 0.0);
        let mut last = Vec::new();
        for frame in 0..24 {
            played.update(time(frame));
            played.set_view(&view(1).camera);
            last = headless::picture(&mut played).unwrap();
        }
        let (mut change, mut trail) = (0, 0);
        for ((last, now), before) in last.chunks(4).zip(now.chunks(4)).zip(before.chunks(4)) {
            if difference(now, before) > 60 {
                change += difference(now, before);
                trail += difference(last, now);
            }
        }
        let share = f64::from(trail) / f64::from(change);
        eprintln!(
            "{light_rate:?}: {share:.3} of a change of {change}; whole picture {:.3}",
            f64::from(difference(&last, &now)) / now.len() as f64
        );
        assert!(change > 20_000, "{change}");
        assert!(share < 0.33, "{light_rate:?}: {share} of the change is not there yet");
    }
}

/// A wall that flies to the right, by its node or by the joint of its skin.
fn flying_wall(is_skinned: bool, speed: f32) -> Model {
    let white = colored([0.8; 3], 0.0, 1.0);
    let builder = Builder::default().quad(Vec3::new(-4.0, -4.0, 0.0), Vec3::X * 8.0, Vec3::Y * 8.0, white);
    let mut model = builder.model();
    let mut mover = 0;
    if is_skinned {
        let primitive = &mut model.meshes[0].primitives[0];
        primitive.joints = vec![vec![[0; 4]; 4]];
        primitive.weights = vec![vec![[1.0, 0.0, 0.0, 0.0]; 4]];
        mover = model.nodes.len();
        model.nodes.push(lvk_gltf::Node::default());
        model.scenes[0].roots.push(mover);
        model.nodes[0].skin = Some(0);
        model.skins.push(lvk_gltf::Skin {
            joints: vec![mover],
            inverse_bind_matrices: vec![glam::Mat4::IDENTITY],
            ..lvk_gltf::Skin::default()
        });
    }
    model.animations.push(Animation {
        channels: vec![Channel { node: mover, path: ChannelPath::Translation, keyframes: 0 }],
        keyframes: vec![Keyframes {
            interpolation: Interpolation::Linear,
            times: vec![0.0, 10.0],
            components: 3,
            values: vec![0.0, 0.0, 0.0, 10.0 * speed, 5.0 * speed, 0.0],
        }],
        name: None,
    });
    model
}

#[test]
fn motion_vectors_are_those_of_a_wall_that_flies_across() {
    let Some(ctx) = software_device() else { return };
    let (distance, fov, speed) = (5.0, 40.0_f32, 1.0);
    let camera = Camera::looking_at([0.0, 0.0, distance], [0.0; 3], fov);
    let view = View { camera, size: [60, 40], samples: 1 };
    // Pixels for each unit at the distance of the wall.
    let pixels = 0.5 * 40.0 / ((0.5 * fov).to_radians().tan() * distance);
    for is_skinned in [false, true] {
        let model = flying_wall(is_skinned, speed);
        let mut viewer =
            viewer(&ctx, (Method::Hybrid, RayPath::Query), &model, &Environment::uniform([1.0; 3]), &view);
        let config = ViewerConfig { is_progressive: true, content: Content::Motion, ..*viewer.config() };
        viewer.configure(&config).unwrap();
        viewer.play(Some(0), 0.0);
        // The last frame stands still.
        for (frame, moved) in [(0, 0.0), (1, 0.1), (3, 0.2), (3, 0.0)] {
            viewer.update(tenths(frame));
            viewer.set_view(&camera);
            headless::picture(&mut viewer).unwrap();
            let [x, y, _] = viewer.radiance().unwrap()[20 * 60 + 30].map(|channel| (channel - 0.5) / 0.05);
            let expected = [pixels * speed * moved, -0.5 * pixels * speed * moved];
            let error = (x - expected[0]).abs().max((y - expected[1]).abs());
            assert!(error < 2e-3, "skinned: {is_skinned}, frame {frame}: {x}, {y} instead of {expected:?}");
        }
    }
}
