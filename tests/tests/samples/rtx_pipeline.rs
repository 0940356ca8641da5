//! The pictures of the `rtx_pipeline` sample: recursion in hit shaders and loops over queries agree, on split structures
//! too, and they look as ever.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use image::RgbaImage;
use lvk::{Context, DeviceProfile, FeatureRequest, RayQueryRequest};
use lvk_samples::app::headless;
use lvk_samples::app::sample::{FrameTime, Sample};
use lvk_samples::app::sample_error::SampleError;
use lvk_samples::hybrid::RayPath;
use lvk_samples::rtx::RtxConfig;
use lvk_samples::rtx_pipeline::{RtxPipeline, RtxPipelineConfig, RtxPipelineSwitches};
use lvk_tests::child::without_ray_tracing;
use lvk_tests::hybrid::paths;
use lvk_tests::picture::{Tolerance, assert_alike, assert_as_ever, reference};
use lvk_tests::still_life::still_life;
use lvk_tests::{device, device_with};

/// No multiple of a work group.
const SIZE: [u32; 2] = [158, 89];
const SAME_RAYS: Tolerance = Tolerance { psnr: 50.0, ssim: 0.999, differing_share: 3e-3, flip: 2e-3 };
/// On SwiftShader: its textures are filtered with fewer bits.
const OTHER_FILTERS: Tolerance = Tolerance { psnr: 40.0, ssim: 0.99, differing_share: 0.4, flip: 0.05 };

fn still(ctx: &Context, path: RayPath, depth: u32) -> RtxPipeline {
    let rtx = RtxConfig { path, width: SIZE[0], height: SIZE[1] };
    RtxPipeline::new(ctx, &still_life(), &RtxPipelineConfig { rtx, depth }).unwrap()
}

fn picture_of(sample: &mut RtxPipeline, frame: u32) -> RgbaImage {
    sample.update(FrameTime::from_frame(frame, 100)).unwrap();
    RgbaImage::from_raw(SIZE[0], SIZE[1], headless::picture(sample).unwrap()).unwrap()
}

#[test]
fn recursion_and_loops_show_the_same() {
    let Some(ctx) = device() else { return };
    let software = device_with(|desc| {
        (desc.ray_tracing_pipeline, desc.ray_query) = (FeatureRequest::Off, RayQueryRequest::Software);
    });
    for depth in [0, 3] {
        let mut all: Vec<_> = paths(&ctx).into_iter().map(|path| still(&ctx, path, depth)).collect();
        all.extend(software.as_deref().map(|ctx| still(ctx, RayPath::Query, depth)));
        let pictures: Vec<_> = all.iter_mut().map(|sample| picture_of(sample, 20)).collect();
        for other in &pictures[1..] {
            assert_alike(&format!("still life at depth {depth}"), other, &pictures[0], &SAME_RAYS);
        }
    }
}

#[test]
fn depth_and_moment_count() {
    let Some(ctx) = device() else { return };
    let path = paths(&ctx)[0];
    let (mut deep, mut flat) = (still(&ctx, path, 3), still(&ctx, path, 0));
    let first = picture_of(&mut deep, 0);
    assert_ne!(picture_of(&mut flat, 0), first, "mirrors show something");
    assert_ne!(picture_of(&mut deep, 30), first, "the camera moves");
    assert_eq!(picture_of(&mut deep, 100), first, "a round has no seam");
}

#[test]
fn switches_of_the_panel_take_depth_and_lights_away() {
    let Some(ctx) = device() else { return };
    for path in paths(&ctx) {
        let mut sample = still(&ctx, path, 3);
        let (first, all) = (picture_of(&mut sample, 0), *sample.switches());
        *sample.switches() = RtxPipelineSwitches { lights: 0, ..all };
        assert_ne!(picture_of(&mut sample, 0), first, "there is light");
        *sample.switches() = RtxPipelineSwitches { depth: 0, ..all };
        assert_eq!(picture_of(&mut sample, 0), picture_of(&mut still(&ctx, path, 0), 0), "{path:?}");
        *sample.switches() = RtxPipelineSwitches { depth: u32::MAX, lights: u32::MAX };
        assert_eq!(picture_of(&mut sample, 0), first, "no more than there is");
    }
}

#[test]
fn split_structures_show_the_same() {
    let Some(whole) = device() else { return };
    let phone = DeviceProfile { max_blas_primitives: 200, ..DeviceProfile::mali_g715() };
    let Some(split) = device_with(|desc| desc.profile = Some(&phone)) else { return };
    let mut split = still(&split, RayPath::Query, 3);
    assert!(split.blas_part_count() > 2, "{} parts", split.blas_part_count());
    let other = picture_of(&mut still(&whole, paths(&whole)[0], 3), 0);
    assert_alike("split still life", &picture_of(&mut split, 0), &other, &SAME_RAYS);
}

#[test]
fn the_still_life_looks_as_it_always_did() {
    let Some(ctx) = device() else { return };
    assert_as_ever("rtx_pipeline_small", &picture_of(&mut still(&ctx, paths(&ctx)[0], 4), 0));
}

#[test]
fn no_deeper_than_the_device_can() {
    let Some(ctx) = device() else { return };
    let limit = ctx.capabilities().limits.max_ray_recursion;
    for path in paths(&ctx) {
        let depth = still(&ctx, path, u32::MAX).config().depth;
        let most = if path == RayPath::Pipeline { limit - 2 } else { u32::MAX };
        assert_eq!(depth, RtxPipelineConfig::MAX_DEPTH.min(most), "{path:?}");
    }
}

#[test]
fn a_driver_without_ray_tracing_shows_the_still_life() {
    without_ray_tracing(a_driver_without_ray_tracing_shows_the_still_life, || {
        let Some(ctx) = device_with(|desc| desc.ray_query = RayQueryRequest::Auto) else { return };
        let picture = picture_of(&mut still(&ctx, RayPath::Query, 4), 0);
        assert_alike("SwiftShader still life", &picture, &reference("rtx_pipeline_small"), &OTHER_FILTERS);
    });
}

#[test]
fn impossible_pictures_are_refused() {
    let Some(ctx) = device() else { return };
    let path = paths(&ctx)[0];
    for (width, height) in [(0, 8), (8, 0), (1 << 30, 8)] {
        let config = RtxPipelineConfig::new(RtxConfig { path, width, height });
        let error = RtxPipeline::new(&ctx, &still_life(), &config).err();
        assert!(matches!(error, Some(SampleError::BadSize { .. })), "{error:?}");
    }
}
