//! Tests of the image tests of `hybrid` and `hybrid_oit`: a shader broken on purpose changes the image, once for each
//! stage and technique.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use image::RgbaImage;
use lvk::Context;
use lvk_samples::app::headless;
use lvk_samples::hybrid::{Bounces, Geometry, HybridConfig, Method, Raster, RasterTuning, RayPath};
use lvk_samples::hybrid_oit::{HybridOitConfig, OitScene};
use lvk_samples::reflections::{Reflections, ReflectionsConfig};
use lvk_samples::scene::Camera;
use lvk_tests::broken_shaders::{BrokenShaders, Mistake, paint_over};
use lvk_tests::device;
use lvk_tests::hybrid::{HybridHarness, paths};
use lvk_tests::image_comparison::{Tolerance, reference_image};
use lvk_tests::oit_reference::OitRenderer;
use lvk_tests::scene_obj::obj_scene;

use super::mistakes::{
    HYBRID, HYBRID_HARDWARE, HYBRID_LARGE, HYBRID_PAPER, HYBRID_QUERY, LEAVES, OIT, OIT_QUERY, OIT_RASTER,
    ORDERED, ORDERED_QUERY, QUEUED_PIPELINE, QUEUED_QUERY, REFLECTIONS, REFLECTIONS_EVER, REFLECTIONS_QUERY,
    VARNISH,
};

const ACROSS_DRIVERS: Tolerance = Tolerance::ACROSS_DRIVERS;
/// Tolerance between an image and itself.
const THE_SAME: Tolerance = Tolerance { psnr: f64::INFINITY, ssim: 0.9999, differing_share: 0.0, flip: 0.0 };

/// Name of the broken part, its mistakes, and the configuration whose image must change.
type HybridWay<'a> = (&'a str, &'a [Mistake], HybridConfig);

fn hybrid_methods() -> [HybridWay<'static>; 9] {
    let plain =
        HybridConfig { width: 160, height: 90, bounces: Some(Bounces::Inline), ..HybridConfig::default() };
    let geometry = |geometry| HybridConfig { geometry, ..plain };
    let visible = |raster| geometry(Geometry::Visibility(Some(raster)));
    let tuning = RasterTuning { small_pixels: Some(0), medium_pixels: Some(512), ..RasterTuning::default() };
    let query = HybridConfig { path: RayPath::Query, ..plain };
    let queued = |config| HybridConfig { bounces: Some(Bounces::Queued), ..config };
    let ordered = |config| HybridConfig { bounces: Some(Bounces::First), ..config };
    [
        ("by pipeline", HYBRID, visible(Raster::Compute)),
        ("by tiles", HYBRID_LARGE, HybridConfig { tuning, ..visible(Raster::Compute) }),
        ("by hardware", HYBRID_HARDWARE, visible(Raster::Hardware)),
        ("by the paper", HYBRID_PAPER, geometry(Geometry::Paper)),
        ("by query", HYBRID_QUERY, query),
        ("queued by pipeline", QUEUED_PIPELINE, queued(plain)),
        ("queued by query", QUEUED_QUERY, queued(query)),
        ("in order by pipeline", ORDERED, ordered(plain)),
        ("in order by query", ORDERED_QUERY, ordered(query)),
    ]
}

#[test]
#[ignore = "minutes for each: cargo test --test broken_shaders hybrid:: -- --ignored"]
fn hybrid_notices() {
    BrokenShaders::in_subprocess(hybrid_notices, |shaders| {
        let Some(ctx) = device() else { return };
        let (scene, paths) = (obj_scene(), paths(&ctx));
        assert_eq!(HybridConfig::default().method, Method::Hybrid);
        for (by, mistakes, config) in hybrid_methods().iter().filter(|way| paths.contains(&way.2.path)) {
            let image = || {
                let mut harness = HybridHarness::with_config(&ctx, &scene, config);
                paint_over(&ctx, harness.renderer.picture());
                harness.render(&scene.cameras[0])
            };
            let inline = HybridConfig { bounces: Some(Bounces::Inline), ..*config };
            let (expected, tolerance) = match (config.geometry, config.bounces) {
                (_, Some(Bounces::First)) => {
                    (HybridHarness::with_config(&ctx, &scene, &inline).render(&scene.cameras[0]), THE_SAME)
                }
                // The paper's edges are not those of rays.
                (Geometry::Paper, _) => (image(), ACROSS_DRIVERS),
                _ => (reference_image("hybrid_small"), ACROSS_DRIVERS),
            };
            shaders.assert_each_changes_image(by, &expected, &tolerance, mistakes, image);
        }
    });
}

