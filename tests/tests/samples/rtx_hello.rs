//! The pictures of the `rtx_hello` sample: its ways of tracing agree, its triangles turn, and they look as ever.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use image::RgbaImage;
use lvk::{Context, FeatureRequest, RayQueryRequest};
use lvk_samples::app::headless;
use lvk_samples::app::sample::{FrameTime, Sample};
use lvk_samples::app::sample_error::SampleError;
use lvk_samples::hybrid::RayPath;
use lvk_samples::rtx::RtxConfig;
use lvk_samples::rtx_hello::{Following, RtxHello};
use lvk_tests::child::without_ray_tracing;
use lvk_tests::hybrid::paths;
use lvk_tests::picture::{Tolerance, assert_alike, assert_as_ever, reference};
use lvk_tests::{device, device_with};

/// No multiple of a work group.
const SIZE: [u32; 2] = [158, 89];
const SAME_RAYS: Tolerance = Tolerance { psnr: 55.0, ssim: 0.9999, differing_share: 1e-3, flip: 1e-3 };
/// Frames of a round of the animation.
const ROUND: u32 = 100;

fn hello(ctx: &Context, path: RayPath) -> RtxHello {
    RtxHello::new(ctx, &RtxConfig { path, width: SIZE[0], height: SIZE[1] }).unwrap()
}

fn picture_of(hello: &mut RtxHello, frame: u32) -> RgbaImage {
    hello.update(FrameTime::from_frame(frame, ROUND)).unwrap();
    RgbaImage::from_raw(SIZE[0], SIZE[1], headless::picture(hello).unwrap()).unwrap()
}

#[test]
fn all_paths_follow_the_triangles() {
    let Some(ctx) = device() else { return };
    let software = device_with(|desc| {
        (desc.ray_tracing_pipeline, desc.ray_query) = (FeatureRequest::Off, RayQueryRequest::Software);
    });
    let mut all: Vec<_> = paths(&ctx).into_iter().map(|path| hello(&ctx, path)).collect();
    all.extend(software.as_deref().map(|ctx| hello(ctx, RayPath::Query)));
    for frame in [0, 17, 50] {
        let pictures: Vec<_> = all.iter_mut().map(|hello| picture_of(hello, frame)).collect();
        for other in &pictures[1..] {
            assert_alike(&format!("triangles in frame {frame}"), other, &pictures[0], &SAME_RAYS);
        }
    }
}

/// More frames than refits between two rebuilds.
#[test]
fn a_frame_depends_on_its_moment_alone() {
    let Some(ctx) = device() else { return };
    let mut sequence = hello(&ctx, paths(&ctx)[0]);
    let first = picture_of(&mut sequence, 0);
    for frame in 1..40 {
        assert_ne!(picture_of(&mut sequence, frame), first, "something moves");
    }
    assert_eq!(picture_of(&mut hello(&ctx, paths(&ctx)[0]), 40), picture_of(&mut sequence, 40), "alone");
    assert_eq!(picture_of(&mut sequence, ROUND), first, "a round has no seam");
}

#[test]
fn switches_of_the_panel_hide_triangles_and_choose_the_update() {
    let Some(ctx) = device() else { return };
    let mut sample = hello(&ctx, paths(&ctx)[0]);
    let all = picture_of(&mut sample, 40);
    let without = [0, 1, 2].map(|group| {
        sample.switches().is_seen[group] = false;
        let picture = picture_of(&mut sample, 40);
        sample.switches().is_seen[group] = true;
        picture
    });
    assert!(without.iter().all(|picture| *picture != all), "each hides something");
    assert!(without[0] != without[1] && without[1] != without[2] && without[2] != without[0]);
    for following in [Following::Refits, Following::Rebuilds, Following::Both] {
        sample.switches().following = following;
        assert_eq!(picture_of(&mut sample, 40), all, "{following:?}");
    }
}

#[test]
fn the_triangles_look_as_they_always_did() {
    let Some(ctx) = device() else { return };
    assert_as_ever("rtx_hello_small", &picture_of(&mut hello(&ctx, paths(&ctx)[0]), 0));
}

#[test]
fn a_driver_without_ray_tracing_shows_the_triangles() {
    without_ray_tracing(a_driver_without_ray_tracing_shows_the_triangles, || {
        let Some(ctx) = device_with(|desc| desc.ray_query = RayQueryRequest::Auto) else { return };
        let picture = picture_of(&mut hello(&ctx, RayPath::Query), 0);
        assert_alike("SwiftShader triangles", &picture, &reference("rtx_hello_small"), &SAME_RAYS);
    });
}

#[test]
fn impossible_pictures_are_refused() {
    let Some(ctx) = device() else { return };
    let path = paths(&ctx)[0];
    for (width, height) in [(0, 8), (8, 0), (1 << 30, 8)] {
        let error = RtxHello::new(&ctx, &RtxConfig { path, width, height }).err();
        assert!(matches!(error, Some(SampleError::BadSize { .. })), "{error:?}");
    }
}
