//! Tests of the tests: the pictures of the samples that only rasterise change when a shader is broken on purpose.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk::{Context, OptionalFeature};
use lvk_samples::app::sample::Sample;
use lvk_samples::hello_triangle::HelloTriangle;
use lvk_samples::mesh_shaders::MeshShaders;
use lvk_samples::render_to_cube_map::{Faces, RenderToCubeMap, RenderToCubeMapConfig};
use lvk_samples::triplanar::Triplanar;
use lvk_tests::broken_shaders::{BrokenShaders, Mistake, mistake};
use lvk_tests::device;
use lvk_tests::picture::Tolerance;
use lvk_tests::raster::has;
use lvk_tests::raster_sample::{SIZE, picture_of};

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

/// Breaks each shader, and takes a picture of a sample made anew.
fn check<S: Sample>(shaders: &BrokenShaders, by: &str, mistakes: &[Mistake], make: impl Fn() -> S) {
    let expected = picture_of(&mut make(), FRAME);
    let picture = || picture_of(&mut make(), FRAME);
    shaders.assert_each_shows(by, &expected, &Tolerance::SAME_AS_EVER, mistakes, picture);
}

fn cube_map(ctx: &Context, faces: Faces) -> RenderToCubeMap {
    let config = RenderToCubeMapConfig { face_size: 64, ..RenderToCubeMapConfig::new(SIZE, faces) };
    RenderToCubeMap::new(ctx, &config).unwrap()
}

#[test]
#[ignore = "half a minute: cargo test -p lvk-tests --test broken_raster_shaders -- --ignored"]
fn samples_that_rasterise_notice() {
    BrokenShaders::in_child("samples_that_rasterise_notice", |shaders| {
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
