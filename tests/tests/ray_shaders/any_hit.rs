//! Candidates that any-hit shaders and ray queries see and judge: the set of hits and the result of the ray do not
//! depend on the order of the driver's traversal.

use lvk::glam::{Affine3A, Quat, Vec3};
use lvk::{Context, GeometryFlags, HitGroup, Result, ShaderStage};
use lvk_tests::accel_backend::whole_and_split;
use lvk_tests::hit_comparison::HitComparison;
use lvk_tests::meshes::Mesh;
use lvk_tests::random::Random;
use lvk_tests::ray_scene::{GpuScene, Layout, Part, Placed, RayScene};
use lvk_tests::ray_tracer::{
    HitRecord, How, MISSED, Method, OPAQUE, RayTracer, TERMINATE_ON_FIRST_HIT, shader, shader_with,
};
use lvk_tests::rays::{Ray, random_rays};
use lvk_tests::reference::{Hit, HitIds, Reference};

/// The shaders' decision about a candidate.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Verdict {
    Ignore,
    Accept,
    Terminate,
}

impl Verdict {
    fn define(self) -> (&'static str, &'static str) {
        match self {
            Self::Ignore => ("IGNORE", ""),
            Self::Accept => ("ACCEPT", ""),
            Self::Terminate => ("TERMINATE", ""),
        }
    }
}

/// The place of the shaders' decision.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Judge {
    AnyHitShader,
    QueryLoop,
    CandidateFunction,
}

impl Judge {
    fn available(ctx: &Context) -> Vec<Self> {
        let of_method = |method| match method {
            Method::Pipeline => [Self::AnyHitShader].as_slice(),
            Method::Query => &[Self::QueryLoop, Self::CandidateFunction],
        };
        Method::available(ctx).into_iter().flat_map(of_method).copied().collect()
    }
}

/// Shaders that count candidates, see `shaders/any_hit.rgen.glsl`.
fn counter(ctx: &Context, judge: Judge, verdict: Verdict) -> Result<RayTracer> {
    let query = include_str!("../../shaders/any_hit_query.comp.glsl");
    match judge {
        Judge::AnyHitShader => any_hit_counter(ctx, verdict),
        Judge::QueryLoop => RayTracer::from_query_text(ctx, query, &[verdict.define()]),
        Judge::CandidateFunction => {
            RayTracer::from_query_text(ctx, query, &[verdict.define(), ("FUNCTION", "")])
        }
    }
}

fn any_hit_counter(ctx: &Context, verdict: Verdict) -> Result<RayTracer> {
    let defines = &[verdict.define()];
    let ray_gen = shader(ctx, ShaderStage::RayGen, include_str!("../../shaders/any_hit.rgen.glsl"))?;
    let miss = shader(ctx, ShaderStage::Miss, include_str!("../../shaders/any_hit_keep.rmiss.glsl"))?;
    let closest = shader(ctx, ShaderStage::ClosestHit, include_str!("../../shaders/any_hit.rchit.glsl"))?;
    let text = include_str!("../../shaders/any_hit.rahit.glsl");
    let any = shader_with(ctx, ShaderStage::AnyHit, text, defines)?;
    RayTracer::from_groups(
        ctx,
        *ray_gen,
        *miss,
        &[HitGroup { closest_hit: Some(*closest), any_hit: Some(*any), ..Default::default() }],
    )
}

/// Overlapping models of two geometries with these flags.
fn scene(flags: [GeometryFlags; 2]) -> RayScene {
    let part = |mesh, flags| Part { flags, ..Part::new(mesh, Layout::Indexed16) };
    let models = vec![
        vec![part(Mesh::sphere(6), flags[0]), part(Mesh::cube_grid(2), flags[1])],
        vec![part(Mesh::torus(6), flags[0]), part(Mesh::terrain(5), flags[1])],
    ];
    let mut random = Random::new(81);
    let mut place = |index: u32| {
        let turn = Quat::from_rotation_x(random.between(0.0, 6.0));
        let scale = random.point(Vec3::splat(0.6), Vec3::splat(1.5));
        let to = random.point(Vec3::splat(-1.0), Vec3::splat(1.0));
        let transform = Affine3A::from_scale_rotation_translation(scale, turn, to);
        Placed { custom_index: 40 + index, ..Placed::new(index as usize % 2, transform) }
    };
    RayScene { models, placed: (0..7).map(&mut place).collect() }
}

