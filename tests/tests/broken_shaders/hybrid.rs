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
use lvk_tests::broken_shaders::{BrokenShaders, Mistake, paint_over};
use lvk_tests::hybrid::{HybridHarness, paths};
use lvk_tests::image_comparison::{Tolerance, reference_image};
use lvk_tests::oit_reference::OitRenderer;
use lvk_tests::scene_obj::obj_scene;
use lvk_tests::{device, mistakes};

const ACROSS_DRIVERS: Tolerance = Tolerance::ACROSS_DRIVERS;
/// Of an image and itself.
const THE_SAME: Tolerance = Tolerance { psnr: f64::INFINITY, ssim: 0.9999, differing_share: 0.0, flip: 0.0 };
const MAIN: &str = "void main() {";
const NOTHING: &str = "void main() {\n    return;";

mistakes! {
    HYBRID:
        "common/lighting.glsl": "no shadows": "if (!traceOccluded(" => "if (true || !traceOccluded(";
        "common/lighting.glsl": "no sun": "if (light.isDistant != 0.0) {" => "if (light.isDistant > 5.0) {";
        "common/lighting.glsl": "no lamp": "return light.color / (" => "return 0.0 * light.color / (";
        "common/lighting.glsl": "even ambient light": "0.5 + 0.5 * facing.normal.y" => "0.5";
        "hybrid/integrator.glsl": "light bent the wrong way": "facing.entering ? 1.0 / material.ior : material.ior" => "facing.entering ? material.ior : 1.0 / material.ior";
        "hybrid/integrator.glsl": "glass without mirror": "glass > 0.0 ?" => "glass > 9.0 ?";
        "hybrid/integrator.glsl": "one bounce less": "ray.depth < kMaxDepth" => "ray.depth + 1u < kMaxDepth";
        "hybrid/integrator.glsl": "no mirror": "weight * (material.reflectivity +" => "weight * (0.0 *";
        "common/phong.glsl": "no highlights": "+ specular *" => "+ 0.0 * specular *";
        "common/surface.glsl": "flat normals": "squaredLength > 1e-12 ?" => "squaredLength > 1e30 ?";
        "common/texture_lod.glsl": "blurred textures": "return lodConstant +" => "return 2.0 + lodConstant +";
        "common/tonemap.glsl": "no exposure": "1.0 - exp(-max(radiance, 0.0))" => "min(radiance, 1.0)";
        "hybrid/closest.rchit.glsl": "hits elsewhere": "= barycentrics;" => "= barycentrics.yx;";
        "hybrid/closest.rmiss.glsl": "no sky": "= kNoTriangle;" => "= 0u;\n    payload.barycentrics = vec2(0.2);";
        "hybrid/shadow.rmiss.glsl": "no light": "occluded = 0u" => "occluded = 1u";
        "hybrid/render.rgen.glsl": "no rays": MAIN => NOTHING;
        "hybrid/raster_small.comp.glsl": "no triangles": MAIN => NOTHING;
    HYBRID_LARGE:
        "hybrid/raster_tile.comp.glsl": "no tiles": MAIN => NOTHING;
        "hybrid/raster_medium.comp.glsl": "no medium triangles": "        rasterMedium(triangle, thread);" => "        ;";
        "hybrid/raster_medium.comp.glsl": "no large triangles": "        cutLarge(triangle, number, thread);" => "        ;";
    HYBRID_HARDWARE:
        "hybrid/cull.comp.glsl": "nothing survives": "bool isInside = " => "bool isInside = false && ";
        "hybrid/compact.comp.glsl": "nothing drawn": "= 3u * (before +" => "= 0u * (before +";
        "hybrid/visibility.frag.glsl": "no numbers": "outTriangle = " => "outTriangle = 0xffffffffu | ";
        "hybrid/geometry.vert.glsl": "no place": "gl_Position = " => "gl_Position = 0.0 * ";
    HYBRID_PAPER:
        "hybrid/geometry.frag.glsl": "white things": "vec4(point.albedo, 1.0)" => "vec4(1.0)";
        "hybrid/geometry.frag.glsl": "coarse normals": "point.normal)" => "point.geometricNormal)";
        "hybrid/geometry.frag.glsl": "moved things": "vec4(point.position," => "vec4(point.position + 0.05,";
    HYBRID_QUERY:
        "hybrid/render.comp.glsl": "no rays": "local_size_y = 8) in;\n\nvoid main() {" => "local_size_y = 8) in;\n\nvoid main() {\n    return;";
        "hybrid/trace_query.glsl": "hits elsewhere": "lvkRayQueryBarycentrics(query, LVK_COMMITTED)" => "vec2(0.2)";
        "hybrid/trace_query.glsl": "other triangles": "hit.triangle = firstTriangle +" => "hit.triangle = 0u * firstTriangle +";
        "hybrid/trace_query.glsl": "glass casts shadows": "frame.tlas, flags, kMaskOpaque" => "frame.tlas, flags, kMaskAll";
    QUEUED_PIPELINE:
        "hybrid/bounces.rgen.glsl": "no bounces": MAIN => NOTHING;
    QUEUED_QUERY:
        "hybrid/bounces.comp.glsl": "no bounces": MAIN => NOTHING;
    /// One image, whatever the order of its pixels: these are asked for the very same one.
    ORDERED:
        "hybrid/order.comp.glsl": "a pixel left out": "= pixel.x | " => "= pixel.x + uint(pixel == uvec2(80u, 45u)) | ";
        // Not left unwritten: its words lead to pixels, and what memory held before may lie outside of the image.
        "hybrid/order.comp.glsl": "no order": "= pixel.x | pixel.y << 16;" => "= 0u;";
        "hybrid/pixel.glsl": "others left out": "isFirst ? before : firsts + " => "isFirst ? before : ";
    ORDERED_QUERY:
        "hybrid/render.comp.glsl": "no rays": "    uint group = " => "    return;\n    uint group = ";
}

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
        ("by pipeline", HYBRID, visible(Raster::Compute)),
        ("by tiles", HYBRID_LARGE, HybridConfig { tuning, ..visible(Raster::Compute) }),
        ("by hardware", HYBRID_HARDWARE, visible(Raster::Hardware)),
        ("by the paper", HYBRID_PAPER, geometry(Geometry::Paper)),
        ("by query", HYBRID_QUERY, query),
        ("queued by pipeline", QUEUED_PIPELINE, queued(plain)),
        ("queued by query", QUEUED_QUERY, queued(query)),
        ("in order by pipeline", ORDERED, ordered(plain)),
        ("in order by query", ORDERED_QUERY, ordered(query)),
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

