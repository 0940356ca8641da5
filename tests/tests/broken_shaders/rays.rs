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
use lvk_tests::broken_shaders::{BrokenShaders, Mistake, mistake};
use lvk_tests::device;
use lvk_tests::hybrid::paths;
use lvk_tests::image_comparison::Tolerance;
use lvk_tests::raster_sample::{SIZE, image_now, image_of};
use lvk_tests::scene_obj::obj_scene;

/// A moment at which everything has moved.
const FRAME: u32 = 20;

// Each writes all pixels all the same, as the image is to follow from the shaders and not from what memory held before.
const HELLO: [Mistake; 7] = [
    mistake("mirrored", "rtx_hello/view.glsl", "vec3(0.55 * seen.x", "vec3(-0.55 * seen.x"),
    mistake("white triangles", "rtx_hello/view.glsl", "sqrt(corners)", "vec3(1.0)"),
    mistake("flat light", "rtx_hello/view.glsl", "mix(0.25, 1.0,", "mix(1.0, 1.0,"),
    mistake("an even backdrop", "rtx_hello/view.glsl", "2.0 * direction.y", "0.0 * direction.y"),
    mistake(
        "all face the eye",
        "rtx_hello/hello.rchit.glsl",
        "gl_ObjectToWorldEXT[2]",
        "vec3(0.0, 0.0, 1.0)",
    ),
    mistake("jagged edges", "rtx_hello/hello.rgen.glsl", "sum += color", "sum = 4.0 * color"),
    mistake("no backdrop", "rtx_hello/hello.rmiss.glsl", "= backdropColor(", "= 0.0 * backdropColor("),
];
const HELLO_QUERY: [Mistake; 3] = [
    mistake(
        "turned by a corner",
        "rtx_hello/hello.comp.glsl",
        "(query, LVK_COMMITTED)[2]",
        "(query, LVK_COMMITTED)[0]",
    ),
    mistake("nothing met", "rtx_hello/hello.comp.glsl", "== LVK_COMMITTED_NONE", "!= 77u"),
    mistake("jagged edges", "rtx_hello/hello.comp.glsl", "sum += color", "sum = 4.0 * color"),
];

const TOWN: [Mistake; 10] = [
    mistake("no sun", "rtx_ao/light.glsl", "bool facesSun = ", "bool facesSun = false && "),
    mistake("all is open", "rtx_ao/light.glsl", "ray > 0u && isOpen ?", "ray > 0u ?"),
    mistake("surroundings without end", "rtx_ao/light.glsl", "1e30 : frame.radius", "1e30 : 1e30"),
    mistake("rays into one corner", "rtx_ao/light.glsl", "vec3(disc, sqrt(", "vec3(abs(disc), sqrt("),
    mistake(
        "no normals",
        "rtx_ao/light.rgen.glsl",
        "lightAt(position.xyz, normal,",
        "lightAt(position.xyz, geometric,",
    ),
    mistake("all is blocked", "rtx_ao/open.rmiss.glsl", "blocked = 0u", "blocked = 1u"),
    mistake("white houses", "rtx_ao/surface.frag.glsl", "vec4(albedoHere(), 1.0)", "vec4(1.0)"),
    mistake("normals at rest", "rtx_ao/surface.vert.glsl", "outNormal = toWorld(", "outNormal = vec3("),
    mistake(
        "the last pass alone",
        "rtx_ao/accumulate.comp.glsl",
        "sum += frame.sums",
        "sum += 0.0 * frame.sums",
    ),
    mistake("even ambient light", "rtx_ao/accumulate.comp.glsl", "light.z)", "0.5)"),
];
/// Seen from where there is some.
const TOWN_SKY: [Mistake; 1] =
    [mistake("no sky", "rtx_ao/accumulate.comp.glsl", "vec4(skyRadiance(", "vec4(0.0 * skyRadiance(")];
const TOWN_QUERY: [Mistake; 3] = [
    mistake(
        "all is blocked",
        "rtx_ao/surface.frag.glsl",
        "return occludedByQuery(",
        "return true || occludedByQuery(",
    ),
    mistake("rays too short", "rtx_ao/surface.frag.glsl", "direction, range);", "direction, 0.1 * range);"),
    mistake(
        "no normals",
        "rtx_ao/surface.frag.glsl",
        "lightAt(inPosition, normal,",
        "lightAt(inPosition, geometric,",
    ),
];

