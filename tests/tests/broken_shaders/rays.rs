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
use lvk_tests::hybrid::paths;
use lvk_tests::image_comparison::Tolerance;
use lvk_tests::raster_sample::{SIZE, image_now, image_of};
use lvk_tests::scene_obj::obj_scene;
use lvk_tests::{device, mistakes};

/// A moment at which everything has moved.
const FRAME: u32 = 20;

mistakes! {
    // Each writes all pixels all the same, as the image is to follow from the shaders and not from what memory held before.
    HELLO:
        "rtx_hello/view.glsl": "mirrored": "vec3(0.55 * seen.x" => "vec3(-0.55 * seen.x";
        "rtx_hello/view.glsl": "white triangles": "sqrt(corners)" => "vec3(1.0)";
        "rtx_hello/view.glsl": "flat light": "mix(0.25, 1.0," => "mix(1.0, 1.0,";
        "rtx_hello/view.glsl": "an even backdrop": "2.0 * direction.y" => "0.0 * direction.y";
        "rtx_hello/hello.rchit.glsl": "all face the eye": "gl_ObjectToWorldEXT[2]" => "vec3(0.0, 0.0, 1.0)";
        "rtx_hello/hello.rgen.glsl": "jagged edges": "sum += color" => "sum = 4.0 * color";
        "rtx_hello/hello.rmiss.glsl": "no backdrop": "= backdropColor(" => "= 0.0 * backdropColor(";
    HELLO_QUERY:
        "rtx_hello/hello.comp.glsl": "turned by a corner": "(query, LVK_COMMITTED)[2]" => "(query, LVK_COMMITTED)[0]";
        "rtx_hello/hello.comp.glsl": "nothing met": "== LVK_COMMITTED_NONE" => "!= 77u";
        "rtx_hello/hello.comp.glsl": "jagged edges": "sum += color" => "sum = 4.0 * color";

    TOWN:
        "rtx_ao/light.glsl": "no sun": "bool facesSun = " => "bool facesSun = false && ";
        "rtx_ao/light.glsl": "all is open": "ray > 0u && isOpen ?" => "ray > 0u ?";
        "rtx_ao/light.glsl": "surroundings without end": "1e30 : frame.radius" => "1e30 : 1e30";
        "rtx_ao/light.glsl": "rays into one corner": "vec3(disc, sqrt(" => "vec3(abs(disc), sqrt(";
        "rtx_ao/light.rgen.glsl": "no normals": "lightAt(position.xyz, normal," => "lightAt(position.xyz, geometric,";
        "rtx_ao/open.rmiss.glsl": "all is blocked": "blocked = 0u" => "blocked = 1u";
        "rtx_ao/surface.frag.glsl": "white houses": "vec4(albedoHere(), 1.0)" => "vec4(1.0)";
        "rtx_ao/surface.vert.glsl": "normals at rest": "outNormal = toWorld(" => "outNormal = vec3(";
        "rtx_ao/accumulate.comp.glsl": "the last pass alone": "sum += frame.sums" => "sum += 0.0 * frame.sums";
        "rtx_ao/accumulate.comp.glsl": "even ambient light": "light.z)" => "0.5)";
    /// Seen from where there is some.
    TOWN_SKY:
        "rtx_ao/accumulate.comp.glsl": "no sky": "vec4(skyRadiance(" => "vec4(0.0 * skyRadiance(";
    TOWN_QUERY:
        "rtx_ao/surface.frag.glsl": "all is blocked": "!= LVK_COMMITTED_NONE" => "!= 77u";
        "rtx_ao/surface.frag.glsl": "rays too short": "direction, range);" => "direction, 0.1 * range);";
        "rtx_ao/surface.frag.glsl": "no normals": "lightAt(inPosition, normal," => "lightAt(inPosition, geometric,";

    RECURSION:
        "rtx_pipeline/glass.rchit.glsl": "glass is solid": "shadeGlass(" => "shadeSolid(";
        "rtx_pipeline/solid.rchit.glsl": "textures blurred": "payload.cone)" => "payload.cone + 0.5)";
        "rtx_pipeline/light.rmiss.glsl": "no light arrives": "occluded = 0u" => "occluded = 1u";
        "rtx_pipeline/sky.rmiss.glsl": "no sky": "payload.light = " => "payload.light = 0.0 * ";
        "rtx_pipeline/recursion.glsl": "one bounce": "payload.depth + 1u)" => "payload.depth + 9u)";
        "rtx_pipeline/recursion.glsl": "hits elsewhere": "pointOf(triangle, barycentrics," => "pointOf(triangle, barycentrics.yx,";
        "rtx_pipeline/recursion.glsl": "no shadows": "return occluded != 0u" => "return false";
        "rtx_pipeline/shade.glsl": "nothing is followed": "return depth < frame.depth" => "return false";
        "rtx_pipeline/shade.glsl": "no mirror": "= material.reflectivity * material.tint" => "= 0.0 * material.tint";
        "rtx_pipeline/shade.glsl": "light bent the wrong way": "1.0 / material.ior : material.ior" => "material.ior : 1.0 / material.ior";
        "rtx_pipeline/shade.glsl": "glass mirrors no sky": "if (facing.entering)" => "if (false)";
        "rtx_pipeline/picture.glsl": "not exposed": "expose(light)" => "light";
        "rtx_pipeline/picture.rgen.glsl": "no glass": "kMaskAll" => "kMaskSolid";
    LOOP:
        "rtx_pipeline/picture.comp.glsl": "glass is solid": "== kGlass;" => "== 77u;";
        "rtx_pipeline/picture.comp.glsl": "glass casts shadows": "flags, kMaskSolid" => "flags, kMaskAll";
        "rtx_pipeline/picture.comp.glsl": "mirrors lose nothing": "weight *= ray.weight;" => ";";
        "rtx_pipeline/picture.comp.glsl": "other triangles": "= firstTriangle + " => "= 0u * firstTriangle + ";
        "rtx_pipeline/picture.comp.glsl": "no light arrives": "!= LVK_COMMITTED_NONE" => "!= 77u";

    WAVES:
        "rtx_textures/glazed.rchit.glsl": "nothing glazed": "asGlazed(" => "asPainted(";
        "rtx_textures/painted.rchit.glsl": "all glazed": "asPainted(" => "asGlazed(";
        "rtx_textures/instances.comp.glsl": "no waves": "0.3 * sin(wave)" => "0.0 * sin(wave)";
        "rtx_textures/instances.comp.glsl": "one texture": "(cell * 5u + cell / 7u) % 6u" => "0u";
        "rtx_textures/instances.comp.glsl": "one hit group": "? kGlazed : kPainted" => "? kPainted : kPainted";
        "rtx_textures/textures.rgen.glsl": "no shadows": "return payload.distance < 0.0" => "return true";
        "rtx_textures/shade.glsl": "no sky": "weight * skyRadiance(" => "0.0 * skyRadiance(";
        "rtx_textures/shade.glsl": "one view a pixel": "vec2 within = fract(0.5 +" => "vec2 within = 0.0 * fract(0.5 +";
        "rtx_textures/shade.glsl": "glaze without shine": "found.gloss *" => "0.0 * found.gloss *";
        "rtx_textures/surface.glsl": "normals not turned": "toWorld * normal" => "normal";
        "rtx_textures/surface.glsl": "textures blurred": "float lod = " => "float lod = 2.0 + ";
        "rtx_textures/surface.glsl": "dull glaze": "found.albedo *= found.albedo" => "found.albedo *= 1.0";
    WAVES_QUERY:
        "rtx_textures/textures.comp.glsl": "nothing glazed": "== kGlazed ?" => "== 77u ?";
        "rtx_textures/textures.comp.glsl": "no shadows": "return lvkRayQueryType(" => "return true || lvkRayQueryType(";
        "rtx_textures/textures.comp.glsl": "far textures sharp": "lvkRayQueryT(query, LVK_COMMITTED), travelled)" => "lvkRayQueryT(query, LVK_COMMITTED), 40.0)";

    VALLEY:
        "large_scene/nearest.rchit.glsl": "other triangles": "[gl_InstanceCustomIndexEXT] +" => "[0] +";
        "large_scene/nearest.rchit.glsl": "one instance": "uint(lvkInstanceId(frame.tlas))" => "0u";
        "large_scene/nearest.rchit.glsl": "hits elsewhere": "= barycentrics;" => "= barycentrics.yx;";
        "large_scene/nearest.rmiss.glsl": "no sky": "= kNothing;" => "= 0u;";
        "large_scene/open.rmiss.glsl": "no light arrives": "occluded = 0u" => "occluded = 1u";
        "large_scene/picture.rgen.glsl": "no shadows": "return occluded != 0u" => "return false";
        "large_scene/picture.glsl": "one place in a pixel": "= 2.0 * shift" => "= 0.0 * shift";
    /// Of large things, one of which is turned.
    STREET:
        "large_scene/picture.glsl": "normals not turned": "point.normal = turn *" => "point.normal =";
        "large_scene/picture.glsl": "places not turned": "turn * (point.position * scale)" => "(point.position * scale)";
    VALLEY_NUMBERS:
        "large_scene/picture.glsl": "one number": "? hit.instance :" => "? 0u :";
        "large_scene/picture.glsl": "one hue": "vec3(0.0, 2.1, 4.2)" => "vec3(0.0)";
        "large_scene/picture.glsl": "flat light": "0.65 * abs(" => "0.65 + 0.0 * abs(";
    VALLEY_QUERY:
        "large_scene/picture.comp.glsl": "other triangles": "hit.triangle = first +" => "hit.triangle = 0u * first +";
        "large_scene/picture.comp.glsl": "one instance": "hit.instance = " => "hit.instance = 0u * ";
        "large_scene/picture.comp.glsl": "hits elsewhere": "hit.barycentrics = " => "hit.barycentrics = 0.5 * ";
        "large_scene/picture.comp.glsl": "no light arrives": "return lvkRayQueryType(" => "return true || lvkRayQueryType(";
}

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