fn rays_for(reference: &Reference) -> Vec<Ray> {
    let (low, high) = reference.bounds();
    random_rays(83, 900, low.as_vec3(), high.as_vec3())
}

/// As the shaders count.
fn tag(ids: &HitIds) -> u32 {
    1 + ids.instance * 131 + ids.geometry * 37 + ids.primitive
}

fn ids(record: &HitRecord) -> HitIds {
    let HitRecord { instance, custom_index, geometry, primitive, .. } = *record;
    HitIds { instance, custom_index, geometry, primitive }
}

/// Rays of which every hit is certain, with their records and hits.
fn certain<'a>(
    reference: &Reference,
    rays: &[Ray],
    records: &'a [HitRecord],
    how: How,
) -> Vec<(&'a HitRecord, Vec<Hit>)> {
    let hits = rays.iter().zip(records).filter_map(|(ray, record)| {
        let hits = reference.all_hits(ray, how)?;
        Some((record, hits))
    });
    let all: Vec<_> = hits.collect();
    let several = all.iter().filter(|(_, hits)| hits.len() > 3).count();
    assert!(all.len() * 10 > rays.len() * 9 && several * 10 > rays.len(), "{} of {several}", all.len());
    all
}

#[test]
fn every_candidate_is_seen_once_where_that_is_asked() -> Result<()> {
    const ONCE: GeometryFlags = GeometryFlags::NO_DUPLICATE_ANY_HIT;
    for ctx in whole_and_split(50) {
        for scene in [scene([ONCE; 2]), RayScene::scattered(ONCE)] {
            for_each_method_of(&ctx, &scene, candidates_are_seen_once)?;
        }
    }
    Ok(())
}

/// A scene on a device, and a way to judge candidates of its rays.
struct Case<'a> {
    ctx: &'a Context,
    judge: Judge,
    gpu: &'a GpuScene,
    reference: &'a Reference,
    rays: &'a [Ray],
}

impl Case<'_> {
    fn count(&self, verdict: Verdict, how: How) -> Result<Vec<HitRecord>> {
        counter(self.ctx, self.judge, verdict)?.trace(&self.gpu.tlas, self.rays, how)
    }
}