mistakes! {
    OIT:
        "hybrid_oit/list.glsl": "not sorted": "; index > 0u && isBefore(" => "; false && isBefore(";
        "hybrid_oit/list.glsl": "only the last node": "Node(next, distance" => "Node(kNoNode, distance";
        "hybrid_oit/glass.rahit.glsl": "no tint in shadows": "payload.opticalDepth += " => "uvec3 unused = ";
        "hybrid_oit/glass.rahit.glsl": "glass casts dark shadows": "ignoreIntersectionEXT;" => ";";
        "hybrid_oit/sphere.rint.glsl": "no spheres in shadows": MAIN => NOTHING;
        "hybrid_oit/shadow.rmiss.glsl": "no sunlight": "isBlocked = 0u" => "isBlocked = 1u";
        "hybrid_oit/shadow.rgen.glsl": "no shadow rays": OIT_RAYS => NO_OIT_RAYS;
        "hybrid_oit/glass.glsl": "no focus": "1.5 * focus" => "0.0 * focus";
        "hybrid_oit/glass.glsl": "no mirrored sky in glass": "1.6 * skyAlong(mirrored)" => "0.0 * mirrored";
        "hybrid_oit/occlusion.glsl": "spheres hide no sky": "1.0 - share * (" => "1.0 - 0.0 * share * (";
        "hybrid_oit/occlusion.glsl": "blocks hide no sky": "blocked += " => "blocked += 0.0 * ";
        "hybrid_oit/shadow.glsl": "hard shadows": "shadowRays == 1u ?" => "shadowRays >= 1u ?";
        "hybrid_oit/composite.comp.glsl": "no haze": "1.0 - exp(-kHaze" => "0.0 * exp(-kHaze";
        "hybrid_oit/animate.comp.glsl": "all at rest": "motion.anchor + offset" => "motion.anchor";
    OIT_RASTER:
        "hybrid_oit/solid.vert.glsl": "no solids": "gl_Position = " => "gl_Position = 0.0 * ";
        "hybrid_oit/solid.frag.glsl": "black solids": "face.albedo" => "vec3(0.0)";
        "hybrid_oit/sphere.vert.glsl": "no spheres": "gl_Position = " => "gl_Position = 0.0 * ";
        "hybrid_oit/ball.frag.glsl": "balls turned inside out": "position - sphere.center" => "sphere.center - position";
        "hybrid_oit/ball_depth.frag.glsl": "balls in front of all": "gl_FragDepth = " => "gl_FragDepth = 1.0 + 0.0 * ";
        "hybrid_oit/glass.frag.glsl": "no glass": MAIN => NOTHING;
        "hybrid_oit/glass.frag.glsl": "no backs of glass": "end == crossing.exit" => "false";
    OIT_QUERY:
        "hybrid_oit/shadow.comp.glsl": "no tint in shadows": "opticalDepth += " => "uvec3 unused = ";
        "hybrid_oit/shadow.comp.glsl": "balls cast none": "sphere.isGlass != 0u" => "true";
        "hybrid_oit/shadow.comp.glsl": "no shadow rays": OIT_RAYS => NO_OIT_RAYS;

    /// Seen from close to a dark ball, as the image of the whole room has few pixels of balls, most of them behind glass.
    VARNISH:
        "hybrid_oit/composite.comp.glsl": "no varnish": "surface.gloss * reflectance" => "0.0";
        "hybrid_oit/composite.comp.glsl": "no highlight on varnish": "30.0 * highlight" => "0.0 * highlight";
}

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
                RayPath::Pipeline => [OIT, OIT_RASTER].concat(),
                RayPath::Query => OIT_QUERY.to_vec(),
            };
            let by = format!("oit by {path:?}");
            let image = || render_oit(&ctx, path, [240, 135], &scene);
            shaders.assert_each_changes_image(&by, &expected, &ACROSS_DRIVERS, &mistakes, image);
        }
        let camera = Camera::looking_at([0.7, 1.7, 2.6], [0.25, 1.32, 0.95], 17.0);
        let scene = OitScene { camera, ..scene };
        let image = || render_oit(&ctx, paths(&ctx)[0], [160, 90], &scene);
        shaders.assert_each_changes_image("varnish", &image(), &ACROSS_DRIVERS, VARNISH, image);
    });
}

