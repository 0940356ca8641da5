//! The pictures of the `hybrid` sample: all its ways of rendering agree, and they show what they should.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::path::{Path, PathBuf};

use image::RgbaImage;
use lvk::{Context, FeatureRequest, RayQueryRequest};
use lvk_samples::hybrid::{HybridConfig, HybridError, HybridRenderer, Method, RayPath};
use lvk_samples::scene::Scene;
use lvk_tests::hybrid::{Studio, paths};
use lvk_tests::picture::{Likeness, Tolerance, assert_alike, keep};
use lvk_tests::still_life::still_life;
use lvk_tests::{device, device_with};

/// No multiple of a workgroup or a band of rows.
const SIZE: [u32; 2] = [163, 91];

/// Of the same method by pipeline and by query.
const SAME_RAYS: Tolerance = Tolerance { psnr: 50.0, ssim: 0.9999, differing_share: 1e-3, flip: 1e-3 };
/// Of rasterised and traced first hits, which decide differently about points on edges.
const SAME_VIEW: Tolerance = Tolerance { psnr: 50.0, ssim: 0.995, differing_share: 2e-3, flip: 0.01 };
/// The same for a picture in which every other pixel is on an edge.
const SAME_DETAIL: Tolerance = Tolerance { psnr: 38.0, ..SAME_VIEW };
/// Of a picture and the same one by another driver, years ago.
const SAME_AS_EVER: Tolerance = Tolerance { psnr: 40.0, ssim: 0.995, differing_share: 1.0, flip: 0.012 };

/// Renders through some cameras by all four ways and compares.
fn assert_all_ways_agree(
    ctx: &Context,
    scene: &Scene,
    size: [u32; 2],
    depth: u32,
    cameras: &[usize],
    tolerance: &Tolerance,
) {
    let studios = |method| -> Vec<Studio> {
        let paths = paths(ctx).into_iter();
        paths.map(|path| Studio::new(ctx, scene, (method, path), size, depth)).collect()
    };
    let mut standalone = studios(Method::Standalone);
    let mut hybrid = studios(Method::Hybrid);
    for &number in cameras {
        let camera = &scene.cameras[number];
        let what = |pair: &str| format!("{} camera {} depth {depth} {pair}", scene.name, number + 1);
        let standalone: Vec<_> = standalone.iter_mut().map(|studio| studio.picture(camera)).collect();
        let hybrid: Vec<_> = hybrid.iter_mut().map(|studio| studio.picture(camera)).collect();
        assert_shows_something(&standalone[0]);
        for other in 1..standalone.len() {
            assert_alike(&what("standalone query"), &standalone[other], &standalone[0], &SAME_RAYS);
            assert_alike(&what("hybrid query"), &hybrid[other], &hybrid[0], &SAME_RAYS);
        }
        assert_alike(&what("hybrid"), &hybrid[0], &standalone[0], tolerance);
    }
}

/// Two empty pictures would agree too.
fn assert_shows_something(picture: &RgbaImage) {
    let colors: std::collections::HashSet<[u8; 4]> = picture.pixels().map(|pixel| pixel.0).collect();
    assert!(colors.len() > 200, "{} colours", colors.len());
    assert!(picture.pixels().all(|pixel| pixel[3] == 255), "a pixel was left out");
}

#[test]
fn all_ways_agree_on_shadows_alone() {
    let Some(ctx) = device() else { return };
    assert_all_ways_agree(&ctx, &still_life(), SIZE, 0, &[0, 3], &SAME_VIEW);
}

#[test]
fn all_ways_agree_on_one_bounce() {
    let Some(ctx) = device() else { return };
    assert_all_ways_agree(&ctx, &still_life(), SIZE, 1, &[1, 2], &SAME_VIEW);
}

#[test]
fn all_ways_agree_on_four_bounces() {
    let Some(ctx) = device() else { return };
    assert_all_ways_agree(&ctx, &still_life(), SIZE, 4, &[0, 1, 2, 3, 4], &SAME_VIEW);
}

#[test]
fn all_ways_agree_on_the_courtyard() {
    let Some(ctx) = device() else { return };
    assert_all_ways_agree(&ctx, &Scene::procedural(), [96, 54], 2, &[0], &SAME_DETAIL);
}

const HYBRID_BY_PIPELINE: (Method, RayPath) = (Method::Hybrid, RayPath::Pipeline);

