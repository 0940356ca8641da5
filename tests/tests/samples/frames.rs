//! Frames of samples: images do not depend on waits between frames, and after a change of size, view or shader they
//! equal those of a new sample. A changed shader takes effect; a wrong one leaves the old one in use.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::fs;
use std::path::Path;

use lvk::{Context, Format, Holder, TextureDesc, TextureHandle, TextureRegion, TextureUsage};
use lvk_samples::app::frame::Frame;
use lvk_samples::app::headless;
use lvk_samples::app::progress::Progress;
use lvk_samples::app::sample::{FrameTime, Sample};
use lvk_samples::deferred::{Deferred, DeferredConfig};
use lvk_samples::hello_triangle::HelloTriangle;
use lvk_samples::hybrid::{HybridConfig, HybridRenderer, HybridSequence, Method};
use lvk_samples::hybrid_oit::{HybridOit, HybridOitConfig, HybridOitSequence, OitScene};
use lvk_samples::large_scene::{LargeScene, LargeSceneConfig, World};
use lvk_samples::mesh_shaders::MeshShaders;
use lvk_samples::omni_shadows::{OmniShadows, OmniShadowsConfig};
use lvk_samples::reflections::{Reflections, ReflectionsConfig};
use lvk_samples::render_to_cube_map::{CubeMapFaces, RenderToCubeMap, RenderToCubeMapConfig};
use lvk_samples::rtx::RtxConfig;
use lvk_samples::rtx_ao::{RtxAo, RtxAoConfig};
use lvk_samples::rtx_hello::RtxHello;
use lvk_samples::rtx_pipeline::{RtxPipeline, RtxPipelineConfig};
use lvk_samples::rtx_textures::RtxTextures;
use lvk_samples::scene::{Camera, Scene};
use lvk_samples::shader_folder;
use lvk_samples::sponza::{Sponza, SponzaConfig};
use lvk_samples::triplanar::Triplanar;
use lvk_samples::yuv::{CONVERSIONS, Yuv, YuvConfig};
use lvk_tests::hybrid::paths;
use lvk_tests::scene_obj::obj_scene;
use lvk_tests::{device, device_with};
use tempfile::TempDir;

const SIZE: [u32; 2] = [40, 24];
const OTHER_SIZE: [u32; 2] = [24, 40];
const FRAMES: [u32; 3] = [0, 3, 7];

fn frame_time(frame: u32) -> FrameTime {
    FrameTime::from_frame(frame, 10)
}

/// Renders a sample at some times, and waits for each frame.
fn one_by_one<S: Sample>(sample: &mut S) -> Vec<Vec<u8>> {
    let mut at = |frame| {
        sample.update(frame_time(frame));
        headless::picture(sample).unwrap()
    };
    FRAMES.map(&mut at).to_vec()
}

/// The same with all frames on their way at once.
fn at_once<S: Sample>(sample: &mut S, size: [u32; 2]) -> Vec<Vec<u8>> {
    let ctx = sample.context().clone();
    let kept = FRAMES.map(|frame| {
        let copy = texture(&ctx, size);
        sample.update(frame_time(frame));
        let mut frame = Frame::free(&ctx).unwrap();
        let image = sample.record(&mut frame).unwrap();
        let region = TextureRegion::default();
        frame.cmd.copy_texture(image, &region, *copy, &region).unwrap();
        assert!(frame.finish().unwrap().is_empty(), "no readback is pending");
        copy
    });
    kept.map(|copy| ctx.download_texture(*copy, &TextureRegion::default()).unwrap()).to_vec()
}

fn texture(ctx: &Context, extent: [u32; 2]) -> Holder<TextureHandle> {
    let (format, usage) = (Format::Rgba8Unorm, TextureUsage::SAMPLED);
    ctx.create_texture(&TextureDesc { format, extent, usage, ..TextureDesc::default() }).unwrap()
}

/// True if a sample can be looked at from elsewhere.
#[derive(PartialEq)]
enum Seen {
    FromAnywhere,
    /// Flat images.
    Flat,
}

/// Asks of the sample that `make` makes what a window will.
fn check<S: Sample>(seen: Seen, make: impl Fn([u32; 2]) -> S) {
    let mut sample = make(SIZE);
    let expected = one_by_one(&mut sample);
    assert!(expected[0] != expected[1], "nothing moves");
    assert!(at_once(&mut sample, SIZE) == expected, "a frame depends on the ones under way");

    sample.resize(OTHER_SIZE).unwrap();
    assert!(one_by_one(&mut sample) == one_by_one(&mut make(OTHER_SIZE)), "another size");
    assert!(sample.resize([0, 9]).is_err() && sample.resize([9, 1 << 20]).is_err());
    sample.resize(SIZE).unwrap();
    check_reload(&mut sample, &expected);
    check_view(&mut sample, seen, &expected[0]);
    check_panel(&mut sample, &expected[0]);
}

