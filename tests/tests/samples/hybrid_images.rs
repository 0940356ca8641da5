//! Images of the `hybrid` sample: all its rendering methods agree, and the images are right.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use image::RgbaImage;
use lvk::{Context, DeviceProfile, RayQueryRequest, RayTracingPipelineRequest};
use lvk_samples::app::sample_error::SampleError;
use lvk_samples::hybrid::{Bounces, Geometry, HybridConfig, HybridRenderer, Method, RayPath};
use lvk_samples::scene::Scene;
use lvk_tests::hybrid::{HybridHarness, paths};
use lvk_tests::image_comparison::{
    ImageSimilarity, Tolerance, assert_matches_reference, assert_not_empty, assert_similar, reference_image,
};
use lvk_tests::scene_obj::obj_scene;
use lvk_tests::{device, device_with};

/// No multiple of a workgroup or a band of rows.
const SIZE: [u32; 2] = [163, 91];
/// Nor these, for images of many samples.
const SMALL: [u32; 2] = [99, 55];

/// Drivers compile the shaders anew for each depth, which takes longer than the images: tests that need no other take
/// this one, and shadows alone and one bounce have one test each.
const DEPTH: u32 = 4;

/// Tolerance between pipeline and query of one method.
const SAME_RAYS: Tolerance = Tolerance { psnr: 50.0, ssim: 0.9999, differing_share: 1e-3, flip: 1e-3 };
/// Tolerance between rasterised and traced first hits: the compute rasteriser leaves to rays what rounding decides.
const SAME_VIEW: Tolerance = Tolerance { psnr: 60.0, ssim: 0.999, differing_share: 2e-4, flip: 1e-3 };
const ACROSS_DRIVERS: Tolerance = Tolerance::ACROSS_DRIVERS;

/// Renders through some cameras by all four ways and compares.
fn assert_all_methods_agree(
    ctx: &Context,
    scene: &Scene,
    size: [u32; 2],
    depth: u32,
    cameras: &[usize],
    tolerance: &Tolerance,
) {
    let harnesses = |method| -> Vec<HybridHarness> {
        let paths = paths(ctx).into_iter();
        paths.map(|path| HybridHarness::new(ctx, scene, (method, path), size, depth)).collect()
    };
    let mut standalone = harnesses(Method::Standalone);
    let mut hybrid = harnesses(Method::Hybrid);
    for &number in cameras {
        let camera = &scene.cameras[number];
        let what = |pair: &str| format!("{} camera {} depth {depth} {pair}", scene.name, number + 1);
        let standalone: Vec<_> = standalone.iter_mut().map(|harness| harness.render(camera)).collect();
        let hybrid: Vec<_> = hybrid.iter_mut().map(|harness| harness.render(camera)).collect();
        assert_not_empty(&standalone[0], 200);
        for other in 1..standalone.len() {
            assert_similar(&what("standalone query"), &standalone[other], &standalone[0], &SAME_RAYS);
            assert_similar(&what("hybrid query"), &hybrid[other], &hybrid[0], &SAME_RAYS);
        }
        assert_similar(&what("hybrid"), &hybrid[0], &standalone[0], tolerance);
    }
}

#[test]
fn all_methods_agree_on_shadows_alone() {
    let Some(ctx) = device() else { return };
    assert_all_methods_agree(&ctx, &obj_scene(), SIZE, 0, &[2, 3], &SAME_VIEW);
}

#[test]
fn all_methods_agree_on_four_bounces() {
    let Some(ctx) = device() else { return };
    assert_all_methods_agree(&ctx, &obj_scene(), SIZE, DEPTH, &[0, 1, 4], &SAME_VIEW);
}

#[test]
fn all_methods_agree_on_the_courtyard() {
    let Some(ctx) = device() else { return };
    assert_all_methods_agree(&ctx, &Scene::procedural(), [96, 54], DEPTH, &[0], &SAME_VIEW);
}

const HYBRID_BY_PIPELINE: (Method, RayPath) = (Method::Hybrid, RayPath::Pipeline);

