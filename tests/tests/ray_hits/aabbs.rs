//! AABBs: intersection shaders with several reports and kinds, any-hit shaders, flags, inactive AABBs, and AABBs
//! beside triangles.

use lvk::glam::{Affine3A, Quat, Vec3};
use lvk::{
    Aabbs, AccelStructHandle, BlasDesc, BlasGeometry, BufferDesc, BufferUsage, Context, DeviceProfile, Error,
    GeometryFlags, HitGroup, Holder, InstanceFlags, RayTracingPipelineDesc, Result, ShaderStage, TlasDesc,
};
use lvk_tests::device::loses_neighbours_of_inactive;
use lvk_tests::hit_check::HitCheck;
use lvk_tests::hit_comparison::HitComparison;
use lvk_tests::meshes::Mesh;
use lvk_tests::ray_scene::{Layout, Placed, RayScene, instances};
use lvk_tests::ray_tracer::{
    BACK, CULL_BACK, CULL_FRONT, CULL_NO_OPAQUE, CULL_OPAQUE, FRONT, HitRecord, How, MISSED, Method,
    NO_OPAQUE, OPAQUE, RayTracer, SKIP_AABBS, SKIP_TRIANGLES, shader, shader_with,
};
use lvk_tests::rays::{Ray, random_rays};
use lvk_tests::reference::{Answer, HitIds, Sphere};
use lvk_tests::{TestDevice, device, device_with};

/// Kind that the shaders report for the far side of a sphere.
const FAR: u32 = 2;
/// Kinds of the near side: before a far side that was not accepted, and before one that was.
const NEAR: [u32; 2] = [126, 127];
/// AABBs of a geometry.
const COUNT: u32 = 24;
/// Radius of every sphere, in object space.
const RADIUS: f32 = 0.9;

fn devices() -> Vec<TestDevice> {
    let profile = DeviceProfile { max_blas_primitives: 20, ..DeviceProfile::default() };
    device().into_iter().chain(device_with(|desc| desc.profile = Some(&profile))).collect()
}

/// Hits both sides of spheres, and triangles. `culling` declares that primitives may be skipped by kind.
fn tracer(ctx: &Context, method: Method, culling: bool) -> Result<RayTracer> {
    let radius = format!("{:?}", RADIUS);
    let mut defines = vec![("RADIUS", radius.as_str())];
    if culling {
        defines.push(("PRIMITIVE_CULLING", ""));
    }
    if method == Method::Query {
        let text = include_str!("../../shaders/shell_query.comp.glsl");
        return RayTracer::from_query_text(ctx, text, &defines);
    }
    let text = include_str!("../../shaders/closest.rgen.glsl");
    let ray_gen = shader_with(ctx, ShaderStage::RayGen, text, &defines)?;
    let miss = shader(ctx, ShaderStage::Miss, include_str!("../../shaders/record.rmiss.glsl"))?;
    let hit = shader(ctx, ShaderStage::ClosestHit, include_str!("../../shaders/shell.rchit.glsl"))?;
    let any_hit = shader(ctx, ShaderStage::AnyHit, include_str!("../../shaders/shell.rahit.glsl"))?;
    let text = include_str!("../../shaders/shell.rint.glsl");
    let shell = shader_with(ctx, ShaderStage::Intersection, text, &defines)?;
    let of_triangles = shader(ctx, ShaderStage::ClosestHit, include_str!("../../shaders/record.rchit.glsl"))?;
    let boxes = HitGroup {
        closest_hit: Some(*hit),
        any_hit: Some(*any_hit),
        intersection: Some(*shell),
        ..Default::default()
    };
    let triangles = HitGroup { closest_hit: Some(*of_triangles), ..Default::default() };
    RayTracer::from_groups(ctx, *ray_gen, *miss, &[boxes, triangles])
}

/// Returns the centre of a sphere in object space, as the shaders compute it.
fn center(geometry: u32, primitive: u32) -> Vec3 {
    Vec3::new((primitive % 3) as f32, (primitive / 3) as f32, geometry as f32) * 2.0
}

