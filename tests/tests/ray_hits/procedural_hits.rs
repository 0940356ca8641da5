//! Hits of AABBs that ray queries generate: at the ends of the ray interval, and outside of it, which only the
//! library's own traversal rejects.

use lvk::glam::{Affine3A, Vec3};
use lvk::{
    Aabbs, BlasDesc, BlasGeometry, BufferDesc, BufferUsage, ComputePipelineDesc, Context, GeometryFlags,
    RayQueryPath, Result, ShaderStage, TlasDesc,
};
use lvk_tests::device;
use lvk_tests::ray_scene::{Placed, instances};
use lvk_tests::ray_tracer::{How, MISSED, RayTracer, requires_ray_queries, shader_with};
use lvk_tests::rays::Ray;

/// Generates hits at two distances in turn. With FUNCTION, the traversal calls the function that does so.
const TEXT: &str = r#"
    #ifdef FUNCTION
    #define LVK_CANDIDATE_FUNCTION generate
    #endif
    #include "ray_query_start.glsl"
    void generate(LvkRayQueryParameter rq) {
        lvkRayQueryGenerateIntersection(rq, FIRST);
        lvkRayQueryGenerateIntersection(rq, SECOND);
    }
    void main() {
        START_RAY_QUERY;
        while (lvkRayQueryProceed(rq)) {
            generate(rq);
        }
        HitRecord record = kNoHit;
        if (lvkRayQueryType(rq, LVK_COMMITTED) == LVK_COMMITTED_GENERATED) {
            record.kind = 1u;
            record.t = lvkRayQueryT(rq, LVK_COMMITTED);
        }
        hits.at[index] = record;
    }"#;

/// Returns the hits of rays with these intervals, in an AABB in which hits are generated at `reports`, one after the
/// other. A loop and a candidate function must generate the same.
fn hits(ctx: &Context, reports: [f32; 2], ends: &[(f32, f32)]) -> Result<Vec<Option<f32>>> {
    let [first, second] = reports.map(|t| format!("{t:?}"));
    let defines = [("FIRST", first.as_str()), ("SECOND", &second), ("FUNCTION", "")];
    let by_loop = hits_of_module(ctx, &defines[..2], ends)?;
    assert_eq!(hits_of_module(ctx, &defines, ends)?, by_loop, "by a candidate function, by a loop");
    Ok(by_loop)
}

fn hits_of_module(ctx: &Context, defines: &[(&str, &str)], ends: &[(f32, f32)]) -> Result<Vec<Option<f32>>> {
    let module = shader_with(ctx, ShaderStage::Compute, TEXT, defines)?;
    let desc = ComputePipelineDesc { module: Some(*module), ..Default::default() };
    let tracer = RayTracer::from_query(ctx, ctx.create_compute_pipeline(&desc)?);
    let corners = [[-1.0, -1.0, 0.0], [1.0, 1.0, 20.0_f32]];
    let (data, usage) = (Some(bytemuck::cast_slice(&corners)), BufferUsage::ACCEL_INPUT);
    let buffer = ctx.create_buffer(&BufferDesc { data, usage, ..Default::default() })?;
    let flags = GeometryFlags::OPAQUE;
    let geometries = [BlasGeometry::Aabbs(Aabbs { buffer: *buffer, offset: 0, stride: 0, count: 1, flags })];
    let model = [ctx.create_blas(&BlasDesc { geometries: &geometries, ..Default::default() })?];
    let placed = instances(&[Placed::new(0, Affine3A::IDENTITY)], &model);
    let tlas = ctx.create_tlas(&TlasDesc { instances: &placed, ..Default::default() })?;
    let ray = |(t_min, t_max): &(f32, f32)| Ray {
        t_min: *t_min,
        t_max: *t_max,
        ..Ray::new(Vec3::new(0.25, 0.5, -1.0), Vec3::Z)
    };
    let records = tracer.trace(&tlas, &ends.iter().map(ray).collect::<Vec<_>>(), How::default())?;
    Ok(records.iter().map(|record| (record.kind != MISSED).then_some(record.t)).collect())
}

#[test]
fn a_generated_hit_within_the_ray_counts_its_ends_included() -> Result<()> {
    let Some(ctx) = device().filter(|ctx| requires_ray_queries(ctx)) else { return Ok(()) };
    let (before, after) = (4.0_f32.next_down(), 4.0_f32.next_up());
    let around = [(4.0, 10.0), (0.0, 4.0), (4.0, 4.0), (before, after)];
    assert_eq!(hits(&ctx, [4.0, 4.0], &around)?, [Some(4.0); 4]);
    assert_eq!(hits(&ctx, [4.0, 2.0], &[(0.0, 10.0), (2.0, 4.0)])?, [Some(2.0); 2], "a nearer one");
    if ctx.capabilities().ray_query_path != RayQueryPath::Software {
        return Ok(());
    }
    assert_eq!(hits(&ctx, [4.0, 4.0], &[(after, 10.0), (0.0, before)])?, [None; 2]);
    assert_eq!(hits(&ctx, [2.0, 4.0], &[(0.0, 10.0), (0.0, 2.0)])?, [Some(2.0); 2], "behind another");
    assert_eq!(hits(&ctx, [2.0, 4.0], &[(after, 10.0), (3.0, 10.0)])?, [None, Some(4.0)]);
    Ok(())
}
