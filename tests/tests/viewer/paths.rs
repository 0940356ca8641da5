//! The same picture by each path of ray tracing, and by any number of launches.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk_samples::app::headless;
use lvk_samples::hybrid::RayPath;
use lvk_samples::scene::Camera;
use lvk_tests::device;
use lvk_tests::rtx_sample::{contexts_and_paths, software_device};
use lvk_viewer::light::{Environment, SunSetting};
use lvk_viewer::{LightRate, Method, ViewerConfig};

use crate::scenes::{View, assert_close, config, configured_viewer, mean, radiance, viewer};
use crate::still_life::still_life;

#[test]
fn all_paths_trace_the_same_light() {
    let Some(ctx) = device() else { return };
    let software = software_device();
    let camera = Camera::looking_at([1.5, 1.7, 4.5], [-0.2, 0.5, 0.0], 40.0);
    let view = View { camera, size: [60, 40], samples: 4 };
    let environment = Environment::day(&SunSetting::default());
    let model = still_life();
    for (method, light_rate) in [
        (Method::PathTrace, LightRate::Full),
        (Method::Hybrid, LightRate::Full),
        (Method::Hybrid, LightRate::Quarter),
    ] {
        let all: Vec<_> = contexts_and_paths(&ctx, software.as_deref())
            .into_iter()
            .map(|(ctx, path)| {
                let config = ViewerConfig { light_rate, ..config((method, path), &view) };
                let mut viewer = configured_viewer(ctx, &config, &model, &environment, &view);
                headless::picture(&mut viewer).unwrap();
                (path, viewer.radiance().unwrap())
            })
            .collect();
        let (_, first) = &all[0];
        for (path, other) in &all[1..] {
            assert_alike(&format!("{method:?} by {path:?}, {light_rate:?}"), first, other);
        }
    }
}

/// The path tracer draws the same numbers by either path, and lavapipe traverses for both by the same code.
#[test]
fn pipelines_and_queries_of_a_cpu_have_the_same_light_to_the_bit() {
    let Some(ctx) = device() else { return };
    if !ctx.capabilities().is_cpu {
        eprintln!("not checked: GPUs may traverse for pipelines and for queries in different ways");
        return;
    }
    let camera = Camera::looking_at([1.5, 1.7, 4.5], [-0.2, 0.5, 0.0], 40.0);
    let view = View { camera, size: [60, 40], samples: 16 };
    let (environment, model) = (Environment::day(&SunSetting::default()), still_life());
    let [pipeline, query] =
        [RayPath::Pipeline, RayPath::Query].map(|path| radiance(&ctx, path, &model, &environment, &view));
    let differing =
        pipeline.iter().zip(&query).filter(|(a, b)| a.map(f32::to_bits) != b.map(f32::to_bits)).count();
    assert_eq!(differing, 0, "of {} pixels", pipeline.len());
}

/// Paths are chaotic: the last bit of a distance may send one to the other side of an edge, and the filter of the hybrid method
/// spreads what differs. So few pixels may differ.
pub fn assert_alike(what: &str, first: &[[f32; 3]], other: &[[f32; 3]]) {
    let differs = |a: &[f32; 3], b: &[f32; 3]| {
        a.iter().zip(b).any(|(a, b)| (a - b).abs() > 0.02 * a.abs().max(b.abs()).max(0.1))
    };
    let count = first.iter().zip(other).filter(|(a, b)| differs(a, b)).count();
    eprintln!("{what}: {count} of {} pixels differ", first.len());
    assert!(count * 20 < first.len(), "{what}: {count} pixels differ");
    assert_close(what, mean(other), mean(first), 0.02);
}

#[test]
fn samples_have_as_many_rays_and_as_much_light_whether_they_are_alone_or_follow_others() {
    let Some(ctx) = device() else { return };
    let camera = Camera::looking_at([1.5, 1.7, 4.5], [-0.2, 0.5, 0.0], 40.0);
    let environment = Environment::day(&SunSetting::default());
    let model = still_life();
    let view = View { camera, size: [60, 40], samples: 1 };
    let mut viewer = viewer(&ctx, (Method::PathTrace, RayPath::Query), &model, &environment, &view);
    // More surfaces take more launches for each sample, which hand each other lists of the paths that go on.
    for bounces in [1, 2, 3, 4, 6, 9, 13] {
        let [alone, many] = [1, 16].map(|samples| {
            viewer.configure(&ViewerConfig { bounces, samples, ..*viewer.config() }).unwrap();
            headless::picture(&mut viewer).unwrap();
            let rays = viewer.ray_count().unwrap().unwrap() as f64 / f64::from(samples);
            (rays, mean(&viewer.radiance().unwrap()))
        });
        eprintln!("{bounces} surfaces: {} and {} rays a sample", alone.0, many.0);
        assert!((alone.0 / many.0 - 1.0).abs() < 0.03, "{bounces} surfaces: {alone:?} and {many:?}");
        assert_close(&format!("{bounces} surfaces"), alone.1, many.1, 0.1);
    }
}
