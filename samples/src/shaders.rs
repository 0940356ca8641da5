//! The GLSL texts of the samples, inside the binary so that it needs no folder beside it.

/// Names as `#include` writes them, and texts, for every sample.
pub const INCLUDES: &[(&str, &str)] = &[
    ("app/ui.glsl", include_str!("../../shaders/app/ui.glsl")),
    ("bench/view.glsl", include_str!("../../shaders/bench/view.glsl")),
    ("common/camera.glsl", include_str!("../../shaders/common/camera.glsl")),
    ("common/fresnel.glsl", include_str!("../../shaders/common/fresnel.glsl")),
    ("common/group_pixel.glsl", include_str!("../../shaders/common/group_pixel.glsl")),
    ("common/lighting.glsl", include_str!("../../shaders/common/lighting.glsl")),
    ("common/octahedral.glsl", include_str!("../../shaders/common/octahedral.glsl")),
    ("common/phong.glsl", include_str!("../../shaders/common/phong.glsl")),
    ("common/ray_offset.glsl", include_str!("../../shaders/common/ray_offset.glsl")),
    ("common/ray_triangle.glsl", include_str!("../../shaders/common/ray_triangle.glsl")),
    ("common/scene_buffers.glsl", include_str!("../../shaders/common/scene_buffers.glsl")),
    ("common/surface.glsl", include_str!("../../shaders/common/surface.glsl")),
    ("common/texture_lod.glsl", include_str!("../../shaders/common/texture_lod.glsl")),
    ("common/tonemap.glsl", include_str!("../../shaders/common/tonemap.glsl")),
    ("deferred/frame.glsl", include_str!("../../shaders/deferred/frame.glsl")),
    ("deferred/targets.glsl", include_str!("../../shaders/deferred/targets.glsl")),
    ("hybrid/bounce_queue.glsl", include_str!("../../shaders/hybrid/bounce_queue.glsl")),
    ("hybrid/coverage.glsl", include_str!("../../shaders/hybrid/coverage.glsl")),
    ("hybrid/footprint.glsl", include_str!("../../shaders/hybrid/footprint.glsl")),
    ("hybrid/frame.glsl", include_str!("../../shaders/hybrid/frame.glsl")),
    ("hybrid/hardware_visibility.glsl", include_str!("../../shaders/hybrid/hardware_visibility.glsl")),
    ("hybrid/hit.glsl", include_str!("../../shaders/hybrid/hit.glsl")),
    ("hybrid/integrator.glsl", include_str!("../../shaders/hybrid/integrator.glsl")),
    ("hybrid/pixel.glsl", include_str!("../../shaders/hybrid/pixel.glsl")),
    ("hybrid/pixel_order.glsl", include_str!("../../shaders/hybrid/pixel_order.glsl")),
    ("hybrid/raster.glsl", include_str!("../../shaders/hybrid/raster.glsl")),
    ("hybrid/survivors.glsl", include_str!("../../shaders/hybrid/survivors.glsl")),
    ("hybrid/trace_pipeline.glsl", include_str!("../../shaders/hybrid/trace_pipeline.glsl")),
    ("hybrid/trace_query.glsl", include_str!("../../shaders/hybrid/trace_query.glsl")),
    ("hybrid/visibility.glsl", include_str!("../../shaders/hybrid/visibility.glsl")),
    ("hybrid/visible_triangle.glsl", include_str!("../../shaders/hybrid/visible_triangle.glsl")),
    ("large_scene/frame.glsl", include_str!("../../shaders/large_scene/frame.glsl")),
    ("large_scene/hit.glsl", include_str!("../../shaders/large_scene/hit.glsl")),
    ("large_scene/picture.glsl", include_str!("../../shaders/large_scene/picture.glsl")),
    ("omni_shadows/frame.glsl", include_str!("../../shaders/omni_shadows/frame.glsl")),
    ("omni_shadows/haze.glsl", include_str!("../../shaders/omni_shadows/haze.glsl")),
    ("omni_shadows/material.glsl", include_str!("../../shaders/omni_shadows/material.glsl")),
    ("omni_shadows/shadow.glsl", include_str!("../../shaders/omni_shadows/shadow.glsl")),
    ("mesh_shaders/frame.glsl", include_str!("../../shaders/mesh_shaders/frame.glsl")),
    ("mesh_shaders/payload.glsl", include_str!("../../shaders/mesh_shaders/payload.glsl")),
    ("mesh_shaders/shade.glsl", include_str!("../../shaders/mesh_shaders/shade.glsl")),
    ("reflections/ambient.glsl", include_str!("../../shaders/reflections/ambient.glsl")),
    ("reflections/fragment.glsl", include_str!("../../shaders/reflections/fragment.glsl")),
    ("reflections/frame.glsl", include_str!("../../shaders/reflections/frame.glsl")),
    ("reflections/gbuffer.glsl", include_str!("../../shaders/reflections/gbuffer.glsl")),
    ("reflections/lighting.glsl", include_str!("../../shaders/reflections/lighting.glsl")),
    ("reflections/lights.glsl", include_str!("../../shaders/reflections/lights.glsl")),
    ("reflections/masks.glsl", include_str!("../../shaders/reflections/masks.glsl")),
    ("reflections/neighbour.glsl", include_str!("../../shaders/reflections/neighbour.glsl")),
    ("reflections/noise.glsl", include_str!("../../shaders/reflections/noise.glsl")),
    ("reflections/range.glsl", include_str!("../../shaders/reflections/range.glsl")),
    ("reflections/reflect.glsl", include_str!("../../shaders/reflections/reflect.glsl")),
    ("reflections/reflectance.glsl", include_str!("../../shaders/reflections/reflectance.glsl")),
    ("reflections/surface.glsl", include_str!("../../shaders/reflections/surface.glsl")),
    ("reflections/trace_pipeline.glsl", include_str!("../../shaders/reflections/trace_pipeline.glsl")),
    ("reflections/trace_query.glsl", include_str!("../../shaders/reflections/trace_query.glsl")),
    ("reflections/visibility.glsl", include_str!("../../shaders/reflections/visibility.glsl")),
    ("reflections/waves.glsl", include_str!("../../shaders/reflections/waves.glsl")),
    ("render_to_cube_map/drop.glsl", include_str!("../../shaders/render_to_cube_map/drop.glsl")),
    ("render_to_cube_map/frame.glsl", include_str!("../../shaders/render_to_cube_map/frame.glsl")),
    ("render_to_cube_map/light.glsl", include_str!("../../shaders/render_to_cube_map/light.glsl")),
    ("render_to_cube_map/view.glsl", include_str!("../../shaders/render_to_cube_map/view.glsl")),
    ("rtx_ao/frame.glsl", include_str!("../../shaders/rtx_ao/frame.glsl")),
    ("rtx_ao/light.glsl", include_str!("../../shaders/rtx_ao/light.glsl")),
    ("rtx_hello/view.glsl", include_str!("../../shaders/rtx_hello/view.glsl")),
    ("rtx_pipeline/frame.glsl", include_str!("../../shaders/rtx_pipeline/frame.glsl")),
    ("rtx_pipeline/picture.glsl", include_str!("../../shaders/rtx_pipeline/picture.glsl")),
    ("rtx_pipeline/radiance.glsl", include_str!("../../shaders/rtx_pipeline/radiance.glsl")),
    ("rtx_pipeline/recursion.glsl", include_str!("../../shaders/rtx_pipeline/recursion.glsl")),
    ("rtx_pipeline/shade.glsl", include_str!("../../shaders/rtx_pipeline/shade.glsl")),
    ("rtx_textures/frame.glsl", include_str!("../../shaders/rtx_textures/frame.glsl")),
    ("rtx_textures/shade.glsl", include_str!("../../shaders/rtx_textures/shade.glsl")),
    ("rtx_textures/surface.glsl", include_str!("../../shaders/rtx_textures/surface.glsl")),
    ("sponza/frame.glsl", include_str!("../../shaders/sponza/frame.glsl")),
    ("sponza/mask.glsl", include_str!("../../shaders/sponza/mask.glsl")),
    ("sponza/relief.glsl", include_str!("../../shaders/sponza/relief.glsl")),
    ("hybrid_oit/ball.glsl", include_str!("../../shaders/hybrid_oit/ball.glsl")),
    ("hybrid_oit/frame.glsl", include_str!("../../shaders/hybrid_oit/frame.glsl")),
    ("hybrid_oit/gbuffer.glsl", include_str!("../../shaders/hybrid_oit/gbuffer.glsl")),
    ("hybrid_oit/glass.glsl", include_str!("../../shaders/hybrid_oit/glass.glsl")),
    ("hybrid_oit/list.glsl", include_str!("../../shaders/hybrid_oit/list.glsl")),
    ("hybrid_oit/occlusion.glsl", include_str!("../../shaders/hybrid_oit/occlusion.glsl")),
    ("hybrid_oit/payload.glsl", include_str!("../../shaders/hybrid_oit/payload.glsl")),
    ("hybrid_oit/shadow.glsl", include_str!("../../shaders/hybrid_oit/shadow.glsl")),
    ("hybrid_oit/sky.glsl", include_str!("../../shaders/hybrid_oit/sky.glsl")),
    ("hybrid_oit/sphere.glsl", include_str!("../../shaders/hybrid_oit/sphere.glsl")),
    ("yuv/push.glsl", include_str!("../../shaders/yuv/push.glsl")),
    ("triplanar/frame.glsl", include_str!("../../shaders/triplanar/frame.glsl")),
    ("triplanar/triplanar.glsl", include_str!("../../shaders/triplanar/triplanar.glsl")),
];