/// The AABB of a sphere.
fn around(geometry: u32, primitive: u32) -> [Vec3; 2] {
    let center = center(geometry, primitive);
    [center - 1.0, center + 1.0]
}

fn tlas_of_aabbs(
    ctx: &Context,
    lists: &[Vec<[Vec3; 2]>],
    flags: GeometryFlags,
) -> Result<Holder<AccelStructHandle>> {
    let mut buffers = Vec::new();
    let mut geometries = Vec::new();
    for list in lists {
        let floats: Vec<f32> = list.iter().flatten().flat_map(Vec3::to_array).collect();
        let count = list.len() as u32;
        let data = if floats.is_empty() { &[0; 24] } else { bytemuck::cast_slice(&floats) };
        let usage = BufferUsage::ACCEL_INPUT;
        let buffer = ctx.create_buffer(&BufferDesc { data: Some(data), usage, ..Default::default() })?;
        geometries.push(BlasGeometry::Aabbs(Aabbs { buffer: *buffer, offset: 0, stride: 0, count, flags }));
        buffers.push(buffer);
    }
    ctx.create_blas(&BlasDesc { geometries: &geometries, ..Default::default() })
}

fn all_aabbs() -> Vec<Vec<[Vec3; 2]>> {
    (0..2).map(|geometry| (0..COUNT).map(|primitive| around(geometry, primitive)).collect()).collect()
}

/// Three instances of the AABBs.
fn placed() -> Vec<Placed> {
    let place = |index: u32| {
        let turn = Quat::from_rotation_y(0.5 + index as f32);
        let to = Vec3::new(index as f32 * 9.0, 1.0, -2.0);
        let scale = Vec3::splat(0.8 + 0.3 * index as f32);
        let transform = Affine3A::from_scale_rotation_translation(scale, turn, to);
        Placed { custom_index: 70 + index, ..Placed::new(0, transform) }
    };
    (0..3).map(place).collect()
}

/// Returns the spheres of two full lists of AABBs.
fn spheres(placed: &[Placed]) -> Vec<Sphere> {
    let mut spheres = Vec::new();
    for (instance, placed) in (0..).zip(placed) {
        let radius = f64::from(RADIUS * placed.transform.matrix3.x_axis.length());
        for (geometry, primitive) in (0..2 * COUNT).map(|index| (index / COUNT, index % COUNT)) {
            let center = placed.transform.transform_point3(center(geometry, primitive)).as_dvec3();
            let ids = HitIds { instance, custom_index: placed.custom_index, geometry, primitive };
            spheres.push(Sphere { center, radius, ids });
        }
    }
    spheres
}

fn rays() -> Vec<Ray> {
    random_rays(91, 1_500, Vec3::new(-4.0, -1.0, -10.0), Vec3::new(26.0, 22.0, 8.0))
}

/// Compares ids, distances and kinds, and attributes where the near sides count.
fn agree(what: &str, rays: &[Ray], records: &[HitRecord], answer: impl Fn(&Ray) -> Answer) {
    HitComparison::of_shapes(rays, records, &answer).assert(what);
    for (ray, record) in rays.iter().zip(records) {
        let answer = answer(ray);
        let (Some(hit), true) = (answer.hit, answer.is_certain) else { continue };
        let kinds = if hit.is_front { NEAR } else { [FAR; 2] };
        assert!(kinds.contains(&record.kind), "{what}: {record:?}");
        let ids = [record.primitive as f32, record.instance as f32];
        assert!(!hit.is_front || record.barycentrics == ids, "{what}: {record:?}");
    }
}

