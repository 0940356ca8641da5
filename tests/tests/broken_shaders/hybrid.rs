//! Tests of the image tests of `hybrid` and `hybrid_oit`: a shader broken on purpose changes the image, once for each
//! stage and technique.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use image::RgbaImage;
use lvk::Context;
use lvk_samples::app::headless;
use lvk_samples::hybrid::{Bounces, Geometry, HybridConfig, Method, Raster, RasterTuning, RayPath};
use lvk_samples::hybrid_oit::{HybridOitConfig, OitScene};
use lvk_samples::reflections::{Reflections, ReflectionsConfig};
use lvk_samples::scene::Camera;
use lvk_tests::broken_shaders::{BrokenShaders, Mistake, mistake, paint_over};
use lvk_tests::device;
use lvk_tests::hybrid::{HybridHarness, paths};
use lvk_tests::image_comparison::{Tolerance, reference_image};
use lvk_tests::oit_reference::OitRenderer;
use lvk_tests::scene_obj::obj_scene;

const ACROSS_DRIVERS: Tolerance = Tolerance::ACROSS_DRIVERS;
/// Of an image and itself.
const THE_SAME: Tolerance = Tolerance { psnr: f64::INFINITY, ssim: 0.9999, differing_share: 0.0, flip: 0.0 };
const MAIN: &str = "void main() {";
const NOTHING: &str = "void main() {\n    return;";