/// Stages of the windows' user interface.
pub mod app {
    /// Corners of its triangles.
    pub const UI_VERT: &str = include_str!("../../shaders/app/ui.vert.glsl");
    /// Their colours.
    pub const UI_FRAG: &str = include_str!("../../shaders/app/ui.frag.glsl");
}

/// Stages of the `bench` program.
pub mod bench {
    /// Macros of the hit shader that takes the number of the primitive from Vulkan.
    pub const BUILT_IN_NUMBERS: &[(&str, &str)] = &[("BENCH_BUILT_IN", "1")];
    /// Macros of the compute stage that traces shadow rays.
    pub const SHADOW_RAYS: &[(&str, &str)] = &[("BENCH_SHADOW", "1")];
    /// A primary ray of a pixel.
    pub const PRIMARY_RGEN: &str = include_str!("../../shaders/bench/primary.rgen.glsl");
    /// A shadow ray of a pixel.
    pub const SHADOW_RGEN: &str = include_str!("../../shaders/bench/shadow.rgen.glsl");
    /// A primary ray that left the scene.
    pub const PRIMARY_RMISS: &str = include_str!("../../shaders/bench/primary.rmiss.glsl");
    /// A shadow ray that reached the light.
    pub const SHADOW_RMISS: &str = include_str!("../../shaders/bench/shadow.rmiss.glsl");
    /// The nearest triangle of a primary ray.
    pub const PRIMARY_RCHIT: &str = include_str!("../../shaders/bench/primary.rchit.glsl");
    /// Rays by query.
    pub const RAYS_COMP: &str = include_str!("../../shaders/bench/rays.comp.glsl");
}

