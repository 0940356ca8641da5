//! Tests of the image tests of the samples that only rasterise: a shader broken on purpose changes the image.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk::{Context, OptionalFeature};
use lvk_samples::app::sample::Sample;
use lvk_samples::deferred::{Deferred, DeferredConfig, Passes};
use lvk_samples::hello_triangle::HelloTriangle;
use lvk_samples::mesh_shaders::MeshShaders;
use lvk_samples::omni_shadows::{self, OmniShadows, OmniShadowsConfig, ShadowFilter};
use lvk_samples::render_to_cube_map::{CubeMapFaces, RenderToCubeMap, RenderToCubeMapConfig};
use lvk_samples::scene::Scene;
use lvk_samples::sponza::{DrawPath, Sponza, SponzaConfig};
use lvk_samples::triplanar::Triplanar;
use lvk_samples::yuv::{CONVERSIONS, Yuv, YuvConfig};
use lvk_tests::broken_shaders::{BrokenShaders, Mistake};
use lvk_tests::image_comparison::Tolerance;
use lvk_tests::raster::has;
use lvk_tests::raster_sample::{SIZE, image_of};
use lvk_tests::scene_normal_map::{Tilt, normal_map_scene};
use lvk_tests::scene_obj::obj_scene;
use lvk_tests::scene_shadow_mask::shadow_mask_scene;
use lvk_tests::{device, device_with};

use super::mistakes::{
    ATRIUM, ATRIUM_PADDED, BOARD, BODIES, CUBE_MAP, CUBE_MAP_FACES, HALL, HALL_ONE, HALL_SEVERAL, LAMP,
    LAMP_FACES, LAMP_HARD, MESHLETS, STILL_LIFE, STILL_LIFE_BY_LAMP, TILES, TRIANGLE, VIDEO,
};

/// A frame time at which everything has moved.
const FRAME: u32 = 20;

/// Breaks each shader, and takes an image of a sample made anew.
fn check<S: Sample>(shaders: &BrokenShaders, by: &str, mistakes: &[Mistake], make: impl Fn() -> S) {
    let expected = image_of(&mut make(), FRAME);
    let image = || image_of(&mut make(), FRAME);
    shaders.assert_each_changes_image(by, &expected, &Tolerance::ACROSS_DRIVERS, mistakes, image);
}

fn cube_map(ctx: &Context, faces: CubeMapFaces) -> RenderToCubeMap {
    let config = RenderToCubeMapConfig { face_size: 64, ..RenderToCubeMapConfig::new(SIZE, faces) };
    RenderToCubeMap::new(ctx, &config).unwrap()
}

fn hall(ctx: &Context, passes: Passes) -> Deferred {
    Deferred::new(ctx, &DeferredConfig { passes: Some(passes), ..DeferredConfig::new(SIZE) }).unwrap()
}

fn lamp(ctx: &Context, config: OmniShadowsConfig) -> OmniShadows {
    OmniShadows::new(ctx, &OmniShadowsConfig { shadow_size: 256, ..config }).unwrap()
}

fn sponza(ctx: &Context, scene: &Scene, draws: DrawPath) -> Sponza {
    let config = SponzaConfig { shadow_size: 512, triangles_per_draw: 64, ..SponzaConfig::new(SIZE) };
    Sponza::new(ctx, scene.clone(), &SponzaConfig { draws: Some(draws), ..config }).unwrap()
}

#[test]
#[ignore = "half a minute: cargo test --test broken_shaders raster:: -- --ignored"]
fn samples_that_rasterise_notice() {
    BrokenShaders::in_subprocess(samples_that_rasterise_notice, |shaders| {
        let Some(ctx) = device() else { return };
        check(shaders, "hello_triangle", TRIANGLE, || HelloTriangle::new(&ctx, SIZE).unwrap());
        check(shaders, "six faces", CUBE_MAP, || cube_map(&ctx, CubeMapFaces::SixPasses));
        if has(&ctx, OptionalFeature::Multiview) {
            check(shaders, "faces at once", CUBE_MAP_FACES, || cube_map(&ctx, CubeMapFaces::OnePass));
        }
        if ctx.capabilities().mesh_shader {
            check(shaders, "mesh_shaders", MESHLETS, || MeshShaders::new(&ctx, SIZE, true).unwrap());
        } else {
            eprintln!("NOT TESTED, {} has no mesh shaders", ctx.capabilities().device_name);
        }
        check(shaders, "triplanar", BODIES, || Triplanar::new(&ctx, SIZE).unwrap());
    });
}