const HYBRID: [Mistake; 17] = [
    mistake("no shadows", "common/lighting.glsl", "if (!traceOccluded(", "if (true || !traceOccluded("),
    mistake(
        "no sun",
        "common/lighting.glsl",
        "if (light.isDistant != 0.0) {",
        "if (light.isDistant > 5.0) {",
    ),
    mistake("no lamp", "common/lighting.glsl", "return light.color / (", "return 0.0 * light.color / ("),
    mistake("even ambient light", "common/lighting.glsl", "0.5 + 0.5 * facing.normal.y", "0.5"),
    mistake(
        "light bent the wrong way",
        "hybrid/integrator.glsl",
        "facing.entering ? 1.0 / material.ior : material.ior",
        "facing.entering ? material.ior : 1.0 / material.ior",
    ),
    mistake("glass without mirror", "hybrid/integrator.glsl", "glass > 0.0 ?", "glass > 9.0 ?"),
    mistake(
        "one bounce less",
        "hybrid/integrator.glsl",
        "ray.depth < kMaxDepth",
        "ray.depth + 1u < kMaxDepth",
    ),
    mistake("no mirror", "hybrid/integrator.glsl", "weight * (material.reflectivity +", "weight * (0.0 *"),
    mistake("no highlights", "common/phong.glsl", "+ specular *", "+ 0.0 * specular *"),
    mistake("flat normals", "common/surface.glsl", "squaredLength > 1e-12 ?", "squaredLength > 1e30 ?"),
    mistake(
        "blurred textures",
        "common/texture_lod.glsl",
        "return lodConstant +",
        "return 2.0 + lodConstant +",
    ),
    mistake("no exposure", "common/tonemap.glsl", "1.0 - exp(-max(radiance, 0.0))", "min(radiance, 1.0)"),
    mistake("hits elsewhere", "hybrid/closest.rchit.glsl", "= barycentrics;", "= barycentrics.yx;"),
    mistake(
        "no sky",
        "hybrid/closest.rmiss.glsl",
        "= kNoTriangle;",
        "= 0u;\n    payload.barycentrics = vec2(0.2);",
    ),
    mistake("no light", "hybrid/shadow.rmiss.glsl", "occluded = 0u", "occluded = 1u"),
    mistake("no rays", "hybrid/render.rgen.glsl", MAIN, NOTHING),
    mistake("no triangles", "hybrid/raster_small.comp.glsl", MAIN, NOTHING),
];
const HYBRID_LARGE: [Mistake; 3] = [
    mistake("no tiles", "hybrid/raster_tile.comp.glsl", MAIN, NOTHING),
    mistake(
        "no medium triangles",
        "hybrid/raster_medium.comp.glsl",
        "        rasterMedium(triangle, thread);",
        "        ;",
    ),
    mistake(
        "no large triangles",
        "hybrid/raster_medium.comp.glsl",
        "        cutLarge(triangle, number, thread);",
        "        ;",
    ),
];
const HYBRID_HARDWARE: [Mistake; 4] = [
    mistake("nothing survives", "hybrid/cull.comp.glsl", "bool isInside = ", "bool isInside = false && "),
    mistake("nothing drawn", "hybrid/compact.comp.glsl", "= 3u * (before +", "= 0u * (before +"),
    mistake("no numbers", "hybrid/visibility.frag.glsl", "outTriangle = ", "outTriangle = 0xffffffffu | "),
    mistake("no place", "hybrid/geometry.vert.glsl", "gl_Position = ", "gl_Position = 0.0 * "),
];
const HYBRID_PAPER: [Mistake; 3] = [
    mistake("white things", "hybrid/geometry.frag.glsl", "vec4(point.albedo, 1.0)", "vec4(1.0)"),
    mistake("coarse normals", "hybrid/geometry.frag.glsl", "point.normal)", "point.geometricNormal)"),
    mistake(
        "moved things",
        "hybrid/geometry.frag.glsl",
        "vec4(point.position,",
        "vec4(point.position + 0.05,",
    ),
];
const HYBRID_QUERY: [Mistake; 4] = [
    mistake(
        "no rays",
        "hybrid/render.comp.glsl",
        "local_size_y = 8) in;\n\nvoid main() {",
        "local_size_y = 8) in;\n\nvoid main() {\n    return;",
    ),
    mistake(
        "hits elsewhere",
        "hybrid/trace_query.glsl",
        "lvkRayQueryBarycentrics(query, LVK_COMMITTED)",
        "vec2(0.2)",
    ),
    mistake(
        "other triangles",
        "hybrid/trace_query.glsl",
        "hit.triangle = firstTriangle +",
        "hit.triangle = 0u * firstTriangle +",
    ),
    mistake(
        "glass casts shadows",
        "hybrid/trace_query.glsl",
        "frame.tlas, kMaskOpaque",
        "frame.tlas, kMaskAll",
    ),
];
const QUEUED_PIPELINE: [Mistake; 1] = [mistake("no bounces", "hybrid/bounces.rgen.glsl", MAIN, NOTHING)];
const QUEUED_QUERY: [Mistake; 1] = [mistake("no bounces", "hybrid/bounces.comp.glsl", MAIN, NOTHING)];
/// One image, whatever the order of its pixels: these are asked for the very same one.
const ORDERED: [Mistake; 3] = [
    mistake(
        "a pixel left out",
        "hybrid/order.comp.glsl",
        "= pixel.x | ",
        "= pixel.x + uint(pixel == uvec2(80u, 45u)) | ",
    ),
    // Not left unwritten: its words lead to pixels, and what memory held before may lie outside of the image.
    mistake("no order", "hybrid/order.comp.glsl", "= pixel.x | pixel.y << 16;", "= 0u;"),
    mistake("others left out", "hybrid/pixel.glsl", "isFirst ? before : firsts + ", "isFirst ? before : "),
];
const ORDERED_QUERY: [Mistake; 1] =
    [mistake("no rays", "hybrid/render.comp.glsl", "    uint group = ", "    return;\n    uint group = ")];

/// Name of the broken part, its mistakes, and the configuration whose image must change.
type HybridWay<'a> = (&'a str, &'a [Mistake], HybridConfig);

