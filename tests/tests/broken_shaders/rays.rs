//! Tests of the image tests of the small ray tracing samples: a shader broken on purpose changes the image.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use image::RgbaImage;
use lvk::Context;
use lvk_samples::app::progress::Progress;
use lvk_samples::app::sample::Sample;
use lvk_samples::hybrid::RayPath;
use lvk_samples::large_scene::{LargeScene, LargeSceneConfig, Show, World};
use lvk_samples::rtx::RtxConfig;
use lvk_samples::rtx_ao::{RtxAo, RtxAoConfig};
use lvk_samples::rtx_hello::RtxHello;
use lvk_samples::rtx_pipeline::{RtxPipeline, RtxPipelineConfig};
use lvk_samples::rtx_textures::RtxTextures;
use lvk_samples::scene::{Camera, Scene};
use lvk_tests::broken_shaders::{BrokenShaders, Mistake};
use lvk_tests::device;
use lvk_tests::hybrid::paths;
use lvk_tests::image_comparison::Tolerance;
use lvk_tests::raster_sample::{SIZE, image_now, image_of};
use lvk_tests::scene_obj::obj_scene;

use super::mistakes::{
    HELLO, HELLO_QUERY, LOOP, RECURSION, STREET, TOWN, TOWN_QUERY, TOWN_SKY, VALLEY, VALLEY_NUMBERS,
    VALLEY_QUERY, WAVES, WAVES_QUERY,
};

/// A frame time at which everything has moved.
const FRAME: u32 = 20;

/// Breaks each shader of a path, and takes an image, of a sample made anew.
fn check(
    shaders: &BrokenShaders,
    by: &str,
    ctx: &Context,
    mistakes: [&[Mistake]; 2],
    image: impl Fn(&RtxConfig) -> RgbaImage,
) {
    let [width, height] = SIZE;
    for path in paths(ctx) {
        let config = RtxConfig { path, width, height };
        let mistakes = match path {
            RayPath::Pipeline => mistakes[0],
            RayPath::Query => mistakes[1],
        };
        let image = || image(&config);
        let by = format!("{by} by {path:?}");
        shaders.assert_each_changes_image(&by, &image(), &Tolerance::ACROSS_DRIVERS, mistakes, image);
    }
}

#[test]
#[ignore = "seconds: cargo test --test broken_shaders rays:: -- --ignored"]
fn rtx_hello_notices() {
    BrokenShaders::in_subprocess(rtx_hello_notices, |shaders| {
        let Some(ctx) = device() else { return };
        check(shaders, "hello", &ctx, [HELLO, HELLO_QUERY], |config| {
            image_of(&mut RtxHello::new(&ctx, config).unwrap(), FRAME)
        });
    });
}

#[test]
#[ignore = "a minute: cargo test --test broken_shaders rays:: -- --ignored"]
fn rtx_ao_notices() {
    BrokenShaders::in_subprocess(rtx_ao_notices, |shaders| {
        let Some(ctx) = device() else { return };
        let (town, carousel) = (Scene::town(), Scene::carousel());
        let make = |config: &RtxConfig| {
            let config = RtxAoConfig { passes: 2, rays: 2, radius: Some(1.8), ..RtxAoConfig::new(*config) };
            RtxAo::new(&ctx, &town, Some(&carousel), &config).unwrap()
        };
        let moved = |config: &RtxConfig| image_of(&mut make(config), FRAME);
        check(shaders, "town", &ctx, [TOWN, TOWN_QUERY], moved);
        let above = Camera::looking_at([0.0, 30.0, 0.0], [30.0, 32.0, 0.0], 60.0);
        check(shaders, "above the town", &ctx, [TOWN_SKY; 2], |config| {
            let mut sample = make(config);
            sample.set_view(&above);
            image_now(&mut sample)
        });
    });
}

#[test]
#[ignore = "a minute: cargo test --test broken_shaders rays:: -- --ignored"]
fn rtx_pipeline_notices() {
    BrokenShaders::in_subprocess(rtx_pipeline_notices, |shaders| {
        let Some(ctx) = device() else { return };
        let scene = obj_scene();
        check(shaders, "still life", &ctx, [RECURSION, LOOP], |config| {
            let config = RtxPipelineConfig { rtx: *config, depth: 3 };
            image_of(&mut RtxPipeline::new(&ctx, &scene, &config).unwrap(), FRAME)
        });
    });
}

#[test]
#[ignore = "a minute: cargo test --test broken_shaders rays:: -- --ignored"]
fn rtx_textures_notices() {
    BrokenShaders::in_subprocess(rtx_textures_notices, |shaders| {
        let Some(ctx) = device() else { return };
        check(shaders, "waves", &ctx, [WAVES, WAVES_QUERY], |config| {
            image_of(&mut RtxTextures::new(&ctx, config).unwrap(), FRAME)
        });
    });
}

#[test]
#[ignore = "a minute: cargo test --test broken_shaders rays:: -- --ignored"]
fn large_scene_notices() {
    BrokenShaders::in_subprocess(large_scene_notices, |shaders| {
        let Some(ctx) = device() else { return };
        let show = |world: &World, rtx: &RtxConfig, show| {
            let config = LargeSceneConfig { show, ..LargeSceneConfig::new(*rtx) };
            let sample = LargeScene::new(&ctx, world, &config, &mut Progress::hidden());
            image_of(&mut sample.unwrap(), FRAME)
        };
        let (valley, street) = (
            World::valley(12_000, 40, &mut Progress::hidden()).unwrap(),
            World::street(vec![obj_scene()], 2).unwrap(),
        );
        check(shaders, "valley", &ctx, [VALLEY, VALLEY_QUERY], |rtx| show(&valley, rtx, Show::Picture));
        check(shaders, "street", &ctx, [STREET; 2], |rtx| show(&street, rtx, Show::Picture));
        let mistakes = [VALLEY_NUMBERS, &VALLEY_QUERY[1..2]];
        check(shaders, "instances", &ctx, mistakes, |rtx| show(&valley, rtx, Show::Instances));
    });
}
