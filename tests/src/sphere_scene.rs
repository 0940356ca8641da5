//! Spheres in boxes, which `sphere.rint.glsl` and `sphere_query.comp.glsl` know how to hit.

use lvk::glam::Vec3;
use lvk::{
    Aabbs, BlasGeometry, BufferDesc, BufferHandle, BufferUsage, ComputePipelineDesc, Context, GeometryFlags,
    HitGroup, Holder, RayTracingPipelineDesc, Result, ShaderStage,
};

use crate::ray_scene::Placed;
use crate::ray_tracer::{Method, RayTracer, shader};
use crate::reference::{HitIds, Sphere};

/// Radius in object space and tag of each hit group of spheres; an instance's hit-group offset chooses one.
pub const GROUPS: [(f32, u32); 2] = [(0.9, 17), (0.5, 99)];

/// Geometries of a model of spheres.
const GEOMETRIES: u32 = 2;

/// Two geometries of `count` boxes each, and their buffers. The second list starts late and has gaps.
pub fn sphere_boxes(ctx: &Context, count: u32) -> Result<(Vec<Holder<BufferHandle>>, Vec<BlasGeometry>)> {
    let mut buffers = Vec::new();
    let mut geometries = Vec::new();
    for (geometry, offset, stride) in [(0, 0, 0), (1, 16, 32)] {
        let mut floats = vec![f32::NAN; offset as usize / 4];
        for center in (0..count).map(|primitive| sphere_center(geometry, primitive)) {
            floats.extend([center - 1.0, center + 1.0].iter().flat_map(Vec3::to_array));
            floats.extend(vec![f32::NAN; if stride == 0 { 0 } else { 2 }]);
        }
        let data = Some(bytemuck::cast_slice(&floats));
        let usage = BufferUsage::ACCEL_INPUT;
        let buffer = ctx.create_buffer(&BufferDesc { data, usage, ..Default::default() })?;
        let flags = GeometryFlags::OPAQUE;
        geometries.push(BlasGeometry::Aabbs(Aabbs { buffer: *buffer, offset, stride, count, flags }));
        buffers.push(buffer);
    }
    Ok((buffers, geometries))
}

/// The spheres of models of `count` boxes a geometry, for the reference.
pub fn spheres(placed: &[Placed], count: u32) -> Vec<Sphere> {
    let mut spheres = Vec::new();
    for (instance, placed) in (0..).zip(placed) {
        let scale = f64::from(placed.transform.matrix3.x_axis.length());
        let radius = f64::from(GROUPS[placed.hit_group_offset as usize].0) * scale;
        for (geometry, primitive) in (0..GEOMETRIES * count).map(|index| (index / count, index % count)) {
            let center = placed.transform.transform_point3(sphere_center(geometry, primitive)).as_dvec3();
            let ids = HitIds { instance, custom_index: placed.custom_index, geometry, primitive };
            spheres.push(Sphere { center, radius, ids });
        }
    }
    spheres
}

/// Hits spheres by either method.
pub fn sphere_tracer(ctx: &Context, method: Method) -> Result<RayTracer> {
    match method {
        Method::Pipeline => sphere_pipeline(ctx),
        Method::Query => sphere_query(ctx),
    }
}

/// Where the shaders look for a sphere, in object space.
fn sphere_center(geometry: u32, primitive: u32) -> Vec3 {
    Vec3::new((primitive % 3) as f32, (primitive / 3) as f32, geometry as f32) * 2.0
}

fn sphere_pipeline(ctx: &Context) -> Result<RayTracer> {
    let ray_gen = shader(ctx, ShaderStage::RayGen, include_str!("../shaders/closest.rgen.glsl"))?;
    let miss = shader(ctx, ShaderStage::Miss, include_str!("../shaders/record.rmiss.glsl"))?;
    let hit = shader(ctx, ShaderStage::ClosestHit, include_str!("../shaders/sphere.rchit.glsl"))?;
    let sphere = shader(ctx, ShaderStage::Intersection, include_str!("../shaders/sphere.rint.glsl"))?;
    let records = GROUPS.map(|(radius, tag)| [radius.to_ne_bytes(), tag.to_ne_bytes()].concat());
    let groups = records.each_ref().map(|record| HitGroup {
        closest_hit: Some(*hit),
        intersection: Some(*sphere),
        record,
        ..Default::default()
    });
    let pipeline = ctx.create_ray_tracing_pipeline(&RayTracingPipelineDesc {
        ray_gen: &[*ray_gen],
        miss: &[*miss],
        hit_groups: &groups,
        ..Default::default()
    })?;
    Ok(RayTracer::of_pipeline(ctx, pipeline))
}

fn sphere_query(ctx: &Context) -> Result<RayTracer> {
    let module = shader(ctx, ShaderStage::Compute, include_str!("../shaders/sphere_query.comp.glsl"))?;
    let desc = ComputePipelineDesc { module: Some(*module), ..Default::default() };
    Ok(RayTracer::of_query(ctx, ctx.create_compute_pipeline(&desc)?))
}
