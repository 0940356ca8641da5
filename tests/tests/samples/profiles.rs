//! Samples under the profiles of Apple's and of recent phones' GPUs: each renders, and what it renders is what the
//! device renders without a profile.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use image::RgbaImage;
use lvk::{Context, DeviceProfile, RayQueryPath, RayQueryRequest};
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
use lvk_samples::scene::Scene;
use lvk_samples::sponza::{Sponza, SponzaConfig};
use lvk_samples::triplanar::Triplanar;
use lvk_samples::yuv::{CONVERSIONS, Yuv, YuvConfig};
use lvk_tests::accel_backend::builds_device_accel_structs;
use lvk_tests::hybrid::paths;
use lvk_tests::image_comparison::{Tolerance, assert_similar};
use lvk_tests::scene_obj::obj_scene;
use lvk_tests::{TestDevice, device_with};

const SIZE: [u32; 2] = [40, 24];
const SAME_DRAWS: Tolerance = Tolerance { psnr: 60.0, ssim: 0.9999, differing_share: 0.0, flip: 1e-4 };
/// Other paths of rays find other hits at the edges of a few triangles.
const SAME_RAYS: Tolerance = Tolerance { psnr: 40.0, ssim: 0.99, differing_share: 0.02, flip: 4e-3 };

/// Creates a context under `profile`, which traces in software where the profile hides ray tracing.
fn under(profile: Option<&DeviceProfile>) -> Option<TestDevice> {
    device_with(|desc| {
        (desc.profile, desc.yuv) = (profile, &CONVERSIONS);
        if profile.is_some_and(|profile| !profile.ray_tracing_pipeline && !profile.ray_query) {
            desc.ray_query = RayQueryRequest::Auto;
        }
    })
}

fn render<S: Sample>(mut sample: S) -> RgbaImage {
    sample.update(FrameTime::from_frame(3, 10));
    let pixels = headless::picture(&mut sample).unwrap();
    RgbaImage::from_raw(SIZE[0], SIZE[1], pixels).unwrap()
}

/// Renders a sample under the profile and without, and compares.
fn rehearse<S: Sample>(
    devices: &[TestDevice; 2],
    what: &str,
    tolerance: &Tolerance,
    make: impl Fn(&Context) -> S,
) {
    let [image, expected] = devices.each_ref().map(|ctx| render(make(ctx)));
    assert!(expected.pixels().any(|pixel| pixel != expected.get_pixel(0, 0)), "{what} shows nothing");
    assert_similar(what, &image, &expected, tolerance);
}

fn rtx(ctx: &Context) -> RtxConfig {
    RtxConfig { path: paths(ctx)[0], width: SIZE[0], height: SIZE[1] }
}

fn hybrid(ctx: &Context, scene: &Scene) -> HybridSequence {
    let [width, height] = SIZE;
    let (path, method) = (paths(ctx)[0], Method::choose(None, ctx.capabilities()));
    let config =
        HybridConfig { path, method, width, height, max_depth: 1, samples: 1, ..HybridConfig::default() };
    HybridSequence::new(HybridRenderer::new(ctx, scene, &config).unwrap(), scene, 0, true)
}

fn large_scene(ctx: &Context, world: &World) -> LargeScene {
    let config = LargeSceneConfig { depth: 1, samples: 1, ..LargeSceneConfig::new(rtx(ctx)) };
    LargeScene::new(ctx, world, &config, &mut Progress::hidden()).unwrap()
}

fn valley() -> World {
    World::valley(4_000, 12, &mut Progress::hidden()).unwrap()
}

fn devices(profile: &DeviceProfile) -> Option<[TestDevice; 2]> {
    Some([under(Some(profile))?, under(None)?])
}

#[test]
fn samples_that_rasterise_render_under_moltenvk() {
    let Some(devices) = devices(&DeviceProfile::moltenvk()) else { return };
    rehearse(&devices, "hello_triangle", &SAME_DRAWS, |ctx| HelloTriangle::new(ctx, SIZE).unwrap());
    rehearse(&devices, "deferred", &SAME_DRAWS, |ctx| {
        Deferred::new(ctx, &DeferredConfig { lights: 20, ..DeferredConfig::new(SIZE) }).unwrap()
    });
    rehearse(&devices, "omni_shadows", &SAME_DRAWS, |ctx| {
        let config = OmniShadowsConfig { shadow_size: 64, shows_cube: true, ..OmniShadowsConfig::new(SIZE) };
        OmniShadows::new(ctx, &config).unwrap()
    });
    rehearse(&devices, "render_to_cube_map", &SAME_DRAWS, |ctx| {
        let config = RenderToCubeMapConfig {
            face_size: 32,
            ..RenderToCubeMapConfig::new(SIZE, CubeMapFaces::SixPasses)
        };
        RenderToCubeMap::new(ctx, &config).unwrap()
    });
    rehearse(&devices, "sponza", &SAME_DRAWS, |ctx| {
        let config = SponzaConfig { shadow_size: 256, triangles_per_draw: 32, ..SponzaConfig::new(SIZE) };
        Sponza::new(ctx, obj_scene(), &config).unwrap()
    });
    rehearse(&devices, "triplanar", &SAME_DRAWS, |ctx| Triplanar::new(ctx, SIZE).unwrap());
    rehearse(&devices, "yuv", &SAME_DRAWS, |ctx| {
        Yuv::new(ctx, &YuvConfig { video_size: [80, 48], ..YuvConfig::new(SIZE) }).unwrap()
    });
    let refused = MeshShaders::new(&devices[0], SIZE, true).err().unwrap().to_string();
    assert!(refused.contains("mesh shaders"), "{refused}");
}