/// Stages of the `hybrid` sample.
pub mod hybrid {
    /// Macros of the ray stages that start from the paper's G-buffer.
    pub const WITH_GBUFFER: &[(&str, &str)] = &[("HYBRID_GBUFFER", "1")];
    /// Macros of the ray stages that start from the visible triangles.
    pub const WITH_VISIBILITY: &[(&str, &str)] = &[("HYBRID_VISIBILITY", "1")];
    /// Macros of the ray stage that queues mirrors and glass.
    pub const WITH_QUEUE: &[(&str, &str)] = &[("HYBRID_QUEUE", "1")];
    /// Macros of the ray stages that take pixels in their order.
    pub const WITH_VISIBILITY_AND_ORDER: &[(&str, &str)] =
        &[("HYBRID_VISIBILITY", "1"), ("HYBRID_ORDERED", "1")];
    /// Macros of the ray stage that queues mirrors and glass, from the visible triangles.
    pub const WITH_VISIBILITY_AND_QUEUE: &[(&str, &str)] =
        &[("HYBRID_VISIBILITY", "1"), ("HYBRID_QUEUE", "1")];
    /// `kNoImage` in `shaders/hybrid/visibility.glsl`.
    pub const NO_IMAGE: u32 = u32::MAX;
    /// Small triangles of the compute rasteriser.
    pub const RASTER_SMALL_COMP: &str = include_str!("../../shaders/hybrid/raster_small.comp.glsl");
    /// Its medium triangles.
    pub const RASTER_MEDIUM_COMP: &str = include_str!("../../shaders/hybrid/raster_medium.comp.glsl");
    /// Tiles of the compute rasteriser's large triangles.
    pub const RASTER_TILE_COMP: &str = include_str!("../../shaders/hybrid/raster_tile.comp.glsl");
    /// The order of pixels.
    pub const ORDER_COMP: &str = include_str!("../../shaders/hybrid/order.comp.glsl");
    /// Culling for the hardware rasteriser.
    pub const CULL_COMP: &str = include_str!("../../shaders/hybrid/cull.comp.glsl");
    /// Closing the gaps that culling leaves.
    pub const COMPACT_COMP: &str = include_str!("../../shaders/hybrid/compact.comp.glsl");
    /// Fragment stage of the hardware rasteriser's visibility.
    pub const VISIBILITY_FRAG: &str = include_str!("../../shaders/hybrid/visibility.frag.glsl");
    /// Vertex stage of the geometry pass.
    pub const GEOMETRY_VERT: &str = include_str!("../../shaders/hybrid/geometry.vert.glsl");
    /// Fragment stage of the geometry pass.
    pub const GEOMETRY_FRAG: &str = include_str!("../../shaders/hybrid/geometry.frag.glsl");
    /// A pixel by the ray tracing pipeline.
    pub const RENDER_RGEN: &str = include_str!("../../shaders/hybrid/render.rgen.glsl");
    /// A pixel by ray queries.
    pub const RENDER_COMP: &str = include_str!("../../shaders/hybrid/render.comp.glsl");
    /// The further rays of a queued pixel by the ray tracing pipeline.
    pub const BOUNCES_RGEN: &str = include_str!("../../shaders/hybrid/bounces.rgen.glsl");
    /// The same by ray queries.
    pub const BOUNCES_COMP: &str = include_str!("../../shaders/hybrid/bounces.comp.glsl");
    /// The nearest triangle of a ray.
    pub const CLOSEST_RCHIT: &str = include_str!("../../shaders/hybrid/closest.rchit.glsl");
    /// A ray that left the scene.
    pub const CLOSEST_RMISS: &str = include_str!("../../shaders/hybrid/closest.rmiss.glsl");
    /// A shadow ray that reached the light.
    pub const SHADOW_RMISS: &str = include_str!("../../shaders/hybrid/shadow.rmiss.glsl");
}