fn hybrid_methods() -> [HybridWay<'static>; 9] {
    let plain =
        HybridConfig { width: 160, height: 90, bounces: Some(Bounces::Inline), ..HybridConfig::default() };
    let geometry = |geometry| HybridConfig { geometry, ..plain };
    let visible = |raster| geometry(Geometry::Visibility(Some(raster)));
    let tuning = RasterTuning { small_pixels: Some(0), medium_pixels: Some(512), ..RasterTuning::default() };
    let query = HybridConfig { path: RayPath::Query, ..plain };
    let queued = |config| HybridConfig { bounces: Some(Bounces::Queued), ..config };
    let ordered = |config| HybridConfig { bounces: Some(Bounces::First), ..config };
    [
        ("by pipeline", &HYBRID, visible(Raster::Compute)),
        ("by tiles", &HYBRID_LARGE, HybridConfig { tuning, ..visible(Raster::Compute) }),
        ("by hardware", &HYBRID_HARDWARE, visible(Raster::Hardware)),
        ("by the paper", &HYBRID_PAPER, geometry(Geometry::Paper)),
        ("by query", &HYBRID_QUERY, query),
        ("queued by pipeline", &QUEUED_PIPELINE, queued(plain)),
        ("queued by query", &QUEUED_QUERY, queued(query)),
        ("in order by pipeline", &ORDERED, ordered(plain)),
        ("in order by query", &ORDERED_QUERY, ordered(query)),
    ]
}

#[test]
#[ignore = "minutes for each: cargo test --test broken_shaders hybrid:: -- --ignored"]
fn hybrid_notices() {
    BrokenShaders::in_subprocess(hybrid_notices, |shaders| {
        let Some(ctx) = device() else { return };
        let (scene, paths) = (obj_scene(), paths(&ctx));
        assert_eq!(HybridConfig::default().method, Method::Hybrid);
        for (by, mistakes, config) in hybrid_methods().iter().filter(|way| paths.contains(&way.2.path)) {
            let image = || {
                let mut harness = HybridHarness::with_config(&ctx, &scene, config);
                paint_over(&ctx, harness.renderer.picture());
                harness.render(&scene.cameras[0])
            };
            let inline = HybridConfig { bounces: Some(Bounces::Inline), ..*config };
            let (expected, tolerance) = match (config.geometry, config.bounces) {
                (_, Some(Bounces::First)) => {
                    (HybridHarness::with_config(&ctx, &scene, &inline).render(&scene.cameras[0]), THE_SAME)
                }
                // The paper's edges are not those of rays.
                (Geometry::Paper, _) => (image(), ACROSS_DRIVERS),
                _ => (reference_image("hybrid_small"), ACROSS_DRIVERS),
            };
            shaders.assert_each_changes_image(by, &expected, &tolerance, mistakes, image);
        }
    });
}

// Passes write all the same, as the image is to follow from the shaders and not from what memory held before.
const OIT_RAYS: &str = "#include \"hybrid_oit/shadow.glsl\"";
const NO_OIT_RAYS: &str =
    "#define traceSunlight(origin, direction) vec3(0.0)\n#include \"hybrid_oit/shadow.glsl\"";

