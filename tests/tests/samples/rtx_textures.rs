//! The pictures of the `rtx_textures` sample: its ways of tracing agree, its instances move, and they look as ever.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use image::RgbaImage;
use lvk::{Context, FeatureRequest, RayQueryRequest};
use lvk_samples::app::headless;
use lvk_samples::app::sample::{FrameTime, Sample};
use lvk_samples::app::sample_error::SampleError;
use lvk_samples::hybrid::RayPath;
use lvk_samples::rtx::RtxConfig;
use lvk_samples::rtx_textures::{RtxTextures, RtxTexturesSwitches};
use lvk_tests::child::without_ray_tracing;
use lvk_tests::hybrid::paths;
use lvk_tests::picture::{Tolerance, assert_alike, assert_as_ever, reference};
use lvk_tests::{device, device_with};

/// No multiple of a work group.
const SIZE: [u32; 2] = [158, 89];
const SAME_RAYS: Tolerance = Tolerance { psnr: 55.0, ssim: 0.9999, differing_share: 1e-3, flip: 1e-3 };
/// On SwiftShader: its textures are filtered with fewer bits.
const OTHER_FILTERS: Tolerance = Tolerance { psnr: 42.0, ssim: 0.998, differing_share: 0.35, flip: 0.05 };
/// Frames of a round of the animation.
const ROUND: u32 = 100;

fn waves(ctx: &Context, path: RayPath) -> RtxTextures {
    RtxTextures::new(ctx, &RtxConfig { path, width: SIZE[0], height: SIZE[1] }).unwrap()
}

fn picture_of(waves: &mut RtxTextures, frame: u32) -> RgbaImage {
    waves.update(FrameTime::from_frame(frame, ROUND)).unwrap();
    RgbaImage::from_raw(SIZE[0], SIZE[1], headless::picture(waves).unwrap()).unwrap()
}

#[test]
fn all_paths_show_the_waves() {
    let Some(ctx) = device() else { return };
    let software = device_with(|desc| {
        (desc.ray_tracing_pipeline, desc.ray_query) = (FeatureRequest::Off, RayQueryRequest::Software);
    });
    let mut all: Vec<_> = paths(&ctx).into_iter().map(|path| waves(&ctx, path)).collect();
    all.extend(software.as_deref().map(|ctx| waves(ctx, RayPath::Query)));
    for frame in [0, 30] {
        let pictures: Vec<_> = all.iter_mut().map(|waves| picture_of(waves, frame)).collect();
        for other in &pictures[1..] {
            assert_alike(&format!("waves in frame {frame}"), other, &pictures[0], &SAME_RAYS);
        }
    }
}

#[test]
fn a_frame_depends_on_its_moment_alone() {
    let Some(ctx) = device() else { return };
    let mut sequence = waves(&ctx, paths(&ctx)[0]);
    let first = picture_of(&mut sequence, 0);
    for frame in 1..4 {
        assert_ne!(picture_of(&mut sequence, frame), first, "something moves");
    }
    assert_eq!(picture_of(&mut waves(&ctx, paths(&ctx)[0]), 40), picture_of(&mut sequence, 40), "alone");
    assert_eq!(picture_of(&mut sequence, ROUND), first, "a round has no seam");
}

#[test]
fn switches_of_the_panel_change_the_picture_and_back() {
    let Some(ctx) = device() else { return };
    let mut sample = waves(&ctx, paths(&ctx)[0]);
    let (first, all) = (picture_of(&mut sample, 0), *sample.switches());
    assert_eq!(all.instances, sample.instance_count());
    for other in [
        RtxTexturesSwitches { instances: 1, ..all },
        RtxTexturesSwitches { handed_on: 1, ..all },
        RtxTexturesSwitches { is_filtered: false, ..all },
    ] {
        *sample.switches() = other;
        assert_ne!(picture_of(&mut sample, 0), first, "{other:?}");
    }
    // As many as there are textures hand each one back, and what is beyond the range is the nearest in it.
    let texture_count = sample.texture_count() as u32;
    *sample.switches() = RtxTexturesSwitches { instances: u32::MAX, handed_on: texture_count, ..all };
    assert_eq!(picture_of(&mut sample, 0), first);
    sample.switches().instances = 1;
    let ground = picture_of(&mut sample, 0);
    sample.switches().instances = 0;
    assert_eq!(picture_of(&mut sample, 0), ground);
}

#[test]
fn the_waves_look_as_they_always_did() {
    let Some(ctx) = device() else { return };
    assert_as_ever("rtx_textures_small", &picture_of(&mut waves(&ctx, paths(&ctx)[0]), 0));
}

#[test]
fn a_driver_without_ray_tracing_shows_the_waves() {
    without_ray_tracing(a_driver_without_ray_tracing_shows_the_waves, || {
        let Some(ctx) = device_with(|desc| desc.ray_query = RayQueryRequest::Auto) else { return };
        let picture = picture_of(&mut waves(&ctx, RayPath::Query), 0);
        assert_alike("SwiftShader waves", &picture, &reference("rtx_textures_small"), &OTHER_FILTERS);
    });
}

#[test]
fn impossible_pictures_are_refused() {
    let Some(ctx) = device() else { return };
    let path = paths(&ctx)[0];
    for (width, height) in [(0, 8), (8, 0), (1 << 30, 8)] {
        let error = RtxTextures::new(&ctx, &RtxConfig { path, width, height }).err();
        assert!(matches!(error, Some(SampleError::BadSize { .. })), "{error:?}");
    }
}
