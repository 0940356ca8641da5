//! Images of the `rtx_hello` sample: its paths agree, its triangles turn, and they equal the reference.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk::Context;
use lvk_samples::hybrid::RayPath;
use lvk_samples::rtx::RtxConfig;
use lvk_samples::rtx_hello::{RtxHello, TlasUpdate};
use lvk_tests::device;
use lvk_tests::hybrid::paths;
use lvk_tests::image_comparison::{Tolerance, assert_matches_reference, assert_swiftshader_matches};
use lvk_tests::raster_sample::ROUND;
use lvk_tests::rtx_sample::{SIZE, assert_paths_agree, assert_refuses_impossible_sizes, image_of};

const SAME_RAYS: Tolerance = Tolerance { psnr: 55.0, ssim: 0.9999, differing_share: 1e-3, flip: 1e-3 };

fn hello(ctx: &Context, path: RayPath) -> RtxHello {
    RtxHello::new(ctx, &RtxConfig { path, width: SIZE[0], height: SIZE[1] }).unwrap()
}

#[test]
fn all_paths_follow_the_triangles() {
    let Some(ctx) = device() else { return };
    assert_paths_agree("triangles", &ctx, &[0, 17, 50], &SAME_RAYS, hello);
}

/// More frames than refits between two rebuilds.
#[test]
fn a_frame_depends_on_its_time_alone() {
    let Some(ctx) = device() else { return };
    let mut sequence = hello(&ctx, paths(&ctx)[0]);
    let first = image_of(&mut sequence, 0);
    for frame in 1..40 {
        assert_ne!(image_of(&mut sequence, frame), first, "something moves");
    }
    assert_eq!(image_of(&mut hello(&ctx, paths(&ctx)[0]), 40), image_of(&mut sequence, 40), "alone");
    assert_eq!(image_of(&mut sequence, ROUND), first, "a round has no seam");
}

#[test]
fn settings_of_the_panel_hide_triangles_and_choose_the_update() {
    let Some(ctx) = device() else { return };
    let mut sample = hello(&ctx, paths(&ctx)[0]);
    let all = image_of(&mut sample, 40);
    let without = [0, 1, 2].map(|group| {
        sample.settings().is_seen[group] = false;
        let image = image_of(&mut sample, 40);
        sample.settings().is_seen[group] = true;
        image
    });
    assert!(without.iter().all(|image| *image != all), "each hides something");
    assert!(without[0] != without[1] && without[1] != without[2] && without[2] != without[0]);
    for following in [TlasUpdate::Refits, TlasUpdate::Rebuilds, TlasUpdate::Both] {
        sample.settings().following = following;
        assert_eq!(image_of(&mut sample, 40), all, "{following:?}");
    }
}

#[test]
fn the_triangles_look_as_they_always_did() {
    let Some(ctx) = device() else { return };
    assert_matches_reference("rtx_hello_small", &image_of(&mut hello(&ctx, paths(&ctx)[0]), 0));
}

#[test]
fn a_driver_without_ray_tracing_renders_the_triangles() {
    assert_swiftshader_matches(
        a_driver_without_ray_tracing_renders_the_triangles,
        "rtx_hello_small",
        &SAME_RAYS,
        |ctx| image_of(&mut hello(ctx, RayPath::Query), 0),
    );
}

#[test]
fn impossible_images_are_refused() {
    let Some(ctx) = device() else { return };
    assert_refuses_impossible_sizes(&ctx, |rtx| RtxHello::new(&ctx, rtx).err());
}