const RECURSION: [Mistake; 13] = [
    mistake("glass is solid", "rtx_pipeline/glass.rchit.glsl", "shadeGlass(", "shadeSolid("),
    mistake("textures blurred", "rtx_pipeline/solid.rchit.glsl", "payload.cone)", "payload.cone + 0.5)"),
    mistake("no light arrives", "rtx_pipeline/light.rmiss.glsl", "occluded = 0u", "occluded = 1u"),
    mistake("no sky", "rtx_pipeline/sky.rmiss.glsl", "payload.light = ", "payload.light = 0.0 * "),
    mistake("one bounce", "rtx_pipeline/recursion.glsl", "payload.depth + 1u)", "payload.depth + 9u)"),
    mistake(
        "hits elsewhere",
        "rtx_pipeline/recursion.glsl",
        "pointOf(triangle, barycentrics,",
        "pointOf(triangle, barycentrics.yx,",
    ),
    mistake("no shadows", "rtx_pipeline/recursion.glsl", "return occluded != 0u", "return false"),
    mistake("nothing is followed", "rtx_pipeline/shade.glsl", "return depth < frame.depth", "return false"),
    mistake(
        "no mirror",
        "rtx_pipeline/shade.glsl",
        "= material.reflectivity * material.tint",
        "= 0.0 * material.tint",
    ),
    mistake(
        "light bent the wrong way",
        "rtx_pipeline/shade.glsl",
        "1.0 / material.ior : material.ior",
        "material.ior : 1.0 / material.ior",
    ),
    mistake("glass mirrors no sky", "rtx_pipeline/shade.glsl", "if (facing.entering)", "if (false)"),
    mistake("not exposed", "rtx_pipeline/picture.glsl", "expose(light)", "light"),
    mistake("no glass", "rtx_pipeline/picture.rgen.glsl", "kMaskAll", "kMaskSolid"),
];
const LOOP: [Mistake; 5] = [
    mistake("glass is solid", "rtx_pipeline/picture.comp.glsl", "== kGlass;", "== 77u;"),
    mistake(
        "glass casts shadows",
        "rtx_pipeline/picture.comp.glsl",
        "frame.tlas, kMaskSolid",
        "frame.tlas, kMaskAll",
    ),
    mistake("mirrors lose nothing", "rtx_pipeline/picture.comp.glsl", "weight *= ray.weight;", ";"),
    mistake(
        "other triangles",
        "rtx_pipeline/picture.comp.glsl",
        "= firstTriangle + ",
        "= 0u * firstTriangle + ",
    ),
    mistake(
        "no light arrives",
        "rtx_pipeline/picture.comp.glsl",
        "return occludedByQuery(",
        "return true || occludedByQuery(",
    ),
];

const WAVES: [Mistake; 12] = [
    mistake("nothing glazed", "rtx_textures/glazed.rchit.glsl", "asGlazed(", "asPainted("),
    mistake("all glazed", "rtx_textures/painted.rchit.glsl", "asPainted(", "asGlazed("),
    mistake("no waves", "rtx_textures/instances.comp.glsl", "0.3 * sin(wave)", "0.0 * sin(wave)"),
    mistake("one texture", "rtx_textures/instances.comp.glsl", "(cell * 5u + cell / 7u) % 6u", "0u"),
    mistake(
        "one hit group",
        "rtx_textures/instances.comp.glsl",
        "? kGlazed : kPainted",
        "? kPainted : kPainted",
    ),
    mistake("no shadows", "rtx_textures/textures.rgen.glsl", "return payload.distance < 0.0", "return true"),
    mistake("no sky", "rtx_textures/shade.glsl", "weight * skyRadiance(", "0.0 * skyRadiance("),
    mistake(
        "one view a pixel",
        "rtx_textures/shade.glsl",
        "vec2 within = fract(0.5 +",
        "vec2 within = 0.0 * fract(0.5 +",
    ),
    mistake("glaze without shine", "rtx_textures/shade.glsl", "found.gloss *", "0.0 * found.gloss *"),
    mistake("normals not turned", "rtx_textures/surface.glsl", "toWorld * normal", "normal"),
    mistake("textures blurred", "rtx_textures/surface.glsl", "float lod = ", "float lod = 2.0 + "),
    mistake("dull glaze", "rtx_textures/surface.glsl", "found.albedo *= found.albedo", "found.albedo *= 1.0"),
];
const WAVES_QUERY: [Mistake; 3] = [
    mistake("nothing glazed", "rtx_textures/textures.comp.glsl", "== kGlazed ?", "== 77u ?"),
    mistake(
        "no shadows",
        "rtx_textures/textures.comp.glsl",
        "return lvkRayQueryType(",
        "return true || lvkRayQueryType(",
    ),
    mistake(
        "far textures sharp",
        "rtx_textures/textures.comp.glsl",
        "lvkRayQueryT(query, LVK_COMMITTED), travelled)",
        "lvkRayQueryT(query, LVK_COMMITTED), 40.0)",
    ),
];

