//! Images of the `rtx_pipeline` sample: recursion in hit shaders and loops over queries agree, on split meshes too,
//! and equal the reference.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk::{Context, DeviceProfile};
use lvk_samples::hybrid::RayPath;
use lvk_samples::rtx::RtxConfig;
use lvk_samples::rtx_pipeline::{RtxPipeline, RtxPipelineConfig, RtxPipelineSettings};
use lvk_tests::hybrid::paths;
use lvk_tests::image_comparison::{
    Tolerance, assert_matches_reference, assert_similar, assert_swiftshader_matches,
};
use lvk_tests::rtx_sample::{SIZE, assert_paths_agree, assert_refuses_impossible_sizes, image_of};
use lvk_tests::scene_obj::obj_scene;
use lvk_tests::{device, device_with};

const SAME_RAYS: Tolerance = Tolerance { psnr: 50.0, ssim: 0.999, differing_share: 3e-3, flip: 2e-3 };
/// Tolerance on SwiftShader, which filters textures with fewer bits.
const OTHER_FILTERS: Tolerance = Tolerance { psnr: 40.0, ssim: 0.99, differing_share: 0.4, flip: 0.05 };

fn still(ctx: &Context, path: RayPath, depth: u32) -> RtxPipeline {
    let rtx = RtxConfig { path, width: SIZE[0], height: SIZE[1] };
    RtxPipeline::new(ctx, &obj_scene(), &RtxPipelineConfig { rtx, depth }).unwrap()
}

#[test]
fn recursion_and_loops_render_the_same() {
    let Some(ctx) = device() else { return };
    for depth in [0, 3] {
        let what = format!("still life at depth {depth}");
        assert_paths_agree(&what, &ctx, &[20], &SAME_RAYS, |ctx, path| still(ctx, path, depth));
    }
}

#[test]
fn depth_and_frame_time_count() {
    let Some(ctx) = device() else { return };
    let path = paths(&ctx)[0];
    let (mut deep, mut flat) = (still(&ctx, path, 3), still(&ctx, path, 0));
    let first = image_of(&mut deep, 0);
    assert_ne!(image_of(&mut flat, 0), first, "mirrors show something");
    assert_ne!(image_of(&mut deep, 30), first, "the camera moves");
    assert_eq!(image_of(&mut deep, 100), first, "a round has no seam");
}

#[test]
fn settings_of_the_panel_take_depth_and_lights_away() {
    let Some(ctx) = device() else { return };
    for path in paths(&ctx) {
        let mut sample = still(&ctx, path, 3);
        let (first, all) = (image_of(&mut sample, 0), *sample.settings());
        *sample.settings() = RtxPipelineSettings { lights: 0, ..all };
        assert_ne!(image_of(&mut sample, 0), first, "there is light");
        *sample.settings() = RtxPipelineSettings { depth: 0, ..all };
        assert_eq!(image_of(&mut sample, 0), image_of(&mut still(&ctx, path, 0), 0), "{path:?}");
        *sample.settings() = RtxPipelineSettings { depth: u32::MAX, lights: u32::MAX };
        assert_eq!(image_of(&mut sample, 0), first, "no more than there is");
    }
}

#[test]
fn split_accel_structs_render_the_same() {
    let Some(whole) = device() else { return };
    let phone = DeviceProfile { max_blas_primitives: 200, ..DeviceProfile::mali_g715() };
    let Some(split) = device_with(|desc| desc.profile = Some(&phone)) else { return };
    let mut split = still(&split, RayPath::Query, 3);
    assert!(split.blas_part_count() > 2, "{} parts", split.blas_part_count());
    let other = image_of(&mut still(&whole, paths(&whole)[0], 3), 0);
    assert_similar("split still life", &image_of(&mut split, 0), &other, &SAME_RAYS);
}

#[test]
fn the_still_life_looks_as_it_always_did() {
    let Some(ctx) = device() else { return };
    assert_matches_reference("rtx_pipeline_small", &image_of(&mut still(&ctx, paths(&ctx)[0], 4), 0));
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
#[ignore = "a minute, of the check swiftshader of .ci/slow"]
fn a_driver_without_ray_tracing_renders_the_obj_scene() {
    assert_swiftshader_matches(
        a_driver_without_ray_tracing_renders_the_obj_scene,
        "rtx_pipeline_small",
        &OTHER_FILTERS,
        |ctx| image_of(&mut still(ctx, RayPath::Query, 4), 0),
    );
}

#[test]
fn impossible_images_are_refused() {
    let Some(ctx) = device() else { return };
    assert_refuses_impossible_sizes(&ctx, |rtx| {
        RtxPipeline::new(&ctx, &obj_scene(), &RtxPipelineConfig::new(*rtx)).err()
    });
}