const OIT: [Mistake; 14] = [
    mistake("not sorted", "hybrid_oit/list.glsl", "; index > 0u && isBefore(", "; false && isBefore("),
    mistake("only the last node", "hybrid_oit/list.glsl", "Node(next, distance", "Node(kNoNode, distance"),
    mistake(
        "no tint in shadows",
        "hybrid_oit/glass.rahit.glsl",
        "payload.opticalDepth += ",
        "uvec3 unused = ",
    ),
    mistake("glass casts dark shadows", "hybrid_oit/glass.rahit.glsl", "ignoreIntersectionEXT;", ";"),
    mistake("no spheres in shadows", "hybrid_oit/sphere.rint.glsl", MAIN, NOTHING),
    mistake("no sunlight", "hybrid_oit/shadow.rmiss.glsl", "isBlocked = 0u", "isBlocked = 1u"),
    mistake("no shadow rays", "hybrid_oit/shadow.rgen.glsl", OIT_RAYS, NO_OIT_RAYS),
    mistake("no focus", "hybrid_oit/glass.glsl", "1.5 * focus", "0.0 * focus"),
    mistake(
        "no mirrored sky in glass",
        "hybrid_oit/glass.glsl",
        "1.6 * skyAlong(mirrored)",
        "0.0 * mirrored",
    ),
    mistake("spheres hide no sky", "hybrid_oit/occlusion.glsl", "1.0 - share * (", "1.0 - 0.0 * share * ("),
    mistake("blocks hide no sky", "hybrid_oit/occlusion.glsl", "blocked += ", "blocked += 0.0 * "),
    mistake("hard shadows", "hybrid_oit/shadow.glsl", "shadowRays == 1u ?", "shadowRays >= 1u ?"),
    mistake("no haze", "hybrid_oit/composite.comp.glsl", "1.0 - exp(-kHaze", "0.0 * exp(-kHaze"),
    mistake("all at rest", "hybrid_oit/animate.comp.glsl", "motion.anchor + offset", "motion.anchor"),
];
const OIT_RASTER: [Mistake; 7] = [
    mistake("no solids", "hybrid_oit/solid.vert.glsl", "gl_Position = ", "gl_Position = 0.0 * "),
    mistake("black solids", "hybrid_oit/solid.frag.glsl", "face.albedo", "vec3(0.0)"),
    mistake("no spheres", "hybrid_oit/sphere.vert.glsl", "gl_Position = ", "gl_Position = 0.0 * "),
    mistake(
        "balls turned inside out",
        "hybrid_oit/ball.frag.glsl",
        "position - sphere.center",
        "sphere.center - position",
    ),
    mistake(
        "balls in front of all",
        "hybrid_oit/ball_depth.frag.glsl",
        "gl_FragDepth = ",
        "gl_FragDepth = 1.0 + 0.0 * ",
    ),
    mistake("no glass", "hybrid_oit/glass.frag.glsl", MAIN, NOTHING),
    mistake("no backs of glass", "hybrid_oit/glass.frag.glsl", "end == crossing.exit", "false"),
];
const OIT_QUERY: [Mistake; 3] = [
    mistake("no tint in shadows", "hybrid_oit/shadow.comp.glsl", "opticalDepth += ", "uvec3 unused = "),
    mistake("balls cast none", "hybrid_oit/shadow.comp.glsl", "sphere.isGlass != 0u", "true"),
    mistake("no shadow rays", "hybrid_oit/shadow.comp.glsl", OIT_RAYS, NO_OIT_RAYS),
];

/// Seen from close to a dark ball, as the image of the whole room has few pixels of balls, most of them behind glass.
const VARNISH: [Mistake; 2] = [
    mistake("no varnish", "hybrid_oit/composite.comp.glsl", "surface.gloss * reflectance", "0.0"),
    mistake(
        "no highlight on varnish",
        "hybrid_oit/composite.comp.glsl",
        "30.0 * highlight",
        "0.0 * highlight",
    ),
];

fn render_oit(ctx: &Context, path: RayPath, [width, height]: [u32; 2], scene: &OitScene) -> RgbaImage {
    let mut room = OitRenderer::new(ctx, scene, &HybridOitConfig::new(path, width, height));
    paint_over(ctx, room.sample.texture());
    room.render(1.9)
}

#[test]
#[ignore = "minutes for each: cargo test --test broken_shaders hybrid:: -- --ignored"]
fn hybrid_oit_notices() {
    BrokenShaders::in_subprocess(hybrid_oit_notices, |shaders| {
        let Some(ctx) = device() else { return };
        let (scene, expected) = (OitScene::default(), reference_image("hybrid_oit_small"));
        for path in paths(&ctx) {
            let mistakes = match path {
                RayPath::Pipeline => [&OIT[..], &OIT_RASTER].concat(),
                RayPath::Query => OIT_QUERY.to_vec(),
            };
            let by = format!("oit by {path:?}");
            let image = || render_oit(&ctx, path, [240, 135], &scene);
            shaders.assert_each_changes_image(&by, &expected, &ACROSS_DRIVERS, &mistakes, image);
        }
        let camera = Camera::looking_at([0.7, 1.7, 2.6], [0.25, 1.32, 0.95], 17.0);
        let scene = OitScene { camera, ..scene };
        let image = || render_oit(&ctx, paths(&ctx)[0], [160, 90], &scene);
        shaders.assert_each_changes_image("varnish", &image(), &ACROSS_DRIVERS, &VARNISH, image);
    });
}