/// Were it not for this, an image without mirrors would agree with itself.
#[test]
fn bounces_change_mirrors_and_glass_only() {
    let Some(ctx) = device() else { return };
    let scene = obj_scene();
    let camera = &scene.cameras[0];
    let at = |depth| HybridHarness::new(&ctx, &scene, HYBRID_BY_PIPELINE, SIZE, depth).render(camera);
    let [none, one, four] = [at(0), at(1), at(DEPTH)];
    let other = (Method::Standalone, paths(&ctx).pop().unwrap());
    let theirs = HybridHarness::new(&ctx, &scene, other, SIZE, 1).render(camera);
    assert_similar(&format!("one bounce {other:?}"), &theirs, &one, &SAME_VIEW);
    let first = ImageSimilarity::measure(&one, &none);
    assert!(first.difference.psnr < 25.0 && first.flip > 0.05, "the first bounce: {first}");
    let further = ImageSimilarity::measure(&four, &one);
    assert!(further.difference.psnr < 40.0 && further.flip > 0.005, "further bounces: {further}");
    let bottom = |image: &RgbaImage| image::imageops::crop_imm(image, 0, SIZE[1] - 4, 40, 4).to_image();
    assert_eq!(bottom(&none), bottom(&four), "the floor is no mirror");
}

#[test]
fn an_image_is_the_same_each_time() {
    let Some(ctx) = device() else { return };
    let scene = obj_scene();
    let paths = paths(&ctx);
    for way in [(Method::Standalone, paths[0]), (Method::Hybrid, paths[paths.len() - 1])] {
        let mut harness = HybridHarness::new(&ctx, &scene, way, SIZE, DEPTH);
        let first = harness.render(&scene.cameras[0]);
        assert_eq!(harness.render(&scene.cameras[0]), first, "{way:?}: the next frame");
        assert_ne!(harness.render(&scene.cameras[1]), first, "{way:?}: another camera");
        assert_eq!(harness.render(&scene.cameras[0]), first, "{way:?}: back at the first camera");
        let mut other = HybridHarness::new(&ctx, &obj_scene(), way, SIZE, DEPTH);
        assert_eq!(other.render(&scene.cameras[0]), first, "{way:?}: set up anew");
    }
}

#[test]
fn a_device_with_one_path_renders_by_it_and_names_the_other() {
    use RayQueryRequest::{HardwareIfPresent, Off as NoQuery};
    use RayTracingPipelineRequest::{HardwareIfPresent as PipelineIfPresent, Off};
    let scene = obj_scene();
    let mut images = Vec::new();
    for (pipeline, query, path, missing) in [
        (PipelineIfPresent, NoQuery, RayPath::Pipeline, RayPath::Query),
        (Off, HardwareIfPresent, RayPath::Query, RayPath::Pipeline),
    ] {
        let Some(ctx) = device_with(|desc| (desc.ray_tracing_pipeline, desc.ray_query) = (pipeline, query))
        else {
            return;
        };
        let Ok(chosen) = RayPath::choose(None, ctx.capabilities()) else {
            eprintln!("NOT TESTED, {} cannot trace by {path:?}", ctx.capabilities().device_name);
            continue;
        };
        assert_eq!(chosen, path);
        images.push(
            HybridHarness::new(&ctx, &scene, (Method::Hybrid, path), SIZE, DEPTH).render(&scene.cameras[2]),
        );
        let config = HybridConfig { path: missing, ..sized(SIZE) };
        let refused = HybridRenderer::new(&ctx, &scene, &config).err();
        assert!(matches!(refused, Some(SampleError::PathMissing { .. })), "{refused:?}");
    }
    for other in &images[1..] {
        assert_similar("the only path", other, &images[0], &SAME_RAYS);
    }
}

fn with_samples(
    ctx: &Context,
    scene: &Scene,
    size: [u32; 2],
    (method, path): (Method, RayPath),
    samples: u32,
) -> RgbaImage {
    let config = HybridConfig { method, path, samples, ..sized(size) };
    HybridHarness::with_config(ctx, scene, &config).render(&scene.cameras[0])
}

/// Neighbours, left and right, whose green differs by more than a third of the range.
fn hard_steps(image: &RgbaImage) -> usize {
    let pairs = (0..image.height()).flat_map(|y| (1..image.width()).map(move |x| (x, y)));
    pairs.filter(|(x, y)| image.get_pixel(*x, *y)[1].abs_diff(image.get_pixel(x - 1, *y)[1]) > 85).count()
}