// As for NO_OIT_RAYS.
const HALL_RAYS: &str = "#include \"reflections/reflect.glsl\"";
const NO_HALL_RAYS: &str = "
#define traceClosest(origin, direction, range) Hit(kNothing, 0u, 0u, vec2(0.0), 0.0)
#include \"reflections/reflect.glsl\"";

mistakes! {
    REFLECTIONS:
        "reflections/ray_range.glsl": "mirrors short-sighted": "return kFar;" => "return 0.5;";
        "reflections/ray_range.glsl": "rough surfaces not traced": "kRoughestTraced = 0.7" => "kRoughestTraced = 0.09";
        "reflections/reflectance.glsl": "no glossy lobe": "float radius = sqrt(u.x);" => "float radius = 0.0;";
        "reflections/reflectance.glsl": "no fresnel": "(1.0 - normalIncidence) * pow(" => "0.0 * pow(";
        "reflections/reflect.glsl": "water mirrors nothing": "reflection = reflectionOf(surface, direction, distance, vec2(0.0), pixelNoise(pixel, 4u));" => "reflection = vec4(0.0);";
        "reflections/visibility.glsl": "all is open": "? 0.0 : 1.0;" => "? 1.0 : 1.0;";
        "reflections/reflect.glsl": "reflections dark": "mix(shadeReflected(" => "mix(0.5 * shadeReflected(";
        "reflections/lighting.glsl": "no light on reflected things": "surface.emission + lightDirectly(surface, view, 2e-3, noise)" => "surface.emission";
        "reflections/visibility.glsl": "no shadows": "if (blocker >= 0.0)" => "if (blocker >= 1e30)";
        "reflections/smooth.comp.glsl": "shadows sharp": "radius[channel] > 0.7" => "radius[channel] > 1e9";
        "reflections/visibility.glsl": "penumbras narrow": "penumbra[i] = max(" => "penumbra[i] = 0.01 * max(";
        "reflections/lighting.glsl": "no shadows in mirrors": "&& !traceOccluded(" => "&& true || traceOccluded(";
        "reflections/ambient.glsl": "no sky light": "return harmonicSum(normal," => "return 0.0 * harmonicSum(normal,";
        "reflections/waves.glsl": "water flat": "(0.022 /" => "(0.0 /";
        "reflections/skin.comp.glsl": "serpent at rest": "= dot(row, p);" => "= v.position[axis];";
        "reflections/skin.comp.glsl": "serpent's normals at rest": "= dot(row.xyz, v.normal);" => "= v.normal[axis];";
        "reflections/leaves.comp.glsl": "leaves elsewhere": "return place + " => "return place + 0.7 + ";
        "reflections/shadow.rmiss.glsl": "no lights": "= 0u;" => "= 1u;";
        "reflections/opaque.rgen.glsl": "only the sky in mirrors": HALL_RAYS => NO_HALL_RAYS;
        "reflections/transparent.rgen.glsl": "only the sky in glass": HALL_RAYS => NO_HALL_RAYS;
        "reflections/closest.rchit.glsl": "hits elsewhere": "= barycentrics;" => "= barycentrics.yx;";
        "reflections/blend.frag.glsl": "no water": "outColor = " => "outColor = 0.0 * ";
        "reflections/filter.comp.glsl": "no blur": "radius > 0.75" => "radius > 1e9";
    REFLECTIONS_QUERY:
        "reflections/trace_query.glsl": "leaves are squares": "return isSolid(instance, geometry, primitive, " => "return true || isSolid(instance, geometry, primitive, ";
        "reflections/opaque.comp.glsl": "only the sky in mirrors": HALL_RAYS => NO_HALL_RAYS;
        "reflections/transparent.comp.glsl": "only the sky in glass": HALL_RAYS => NO_HALL_RAYS;

    REFLECTIONS_EVER:
        "reflections/ray_range.glsl": "mirrors short-sighted": "return kFar;" => "return 0.5;";
        "reflections/visibility.glsl": "no shadows": "if (blocker >= 0.0)" => "if (blocker >= 1e30)";
        "reflections/filter.comp.glsl": "no blur": "radius > 0.75" => "radius > 1e9";

    /// Seen from just above the floor, where leaves are mirrored and throw shadows.
    LEAVES:
        "reflections/surface.glsl": "leaves are squares": ".a >= 0.5;" => ".a >= -1.0;";
        "reflections/leaf.rahit.glsl": "leaves are squares to rays": "ignoreIntersectionEXT;" => ";";
}

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
                RayPath::Pipeline => REFLECTIONS,
                RayPath::Query => REFLECTIONS_QUERY,
            };
            let by = format!("reflections by {path:?}");
            shaders.assert_each_changes_image(&by, &expected, &ACROSS_DRIVERS, mistakes, || {
                hall(&ctx, path, None)
            });
        }
        let path = paths(&ctx)[0];
        let view = Camera::looking_at([2.6, 0.3, -3.6], [1.6, 0.1, -7.0], 45.0);
        let expected = hall(&ctx, path, Some(&view));
        let mistakes = if path == RayPath::Pipeline { LEAVES } else { &LEAVES[..1] };
        shaders.assert_each_changes_image("leaves", &expected, &ACROSS_DRIVERS, mistakes, || {
            hall(&ctx, path, Some(&view))
        });
        // The image of the test that the hall looks as it always did.
        let config = ReflectionsConfig { samples: 4, ..ReflectionsConfig::new(path, 162, 91) };
        let expected = reference_image("reflections_small");
        shaders.assert_each_changes_image("as ever", &expected, &ACROSS_DRIVERS, REFLECTIONS_EVER, || {
            hall_of(&ctx, &config, None)
        });
    });
}
