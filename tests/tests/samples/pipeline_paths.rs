//! Images of the samples by each path of ray tracing pipelines that the device has: its own pipelines, and pipelines that
//! are lowered onto its ray queries and onto the library's traversal.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use image::RgbaImage;
use lvk::{Context, RayQueryRequest, RayTracingPipelinePath, RayTracingPipelineRequest};
use lvk_samples::app::headless;
use lvk_samples::app::progress::Progress;
use lvk_samples::app::sample::{FrameTime, Sample};
use lvk_samples::hybrid::{Method, RayPath};
use lvk_samples::hybrid_oit::{HybridOitConfig, OitScene};
use lvk_samples::large_scene::{LargeScene, LargeSceneConfig, World};
use lvk_samples::reflections::{Reflections, ReflectionsConfig};
use lvk_samples::rtx::RtxConfig;
use lvk_samples::rtx_ao::{RtxAo, RtxAoConfig};
use lvk_samples::rtx_hello::RtxHello;
use lvk_samples::rtx_pipeline::{RtxPipeline, RtxPipelineConfig};
use lvk_samples::rtx_textures::RtxTextures;
use lvk_samples::scene::Scene;
use lvk_tests::hybrid::HybridHarness;
use lvk_tests::image_comparison::{Tolerance, assert_not_empty, assert_similar, reference_image};
use lvk_tests::oit_reference::OitRenderer;
use lvk_tests::pipeline_paths::pipeline_devices;
use lvk_tests::scene_obj::obj_scene;
use lvk_tests::subprocess::on_swiftshader;
use lvk_tests::{device_with, rtx_sample};

/// No multiple of a workgroup.
const SIZE: [u32; 2] = [99, 55];
/// Tolerance between two paths: rays that meet an edge may fall to either side.
const SAME_RAYS: Tolerance = Tolerance { psnr: 60.0, ssim: 0.9999, differing_share: 1e-3, flip: 1e-3 };
/// Tolerance between two drivers.
const ANOTHER_DRIVER: Tolerance = Tolerance { psnr: 55.0, ..SAME_RAYS };

const RTX: RtxConfig = RtxConfig { path: RayPath::Pipeline, width: SIZE[0], height: SIZE[1] };

/// Asserts that `render` makes similar images of more than `colors` colours on all paths.
fn assert_paths_agree(what: &str, colors: usize, render: impl Fn(&Context) -> RgbaImage) {
    let mut first: Option<(RayTracingPipelinePath, RgbaImage)> = None;
    for (path, ctx) in pipeline_devices() {
        let image = render(&ctx);
        let Some((expected_path, expected)) = &first else {
            assert_not_empty(&image, colors);
            first = Some((path, image));
            continue;
        };
        assert_similar(&format!("{what} by {path:?} and {expected_path:?}"), &image, expected, &SAME_RAYS);
    }
}

/// Renders frame 3 of 20 of a sample that makes images of [`SIZE`].
fn image_of<S: Sample>(mut sample: S) -> RgbaImage {
    sample.update(FrameTime::from_frame(3, 20));
    RgbaImage::from_raw(SIZE[0], SIZE[1], headless::picture(&mut sample).unwrap()).unwrap()
}

fn still_life(ctx: &Context, method: Method) -> RgbaImage {
    let scene = obj_scene();
    HybridHarness::new(ctx, &scene, (method, RayPath::Pipeline), SIZE, 4).render(&scene.cameras[0])
}

#[test]
fn hybrid_looks_the_same_by_all_pipelines() {
    assert_paths_agree("hybrid", 200, |ctx| still_life(ctx, Method::Hybrid));
}

#[test]
fn standalone_looks_the_same_by_all_pipelines() {
    assert_paths_agree("standalone", 200, |ctx| still_life(ctx, Method::Standalone));
}

#[test]
fn hybrid_oit_looks_the_same_by_all_pipelines() {
    let config = HybridOitConfig::new(RayPath::Pipeline, SIZE[0], SIZE[1]);
    assert_paths_agree("glass", 200, |ctx| OitRenderer::new(ctx, &OitScene::default(), &config).render(1.9));
}

#[test]
fn reflections_look_the_same_by_all_pipelines() {
    let config =
        ReflectionsConfig { samples: 1, ..ReflectionsConfig::new(RayPath::Pipeline, SIZE[0], SIZE[1]) };
    assert_paths_agree("reflections", 200, |ctx| image_of(Reflections::new(ctx, &config).unwrap()));
}

#[test]
fn rtx_hello_looks_the_same_by_all_pipelines() {
    assert_paths_agree("triangles", 20, |ctx| image_of(RtxHello::new(ctx, &RTX).unwrap()));
}

#[test]
fn a_driver_without_ray_tracing_renders_the_triangles_by_a_pipeline() {
    on_swiftshader(a_driver_without_ray_tracing_renders_the_triangles_by_a_pipeline, || {
        let lowered = device_with(|desc| {
            (desc.ray_query, desc.ray_tracing_pipeline) =
                (RayQueryRequest::Off, RayTracingPipelineRequest::Auto);
        });
        let Some(ctx) = lowered else { return };
        let [width, height] = rtx_sample::SIZE;
        let mut triangles = RtxHello::new(&ctx, &RtxConfig { width, height, ..RTX }).unwrap();
        let image = rtx_sample::image_of(&mut triangles, 0);
        assert_similar(
            "SwiftShader by a pipeline",
            &image,
            &reference_image("rtx_hello_small"),
            &ANOTHER_DRIVER,
        );
    });
}

#[test]
fn rtx_pipeline_looks_the_same_by_all_pipelines() {
    let config = RtxPipelineConfig { rtx: RTX, depth: 8 };
    assert_paths_agree("mirrors", 200, |ctx| image_of(RtxPipeline::new(ctx, &obj_scene(), &config).unwrap()));
}

#[test]
fn rtx_textures_look_the_same_by_all_pipelines() {
    assert_paths_agree("waves", 200, |ctx| image_of(RtxTextures::new(ctx, &RTX).unwrap()));
}

#[test]
fn rtx_ao_looks_the_same_by_all_pipelines() {
    let config = RtxAoConfig { passes: 2, rays: 1, radius: Some(1.8), ..RtxAoConfig::new(RTX) };
    let town = |ctx: &Context| RtxAo::new(ctx, &Scene::town(), Some(&Scene::carousel()), &config).unwrap();
    assert_paths_agree("town", 200, |ctx| image_of(town(ctx)));
}

#[test]
fn large_scene_looks_the_same_by_all_pipelines() {
    let valley = World::valley(12_000, 40, &mut Progress::hidden()).unwrap();
    let config = LargeSceneConfig::new(RTX);
    assert_paths_agree("valley", 200, |ctx| {
        image_of(LargeScene::new(ctx, &valley, &config, &mut Progress::hidden()).unwrap())
    });
}