/// Stages of the `reflections` sample.
pub mod reflections {
    /// Moves the vertices of the character by its bones.
    pub const SKIN_COMP: &str = include_str!("../../shaders/reflections/skin.comp.glsl");
    /// Turns the leaves to the camera.
    pub const LEAVES_COMP: &str = include_str!("../../shaders/reflections/leaves.comp.glsl");
    /// Vertex stage of all raster passes.
    pub const SURFACE_VERT: &str = include_str!("../../shaders/reflections/surface.vert.glsl");
    /// The g-buffer of opaque surfaces.
    pub const OPAQUE_FRAG: &str = include_str!("../../shaders/reflections/opaque.frag.glsl");
    /// The g-buffer of transparent surfaces.
    pub const TRANSPARENT_FRAG: &str = include_str!("../../shaders/reflections/transparent.frag.glsl");
    /// Transparent surfaces over the lit picture.
    pub const BLEND_FRAG: &str = include_str!("../../shaders/reflections/blend.frag.glsl");
    /// What opaque surfaces reflect, by the ray tracing pipeline.
    pub const OPAQUE_RGEN: &str = include_str!("../../shaders/reflections/opaque.rgen.glsl");
    /// The same by ray queries.
    pub const OPAQUE_COMP: &str = include_str!("../../shaders/reflections/opaque.comp.glsl");
    /// What transparent surfaces reflect, by the ray tracing pipeline.
    pub const TRANSPARENT_RGEN: &str = include_str!("../../shaders/reflections/transparent.rgen.glsl");
    /// The same by ray queries.
    pub const TRANSPARENT_COMP: &str = include_str!("../../shaders/reflections/transparent.comp.glsl");
    /// The nearest triangle of a ray.
    pub const CLOSEST_RCHIT: &str = include_str!("../../shaders/reflections/closest.rchit.glsl");
    /// Whether a ray passes a leaf.
    pub const LEAF_RAHIT: &str = include_str!("../../shaders/reflections/leaf.rahit.glsl");
    /// A ray that left the scene.
    pub const CLOSEST_RMISS: &str = include_str!("../../shaders/reflections/closest.rmiss.glsl");
    /// A shadow ray that reached the light.
    pub const SHADOW_RMISS: &str = include_str!("../../shaders/reflections/shadow.rmiss.glsl");
    /// Smooths shadows and openness.
    pub const SMOOTH_COMP: &str = include_str!("../../shaders/reflections/smooth.comp.glsl");
    /// Blurs reflections.
    pub const FILTER_COMP: &str = include_str!("../../shaders/reflections/filter.comp.glsl");
    /// Lights the opaque surfaces.
    pub const COMPOSITE_COMP: &str = include_str!("../../shaders/reflections/composite.comp.glsl");
    /// Averages the samples of a picture.
    pub const RESOLVE_COMP: &str = include_str!("../../shaders/reflections/resolve.comp.glsl");
}