#[test]
#[ignore = "a minute: cargo test --test broken_shaders raster:: -- --ignored"]
fn deferred_notices() {
    BrokenShaders::in_subprocess(deferred_notices, |shaders| {
        let Some(ctx) = device() else { return };
        check(shaders, "by several passes", &[HALL, HALL_SEVERAL].concat(), || hall(&ctx, Passes::Several));
        if has(&ctx, OptionalFeature::LocalRead) {
            check(shaders, "by one pass", &[HALL, HALL_ONE].concat(), || hall(&ctx, Passes::One));
        }
    });
}

#[test]
#[ignore = "a minute: cargo test --test broken_shaders raster:: -- --ignored"]
fn omni_shadows_notices() {
    BrokenShaders::in_subprocess(omni_shadows_notices, |shaders| {
        let Some(ctx) = device() else { return };
        let usual = OmniShadowsConfig { shows_cube: true, ..OmniShadowsConfig::new(SIZE) };
        if has(&ctx, OptionalFeature::Multiview) {
            let at_once = OmniShadowsConfig { faces: omni_shadows::ShadowFaces::Multiview, ..usual };
            check(shaders, "a lamp", LAMP, || lamp(&ctx, at_once));
        }
        let single = OmniShadowsConfig { faces: omni_shadows::ShadowFaces::Single, ..usual };
        check(shaders, "face by face", LAMP_FACES, || lamp(&ctx, single));
        let hard = OmniShadowsConfig { filter: ShadowFilter::Hard, ..single };
        check(shaders, "one comparison", LAMP_HARD, || lamp(&ctx, hard));
    });
}

#[test]
#[ignore = "seconds: cargo test --test broken_shaders raster:: -- --ignored"]
fn yuv_notices() {
    BrokenShaders::in_subprocess(yuv_notices, |shaders| {
        let Some(ctx) = device_with(|desc| desc.yuv = &CONVERSIONS) else { return };
        let config = YuvConfig { video_size: [96, 64], shows_planes: true, ..YuvConfig::new(SIZE) };
        check(shaders, "yuv", VIDEO, || Yuv::new(&ctx, &config).unwrap());
    });
}

#[test]
#[ignore = "a minute: cargo test --test broken_shaders raster:: -- --ignored"]
fn sponza_notices() {
    BrokenShaders::in_subprocess(sponza_notices, |shaders| {
        let Some(ctx) = device() else { return };
        let atrium = Scene::atrium();
        if has(&ctx, OptionalFeature::DrawIndirectCount) {
            check(shaders, "atrium", ATRIUM, || sponza(&ctx, &atrium, DrawPath::Counted));
        }
        check(shaders, "padded", ATRIUM_PADDED, || sponza(&ctx, &atrium, DrawPath::Padded));
        let board = shadow_mask_scene();
        check(shaders, "board", BOARD, || sponza(&ctx, &board, DrawPath::Padded));
        let tiles = normal_map_scene(Tilt::Map);
        check(shaders, "tiles", TILES, || sponza(&ctx, &tiles, DrawPath::Padded));
        let sunny = obj_scene();
        check(shaders, "still life", STILL_LIFE, || sponza(&ctx, &sunny, DrawPath::Padded));
        let dark = Scene { sun: None, ..sunny.clone() };
        check(shaders, "by the lamp", STILL_LIFE_BY_LAMP, || sponza(&ctx, &dark, DrawPath::Padded));
    });
}