/// The far side is reported before the near side, and something that is out of range before both.
#[test]
fn the_closest_of_several_reports_is_the_hit() -> Result<()> {
    for ctx in devices() {
        let model = [tlas_of_aabbs(&ctx, &all_aabbs(), GeometryFlags::OPAQUE)?];
        let placed = placed();
        let desc = TlasDesc { instances: &instances(&placed, &model), ..Default::default() };
        let tlas = ctx.create_tlas(&TlasDesc { parts_per_instance: 8, ..desc })?;
        let (rays, spheres) = (rays(), spheres(&placed));
        for method in Method::available(&ctx) {
            let records = tracer(&ctx, method, false)?.trace(&tlas, &rays, How::default())?;
            let what = format!("shells by {method:?}");
            agree(&what, &rays, &records, |ray| Sphere::closest(&spheres, ray));
        }
    }
    Ok(())
}

/// The any-hit shader of AABBs that are not opaque ignores the near sides.
#[test]
fn flags_of_ray_instance_and_geometry_reach_aabbs() -> Result<()> {
    let (none, solid, open) =
        (InstanceFlags::NO_CULL, InstanceFlags::FORCE_OPAQUE, InstanceFlags::FORCE_NO_OPAQUE);
    for ctx in devices() {
        let check = HitCheck::with_tracers(&ctx, |ctx, method| tracer(ctx, method, false))?;
        for (geometry, instance, ray, opaque) in [
            (GeometryFlags::empty(), none, 0, false),
            (GeometryFlags::NO_DUPLICATE_ANY_HIT, none, CULL_BACK, false),
            (GeometryFlags::OPAQUE, none, CULL_FRONT, true),
            (GeometryFlags::OPAQUE, open, 0, false),
            (GeometryFlags::empty(), solid, 0, true),
            (GeometryFlags::empty(), open, OPAQUE, true),
            (GeometryFlags::OPAQUE, solid, NO_OPAQUE, false),
        ] {
            let model = [tlas_of_aabbs(&ctx, &all_aabbs(), geometry)?];
            let placed: Vec<_> =
                placed().into_iter().map(|placed| Placed { flags: instance, ..placed }).collect();
            let instances = instances(&placed, &model);
            let tlas = ctx.create_tlas(&TlasDesc { instances: &instances, ..Default::default() })?;
            let (rays, spheres) = (rays(), spheres(&placed));
            for (method, tracer) in check.tracers() {
                let records = tracer.trace(&tlas, &rays, How { flags: ray, ..How::default() })?;
                let what = format!("{geometry:?}, {instance:?}, ray flags {ray:#x} by {method:?}");
                agree(&what, &rays, &records, |ray| match opaque {
                    true => Sphere::closest(&spheres, ray),
                    false => Sphere::closest_exit(&spheres, ray),
                });
                if ray & (OPAQUE | NO_OPAQUE) == 0 {
                    let culled = if opaque { CULL_OPAQUE } else { CULL_NO_OPAQUE };
                    let records = tracer.trace(&tlas, &rays, How { flags: culled, ..How::default() })?;
                    assert!(records.iter().all(|record| record.kind == MISSED), "{what}, culled");
                }
            }
        }
    }
    Ok(())
}

/// Traces what is left of AABBs, the lists of which `change` has changed.
fn check_lists(ctx: &Context, lists: &[Vec<[Vec3; 2]>], is_there: impl Fn(&HitIds) -> bool) -> Result<()> {
    let model = [tlas_of_aabbs(ctx, lists, GeometryFlags::OPAQUE)?];
    let placed = placed();
    let instances = instances(&placed, &model);
    let tlas = ctx.create_tlas(&TlasDesc { instances: &instances, ..Default::default() })?;
    let mut spheres = spheres(&placed);
    spheres.retain(|sphere| is_there(&sphere.ids));
    let rays = rays();
    for method in Method::available(ctx) {
        let records = tracer(ctx, method, false)?.trace(&tlas, &rays, How::default())?;
        let what = format!("boxes left by {method:?}");
        agree(&what, &rays, &records, |ray| Sphere::closest(&spheres, ray));
    }
    Ok(())
}