/// Stages of the `hybrid_oit` sample.
pub mod hybrid_oit {
    /// Places the spheres.
    pub const ANIMATE_COMP: &str = include_str!("../../shaders/hybrid_oit/animate.comp.glsl");
    /// Floor and blocks.
    pub const SOLID_VERT: &str = include_str!("../../shaders/hybrid_oit/solid.vert.glsl");
    /// A square that covers a sphere.
    pub const SPHERE_VERT: &str = include_str!("../../shaders/hybrid_oit/sphere.vert.glsl");
    /// Depth of a ball.
    pub const BALL_DEPTH_FRAG: &str = include_str!("../../shaders/hybrid_oit/ball_depth.frag.glsl");
    /// Floor and blocks into the G-buffer.
    pub const SOLID_FRAG: &str = include_str!("../../shaders/hybrid_oit/solid.frag.glsl");
    /// A ball into the G-buffer.
    pub const BALL_FRAG: &str = include_str!("../../shaders/hybrid_oit/ball.frag.glsl");
    /// Glass into the lists.
    pub const GLASS_FRAG: &str = include_str!("../../shaders/hybrid_oit/glass.frag.glsl");
    /// Shadow rays by the ray tracing pipeline.
    pub const SHADOW_RGEN: &str = include_str!("../../shaders/hybrid_oit/shadow.rgen.glsl");
    /// A shadow ray that reached the sun.
    pub const SHADOW_RMISS: &str = include_str!("../../shaders/hybrid_oit/shadow.rmiss.glsl");
    /// A shadow ray in the box of a sphere.
    pub const SPHERE_RINT: &str = include_str!("../../shaders/hybrid_oit/sphere.rint.glsl");
    /// A shadow ray through glass.
    pub const GLASS_RAHIT: &str = include_str!("../../shaders/hybrid_oit/glass.rahit.glsl");
    /// Shadow rays by queries.
    pub const SHADOW_COMP: &str = include_str!("../../shaders/hybrid_oit/shadow.comp.glsl");
    /// The picture.
    pub const COMPOSITE_COMP: &str = include_str!("../../shaders/hybrid_oit/composite.comp.glsl");
}

