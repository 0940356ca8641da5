//! Tests of the image tests of the samples that only rasterise: a shader broken on purpose changes the image.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk::{Context, OptionalFeature};
use lvk_samples::app::sample::Sample;
use lvk_samples::deferred::{Deferred, DeferredConfig, Passes};
use lvk_samples::hello_triangle::HelloTriangle;
use lvk_samples::mesh_shaders::MeshShaders;
use lvk_samples::omni_shadows::{self, OmniShadows, OmniShadowsConfig, ShadowFilter};
use lvk_samples::render_to_cube_map::{Faces, RenderToCubeMap, RenderToCubeMapConfig};
use lvk_samples::scene::Scene;
use lvk_samples::sponza::{DrawPath, Sponza, SponzaConfig};
use lvk_samples::triplanar::Triplanar;
use lvk_samples::yuv::{CONVERSIONS, Yuv, YuvConfig};
use lvk_tests::broken_shaders::{BrokenShaders, Mistake, mistake};
use lvk_tests::image_comparison::Tolerance;
use lvk_tests::raster::has;
use lvk_tests::raster_sample::{SIZE, image_of};
use lvk_tests::scene_normal_map::{Tilt, normal_map_scene};
use lvk_tests::scene_obj::obj_scene;
use lvk_tests::scene_shadow_mask::shadow_mask_scene;
use lvk_tests::{device, device_with};

/// A moment at which everything has moved.
const FRAME: u32 = 20;

const TRIANGLE: [Mistake; 3] = [
    mistake(
        "turns the other way",
        "hello_triangle/triangle.vert.glsl",
        "= radians(360.0)",
        "= -radians(360.0)",
    ),
    mistake("as wide as the picture", "hello_triangle/triangle.vert.glsl", " / aspect", ""),
    mistake("other colours", "hello_triangle/triangle.frag.glsl", "vec4(color, 1.0)", "vec4(color.bgr, 1.0)"),
];

const CUBE_MAP: [Mistake; 7] = [
    mistake("blocks askew", "render_to_cube_map/block.vert.glsl", "turned * (place", "(place"),
    mistake("other squares", "render_to_cube_map/block.frag.glsl", "wave.x * wave.y", "wave.x"),
    mistake(
        "glass in place of a mirror",
        "render_to_cube_map/drop.frag.glsl",
        "reflect(seen, normal)",
        "seen",
    ),
    mistake("sharp rim", "render_to_cube_map/drop.frag.glsl", "log2(max(texels, 1.0))", "0.0"),
    mistake("a ball", "render_to_cube_map/drop.glsl", "1.0 + frame.waves *", "1.0 + 0.0 *"),
    mistake("no sky", "render_to_cube_map/sky.frag.glsl", "targetColor(", "0.0 * targetColor("),
    mistake("no shadow", "render_to_cube_map/light.glsl", "sun = along > 0.0", "sun = along > 1e9"),
];
const CUBE_MAP_FACES: [Mistake; 2] = [
    mistake("one view six times", "render_to_cube_map/view.glsl", "cameras[gl_ViewIndex]", "cameras[0]"),
    mistake("no sky", "render_to_cube_map/sky.frag.glsl", "targetColor(", "0.0 * targetColor("),
];

const MESHLETS: [Mistake; 6] = [
    mistake(
        "leaves out what looks here",
        "mesh_shaders/meshlet.task.glsl",
        "(meshlet.axis)) >=",
        "(meshlet.axis)) <=",
    ),
    mistake("a frustum too narrow", "mesh_shaders/meshlet.task.glsl", "radius * slope", "-2.5 * slope"),
    mistake(
        "one meshlet less a group",
        "mesh_shaders/meshlet.task.glsl",
        "EmitMeshTasksEXT(count",
        "EmitMeshTasksEXT(max(count, 1u) - 1u",
    ),
    mistake("triangles without area", "mesh_shaders/meshlet.mesh.glsl", "corners >> 8", "corners >> 16"),
    mistake("all together", "mesh_shaders/frame.glsl", "frame.apart * wave", "0.0 * wave"),
    mistake("one colour", "mesh_shaders/meshlet.frag.glsl", "meshletColor(meshletNumber", "meshletColor(0u"),
];

const BODIES: [Mistake; 6] = [
    mistake("soft borders", "triplanar/triplanar.glsl", "vec3(frame.sharpness)", "vec3(0.5)"),
    mistake(
        "sides on top",
        "triplanar/triplanar.glsl",
        "normal.y > 0.0 ? body.top : body.sides",
        "body.sides",
    ),
    mistake("a plane askew", "triplanar/triplanar.glsl", "position.xy)", "position.xz)"),
    mistake("upside down", "triplanar/triplanar.glsl", "-0.5 * at.y", "0.5 * at.y"),
    mistake("at rest", "triplanar/body.vert.glsl", "turned(body, position)", "position"),
    mistake("no shadows", "triplanar/body.frag.glsl", "along > 0.0", "along > 1e9"),
];