/// Runs a test of whole and of split meshes, whose two geometries have these flags, in each way to judge.
fn for_each_case(flags: [GeometryFlags; 2], test: impl Fn(&Case<'_>) -> Result<()>) -> Result<()> {
    whole_and_split(50).iter().try_for_each(|ctx| for_each_method_of(ctx, &scene(flags), &test))
}

fn for_each_method_of(ctx: &Context, scene: &RayScene, test: impl Fn(&Case<'_>) -> Result<()>) -> Result<()> {
    let (gpu, reference) = (scene.upload(ctx)?, scene.reference());
    let rays = rays_for(&reference);
    let case = |judge| Case { ctx, judge, gpu: &gpu, reference: &reference, rays: &rays };
    Judge::available(ctx).into_iter().try_for_each(|judge| test(&case(judge)))
}

fn candidates_are_seen_once(case: &Case<'_>) -> Result<()> {
    let how = How::default();
    for (record, hits) in certain(case.reference, case.rays, &case.count(Verdict::Ignore, how)?, how) {
        let sum: u32 = hits.iter().map(|hit| tag(&hit.ids)).sum();
        let expected = [hits.len() as f32, sum as f32];
        assert_eq!(record.barycentrics, expected, "{:?}: {hits:?}", case.judge);
        assert_eq!(record.kind, MISSED, "all were ignored");
    }
    Ok(())
}

/// Without the flag a driver may show a candidate again, but leaves none out.
#[test]
fn every_candidate_is_seen_at_least_once() -> Result<()> {
    for_each_case([GeometryFlags::empty(); 2], |case| {
        let judge = case.judge;
        let how = How::default();
        let records = case.count(Verdict::Ignore, how)?;
        for (record, hits) in certain(case.reference, case.rays, &records, how) {
            let sum: u32 = hits.iter().map(|hit| tag(&hit.ids)).sum();
            let [seen, seen_sum] = record.barycentrics;
            assert!(seen >= hits.len() as f32 && seen_sum >= sum as f32, "{judge:?}: {seen} of {hits:?}");
            assert!(hits.is_empty() == (seen == 0.0));
        }
        Ok(())
    })
}

/// The closest hit does not depend on the order in which candidates were accepted.
#[test]
fn accepted_candidates_leave_the_closest() -> Result<()> {
    for_each_case([GeometryFlags::empty(), GeometryFlags::OPAQUE], |case| {
        let judge = case.judge;
        for flags in [0, OPAQUE] {
            let how = How { flags, ..How::default() };
            let records = case.count(Verdict::Accept, how)?;
            HitComparison::of_shapes(case.rays, &records, |ray| case.reference.closest_by(ray, how))
                .assert(&format!("all accepted by {judge:?}, flags {flags}"));
            for (record, hits) in certain(case.reference, case.rays, &records, how) {
                let least = hits.first().is_some_and(|hit| !hit.is_opaque);
                let most = hits.iter().filter(|hit| !hit.is_opaque).count();
                let seen = record.barycentrics[0] as usize;
                assert!(usize::from(least) <= seen && seen <= most, "{judge:?}: {seen} of {hits:?}");
            }
        }
        Ok(())
    })
}

/// The driver chooses the hit that ends the ray, but it is one of the hits, and no hit follows it.
#[test]
fn a_terminated_ray_keeps_one_of_its_hits() -> Result<()> {
    for_each_case([GeometryFlags::empty(); 2], |case| {
        let judge = case.judge;
        for (verdict, flags) in [(Verdict::Terminate, 0), (Verdict::Accept, TERMINATE_ON_FIRST_HIT)] {
            let how = How { flags, ..How::default() };
            let records = case.count(verdict, how)?;
            for (record, hits) in certain(case.reference, case.rays, &records, how) {
                let Some(first) = hits.first() else {
                    assert_eq!((record.kind, record.barycentrics), (MISSED, [0.0; 2]));
                    continue;
                };
                assert_eq!(record.barycentrics[0], 1.0, "{judge:?}: one candidate was judged");
                let hit = hits.iter().find(|hit| hit.ids == ids(record));
                let hit = hit.unwrap_or_else(|| unreachable!("{judge:?}: {record:?} is none of {hits:?}"));
                let error = (f64::from(record.t) - hit.t).abs();
                assert!(error <= 1e-5 * hit.t.max(1.0) && hit.t >= first.t, "{record:?}, {hit:?}");
                assert_eq!(record.barycentrics[1], tag(&hit.ids) as f32);
            }
        }
        Ok(())
    })
}

/// Ignored candidates in front of opaque ones: those are hit as if nothing stood before them.
#[test]
fn ignored_hits_hide_nothing() -> Result<()> {
    for_each_case([GeometryFlags::empty(), GeometryFlags::OPAQUE], |case| {
        let judge = case.judge;
        let how = How::default();
        let records = case.count(Verdict::Ignore, how)?;
        HitComparison::of_shapes(case.rays, &records, |ray| {
            case.reference.closest_by_where(ray, how, |hit| hit.is_opaque)
        })
        .assert(&format!("behind the ignored by {judge:?}"));
        for (record, hits) in certain(case.reference, case.rays, &records, how) {
            let before = hits.iter().take_while(|hit| !hit.is_opaque).count();
            assert!(record.barycentrics[0] >= before as f32, "{judge:?}: {record:?} of {hits:?}");
        }
        Ok(())
    })
}