/// Stages of the `large_scene` sample.
pub mod large_scene {
    /// A pixel by the ray tracing pipeline.
    pub const PICTURE_RGEN: &str = include_str!("../../shaders/large_scene/picture.rgen.glsl");
    /// The nearest triangle of a ray.
    pub const NEAREST_RCHIT: &str = include_str!("../../shaders/large_scene/nearest.rchit.glsl");
    /// A ray that left the world.
    pub const NEAREST_RMISS: &str = include_str!("../../shaders/large_scene/nearest.rmiss.glsl");
    /// A shadow ray with nothing in its way.
    pub const OPEN_RMISS: &str = include_str!("../../shaders/large_scene/open.rmiss.glsl");
    /// A pixel by ray queries.
    pub const PICTURE_COMP: &str = include_str!("../../shaders/large_scene/picture.comp.glsl");
}

/// Stages of the `rtx_hello` sample.
pub mod rtx_hello {
    /// Rays of a pixel, by the ray tracing pipeline.
    pub const HELLO_RGEN: &str = include_str!("../../shaders/rtx_hello/hello.rgen.glsl");
    /// A ray that met nothing.
    pub const HELLO_RMISS: &str = include_str!("../../shaders/rtx_hello/hello.rmiss.glsl");
    /// The nearest triangle of a ray.
    pub const HELLO_RCHIT: &str = include_str!("../../shaders/rtx_hello/hello.rchit.glsl");
    /// Rays of a pixel, by ray queries.
    pub const HELLO_COMP: &str = include_str!("../../shaders/rtx_hello/hello.comp.glsl");
}

/// Stages of the `rtx_textures` sample.
pub mod rtx_textures {
    /// Writes the instances.
    pub const INSTANCES_COMP: &str = include_str!("../../shaders/rtx_textures/instances.comp.glsl");
    /// Rays of a pixel, by the ray tracing pipeline.
    pub const TEXTURES_RGEN: &str = include_str!("../../shaders/rtx_textures/textures.rgen.glsl");
    /// A ray that left the scene.
    pub const SKY_RMISS: &str = include_str!("../../shaders/rtx_textures/sky.rmiss.glsl");
    /// The hit group of what is painted.
    pub const PAINTED_RCHIT: &str = include_str!("../../shaders/rtx_textures/painted.rchit.glsl");
    /// The hit group of what is glazed.
    pub const GLAZED_RCHIT: &str = include_str!("../../shaders/rtx_textures/glazed.rchit.glsl");
    /// Rays of a pixel, by ray queries.
    pub const TEXTURES_COMP: &str = include_str!("../../shaders/rtx_textures/textures.comp.glsl");
}

/// Stages of the `rtx_pipeline` sample.
pub mod rtx_pipeline {
    /// A pixel by the ray tracing pipeline.
    pub const PICTURE_RGEN: &str = include_str!("../../shaders/rtx_pipeline/picture.rgen.glsl");
    /// A ray that left the scene.
    pub const SKY_RMISS: &str = include_str!("../../shaders/rtx_pipeline/sky.rmiss.glsl");
    /// A shadow ray that reached its light.
    pub const LIGHT_RMISS: &str = include_str!("../../shaders/rtx_pipeline/light.rmiss.glsl");
    /// The hit group of what stops light.
    pub const SOLID_RCHIT: &str = include_str!("../../shaders/rtx_pipeline/solid.rchit.glsl");
    /// The hit group of what light passes through.
    pub const GLASS_RCHIT: &str = include_str!("../../shaders/rtx_pipeline/glass.rchit.glsl");
    /// A pixel by ray queries.
    pub const PICTURE_COMP: &str = include_str!("../../shaders/rtx_pipeline/picture.comp.glsl");
}