const VALLEY: [Mistake; 7] = [
    mistake("other triangles", "large_scene/nearest.rchit.glsl", "[gl_InstanceCustomIndexEXT] +", "[0] +"),
    mistake("one instance", "large_scene/nearest.rchit.glsl", "uint(lvkInstanceId(frame.tlas))", "0u"),
    mistake("hits elsewhere", "large_scene/nearest.rchit.glsl", "= barycentrics;", "= barycentrics.yx;"),
    mistake("no sky", "large_scene/nearest.rmiss.glsl", "= kNothing;", "= 0u;"),
    mistake("no light arrives", "large_scene/open.rmiss.glsl", "occluded = 0u", "occluded = 1u"),
    mistake("no shadows", "large_scene/picture.rgen.glsl", "return occluded != 0u", "return false"),
    mistake("one place in a pixel", "large_scene/picture.glsl", "= 2.0 * shift", "= 0.0 * shift"),
];
/// Of large things, one of which is turned.
const STREET: [Mistake; 2] = [
    mistake("normals not turned", "large_scene/picture.glsl", "point.normal = turn *", "point.normal ="),
    mistake(
        "places not turned",
        "large_scene/picture.glsl",
        "turn * (point.position * scale)",
        "(point.position * scale)",
    ),
];
const VALLEY_NUMBERS: [Mistake; 3] = [
    mistake("one number", "large_scene/picture.glsl", "? hit.instance :", "? 0u :"),
    mistake("one hue", "large_scene/picture.glsl", "vec3(0.0, 2.1, 4.2)", "vec3(0.0)"),
    mistake("flat light", "large_scene/picture.glsl", "0.65 * abs(", "0.65 + 0.0 * abs("),
];
const VALLEY_QUERY: [Mistake; 4] = [
    mistake(
        "other triangles",
        "large_scene/picture.comp.glsl",
        "hit.triangle = first +",
        "hit.triangle = 0u * first +",
    ),
    mistake("one instance", "large_scene/picture.comp.glsl", "hit.instance = ", "hit.instance = 0u * "),
    mistake(
        "hits elsewhere",
        "large_scene/picture.comp.glsl",
        "hit.barycentrics = ",
        "hit.barycentrics = 0.5 * ",
    ),
    mistake(
        "no light arrives",
        "large_scene/picture.comp.glsl",
        "return lvkRayQueryType(",
        "return true || lvkRayQueryType(",
    ),
];

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
        check(shaders, "hello", &ctx, [&HELLO, &HELLO_QUERY], |config| {
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
        check(shaders, "town", &ctx, [&TOWN, &TOWN_QUERY], moved);
        let above = Camera::looking_at([0.0, 30.0, 0.0], [30.0, 32.0, 0.0], 60.0);
        check(shaders, "above the town", &ctx, [&TOWN_SKY; 2], |config| {
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
        check(shaders, "still life", &ctx, [&RECURSION, &LOOP], |config| {
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
        check(shaders, "waves", &ctx, [&WAVES, &WAVES_QUERY], |config| {
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
        check(shaders, "valley", &ctx, [&VALLEY, &VALLEY_QUERY], |rtx| show(&valley, rtx, Show::Picture));
        check(shaders, "street", &ctx, [&STREET; 2], |rtx| show(&street, rtx, Show::Picture));
        let mistakes = [&VALLEY_NUMBERS, &VALLEY_QUERY[1..2]];
        check(shaders, "instances", &ctx, mistakes, |rtx| show(&valley, rtx, Show::Instances));
    });
}