// As for NO_OIT_RAYS.
const HALL_RAYS: &str = "#include \"reflections/reflect.glsl\"";
const NO_HALL_RAYS: &str = "
#define traceClosest(origin, direction, range) Hit(kNothing, 0u, 0u, vec2(0.0), 0.0)
#include \"reflections/reflect.glsl\"";

const REFLECTIONS: [Mistake; 23] = [
    mistake("mirrors short-sighted", "reflections/ray_range.glsl", "return kFar;", "return 0.5;"),
    mistake(
        "rough surfaces not traced",
        "reflections/ray_range.glsl",
        "kRoughestTraced = 0.7",
        "kRoughestTraced = 0.09",
    ),
    mistake(
        "no glossy lobe",
        "reflections/reflectance.glsl",
        "float radius = sqrt(u.x);",
        "float radius = 0.0;",
    ),
    mistake("no fresnel", "reflections/reflectance.glsl", "(1.0 - normalIncidence) * pow(", "0.0 * pow("),
    mistake(
        "water mirrors nothing",
        "reflections/reflect.glsl",
        "reflection = reflectionOf(surface, direction, distance, vec2(0.0), pixelNoise(pixel, 4u));",
        "reflection = vec4(0.0);",
    ),
    mistake("all is open", "reflections/visibility.glsl", "? 0.0 : 1.0;", "? 1.0 : 1.0;"),
    mistake(
        "reflections dark",
        "reflections/reflect.glsl",
        "mix(shadeReflected(",
        "mix(0.5 * shadeReflected(",
    ),
    mistake(
        "no light on reflected things",
        "reflections/lighting.glsl",
        "surface.emission + lightDirectly(surface, view, 2e-3, noise)",
        "surface.emission",
    ),
    mistake("no shadows", "reflections/visibility.glsl", "if (blocker >= 0.0)", "if (blocker >= 1e30)"),
    mistake(
        "shadows sharp",
        "reflections/smooth.comp.glsl",
        "radius[channel] > 0.7",
        "radius[channel] > 1e9",
    ),
    mistake(
        "penumbras narrow",
        "reflections/visibility.glsl",
        "penumbra[i] = max(",
        "penumbra[i] = 0.01 * max(",
    ),
    mistake(
        "no shadows in mirrors",
        "reflections/lighting.glsl",
        "&& !traceOccluded(",
        "&& true || traceOccluded(",
    ),
    mistake(
        "no sky light",
        "reflections/ambient.glsl",
        "return harmonicSum(normal,",
        "return 0.0 * harmonicSum(normal,",
    ),
    mistake("water flat", "reflections/waves.glsl", "(0.022 /", "(0.0 /"),
    mistake("serpent at rest", "reflections/skin.comp.glsl", "= dot(row, p);", "= v.position[axis];"),
    mistake(
        "serpent's normals at rest",
        "reflections/skin.comp.glsl",
        "= dot(row.xyz, v.normal);",
        "= v.normal[axis];",
    ),
    mistake("leaves elsewhere", "reflections/leaves.comp.glsl", "return place + ", "return place + 0.7 + "),
    mistake("no lights", "reflections/shadow.rmiss.glsl", "= 0u;", "= 1u;"),
    mistake("only the sky in mirrors", "reflections/opaque.rgen.glsl", HALL_RAYS, NO_HALL_RAYS),
    mistake("only the sky in glass", "reflections/transparent.rgen.glsl", HALL_RAYS, NO_HALL_RAYS),
    mistake("hits elsewhere", "reflections/closest.rchit.glsl", "= barycentrics;", "= barycentrics.yx;"),
    mistake("no water", "reflections/blend.frag.glsl", "outColor = ", "outColor = 0.0 * "),
    mistake("no blur", "reflections/filter.comp.glsl", "radius > 0.75", "radius > 1e9"),
];
const REFLECTIONS_QUERY: [Mistake; 3] = [
    mistake(
        "leaves are squares",
        "reflections/trace_query.glsl",
        "return isSolid(instance, geometry, primitive, ",
        "return true || isSolid(instance, geometry, primitive, ",
    ),
    mistake("only the sky in mirrors", "reflections/opaque.comp.glsl", HALL_RAYS, NO_HALL_RAYS),
    mistake("only the sky in glass", "reflections/transparent.comp.glsl", HALL_RAYS, NO_HALL_RAYS),
];