#[test]
fn samples_smooth_edges_and_all_methods_take_the_same_ones() {
    let Some(ctx) = device() else { return };
    let scene = obj_scene();
    let one = with_samples(&ctx, &scene, SMALL, HYBRID_BY_PIPELINE, 1);
    assert_eq!(
        HybridHarness::with_config(&ctx, &scene, &sized(SMALL)).render(&scene.cameras[0]),
        one,
        "one sample is the default"
    );
    let smooth = with_samples(&ctx, &scene, SMALL, HYBRID_BY_PIPELINE, 16);
    assert_eq!(
        with_samples(&ctx, &scene, SMALL, HYBRID_BY_PIPELINE, 16),
        smooth,
        "the same samples each time"
    );
    for path in paths(&ctx) {
        let standalone = with_samples(&ctx, &scene, SMALL, (Method::Standalone, path), 16);
        assert_similar(&format!("16 samples {path:?}"), &smooth, &standalone, &SAME_VIEW);
    }
    let (before, after) = (hard_steps(&one), hard_steps(&smooth));
    eprintln!("{before} hard steps, {after} with 16 samples");
    assert!(before > 50 && after * 3 < before * 2, "{before} hard steps, {after} with 16 samples");
}

/// The middles of a pixel's samples lie evenly in it: their mean is that of an image four times as large, shrunk.
#[test]
fn samples_are_spread_over_their_pixel() {
    let Some(ctx) = device() else { return };
    let scene = obj_scene();
    let large =
        HybridHarness::with_config(&ctx, &scene, &sized(SIZE.map(|side| 4 * side))).render(&scene.cameras[0]);
    let smooth = with_samples(&ctx, &scene, SIZE, HYBRID_BY_PIPELINE, 16);
    let shrunk = shrunk(&large);
    let one = with_samples(&ctx, &scene, SIZE, HYBRID_BY_PIPELINE, 1);
    let [near, far] = [&smooth, &one].map(|image| ImageSimilarity::measure(image, &shrunk).difference.psnr);
    eprintln!("{near:.1} dB from the shrunk image, {far:.1} dB with one sample");
    assert!(near > 36.0 && near > far + 6.0, "{near:.1} dB, {far:.1} dB with one sample");
}

/// Every 4 x 4 pixels as their mean in linear light.
fn shrunk(large: &RgbaImage) -> RgbaImage {
    let linear = |value: u8| {
        let encoded = f64::from(value) / 255.0;
        if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
    };
    let encode = |linear: f64| {
        let encoded =
            if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
        (255.0 * encoded).round() as u8
    };
    RgbaImage::from_fn(large.width() / 4, large.height() / 4, |x, y| {
        let mean = |channel: usize| {
            let value = |i: u32| linear(large.get_pixel(4 * x + i % 4, 4 * y + i / 4)[channel]);
            encode((0..16).map(value).sum::<f64>() / 16.0)
        };
        image::Rgba([mean(0), mean(1), mean(2), 255])
    })
}

fn sized([width, height]: [u32; 2]) -> HybridConfig {
    HybridConfig { width, height, max_depth: DEPTH, ..HybridConfig::default() }
}

#[test]
fn queued_bounces_give_the_very_same_image() {
    let Some(ctx) = device() else { return };
    let scene = obj_scene();
    let paths = paths(&ctx);
    for &path in &paths {
        let is = |which| path == which || paths.len() == 1;
        // The queue is one text for all: what comes before it is tried by one path each.
        let paper = is(RayPath::Query).then_some((Method::Hybrid, Geometry::Paper, 1));
        let alone = is(RayPath::Pipeline).then_some((Method::Standalone, Geometry::default(), 1));
        let ways = [1, 3].map(|samples| (Method::Hybrid, Geometry::default(), samples));
        for (method, geometry, samples) in ways.into_iter().chain(paper).chain(alone) {
            let image = |bounces| {
                let bounces = Some(bounces);
                let config = HybridConfig { method, path, geometry, samples, bounces, ..sized(SIZE) };
                HybridHarness::with_config(&ctx, &scene, &config).render(&scene.cameras[1])
            };
            let what = format!("{method:?} {path:?} {geometry:?}, {samples} samples");
            let inline = image(Bounces::Inline);
            assert!(image(Bounces::Queued) == inline, "{what}, queued");
            if method == Method::Hybrid && geometry != Geometry::Paper {
                assert!(image(Bounces::First) == inline, "{what}, first");
                continue;
            }
            let config =
                HybridConfig { method, path, geometry, bounces: Some(Bounces::First), ..sized(SIZE) };
            let refused = HybridRenderer::new(&ctx, &scene, &config).err();
            assert!(matches!(refused, Some(SampleError::NothingFirst)), "{what}, first: {refused:?}");
        }
    }
}