const HALL: [Mistake; 14] = [
    mistake("no night sky", "deferred/ambient.frag.glsl", "vec4(sky(-surface.toEye.y)", "vec4(vec3(0.0)"),
    mistake("mirrors nothing", "deferred/ambient.frag.glsl", "+ mirrored + moon", "+ moon"),
    mistake("no shine", "deferred/glow.frag.glsl", "0.2 * shine", "0.0 * shine"),
    mistake("no lights", "deferred/light.frag.glsl", "vec4(color * window", "vec4(0.0 * color * window"),
    mistake(
        "lights without end",
        "deferred/light.frag.glsl",
        "float window = ",
        "float window = 1.0; float unused = ",
    ),
    mistake(
        "bodies of lights too small",
        "deferred/light.vert.glsl",
        "kAround * light.reach",
        "0.4 * light.reach",
    ),
    mistake("dark orbs", "deferred/orbs.frag.glsl", "color * 2.2 + 0.7 * (1.0 - from)", "color * 0.0"),
    mistake(
        "orbs and shine elsewhere",
        "deferred/orbs.vert.glsl",
        "light.position + ",
        "light.position + 0.3 + ",
    ),
    mistake("no mist", "deferred/resolve.frag.glsl", "exp(-0.016 *", "exp(-0.0 *"),
    mistake("slabs of one kind", "deferred/surfaces.frag.glsl", "mix(1.0, 0.22, other)", "1.0"),
    mistake(
        "normals inside out",
        "deferred/surfaces.vert.glsl",
        "normal = vertex.normal",
        "normal = -vertex.normal",
    ),
    mistake("no highlights", "deferred/targets.glsl", "distribution * masking", "0.0 * masking"),
    mistake(
        "surfaces elsewhere",
        "deferred/targets.glsl",
        "frame.camera.eye + frame",
        "0.3 + frame.camera.eye + frame",
    ),
    mistake("lights at rest", "deferred/frame.glsl", "kTau * (frame.phase *", "kTau * (0.0 *"),
];
const HALL_SEVERAL: [Mistake; 2] = [
    mistake(
        "the albedo for all",
        "deferred/targets.glsl",
        "kTextures2D[frame.name]",
        "kTextures2D[frame.albedo]",
    ),
    mistake(
        "not at this pixel",
        "deferred/targets.glsl",
        "ivec2(gl_FragCoord.xy), 0)",
        "ivec2(gl_FragCoord.yx), 0)",
    ),
];
const HALL_ONE: [Mistake; 1] =
    [mistake("the normal for the light", "deferred/resolve.frag.glsl", "LVK_INPUT(2, ", "LVK_INPUT(1, ")];

const LAMP: [Mistake; 15] = [
    mistake(
        "one face twice",
        "omni_shadows/caster.vert.glsl",
        "uint(gl_ViewIndex)",
        "uint(gl_ViewIndex) & 6u",
    ),
    mistake(
        "a face turned",
        "omni_shadows/caster.vert.glsl",
        "vec3(d.x, -d.y, d.z)",
        "vec3(-d.x, -d.y, d.z)",
    ),
    mistake("the lamp elsewhere", "omni_shadows/caster.vert.glsl", "- frame.light)", "- frame.light + 0.2)"),
    mistake("surfaces shade themselves", "omni_shadows/shadow.glsl", "way += 1.5 *", "way -= 1.5 *"),
    mistake("hard edges", "omni_shadows/shadow.glsl", "return frame.bulb *", "return 0.0 *"),
    mistake("no shadows", "omni_shadows/shadow.glsl", "part >= 1.0", "part >= 0.0"),
    mistake("no haze", "omni_shadows/haze.glsl", "return frame.haze *", "return 0.0 *"),
    mistake("no beams", "omni_shadows/haze.glsl", "sum += compareAlong(", "sum += 0.5 + 0.0 * compareAlong("),
    mistake("no tiles", "omni_shadows/material.glsl", "0.11), odd)", "0.11), 0.5)"),
    mistake("plain walls", "omni_shadows/material.glsl", "surface.albedo = wall;", ";"),
    mistake("no highlights", "omni_shadows/surface.frag.glsl", "mirrored * highlight *", "0.0 * highlight *"),
    mistake("no dark corners", "omni_shadows/surface.frag.glsl", "exp(-2.5 *", "0.0 * exp(-2.5 *"),
    mistake("all is one thing", "omni_shadows/surface.vert.glsl", "number = gl_InstanceIndex", "number = 0u"),
    mistake("the cube all grey", "omni_shadows/cube_view.frag.glsl", "exp(-0.45 *", "exp(-0.0 *"),
    mistake("all faces in one place", "omni_shadows/cube_view.vert.glsl", "kCells[side]", "kCells[0]"),
];
const LAMP_FACES: [Mistake; 1] =
    [mistake("one face six times", "omni_shadows/caster.vert.glsl", "uint side = face", "uint side = 0u")];
