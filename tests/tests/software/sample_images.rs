//! Images of the samples by software ray queries: equal to those by the device's own, on a device without ray tracing
//! too.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use image::RgbaImage;
use lvk::{Context, RayQueryPath, RayQueryRequest, RayTracingPipelineRequest};
use lvk_samples::app::headless;
use lvk_samples::app::sample_error::SampleError;
use lvk_samples::hybrid::{Bounces, HybridConfig, HybridRenderer, Method, RayPath};
use lvk_samples::hybrid_oit::{HybridOitConfig, OitScene};
use lvk_samples::reflections::{Reflections, ReflectionsConfig};
use lvk_tests::hybrid::HybridHarness;
use lvk_tests::image_comparison::{Tolerance, assert_similar, reference_image};
use lvk_tests::oit_reference::OitRenderer;
use lvk_tests::scene_obj::obj_scene;
use lvk_tests::subprocess::on_swiftshader;
use lvk_tests::{TestDevice, device_with};

const SIZE: [u32; 2] = [160, 90];
const DEPTH: u32 = 3;
/// Frame time of the reference image of the scene of glass.
const TIME_SECONDS: f64 = 1.9;
const SAME_RAYS: Tolerance = Tolerance { psnr: 50.0, ssim: 0.9999, differing_share: 1e-3, flip: 1e-3 };
/// The same rays, but filters spread what a ray at an edge finds elsewhere.
const SAME_FILTERED: Tolerance = Tolerance { psnr: 55.0, ssim: 0.9999, differing_share: 0.01, flip: 0.004 };
/// Limits of images from rays alone, on SwiftShader: its textures are filtered with fewer bits.
const OTHER_FILTERS: Tolerance = Tolerance { psnr: 46.0, ssim: 0.999, differing_share: 0.2, flip: 0.012 };
/// Tolerance where it rasterises too: vertices are snapped to 4 bits of a pixel in place of 8, so edges differ.
const OTHER_EDGES: Tolerance = Tolerance { psnr: 38.0, ssim: 0.99, differing_share: 0.1, flip: 0.012 };
/// Reflected and lit edges, on top of those that are seen.
const OTHER_REFLECTIONS: Tolerance = Tolerance { psnr: 33.0, ssim: 0.975, differing_share: 0.3, flip: 0.05 };

fn queries(request: RayQueryRequest) -> Option<TestDevice> {
    device_with(|desc| {
        (desc.ray_tracing_pipeline, desc.ray_query) = (RayTracingPipelineRequest::Off, request)
    })
}

#[test]
fn software_and_the_device_make_the_same_image() {
    let (Some(one), Some(other)) =
        (queries(RayQueryRequest::HardwareIfPresent), queries(RayQueryRequest::Software))
    else {
        return;
    };
    assert_eq!(other.capabilities().ray_query_path, RayQueryPath::Software);
    if one.capabilities().ray_query_path != RayQueryPath::Hardware {
        return eprintln!("NOT TESTED, {} has no ray queries", one.capabilities().device_name);
    }
    let scene = obj_scene();
    for method in [Method::Standalone, Method::Hybrid] {
        let harness = |ctx| HybridHarness::new(ctx, &scene, (method, RayPath::Query), SIZE, DEPTH);
        let (mut expected, mut actual) = (harness(&*one), harness(&*other));
        for number in [0, 2] {
            let camera = &scene.cameras[number];
            let what = format!("{method:?} in software, camera {}", number + 1);
            assert_similar(&what, &actual.render(camera), &expected.render(camera), &SAME_RAYS);
        }
    }
}

/// The images that are kept were made by the device's own tracing.
#[test]
fn software_and_the_device_render_the_same_glass_and_hall() {
    let Some(ctx) = queries(RayQueryRequest::Software) else { return };
    let glass = reference_image("hybrid_oit_small");
    assert_similar("glass in software", &glass_scene(&ctx, &glass), &glass, &SAME_RAYS);
    let expected = reference_image("reflections_small");
    let image = hall(&ctx, [expected.width(), expected.height()]);
    assert_similar("hall in software", &image, &expected, &SAME_FILTERED);
}

/// A device without any ray tracing, whose queries are the library's.
fn without() -> Option<TestDevice> {
    let ctx = device_with(|desc| desc.ray_query = RayQueryRequest::Auto)?;
    assert_eq!(ctx.capabilities().ray_query_path, RayQueryPath::Software);
    Some(ctx)
}

#[test]
#[ignore = "minutes in which SwiftShader compiles, of the check swiftshader of .ci/slow"]
fn a_driver_without_ray_tracing_renders_the_obj_scene() {
    on_swiftshader(a_driver_without_ray_tracing_renders_the_obj_scene, || {
        let Some(ctx) = without() else { return };
        let (scene, expected) = (obj_scene(), reference_image("hybrid_small"));
        let plain = HybridConfig { path: RayPath::Query, ..sized(&expected) };
        let refused = HybridRenderer::new(&ctx, &scene, &plain).err();
        assert!(matches!(refused, Some(SampleError::NoRasteriser { .. })), "{refused:?}");
        let method = Method::choose(None, ctx.capabilities());
        assert_eq!(method, Method::Standalone);
        for bounces in [Bounces::Inline, Bounces::Queued] {
            let config = HybridConfig { method, bounces: Some(bounces), ..plain };
            let image = HybridHarness::with_config(&ctx, &scene, &config).render(&scene.cameras[0]);
            assert_similar(&format!("SwiftShader {bounces:?}"), &image, &expected, &OTHER_FILTERS);
        }
    });
}

#[test]
fn a_driver_without_ray_tracing_renders_the_glass() {
    on_swiftshader(a_driver_without_ray_tracing_renders_the_glass, || {
        let Some(ctx) = without() else { return };
        let expected = reference_image("hybrid_oit_small");
        assert_similar("SwiftShader glass", &glass_scene(&ctx, &expected), &expected, &OTHER_EDGES);
    });
}

#[test]
#[ignore = "minutes in which SwiftShader compiles, of the check swiftshader of .ci/slow"]
fn a_driver_without_ray_tracing_renders_the_hall() {
    on_swiftshader(a_driver_without_ray_tracing_renders_the_hall, || {
        let Some(ctx) = without() else { return };
        let expected = reference_image("reflections_small");
        let image = hall(&ctx, [expected.width(), expected.height()]);
        assert_similar("SwiftShader hall", &image, &expected, &OTHER_REFLECTIONS);
    });
}

fn sized(image: &RgbaImage) -> HybridConfig {
    let (width, height) = image.dimensions();
    HybridConfig { width, height, max_depth: 4, ..HybridConfig::default() }
}

/// The room of glass in the size of an image.
fn glass_scene(ctx: &Context, like: &RgbaImage) -> RgbaImage {
    let config = HybridOitConfig::new(RayPath::Query, like.width(), like.height());
    OitRenderer::new(ctx, &OitScene::default(), &config).render(TIME_SECONDS)
}

fn hall(ctx: &Context, [width, height]: [u32; 2]) -> RgbaImage {
    let config = ReflectionsConfig { samples: 4, ..ReflectionsConfig::new(RayPath::Query, width, height) };
    let mut hall = Reflections::new(ctx, &config).unwrap();
    hall.show(0.0);
    RgbaImage::from_raw(width, height, headless::picture(&mut hall).unwrap()).unwrap()
}
