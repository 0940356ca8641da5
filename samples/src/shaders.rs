//! The GLSL texts that shaders include, inside the binary so that it needs no folder beside it.

/// Pairs each name of a file below `shaders/` with its text.
macro_rules! includes {
    ($($name:literal,)*) => {
        &[$((
            concat!($name, ".glsl"),
            include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/../shaders/", $name, ".glsl")),
        ),)*]
    };
}

/// Names as `#include` writes them, and texts, for every sample.
pub const INCLUDES: &[(&str, &str)] = includes![
    "bench/view",
    "common/arrays",
    "common/camera",
    "common/count_up_to_here",
    "common/for_each_pixel",
    "common/fresnel",
    "common/group_pixel",
    "common/lighting",
    "common/no_texture",
    "common/occlusion_query",
    "common/octahedral",
    "common/phong",
    "common/ray_offset",
    "common/ray_triangle",
    "common/scene_buffers",
    "common/scene_frame",
    "common/surface",
    "common/texture_lod",
    "common/tonemap",
    "common/vertices",
    "deferred/frame",
    "deferred/light_output",
    "deferred/targets",
    "hybrid/coverage",
    "hybrid/footprint",
    "hybrid/frame",
    "hybrid/hardware_visibility",
    "hybrid/hit",
    "hybrid/integrator",
    "hybrid/pixel",
    "hybrid/pixel_order",
    "hybrid/raster",
    "hybrid/reflective_pixels",
    "hybrid/trace_pipeline",
    "hybrid/trace_query",
    "hybrid/unculled_triangles",
    "hybrid/visibility",
    "hybrid/visible_triangle",
    "hybrid_oit/ball",
    "hybrid_oit/frame",
    "hybrid_oit/gbuffer",
    "hybrid_oit/glass",
    "hybrid_oit/list",
    "hybrid_oit/occlusion",
    "hybrid_oit/payload",
    "hybrid_oit/shadow",
    "hybrid_oit/sky",
    "hybrid_oit/sphere",
    "large_scene/frame",
    "large_scene/hit",
    "large_scene/picture",
    "mesh_shaders/frame",
    "mesh_shaders/payload",
    "mesh_shaders/shade",
    "omni_shadows/frame",
    "omni_shadows/haze",
    "omni_shadows/material",
    "omni_shadows/shadow",
    "reflections/ambient",
    "reflections/fragment",
    "reflections/frame",
    "reflections/gbuffer",
    "reflections/lighting",
    "reflections/lights",
    "reflections/masks",
    "reflections/neighbour",
    "reflections/noise",
    "reflections/ray_range",
    "reflections/reflect",
    "reflections/reflectance",
    "reflections/surface",
    "reflections/trace_pipeline",
    "reflections/trace_query",
    "reflections/visibility",
    "reflections/waves",
    "render_to_cube_map/drop",
    "render_to_cube_map/frame",
    "render_to_cube_map/light",
    "render_to_cube_map/view",
    "rtx_ao/frame",
    "rtx_ao/light",
    "rtx_hello/view",
    "rtx_pipeline/frame",
    "rtx_pipeline/picture",
    "rtx_pipeline/radiance",
    "rtx_pipeline/recursion",
    "rtx_pipeline/shade",
    "rtx_textures/frame",
    "rtx_textures/hit",
    "rtx_textures/shade",
    "rtx_textures/surface",
    "sponza/frame",
    "sponza/mask",
    "sponza/normal_mapping",
    "triplanar/frame",
    "triplanar/triplanar",
    "viewer/albedo",
    "viewer/ambient_occlusion",
    "viewer/ambient_probe",
    "viewer/ambient_term",
    "viewer/bsdf",
    "viewer/candidate",
    "viewer/emitters",
    "viewer/frame",
    "viewer/ggx",
    "viewer/history",
    "viewer/hit",
    "viewer/iridescence",
    "viewer/light_turn",
    "viewer/lights",
    "viewer/material",
    "viewer/nearest_ray",
    "viewer/occlusion",
    "viewer/path",
    "viewer/path_launch",
    "viewer/plane",
    "viewer/pyramid",
    "viewer/radiance_cache",
    "viewer/radiance_cache_layout",
    "viewer/random",
    "viewer/sample_path",
    "viewer/sky",
    "viewer/surface",
    "viewer/thin",
    "viewer/tone",
    "viewer/trace_pipeline",
    "viewer/trace_query",
    "viewer/visible_light",
    "viewer/visible_surface",
    "viewer/visible_triangle",
    "yuv/push",
];

/// Stages of the `bench` program.
pub mod bench {
    /// Macros of the hit shader that takes the number of the primitive from Vulkan.
    pub const BUILT_IN_NUMBERS: &[(&str, &str)] = &[("BENCH_BUILT_IN", "1")];
    /// Macros of the compute stage that traces shadow rays.
    pub const SHADOW_RAYS: &[(&str, &str)] = &[("BENCH_SHADOW", "1")];
    /// Macros of the compute stage that traces bounce rays.
    pub const BOUNCE_RAYS: &[(&str, &str)] = &[("BENCH_BOUNCE", "1")];
    /// A primary ray of a pixel.
    pub const PRIMARY_RGEN: &str = include_str!("../../shaders/bench/primary.rgen.glsl");
    /// A shadow ray of a pixel.
    pub const SHADOW_RGEN: &str = include_str!("../../shaders/bench/shadow.rgen.glsl");
    /// A bounce ray of a pixel.
    pub const BOUNCE_RGEN: &str = include_str!("../../shaders/bench/bounce.rgen.glsl");
    /// A primary ray that left the scene.
    pub const PRIMARY_RMISS: &str = include_str!("../../shaders/bench/primary.rmiss.glsl");
    /// A shadow ray that reached the light.
    pub const SHADOW_RMISS: &str = include_str!("../../shaders/bench/shadow.rmiss.glsl");
    /// The nearest triangle of a primary ray.
    pub const PRIMARY_RCHIT: &str = include_str!("../../shaders/bench/primary.rchit.glsl");
    /// Rays by query.
    pub const RAYS_COMP: &str = include_str!("../../shaders/bench/rays.comp.glsl");
}
