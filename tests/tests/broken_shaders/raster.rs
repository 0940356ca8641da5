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
use lvk_tests::broken_shaders::{BrokenShaders, Mistake};
use lvk_tests::image_comparison::Tolerance;
use lvk_tests::raster::has;
use lvk_tests::raster_sample::{SIZE, image_of};
use lvk_tests::scene_normal_map::{Tilt, normal_map_scene};
use lvk_tests::scene_obj::obj_scene;
use lvk_tests::scene_shadow_mask::shadow_mask_scene;
use lvk_tests::{device, device_with, mistakes};

/// A moment at which everything has moved.
const FRAME: u32 = 20;

mistakes! {
    TRIANGLE:
        "hello_triangle/triangle.vert.glsl": "turns the other way": "= radians(360.0)" => "= -radians(360.0)";
        "hello_triangle/triangle.vert.glsl": "as wide as the picture": " / aspect" => "";
        "hello_triangle/triangle.frag.glsl": "other colours": "vec4(color, 1.0)" => "vec4(color.bgr, 1.0)";

    CUBE_MAP:
        "render_to_cube_map/block.vert.glsl": "blocks askew": "turned * (place" => "(place";
        "render_to_cube_map/block.frag.glsl": "other squares": "wave.x * wave.y" => "wave.x";
        "render_to_cube_map/drop.frag.glsl": "glass in place of a mirror": "reflect(seen, normal)" => "seen";
        "render_to_cube_map/drop.frag.glsl": "sharp rim": "log2(max(texels, 1.0))" => "0.0";
        "render_to_cube_map/drop.glsl": "a ball": "1.0 + frame.waves *" => "1.0 + 0.0 *";
        "render_to_cube_map/sky.frag.glsl": "no sky": "targetColor(" => "0.0 * targetColor(";
        "render_to_cube_map/light.glsl": "no shadow": "sun = along > 0.0" => "sun = along > 1e9";
    CUBE_MAP_FACES:
        "render_to_cube_map/view.glsl": "one view six times": "cameras[gl_ViewIndex]" => "cameras[0]";
        "render_to_cube_map/sky.frag.glsl": "no sky": "targetColor(" => "0.0 * targetColor(";

    MESHLETS:
        "mesh_shaders/meshlet.task.glsl": "leaves out what looks here": "(meshlet.axis)) >=" => "(meshlet.axis)) <=";
        "mesh_shaders/meshlet.task.glsl": "a frustum too narrow": "radius * slope" => "-2.5 * slope";
        "mesh_shaders/meshlet.task.glsl": "one meshlet less a group": "EmitMeshTasksEXT(count" => "EmitMeshTasksEXT(max(count, 1u) - 1u";
        "mesh_shaders/meshlet.mesh.glsl": "triangles without area": "corners >> 8" => "corners >> 16";
        "mesh_shaders/frame.glsl": "all together": "frame.apart * wave" => "0.0 * wave";
        "mesh_shaders/meshlet.frag.glsl": "one colour": "meshletColor(meshletNumber" => "meshletColor(0u";

    BODIES:
        "triplanar/triplanar.glsl": "soft borders": "vec3(frame.sharpness)" => "vec3(0.5)";
        "triplanar/triplanar.glsl": "sides on top": "normal.y > 0.0 ? body.top : body.sides" => "body.sides";
        "triplanar/triplanar.glsl": "a plane askew": "position.xy)" => "position.xz)";
        "triplanar/triplanar.glsl": "upside down": "-0.5 * at.y" => "0.5 * at.y";
        "triplanar/body.vert.glsl": "at rest": "turned(body, position)" => "position";
        "triplanar/body.frag.glsl": "no shadows": "along > 0.0" => "along > 1e9";

    HALL:
        "deferred/ambient.frag.glsl": "no night sky": "vec4(sky(-surface.toEye.y)" => "vec4(vec3(0.0)";
        "deferred/ambient.frag.glsl": "mirrors nothing": "+ mirrored + moon" => "+ moon";
        "deferred/glow.frag.glsl": "no shine": "0.2 * shine" => "0.0 * shine";
        "deferred/light.frag.glsl": "no lights": "vec4(color * window" => "vec4(0.0 * color * window";
        "deferred/light.frag.glsl": "lights without end": "float window = " => "float window = 1.0; float unused = ";
        "deferred/light.vert.glsl": "bodies of lights too small": "kAround * light.reach" => "0.4 * light.reach";
        "deferred/orbs.frag.glsl": "dark orbs": "color * 2.2 + 0.7 * (1.0 - from)" => "color * 0.0";
        "deferred/orbs.vert.glsl": "orbs and shine elsewhere": "light.position + " => "light.position + 0.3 + ";
        "deferred/resolve.frag.glsl": "no mist": "exp(-0.016 *" => "exp(-0.0 *";
        "deferred/surfaces.frag.glsl": "slabs of one kind": "mix(1.0, 0.22, other)" => "1.0";
        "deferred/surfaces.vert.glsl": "normals inside out": "normal = vertex.normal" => "normal = -vertex.normal";
        "deferred/targets.glsl": "no highlights": "distribution * masking" => "0.0 * masking";
        "deferred/targets.glsl": "surfaces elsewhere": "frame.camera.eye + frame" => "0.3 + frame.camera.eye + frame";
        "deferred/frame.glsl": "lights at rest": "kTau * (frame.phase *" => "kTau * (0.0 *";
    HALL_SEVERAL:
        "deferred/targets.glsl": "the albedo for all": "kTextures2D[frame.name]" => "kTextures2D[frame.albedo]";
        "deferred/targets.glsl": "not at this pixel": "ivec2(gl_FragCoord.xy), 0)" => "ivec2(gl_FragCoord.yx), 0)";
    HALL_ONE:
        "deferred/resolve.frag.glsl": "the normal for the light": "LVK_INPUT(2, " => "LVK_INPUT(1, ";

    LAMP:
        "omni_shadows/caster.vert.glsl": "one face twice": "uint(gl_ViewIndex)" => "uint(gl_ViewIndex) & 6u";
        "omni_shadows/caster.vert.glsl": "a face turned": "vec3(d.x, -d.y, d.z)" => "vec3(-d.x, -d.y, d.z)";
        "omni_shadows/caster.vert.glsl": "the lamp elsewhere": "- frame.light)" => "- frame.light + 0.2)";
        "omni_shadows/shadow.glsl": "surfaces shade themselves": "way += 1.5 *" => "way -= 1.5 *";
        "omni_shadows/shadow.glsl": "hard edges": "return frame.bulb *" => "return 0.0 *";
        "omni_shadows/shadow.glsl": "no shadows": "part >= 1.0" => "part >= 0.0";
        "omni_shadows/haze.glsl": "no haze": "return frame.haze *" => "return 0.0 *";
        "omni_shadows/haze.glsl": "no beams": "sum += compareAlong(" => "sum += 0.5 + 0.0 * compareAlong(";
        "omni_shadows/material.glsl": "no tiles": "0.11), odd)" => "0.11), 0.5)";
        "omni_shadows/material.glsl": "plain walls": "surface.albedo = wall;" => ";";
        "omni_shadows/surface.frag.glsl": "no highlights": "mirrored * highlight *" => "0.0 * highlight *";
        "omni_shadows/surface.frag.glsl": "no dark corners": "exp(-2.5 *" => "0.0 * exp(-2.5 *";
        "omni_shadows/surface.vert.glsl": "all is one thing": "number = gl_InstanceIndex" => "number = 0u";
        "omni_shadows/cube_view.frag.glsl": "the cube all grey": "exp(-0.45 *" => "exp(-0.0 *";
        "omni_shadows/cube_view.vert.glsl": "all faces in one place": "kCells[side]" => "kCells[0]";
    LAMP_FACES:
        "omni_shadows/caster.vert.glsl": "one face six times": "uint side = face" => "uint side = 0u";
    LAMP_HARD:
        "omni_shadows/shadow.glsl": "no comparison": "return compareAlong(smp," => "return 1.0 + 0.0 * compareAlong(smp,";

    FILM:
        "yuv/picture.frag.glsl": "not decoded": "decodeSrgb(clamp(" => "(clamp(";
        "yuv/picture.frag.glsl": "upside down": "picture, place)" => "picture, vec2(place.x, 1.0 - place.y))";
        "yuv/picture.vert.glsl": "too large": "(2.0 * place - 1.0) * covered" => "(2.0 * place - 1.0)";
        "yuv/planes.frag.glsl": "one plane three times": "planes[which]" => "planes[0]";
        "yuv/planes.frag.glsl": "one channel": "channels[which]" => "channels[0]";
        "yuv/planes.vert.glsl": "a plane missing": "float(which) *" => "float(which & 1u) *";
        "yuv/planes.vert.glsl": "planes too small": "0.28 * covered" => "0.2 * covered";

    ATRIUM:
        "sponza/cull.comp.glsl": "nothing is seen": "bool seen = true;" => "bool seen = false;";
        "sponza/cull.comp.glsl": "the far corner counts": "mix(high, low," => "mix(low, high,";
        "sponza/cull.comp.glsl": "half of the draws": "[view] = left;" => "[view] = left / 2u;";
        "sponza/mask.glsl": "no textures": "tex == kNoTexture" => "true";
        "sponza/shadow.vert.glsl": "no shadows drawn": "gl_Position = " => "gl_Position = 0.0 * ";
        "sponza/sky.frag.glsl": "no sky": "expose(textureBindless" => "expose(0.0 * textureBindless";
        "sponza/sky.vert.glsl": "the sky nowhere": "gl_Position = " => "gl_Position = 0.0 * ";
        "sponza/surface.frag.glsl": "shadows sharp": "= int(frame.sun.pcf)" => "= 0";
        "sponza/surface.frag.glsl": "no shadows": "return lit / (side * side)" => "return 1.0";
        "sponza/surface.frag.glsl": "surfaces shade themselves": "position + normal * (" => "position - normal * (";
        "sponza/surface.frag.glsl": "even ambient light": "0.5 + 0.5 * normal.y" => "0.5";
        "sponza/surface.vert.glsl": "textures not laid out": "outTexcoord = " => "outTexcoord = 0.0 * ";
    ATRIUM_PADDED:
        "sponza/cull.comp.glsl": "nothing is left": "at[number] = draw;" => "at[number] = uvec4(0u);";
    /// Of the board with a hole.
    BOARD:
        "sponza/mask.glsl": "no holes": "alpha < 0.5" => "alpha < -1.0";
        "sponza/shadow.frag.glsl": "holes cast shadows": "if (isHole(" => "if (false && isHole(";
    /// Of tilted tiles.
    TILES:
        "sponza/normal_mapping.glsl": "no relief": "kNoTexture || frame.hasRelief == 0u" => "0u || true";
        "sponza/normal_mapping.glsl": "upside down": "found.y * upwards" => "-found.y * upwards";
        "sponza/normal_mapping.glsl": "turned by neighbours": "sign(dot(right, acrossDown))" => "-1.0 * sign(dot(right, acrossDown))";
    /// Of things with highlights and a mirror.
    STILL_LIFE:
        "sponza/surface.frag.glsl": "no highlights": "phong(albedo, material.specular," => "phong(albedo, vec3(0.0),";
        "sponza/surface.frag.glsl": "no mirror": "material.reflectivity)" => "0.0)";
    /// Mistakes in a scene without the sun.
    STILL_LIFE_BY_LAMP:
        "sponza/surface.frag.glsl": "no lamp": "albedo * lamplight" => "0.0 * lamplight";
}

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
        check(shaders, "hello_triangle", TRIANGLE, || HelloTriangle::new(&ctx, SIZE).unwrap());
        check(shaders, "six faces", CUBE_MAP, || cube_map(&ctx, Faces::SixPasses));
        if has(&ctx, OptionalFeature::Multiview) {
            check(shaders, "faces at once", CUBE_MAP_FACES, || cube_map(&ctx, Faces::OnePass));
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
            let at_once = OmniShadowsConfig { faces: omni_shadows::Faces::Multiview, ..usual };
            check(shaders, "a lamp", LAMP, || lamp(&ctx, at_once));
        }
        let single = OmniShadowsConfig { faces: omni_shadows::Faces::Single, ..usual };
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
        let config = YuvConfig { film: [96, 64], shows_planes: true, ..YuvConfig::new(SIZE) };
        check(shaders, "yuv", FILM, || Yuv::new(&ctx, &config).unwrap());
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