/// Renders `sample` at the first of the times.
fn first<S: Sample>(sample: &mut S) -> Vec<u8> {
    sample.update(frame_time(FRAMES[0]));
    headless::picture(sample).unwrap()
}

fn check_reload<S: Sample>(sample: &mut S, expected: &[Vec<u8>]) {
    let wrong = changed_shaders("noSuchValue + ");
    let told = shader_folder::with(wrong.path(), || sample.reload()).unwrap_err();
    assert!(told.to_string().contains("noSuchValue"), "{told}");
    assert!(first(sample) == expected[0], "the old pipelines stay");
    let inverted = changed_shaders("1.0 - ");
    shader_folder::with(inverted.path(), || sample.reload()).unwrap();
    assert!(first(sample) != expected[0], "the new shaders are not in use");
    sample.reload().unwrap();
    assert!(one_by_one(sample) == expected, "back again, by new pipelines");
}

/// A copy of the folder of shaders with `change` before what the last one of each sample makes of light.
fn changed_shaders(change: &str) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    copy_folder(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../shaders"), folder.path());
    for (file, before) in [
        ("common/tonemap.glsl", "vec3 high = 1.055 * pow(max(linear, 0.0), "),
        ("common/tonemap.glsl", "    return 1.0 - exp("),
        ("hello_triangle/triangle.frag.glsl", "    result = vec4("),
        ("rtx_hello/view.glsl", "    return sqrt("),
        ("yuv/picture.frag.glsl", "    color = vec4(decodeSrgb(clamp("),
    ] {
        let path = folder.path().join(file);
        let text = fs::read_to_string(&path).unwrap();
        assert_eq!(text.matches(before).count(), 1, "`{before}` in {file}");
        fs::write(&path, text.replace(before, &format!("{before}{change}"))).unwrap();
    }
    folder
}

pub(crate) fn copy_folder(from: &Path, to: &Path) {
    for entry in fs::read_dir(from).unwrap() {
        let (path, to) = (entry.as_ref().unwrap().path(), to.join(entry.unwrap().file_name()));
        if path.is_dir() {
            fs::create_dir(&to).unwrap();
            copy_folder(&path, &to);
        } else {
            fs::copy(&path, &to).unwrap();
        }
    }
}

fn check_view<S: Sample>(sample: &mut S, seen: Seen, expected: &[u8]) {
    sample.update(frame_time(FRAMES[0]));
    assert!(sample.view().is_some() == (seen == Seen::FromAnywhere), "has it a camera?");
    let Some(view) = sample.view() else { return };
    sample.set_view(&Camera { vertical_fov_degrees: 0.5 * view.vertical_fov_degrees, ..view });
    assert!(headless::picture(sample).unwrap() != expected, "another view");
    sample.set_view(&view);
    assert!(headless::picture(sample).unwrap() == expected, "the first view again");
}

fn check_panel<S: Sample>(sample: &mut S, expected: &[u8]) {
    let ui = egui::Context::default();
    for _ in 0..2 {
        let _ = ui.run(egui::RawInput::default(), |ui| {
            egui::Window::new("panel").show(ui, |ui| sample.panel(ui));
        });
    }
    assert!(first(sample) == expected, "a panel changes settings without input");
}

fn rtx(ctx: &Context, [width, height]: [u32; 2]) -> RtxConfig {
    RtxConfig { path: paths(ctx)[0], width, height }
}

#[test]
fn deferred_goes_by_frames() {
    let Some(ctx) = device() else { return };
    check(Seen::FromAnywhere, |size| {
        Deferred::new(&ctx, &DeferredConfig { lights: 60, ..DeferredConfig::new(size) }).unwrap()
    });
}

#[test]
fn hello_triangle_goes_by_frames() {
    let Some(ctx) = device() else { return };
    check(Seen::Flat, |size| HelloTriangle::new(&ctx, size).unwrap());
}

#[test]
fn render_to_cube_map_goes_by_frames() {
    let Some(ctx) = device() else { return };
    check(Seen::FromAnywhere, |extent| {
        let config = RenderToCubeMapConfig {
            face_size: 32,
            ..RenderToCubeMapConfig::new(extent, CubeMapFaces::SixPasses)
        };
        RenderToCubeMap::new(&ctx, &config).unwrap()
    });
}

