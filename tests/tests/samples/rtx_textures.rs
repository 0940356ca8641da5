//! Images of the `rtx_textures` sample: its paths agree, its instances move, and they equal the reference.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk::Context;
use lvk_samples::hybrid::RayPath;
use lvk_samples::rtx::RtxConfig;
use lvk_samples::rtx_textures::{RtxTextures, RtxTexturesSettings};
use lvk_tests::device;
use lvk_tests::hybrid::paths;
use lvk_tests::image_comparison::{Tolerance, assert_matches_reference, assert_swiftshader_matches};
use lvk_tests::raster_sample::ROUND;
use lvk_tests::rtx_sample::{SIZE, assert_paths_agree, assert_refuses_impossible_sizes, image_of};

const SAME_RAYS: Tolerance = Tolerance { psnr: 55.0, ssim: 0.9999, differing_share: 1e-3, flip: 1e-3 };
/// Tolerance on SwiftShader, which filters textures with fewer bits.
const OTHER_FILTERS: Tolerance = Tolerance { psnr: 42.0, ssim: 0.998, differing_share: 0.35, flip: 0.05 };

fn waves(ctx: &Context, path: RayPath) -> RtxTextures {
    RtxTextures::new(ctx, &RtxConfig { path, width: SIZE[0], height: SIZE[1] }).unwrap()
}

#[test]
fn all_paths_render_the_waves() {
    let Some(ctx) = device() else { return };
    assert_paths_agree("waves", &ctx, &[0, 30], &SAME_RAYS, waves);
}

#[test]
fn a_frame_depends_on_its_time_alone() {
    let Some(ctx) = device() else { return };
    let mut sequence = waves(&ctx, paths(&ctx)[0]);
    let first = image_of(&mut sequence, 0);
    for frame in 1..4 {
        assert_ne!(image_of(&mut sequence, frame), first, "something moves");
    }
    assert_eq!(image_of(&mut waves(&ctx, paths(&ctx)[0]), 40), image_of(&mut sequence, 40), "alone");
    assert_eq!(image_of(&mut sequence, ROUND), first, "a round has no seam");
}

#[test]
fn settings_of_the_panel_change_the_image_and_back() {
    let Some(ctx) = device() else { return };
    let mut sample = waves(&ctx, paths(&ctx)[0]);
    let (first, all) = (image_of(&mut sample, 0), *sample.settings());
    assert_eq!(all.instances, sample.instance_count());
    for other in [
        RtxTexturesSettings { instances: 1, ..all },
        RtxTexturesSettings { handed_on: 1, ..all },
        RtxTexturesSettings { is_filtered: false, ..all },
    ] {
        *sample.settings() = other;
        assert_ne!(image_of(&mut sample, 0), first, "{other:?}");
    }
    // As many as there are textures hand each one back, and what is beyond the range is the nearest in it.
    let texture_count = sample.texture_count() as u32;
    *sample.settings() = RtxTexturesSettings { instances: u32::MAX, handed_on: texture_count, ..all };
    assert_eq!(image_of(&mut sample, 0), first);
    sample.settings().instances = 1;
    let ground = image_of(&mut sample, 0);
    sample.settings().instances = 0;
    assert_eq!(image_of(&mut sample, 0), ground);
}

#[test]
fn the_waves_look_as_they_always_did() {
    let Some(ctx) = device() else { return };
    assert_matches_reference("rtx_textures_small", &image_of(&mut waves(&ctx, paths(&ctx)[0]), 0));
}

#[test]
#[ignore = "a minute, of the check swiftshader of .ci/slow"]
fn a_driver_without_ray_tracing_renders_the_waves() {
    assert_swiftshader_matches(
        a_driver_without_ray_tracing_renders_the_waves,
        "rtx_textures_small",
        &OTHER_FILTERS,
        |ctx| image_of(&mut waves(ctx, RayPath::Query), 0),
    );
}

#[test]
fn impossible_images_are_refused() {
    let Some(ctx) = device() else { return };
    assert_refuses_impossible_sizes(&ctx, |rtx| RtxTextures::new(&ctx, rtx).err());
}