const REFLECTIONS_EVER: [Mistake; 3] = [
    mistake("mirrors short-sighted", "reflections/ray_range.glsl", "return kFar;", "return 0.5;"),
    mistake("no shadows", "reflections/visibility.glsl", "if (blocker >= 0.0)", "if (blocker >= 1e30)"),
    mistake("no blur", "reflections/filter.comp.glsl", "radius > 0.75", "radius > 1e9"),
];

/// Seen from just above the floor, where leaves are mirrored and throw shadows.
const LEAVES: [Mistake; 2] = [
    mistake("leaves are squares", "reflections/surface.glsl", ".a >= 0.5;", ".a >= -1.0;"),
    mistake("leaves are squares to rays", "reflections/leaf.rahit.glsl", "ignoreIntersectionEXT;", ";"),
];

fn hall(ctx: &Context, path: RayPath, view: Option<&Camera>) -> RgbaImage {
    hall_of(ctx, &ReflectionsConfig { samples: 1, ..ReflectionsConfig::new(path, 130, 73) }, view)
}

fn hall_of(ctx: &Context, config: &ReflectionsConfig, view: Option<&Camera>) -> RgbaImage {
    let mut hall = Reflections::new(ctx, config).unwrap();
    hall.show(0.0);
    if let Some(view) = view {
        hall.set_camera(view);
    }
    paint_over(ctx, hall.picture());
    RgbaImage::from_raw(config.width, config.height, headless::picture(&mut hall).unwrap()).unwrap()
}

#[test]
#[ignore = "minutes for each: cargo test --test broken_shaders hybrid:: -- --ignored"]
fn reflections_notices() {
    BrokenShaders::in_subprocess(reflections_notices, |shaders| {
        let Some(ctx) = device() else { return };
        // Smaller than the image that is as ever: there are many.
        let expected = hall(&ctx, paths(&ctx)[0], None);
        for path in paths(&ctx) {
            let mistakes: &[Mistake] = match path {
                RayPath::Pipeline => &REFLECTIONS,
                RayPath::Query => &REFLECTIONS_QUERY,
            };
            let by = format!("reflections by {path:?}");
            shaders.assert_each_changes_image(&by, &expected, &ACROSS_DRIVERS, mistakes, || {
                hall(&ctx, path, None)
            });
        }
        let path = paths(&ctx)[0];
        let view = Camera::looking_at([2.6, 0.3, -3.6], [1.6, 0.1, -7.0], 45.0);
        let expected = hall(&ctx, path, Some(&view));
        let mistakes = if path == RayPath::Pipeline { &LEAVES[..] } else { &LEAVES[..1] };
        shaders.assert_each_changes_image("leaves", &expected, &ACROSS_DRIVERS, mistakes, || {
            hall(&ctx, path, Some(&view))
        });
        // The image of the test that the hall looks as it always did.
        let config = ReflectionsConfig { samples: 4, ..ReflectionsConfig::new(path, 162, 91) };
        let expected = reference_image("reflections_small");
        shaders.assert_each_changes_image("as ever", &expected, &ACROSS_DRIVERS, &REFLECTIONS_EVER, || {
            hall_of(&ctx, &config, None)
        });
    });
}