const LAMP_HARD: [Mistake; 1] = [mistake(
    "no comparison",
    "omni_shadows/shadow.glsl",
    "return compareAlong(smp,",
    "return 1.0 + 0.0 * compareAlong(smp,",
)];

const FILM: [Mistake; 7] = [
    mistake("not decoded", "yuv/picture.frag.glsl", "decodeSrgb(clamp(", "(clamp("),
    mistake(
        "upside down",
        "yuv/picture.frag.glsl",
        "picture, place)",
        "picture, vec2(place.x, 1.0 - place.y))",
    ),
    mistake("too large", "yuv/picture.vert.glsl", "(2.0 * place - 1.0) * covered", "(2.0 * place - 1.0)"),
    mistake("one plane three times", "yuv/planes.frag.glsl", "planes[which]", "planes[0]"),
    mistake("one channel", "yuv/planes.frag.glsl", "channels[which]", "channels[0]"),
    mistake("a plane missing", "yuv/planes.vert.glsl", "float(which) *", "float(which & 1u) *"),
    mistake("planes too small", "yuv/planes.vert.glsl", "0.28 * covered", "0.2 * covered"),
];

const ATRIUM: [Mistake; 12] = [
    mistake("nothing is seen", "sponza/cull.comp.glsl", "bool seen = true;", "bool seen = false;"),
    mistake("the far corner counts", "sponza/cull.comp.glsl", "mix(high, low,", "mix(low, high,"),
    mistake("half of the draws", "sponza/cull.comp.glsl", "[view] = left;", "[view] = left / 2u;"),
    mistake("no textures", "sponza/mask.glsl", "tex == kNoTexture", "true"),
    mistake("no shadows drawn", "sponza/shadow.vert.glsl", "gl_Position = ", "gl_Position = 0.0 * "),
    mistake("no sky", "sponza/sky.frag.glsl", "expose(textureBindless", "expose(0.0 * textureBindless"),
    mistake("the sky nowhere", "sponza/sky.vert.glsl", "gl_Position = ", "gl_Position = 0.0 * "),
    mistake("shadows sharp", "sponza/surface.frag.glsl", "= int(frame.sun.pcf)", "= 0"),
    mistake("no shadows", "sponza/surface.frag.glsl", "return lit / (side * side)", "return 1.0"),
    mistake(
        "surfaces shade themselves",
        "sponza/surface.frag.glsl",
        "position + normal * (",
        "position - normal * (",
    ),
    mistake("even ambient light", "sponza/surface.frag.glsl", "0.5 + 0.5 * normal.y", "0.5"),
    mistake("textures not laid out", "sponza/surface.vert.glsl", "outTexcoord = ", "outTexcoord = 0.0 * "),
];
const ATRIUM_PADDED: [Mistake; 1] =
    [mistake("nothing is left", "sponza/cull.comp.glsl", "at[number] = draw;", "at[number] = uvec4(0u);")];
/// Of the board with a hole.
const BOARD: [Mistake; 2] = [
    mistake("no holes", "sponza/mask.glsl", "alpha < 0.5", "alpha < -1.0"),
    mistake("holes cast shadows", "sponza/shadow.frag.glsl", "if (isHole(", "if (false && isHole("),
];
/// Of tilted tiles.
const TILES: [Mistake; 3] = [
    mistake("no relief", "sponza/normal_mapping.glsl", "kNoTexture || frame.hasRelief == 0u", "0u || true"),
    mistake("upside down", "sponza/normal_mapping.glsl", "found.y * upwards", "-found.y * upwards"),
    mistake(
        "turned by neighbours",
        "sponza/normal_mapping.glsl",
        "sign(dot(right, acrossDown))",
        "-1.0 * sign(dot(right, acrossDown))",
    ),
];
/// Of things with highlights and a mirror.
const STILL_LIFE: [Mistake; 2] = [
    mistake(
        "no highlights",
        "sponza/surface.frag.glsl",
        "phong(albedo, material.specular,",
        "phong(albedo, vec3(0.0),",
    ),
    mistake("no mirror", "sponza/surface.frag.glsl", "material.reflectivity)", "0.0)"),
];
/// Mistakes in a scene without the sun.
const STILL_LIFE_BY_LAMP: [Mistake; 1] =
    [mistake("no lamp", "sponza/surface.frag.glsl", "albedo * lamplight", "0.0 * lamplight")];