/// A phone whose structures hold so little that the scene's are split.
#[test]
fn a_phone_with_split_meshes_renders_the_same() {
    let Some(ctx) = device() else { return };
    let scene = obj_scene();
    let phone = DeviceProfile { max_blas_primitives: 200, ..DeviceProfile::mali_g715() };
    let Some(rehearsal) = device_with(|desc| desc.profile = Some(&phone)) else { return };
    assert_eq!(paths(&rehearsal), [RayPath::Query]);
    for method in [Method::Hybrid, Method::Standalone] {
        let config = HybridConfig { method, path: RayPath::Query, ..sized(SIZE) };
        let renderer = HybridRenderer::new(&rehearsal, &scene, &config).unwrap();
        let (parts, structures) = (renderer.blas_part_count() as usize, renderer.blas_count());
        assert!(parts >= 2 * structures, "{structures} structures in {parts} parts");
        let mut split = HybridHarness::with_config(&rehearsal, &scene, &config);
        let whole = HybridConfig { path: paths(&ctx)[0], ..config };
        let mut whole = HybridHarness::with_config(&ctx, &scene, &whole);
        for (number, camera) in scene.cameras.iter().enumerate().take(2) {
            let what = format!("{method:?} on a phone, camera {}", number + 1);
            assert_similar(&what, &split.render(camera), &whole.render(camera), &SAME_VIEW);
        }
    }
}

#[test]
fn the_still_life_looks_as_it_always_did() {
    let Some(ctx) = device() else { return };
    let image = small_image(&ctx, &obj_scene());
    assert_matches_reference("hybrid_small", &image);
}

/// Name of a mistake, and the change of the scene that makes it.
type Mistake<'a> = (&'a str, &'a dyn Fn(&mut Scene));

/// A mistake in a shader differs from the reference by more than another driver's rounding.
#[test]
fn the_reference_image_detects_small_mistakes() {
    let Some(ctx) = device() else { return };
    let expected = reference_image("hybrid_small");
    let scene = obj_scene();
    let named = |name: &str| scene.materials.iter().position(|material| material.name == name).unwrap();
    let mistakes: [Mistake<'_>; 6] = [
        ("no highlight", &|scene| {
            scene.materials.iter_mut().for_each(|material| material.specular = [0.0; 3])
        }),
        ("no texture", &|scene| scene.materials[named("floor")].albedo_texture = None),
        ("no colour in the mirror", &|scene| scene.materials[named("gold")].tint = [1.0; 3]),
        ("no mirror", &|scene| scene.materials[named("gold")].reflectivity = 0.0),
        ("other glass", &|scene| scene.materials[named("glass")].ior = 1.2),
        ("moved lamp", &|scene| scene.light.position[0] += 0.5),
    ];
    for (what, mistake) in mistakes {
        let mut wrong = scene.clone();
        mistake(&mut wrong);
        let similarity = ImageSimilarity::measure(&small_image(&ctx, &wrong), &expected);
        eprintln!("{what}: {similarity}");
        assert!(!similarity.is_within(&ACROSS_DRIVERS), "{what} goes unnoticed: {similarity}");
    }
}

fn small_image(ctx: &Context, scene: &Scene) -> RgbaImage {
    HybridHarness::new(ctx, scene, HYBRID_BY_PIPELINE, [160, 90], DEPTH).render(&scene.cameras[0])
}