#[test]
fn samples_that_trace_rays_render_under_moltenvk_in_software() {
    let Some(devices) = devices(&DeviceProfile::moltenvk()) else { return };
    assert_eq!(devices[0].capabilities().ray_query_path, RayQueryPath::Software);
    let [width, height] = SIZE;
    let scene = obj_scene();
    rehearse(&devices, "rtx_hello", &SAME_RAYS, |ctx| RtxHello::new(ctx, &rtx(ctx)).unwrap());
    rehearse(&devices, "rtx_textures", &SAME_RAYS, |ctx| RtxTextures::new(ctx, &rtx(ctx)).unwrap());
    rehearse(&devices, "rtx_pipeline", &SAME_RAYS, |ctx| {
        let config = RtxPipelineConfig { depth: 1, ..RtxPipelineConfig::new(rtx(ctx)) };
        RtxPipeline::new(ctx, &scene, &config).unwrap()
    });
    rehearse(&devices, "rtx_ao", &SAME_RAYS, |ctx| {
        let config = RtxAoConfig { passes: 1, rays: 1, ..RtxAoConfig::new(rtx(ctx)) };
        RtxAo::new(ctx, &scene, None, &config).unwrap()
    });
    rehearse(&devices, "reflections", &SAME_RAYS, |ctx| {
        Reflections::new(
            ctx,
            &ReflectionsConfig { samples: 1, ..ReflectionsConfig::new(paths(ctx)[0], width, height) },
        )
        .unwrap()
    });
    rehearse(&devices, "hybrid_oit", &SAME_RAYS, |ctx| {
        let config =
            HybridOitConfig { supersampling: 1, ..HybridOitConfig::new(paths(ctx)[0], width, height) };
        HybridOitSequence::new(HybridOit::new(ctx, &OitScene::default(), &config).unwrap(), 1.0)
    });
    rehearse(&devices, "hybrid", &SAME_RAYS, |ctx| hybrid(ctx, &scene));
    rehearse(&devices, "large_scene", &SAME_RAYS, |ctx| large_scene(ctx, &valley()));
}

/// Bytes of scratch for which the meshes here are large, as those of applications are for 256 MiB.
const SMALL_SCRATCH: u64 = 2 << 20;

#[test]
fn hybrid_and_large_scene_render_under_recent_phones() {
    let (scene, world) = (obj_scene(), valley().combined().unwrap());
    let mali = DeviceProfile { max_accel_scratch_bytes: SMALL_SCRATCH, ..DeviceProfile::mali_g720() };
    for profile in [DeviceProfile::adreno_840(), mali] {
        let Some(devices) = devices(&profile) else { return };
        let pipelines = devices[1].capabilities().ray_tracing_pipeline && profile.ray_tracing_pipeline;
        assert_eq!(devices[0].capabilities().ray_tracing_pipeline, pipelines);
        rehearse(&devices, &format!("hybrid, {}", profile.name), &SAME_RAYS, |ctx| hybrid(ctx, &scene));
        let what = format!("large_scene, {}", profile.name);
        rehearse(&devices, &what, &SAME_RAYS, |ctx| large_scene(ctx, &world));
        if builds_device_accel_structs(&devices[0]) {
            let parts = large_scene(&devices[0], &world).figures().parts();
            let least = scratch_bytes(&profile, &world).div_ceil(profile.max_accel_scratch_bytes.max(1));
            assert!(u64::from(parts) >= least, "{}: {parts} parts of {least}", profile.name);
            assert_eq!(
                parts > 4,
                profile.max_accel_scratch_bytes == SMALL_SCRATCH,
                "{}: {parts}",
                profile.name
            );
        }
    }
}

/// Scratch that the profile's driver needs for a build of the whole world.
fn scratch_bytes(profile: &DeviceProfile, world: &World) -> u64 {
    world.triangle_count() * profile.scratch_bytes_per_primitive
}