/// Breaks each shader, and takes an image of a sample made anew.
fn check<S: Sample>(shaders: &BrokenShaders, by: &str, mistakes: &[Mistake], make: impl Fn() -> S) {
    let expected = image_of(&mut make(), FRAME);
    let image = || image_of(&mut make(), FRAME);
    shaders.assert_each_changes_image(by, &expected, &Tolerance::ACROSS_DRIVERS, mistakes, image);
}

fn cube_map(ctx: &Context, faces: Faces) -> RenderToCubeMap {
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
        check(shaders, "hello_triangle", &TRIANGLE, || HelloTriangle::new(&ctx, SIZE).unwrap());
        check(shaders, "six faces", &CUBE_MAP, || cube_map(&ctx, Faces::SixPasses));
        if has(&ctx, OptionalFeature::Multiview) {
            check(shaders, "faces at once", &CUBE_MAP_FACES, || cube_map(&ctx, Faces::OnePass));
        }
        if ctx.capabilities().mesh_shader {
            check(shaders, "mesh_shaders", &MESHLETS, || MeshShaders::new(&ctx, SIZE, true).unwrap());
        } else {
            eprintln!("NOT TESTED, {} has no mesh shaders", ctx.capabilities().device_name);
        }
        check(shaders, "triplanar", &BODIES, || Triplanar::new(&ctx, SIZE).unwrap());
    });
}

#[test]
#[ignore = "a minute: cargo test --test broken_shaders raster:: -- --ignored"]
fn deferred_notices() {
    BrokenShaders::in_subprocess(deferred_notices, |shaders| {
        let Some(ctx) = device() else { return };
        check(shaders, "by several passes", &[&HALL[..], &HALL_SEVERAL].concat(), || {
            hall(&ctx, Passes::Several)
        });
        if has(&ctx, OptionalFeature::LocalRead) {
            check(shaders, "by one pass", &[&HALL[..], &HALL_ONE].concat(), || hall(&ctx, Passes::One));
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
            let at_once = OmniShadowsConfig { faces: omni_shadows::Faces::Multiview, ..usual };
            check(shaders, "a lamp", &LAMP, || lamp(&ctx, at_once));
        }
        let single = OmniShadowsConfig { faces: omni_shadows::Faces::Single, ..usual };
        check(shaders, "face by face", &LAMP_FACES, || lamp(&ctx, single));
        let hard = OmniShadowsConfig { filter: ShadowFilter::Hard, ..single };
        check(shaders, "one comparison", &LAMP_HARD, || lamp(&ctx, hard));
    });
}

#[test]
#[ignore = "seconds: cargo test --test broken_shaders raster:: -- --ignored"]
fn yuv_notices() {
    BrokenShaders::in_subprocess(yuv_notices, |shaders| {
        let Some(ctx) = device_with(|desc| desc.yuv = &CONVERSIONS) else { return };
        let config = YuvConfig { film: [96, 64], shows_planes: true, ..YuvConfig::new(SIZE) };
        check(shaders, "yuv", &FILM, || Yuv::new(&ctx, &config).unwrap());
    });
}

#[test]
#[ignore = "a minute: cargo test --test broken_shaders raster:: -- --ignored"]
fn sponza_notices() {
    BrokenShaders::in_subprocess(sponza_notices, |shaders| {
        let Some(ctx) = device() else { return };
        let atrium = Scene::atrium();
        if has(&ctx, OptionalFeature::DrawIndirectCount) {
            check(shaders, "atrium", &ATRIUM, || sponza(&ctx, &atrium, DrawPath::Counted));
        }
        check(shaders, "padded", &ATRIUM_PADDED, || sponza(&ctx, &atrium, DrawPath::Padded));
        let board = shadow_mask_scene();
        check(shaders, "board", &BOARD, || sponza(&ctx, &board, DrawPath::Padded));
        let tiles = normal_map_scene(Tilt::Map);
        check(shaders, "tiles", &TILES, || sponza(&ctx, &tiles, DrawPath::Padded));
        let sunny = obj_scene();
        check(shaders, "still life", &STILL_LIFE, || sponza(&ctx, &sunny, DrawPath::Padded));
        let dark = Scene { sun: None, ..sunny.clone() };
        check(shaders, "by the lamp", &STILL_LIFE_BY_LAMP, || sponza(&ctx, &dark, DrawPath::Padded));
    });
}