#[test]
fn omni_shadows_goes_by_frames() {
    let Some(ctx) = device() else { return };
    check(Seen::FromAnywhere, |size| {
        let config = OmniShadowsConfig { shadow_size: 64, shows_cube: true, ..OmniShadowsConfig::new(size) };
        OmniShadows::new(&ctx, &config).unwrap()
    });
}

#[test]
fn mesh_shaders_goes_by_frames() {
    let Some(ctx) = device() else { return };
    if !ctx.capabilities().mesh_shader {
        eprintln!("NOT TESTED, {} has no mesh shaders", ctx.capabilities().device_name);
        return;
    }
    check(Seen::FromAnywhere, |size| MeshShaders::new(&ctx, size, true).unwrap());
}

#[test]
fn yuv_goes_by_frames() {
    let Some(ctx) = device_with(|desc| desc.yuv = &CONVERSIONS) else { return };
    check(Seen::Flat, |extent| {
        Yuv::new(&ctx, &YuvConfig { video_size: [80, 48], ..YuvConfig::new(extent) }).unwrap()
    });
}

#[test]
fn triplanar_goes_by_frames() {
    let Some(ctx) = device() else { return };
    check(Seen::FromAnywhere, |size| Triplanar::new(&ctx, size).unwrap());
}

#[test]
fn rtx_hello_goes_by_frames() {
    let Some(ctx) = device() else { return };
    check(Seen::FromAnywhere, |size| RtxHello::new(&ctx, &rtx(&ctx, size)).unwrap());
}

#[test]
fn rtx_textures_goes_by_frames() {
    let Some(ctx) = device() else { return };
    check(Seen::FromAnywhere, |size| RtxTextures::new(&ctx, &rtx(&ctx, size)).unwrap());
}

#[test]
fn rtx_pipeline_goes_by_frames() {
    let Some(ctx) = device() else { return };
    let scene = obj_scene();
    check(Seen::FromAnywhere, |size| {
        let config = RtxPipelineConfig { depth: 2, ..RtxPipelineConfig::new(rtx(&ctx, size)) };
        RtxPipeline::new(&ctx, &scene, &config).unwrap()
    });
}

#[test]
fn rtx_ao_goes_by_frames() {
    let Some(ctx) = device() else { return };
    check(Seen::FromAnywhere, |size| {
        let config = RtxAoConfig { passes: 2, rays: 1, ..RtxAoConfig::new(rtx(&ctx, size)) };
        RtxAo::new(&ctx, &Scene::town(), Some(&Scene::carousel()), &config).unwrap()
    });
}

#[test]
fn large_scene_goes_by_frames() {
    let Some(ctx) = device() else { return };
    let world = World::valley(4_000, 12, &mut Progress::hidden()).unwrap();
    check(Seen::FromAnywhere, |size| {
        let config = LargeSceneConfig { depth: 1, samples: 2, ..LargeSceneConfig::new(rtx(&ctx, size)) };
        LargeScene::new(&ctx, &world, &config, &mut Progress::hidden()).unwrap()
    });
}

#[test]
fn hybrid_goes_by_frames() {
    let Some(ctx) = device() else { return };
    let scene = obj_scene();
    check(Seen::FromAnywhere, |[width, height]| {
        let (path, method) = (paths(&ctx)[0], Method::choose(None, ctx.capabilities()));
        let few = HybridConfig { max_depth: 1, samples: 2, ..HybridConfig::default() };
        let config = HybridConfig { path, method, width, height, ..few };
        let renderer = HybridRenderer::new(&ctx, &scene, &config).unwrap();
        HybridSequence::new(renderer, &scene, 0, true)
    });
}

#[test]
fn hybrid_oit_goes_by_frames() {
    let Some(ctx) = device() else { return };
    check(Seen::FromAnywhere, |[width, height]| {
        let config =
            HybridOitConfig { supersampling: 1, ..HybridOitConfig::new(paths(&ctx)[0], width, height) };
        let sample = HybridOit::new(&ctx, &OitScene::default(), &config).unwrap();
        HybridOitSequence::new(sample, 1.0)
    });
}

#[test]
fn reflections_goes_by_frames() {
    let Some(ctx) = device() else { return };
    check(Seen::FromAnywhere, |[width, height]| {
        let config =
            ReflectionsConfig { samples: 2, ..ReflectionsConfig::new(paths(&ctx)[0], width, height) };
        Reflections::new(&ctx, &config).unwrap()
    });
}

#[test]
fn sponza_goes_by_frames() {
    let Some(ctx) = device() else { return };
    let scene = obj_scene();
    check(Seen::FromAnywhere, |size| {
        let config = SponzaConfig { shadow_size: 256, triangles_per_draw: 32, ..SponzaConfig::new(size) };
        Sponza::new(&ctx, scene.clone(), &config).unwrap()
    });
}