#[test]
fn an_empty_list_of_aabbs_keeps_its_number() -> Result<()> {
    for ctx in devices() {
        let [first, second] = [0, 1].map(|geometry| all_aabbs().swap_remove(geometry));
        check_lists(&ctx, &[Vec::new(), second, Vec::new()], |ids| ids.geometry == 1)?;
        check_lists(&ctx, &[first, Vec::new()], |ids| ids.geometry == 0)?;
    }
    Ok(())
}

/// An AABB with a NaN for its smallest x coordinate is none.
#[test]
fn inactive_aabbs_disturb_no_other_aabbs() -> Result<()> {
    for ctx in devices() {
        if loses_neighbours_of_inactive(&ctx) {
            continue;
        }
        let mut lists = all_aabbs();
        for corners in lists.iter_mut().flatten().skip(1).step_by(3) {
            corners[0].x = f32::NAN;
        }
        check_lists(&ctx, &lists, |ids| (ids.geometry * COUNT + ids.primitive) % 3 != 1)?;
    }
    Ok(())
}

/// An AABB without thickness is crossed by rays through it, as a triangle is.
#[test]
fn a_flat_aabb_can_be_hit() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let mut corners = around(0, 0);
    corners.iter_mut().for_each(|corner| corner.z = 0.0);
    let model = [tlas_of_aabbs(&ctx, &[vec![corners]], GeometryFlags::OPAQUE)?];
    let placed = [Placed::new(0, Affine3A::IDENTITY)];
    let tlas = ctx.create_tlas(&TlasDesc { instances: &instances(&placed, &model), ..Default::default() })?;
    let sphere =
        [Sphere { center: Vec3::ZERO.as_dvec3(), radius: f64::from(RADIUS), ids: HitIds::default() }];
    let rays: Vec<_> = random_rays(93, 100, Vec3::new(-0.5, -0.5, -6.0), Vec3::new(0.5, 0.5, -3.0))
        .into_iter()
        .map(|ray| Ray { direction: [0.0, 0.0, 1.0], t_min: 0.0, t_max: 1e4, ..ray })
        .filter(|ray| ray.origin[2] < -1.0 && ray.origin[0].abs() < 0.7 && ray.origin[1].abs() < 0.5)
        .collect();
    assert!(rays.len() > 10);
    for method in Method::available(&ctx) {
        let records = tracer(&ctx, method, false)?.trace(&tlas, &rays, How::default())?;
        agree("flat", &rays, &records, |ray| Sphere::closest(&sphere, ray));
    }
    Ok(())
}

/// Reports of an intersection shader at the very ends of a ray count, unlike hits of triangles. The shader of a query
/// decides for itself.
#[test]
fn a_report_at_an_end_of_the_ray_is_accepted() -> Result<()> {
    const REPORT: &str = r"
        hitAttributeEXT vec2 ids;
        void main() { ids = vec2(0); reportIntersectionEXT(4.0, 5u); }";
    let Some(ctx) = device() else { return Ok(()) };
    if !ctx.capabilities().ray_tracing_pipeline {
        eprintln!("NOT TESTED, {} has no ray tracing pipelines", ctx.capabilities().device_name);
        return Ok(());
    }
    let ray_gen = shader(&ctx, ShaderStage::RayGen, include_str!("../../shaders/closest.rgen.glsl"))?;
    let miss = shader(&ctx, ShaderStage::Miss, include_str!("../../shaders/record.rmiss.glsl"))?;
    let hit = shader(&ctx, ShaderStage::ClosestHit, include_str!("../../shaders/shell.rchit.glsl"))?;
    let report = shader(&ctx, ShaderStage::Intersection, REPORT)?;
    let pipeline = ctx.create_ray_tracing_pipeline(&RayTracingPipelineDesc {
        ray_gen: &[*ray_gen],
        miss: &[*miss],
        hit_groups: &[HitGroup {
            closest_hit: Some(*hit),
            intersection: Some(*report),
            ..Default::default()
        }],
        ..Default::default()
    })?;
    let wide = [Vec3::new(-1.0, -1.0, 0.0), Vec3::new(1.0, 1.0, 20.0)];
    let model = [tlas_of_aabbs(&ctx, &[vec![wide]], GeometryFlags::OPAQUE)?];
    let placed = [Placed::new(0, Affine3A::IDENTITY)];
    let tlas = ctx.create_tlas(&TlasDesc { instances: &instances(&placed, &model), ..Default::default() })?;
    let (before, after) = (4.0_f32.next_down(), 4.0_f32.next_up());
    let cases = [
        (4.0, 10.0, true),
        (0.0, 4.0, true),
        (4.0, 4.0, true),
        (after, 10.0, false),
        (0.0, before, false),
        (before, after, true),
    ];
    let ray = |(t_min, t_max, _)| Ray { t_min, t_max, ..Ray::new(Vec3::new(0.25, 0.5, -1.0), Vec3::Z) };
    let records = RayTracer::from_pipeline(&ctx, pipeline).trace(&tlas, &cases.map(ray), How::default())?;
    let found: Vec<_> = records.iter().map(|record| record.kind).collect();
    assert_eq!(found, cases.map(|(_, _, accepted)| if accepted { 5 } else { MISSED }));
    Ok(())
}