/// Stages of the `rtx_ao` sample.
pub mod rtx_ao {
    /// Macros of the fragment stage that leaves light to a later pass.
    pub const WITH_TARGETS: &[(&str, &str)] = &[("RTX_AO_TARGETS", "1")];
    /// Corners of a body's triangles.
    pub const SURFACE_VERT: &str = include_str!("../../shaders/rtx_ao/surface.vert.glsl");
    /// Colour and light of what is nearest.
    pub const SURFACE_FRAG: &str = include_str!("../../shaders/rtx_ao/surface.frag.glsl");
    /// Light by the ray tracing pipeline.
    pub const LIGHT_RGEN: &str = include_str!("../../shaders/rtx_ao/light.rgen.glsl");
    /// A ray that nothing stopped.
    pub const OPEN_RMISS: &str = include_str!("../../shaders/rtx_ao/open.rmiss.glsl");
    /// The cache, and the picture.
    pub const ACCUMULATE_COMP: &str = include_str!("../../shaders/rtx_ao/accumulate.comp.glsl");
}

/// Stages of the `hello_triangle` sample.
pub mod hello_triangle {
    /// Corners of the triangle.
    pub const TRIANGLE_VERT: &str = include_str!("../../shaders/hello_triangle/triangle.vert.glsl");
    /// The colour between them.
    pub const TRIANGLE_FRAG: &str = include_str!("../../shaders/hello_triangle/triangle.frag.glsl");
}

/// Stages of the `render_to_cube_map` sample.
pub mod render_to_cube_map {
    /// Macros of the fragment stages that draw the picture in place of the cube map.
    pub const OF_PICTURE: &[(&str, &str)] = &[("PICTURE", "1")];
    /// Macros of the vertex stages that draw all faces at once.
    pub const OF_ALL_FACES: &[(&str, &str)] = &[("ALL_FACES", "1")];
    /// Corners of the blocks.
    pub const BLOCK_VERT: &str = include_str!("../../shaders/render_to_cube_map/block.vert.glsl");
    /// Their colours, and those of the floor.
    pub const BLOCK_FRAG: &str = include_str!("../../shaders/render_to_cube_map/block.frag.glsl");
    /// A triangle behind everything.
    pub const SKY_VERT: &str = include_str!("../../shaders/render_to_cube_map/sky.vert.glsl");
    /// The sky.
    pub const SKY_FRAG: &str = include_str!("../../shaders/render_to_cube_map/sky.frag.glsl");
    /// Corners of the drop.
    pub const DROP_VERT: &str = include_str!("../../shaders/render_to_cube_map/drop.vert.glsl");
    /// What it mirrors.
    pub const DROP_FRAG: &str = include_str!("../../shaders/render_to_cube_map/drop.frag.glsl");
}

/// Stages of the `omni_shadows` sample.
pub mod omni_shadows {
    /// Macros of the stage that draws all faces of the cube map at once.
    pub const MULTIVIEW: &[(&str, &str)] = &[("OMNI_MULTIVIEW", "1")];

    /// What throws shadows.
    pub const CASTER_VERT: &str = include_str!("../../shaders/omni_shadows/caster.vert.glsl");
    /// Surfaces.
    pub const SURFACE_VERT: &str = include_str!("../../shaders/omni_shadows/surface.vert.glsl");
    /// Their colours in the light of the lamp.
    pub const SURFACE_FRAG: &str = include_str!("../../shaders/omni_shadows/surface.frag.glsl");
    /// The unfolded cube map.
    pub const CUBE_VIEW_VERT: &str = include_str!("../../shaders/omni_shadows/cube_view.vert.glsl");
    /// Its depths.
    pub const CUBE_VIEW_FRAG: &str = include_str!("../../shaders/omni_shadows/cube_view.frag.glsl");
}