/// Were it not for this, a picture without mirrors would agree with itself.
#[test]
fn bounces_show_in_mirrors_and_glass_only() {
    let Some(ctx) = device() else { return };
    let scene = still_life();
    let camera = &scene.cameras[0];
    let at = |depth| Studio::new(&ctx, &scene, HYBRID_BY_PIPELINE, SIZE, depth).picture(camera);
    let [none, one, four] = [at(0), at(1), at(4)];
    let first = Likeness::of(&one, &none);
    assert!(first.difference.psnr < 25.0 && first.flip > 0.05, "the first bounce: {first}");
    let further = Likeness::of(&four, &one);
    assert!(further.difference.psnr < 40.0 && further.flip > 0.005, "further bounces: {further}");
    let bottom = |picture: &RgbaImage| image::imageops::crop_imm(picture, 0, SIZE[1] - 4, 40, 4).to_image();
    assert_eq!(bottom(&none), bottom(&four), "the floor is no mirror");
}

#[test]
fn a_picture_is_the_same_each_time() {
    let Some(ctx) = device() else { return };
    let scene = still_life();
    let paths = paths(&ctx);
    for way in [(Method::Hybrid, paths[0]), (Method::Standalone, paths[paths.len() - 1])] {
        let mut studio = Studio::new(&ctx, &scene, way, SIZE, 4);
        let first = studio.picture(&scene.cameras[0]);
        assert_eq!(studio.picture(&scene.cameras[0]), first, "{way:?}: the next frame");
        assert_ne!(studio.picture(&scene.cameras[1]), first, "{way:?}: another camera");
        assert_eq!(studio.picture(&scene.cameras[0]), first, "{way:?}: back at the first camera");
        let mut other = Studio::new(&ctx, &still_life(), way, SIZE, 4);
        assert_eq!(other.picture(&scene.cameras[0]), first, "{way:?}: set up anew");
    }
}

#[test]
fn a_device_with_one_path_renders_by_it_and_names_the_other() {
    use FeatureRequest::{Off, Optional};
    use RayQueryRequest::{HardwareIfPresent, Off as NoQuery};
    let scene = still_life();
    let mut pictures = Vec::new();
    for (pipeline, query, path, missing) in [
        (Optional, NoQuery, RayPath::Pipeline, RayPath::Query),
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
        pictures.push(Studio::new(&ctx, &scene, (Method::Hybrid, path), SIZE, 1).picture(&scene.cameras[2]));
        let config = HybridConfig {
            method: Method::Hybrid,
            path: missing,
            width: SIZE[0],
            height: SIZE[1],
            max_depth: 1,
            ..HybridConfig::default()
        };
        let refused = HybridRenderer::new(&ctx, &scene, &config).err();
        assert!(matches!(refused, Some(HybridError::PathMissing { .. })), "{refused:?}");
    }
    for other in &pictures[1..] {
        assert_alike("the only path", other, &pictures[0], &SAME_RAYS);
    }
}

/// Where the change of a picture is meant, look at the new one and copy it over `tests/reference/hybrid_small.png`.
#[test]
fn the_still_life_looks_as_it_always_did() {
    let Some(ctx) = device() else { return };
    let picture = small_picture(&ctx, &still_life());
    match image::open(reference_path()) {
        Ok(expected) => assert_alike("hybrid_small", &picture, &expected.into_rgba8(), &SAME_AS_EVER),
        Err(error) => {
            let kept = keep("hybrid_small actual", &picture);
            panic!("{}: {error}; the picture is in {}", reference_path().display(), kept.display());
        }
    }
}

/// What it is, and how a scene shows it.
type Mistake<'a> = (&'a str, &'a dyn Fn(&mut Scene));

/// What a shader forgets or gets wrong must not pass for another driver's rounding.
#[test]
fn the_reference_picture_tells_small_mistakes() {
    let Some(ctx) = device() else { return };
    let expected = image::open(reference_path()).unwrap().into_rgba8();
    let scene = still_life();
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
        let likeness = Likeness::of(&small_picture(&ctx, &wrong), &expected);
        eprintln!("{what}: {likeness}");
        assert!(!likeness.is_within(&SAME_AS_EVER), "{what} goes unnoticed: {likeness}");
    }
}

fn small_picture(ctx: &Context, scene: &Scene) -> RgbaImage {
    Studio::new(ctx, scene, HYBRID_BY_PIPELINE, [160, 90], 4).picture(&scene.cameras[0])
}

fn reference_path() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("reference/hybrid_small.png")
}