/// A sphere in an AABB within a mesh of a sphere, by turns without the one and the other.
#[test]
fn a_ray_skips_triangles_or_aabbs() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let balls = RayScene::single(Mesh::sphere(8), Layout::Indexed16);
    let gpu = balls.upload(&ctx)?;
    let corners = around(0, 0);
    let beside = Affine3A::from_translation(Vec3::X * 1.2);
    let of_triangles = Placed { hit_group_offset: 1, ..Placed::new(0, beside) };
    let of_boxes = Placed::new(1, Affine3A::IDENTITY);
    let model = [tlas_of_aabbs(&ctx, &[vec![corners]], GeometryFlags::OPAQUE)?];
    let mut list = instances(&[of_triangles], &gpu.models);
    list.extend(instances(&[Placed { model: 0, ..of_boxes }], &model));
    let tlas = ctx.create_tlas(&TlasDesc { instances: &list, ..Default::default() })?;
    let reference = RayScene { placed: vec![of_triangles], ..balls }.reference();
    let sphere = [Sphere {
        center: Vec3::ZERO.as_dvec3(),
        radius: f64::from(RADIUS),
        ids: HitIds { instance: 1, ..HitIds::default() },
    }];
    let rays = random_rays(95, 600, Vec3::new(-1.0, -1.0, -1.0), Vec3::new(2.2, 1.0, 1.0));
    let triangle = |ray: &Ray| reference.closest(ray, 0xff);
    let shell = |ray: &Ray| Sphere::closest(&sphere, ray);
    for method in Method::available(&ctx) {
        let tracer = match tracer(&ctx, method, true) {
            Err(Error::Unsupported { .. }) => {
                eprintln!("NOT TESTED, {} skips nothing by kind", ctx.capabilities().device_name);
                continue;
            }
            made => made?,
        };
        let trace = |flags| tracer.trace(&tlas, &rays, How { flags, ..How::default() });
        HitComparison::of_shapes(&rays, &trace(SKIP_AABBS)?, triangle).assert("triangles alone");
        agree("boxes alone", &rays, &trace(SKIP_TRIANGLES)?, shell);
        let records = trace(0)?;
        HitComparison::of_shapes(&rays, &records, |ray| nearer(triangle(ray), shell(ray))).assert("both");
        let kinds = [FRONT, BACK, NEAR[1], FAR];
        assert!(kinds.iter().all(|kind| records.iter().any(|record| record.kind == *kind)));
    }
    Ok(())
}

fn nearer(one: Answer, other: Answer) -> Answer {
    let is_certain = one.is_certain && other.is_certain;
    let hit = [one.hit, other.hit].into_iter().flatten().min_by(|a, b| a.t.total_cmp(&b.t));
    Answer { hit, is_certain }
}