/// Stages of the `mesh_shaders` sample.
pub mod mesh_shaders {
    /// Chooses the meshlets that can be seen.
    pub const MESHLET_TASK: &str = include_str!("../../shaders/mesh_shaders/meshlet.task.glsl");
    /// Corners and triangles of a meshlet.
    pub const MESHLET_MESH: &str = include_str!("../../shaders/mesh_shaders/meshlet.mesh.glsl");
    /// Their colours.
    pub const MESHLET_FRAG: &str = include_str!("../../shaders/mesh_shaders/meshlet.frag.glsl");
}

/// Stages of the `yuv` sample.
pub mod yuv {
    /// Corners of the moving picture.
    pub const PICTURE_VERT: &str = include_str!("../../shaders/yuv/picture.vert.glsl");
    /// Its colours.
    pub const PICTURE_FRAG: &str = include_str!("../../shaders/yuv/picture.frag.glsl");
    /// Corners of its planes.
    pub const PLANES_VERT: &str = include_str!("../../shaders/yuv/planes.vert.glsl");
    /// Their greys.
    pub const PLANES_FRAG: &str = include_str!("../../shaders/yuv/planes.frag.glsl");
}

/// Stages of the `deferred` sample.
pub mod deferred {
    /// Corners of everything solid.
    pub const SURFACES_VERT: &str = include_str!("../../shaders/deferred/surfaces.vert.glsl");
    /// What surfaces are like.
    pub const SURFACES_FRAG: &str = include_str!("../../shaders/deferred/surfaces.frag.glsl");
    /// A square for each light, or with `GLOW` for the shine around it.
    pub const ORBS_VERT: &str = include_str!("../../shaders/deferred/orbs.vert.glsl");
    /// A light itself.
    pub const ORBS_FRAG: &str = include_str!("../../shaders/deferred/orbs.frag.glsl");
    /// The shine around a light.
    pub const GLOW_FRAG: &str = include_str!("../../shaders/deferred/glow.frag.glsl");
    /// A triangle over all pixels.
    pub const SCREEN_VERT: &str = include_str!("../../shaders/deferred/screen.vert.glsl");
    /// Light from nowhere in particular, and the sky.
    pub const AMBIENT_FRAG: &str = include_str!("../../shaders/deferred/ambient.frag.glsl");
    /// A body around all that a light reaches.
    pub const LIGHT_VERT: &str = include_str!("../../shaders/deferred/light.vert.glsl");
    /// What a light does to a surface.
    pub const LIGHT_FRAG: &str = include_str!("../../shaders/deferred/light.frag.glsl");
    /// From light to the picture.
    pub const RESOLVE_FRAG: &str = include_str!("../../shaders/deferred/resolve.frag.glsl");
}

/// Stages of the `triplanar` sample.
pub mod triplanar {
    /// Corners of the models.
    pub const BODY_VERT: &str = include_str!("../../shaders/triplanar/body.vert.glsl");
    /// Colour and light of what is nearest.
    pub const BODY_FRAG: &str = include_str!("../../shaders/triplanar/body.frag.glsl");
}

/// Stages of the `sponza` sample.
pub mod sponza {
    /// Culls draws for the camera and the sun.
    pub const CULL_COMP: &str = include_str!("../../shaders/sponza/cull.comp.glsl");
    /// Corners as the sun sees them.
    pub const SHADOW_VERT: &str = include_str!("../../shaders/sponza/shadow.vert.glsl");
    /// Holes that cast no shadow.
    pub const SHADOW_FRAG: &str = include_str!("../../shaders/sponza/shadow.frag.glsl");
    /// Corners as the camera sees them.
    pub const SURFACE_VERT: &str = include_str!("../../shaders/sponza/surface.vert.glsl");
    /// A surface in the sun and under the sky.
    pub const SURFACE_FRAG: &str = include_str!("../../shaders/sponza/surface.frag.glsl");
    /// A triangle that covers the picture.
    pub const SKY_VERT: &str = include_str!("../../shaders/sponza/sky.vert.glsl");
    /// The sky where nothing hides it.
    pub const SKY_FRAG: &str = include_str!("../../shaders/sponza/sky.frag.glsl");
}