fn render_oit(ctx: &Context, path: RayPath, [width, height]: [u32; 2], scene: &OitScene) -> RgbaImage {
    let mut room = OitRenderer::new(ctx, scene, &HybridOitConfig::new(path, width, height));
    paint_over(ctx, room.sample.texture());
    room.render(1.9)
}

#[test]
#[ignore = "minutes for each: cargo test --test broken_shaders hybrid:: -- --ignored"]
fn hybrid_oit_notices() {
    BrokenShaders::in_subprocess(hybrid_oit_notices, |shaders| {
        let Some(ctx) = device() else { return };
        let (scene, expected) = (OitScene::default(), reference_image("hybrid_oit_small"));
        for path in paths(&ctx) {
            let mistakes = match path {
                RayPath::Pipeline => [OIT, OIT_RASTER].concat(),
                RayPath::Query => OIT_QUERY.to_vec(),
            };
            let by = format!("oit by {path:?}");
            let image = || render_oit(&ctx, path, [240, 135], &scene);
            shaders.assert_each_changes_image(&by, &expected, &ACROSS_DRIVERS, &mistakes, image);
        }
        let camera = Camera::looking_at([0.7, 1.7, 2.6], [0.25, 1.32, 0.95], 17.0);
        let scene = OitScene { camera, ..scene };
        let image = || render_oit(&ctx, paths(&ctx)[0], [160, 90], &scene);
        shaders.assert_each_changes_image("varnish", &image(), &ACROSS_DRIVERS, VARNISH, image);
    });
}

fn hall(ctx: &Context, path: RayPath, view: Option<&Camera>) -> RgbaImage {
    hall_of(ctx, &ReflectionsConfig { samples: 1, ..ReflectionsConfig::new(path, 130, 73) }, view)
}

fn hall_of(ctx: &Context, config: &ReflectionsConfig, view: Option<&Camera>) -> RgbaImage {
    let mut hall = Reflections::new(ctx, config).unwrap();
    hall.show(0.0);
    if let Some(view) = view {
        hall.set_camera(view);
    }
    paint_over(ctx, hall.picture());
    RgbaImage::from_raw(config.width, config.height, headless::picture(&mut hall).unwrap()).unwrap()
}

#[test]
#[ignore = "minutes for each: cargo test --test broken_shaders hybrid:: -- --ignored"]
fn reflections_notices() {
    BrokenShaders::in_subprocess(reflections_notices, |shaders| {
        let Some(ctx) = device() else { return };
        // Smaller than the image that is as ever: there are many.
        let expected = hall(&ctx, paths(&ctx)[0], None);
        for path in paths(&ctx) {
            let mistakes: &[Mistake] = match path {
                RayPath::Pipeline => REFLECTIONS,
                RayPath::Query => REFLECTIONS_QUERY,
            };
            let by = format!("reflections by {path:?}");
            shaders.assert_each_changes_image(&by, &expected, &ACROSS_DRIVERS, mistakes, || {
                hall(&ctx, path, None)
            });
        }
        let path = paths(&ctx)[0];
        let view = Camera::looking_at([2.6, 0.3, -3.6], [1.6, 0.1, -7.0], 45.0);
        let expected = hall(&ctx, path, Some(&view));
        let mistakes = if path == RayPath::Pipeline { LEAVES } else { &LEAVES[..1] };
        shaders.assert_each_changes_image("leaves", &expected, &ACROSS_DRIVERS, mistakes, || {
            hall(&ctx, path, Some(&view))
        });
        // The image of the test that the hall looks as it always did.
        let config = ReflectionsConfig { samples: 4, ..ReflectionsConfig::new(path, 162, 91) };
        let expected = reference_image("reflections_small");
        shaders.assert_each_changes_image("as ever", &expected, &ACROSS_DRIVERS, REFLECTIONS_EVER, || {
            hall_of(&ctx, &config, None)
        });
    });
}
