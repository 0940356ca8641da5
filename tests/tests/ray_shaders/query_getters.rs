//! Values that ray queries report of their ray, of the closest hit and of candidates, against matrices and hits
//! computed in f64.

use bytemuck::{NoUninit, Pod, Zeroable};
use lvk::glam::{Affine3A, DAffine3, DVec3, Quat, Vec3};
use lvk::{
    BufferDesc, ComputePipelineDesc, ComputePipelineHandle, Context, Dependencies, DeviceProfile,
    GeometryFlags, Holder, InstanceFlags, RayQueryRequest, Result, ShaderStage,
};
use lvk_tests::hit_comparison::HitComparison;
use lvk_tests::meshes::Mesh;
use lvk_tests::ray_scene::{GpuScene, Layout, Part, Placed, RayScene};
use lvk_tests::ray_tracer::{
    BACK, CULL_BACK, CULL_FRONT, HitRecord, How, MISSED, NO_OPAQUE, OPAQUE, shader_with,
};
use lvk_tests::rays::{Ray, random_rays};
use lvk_tests::reference::{HitIds, Reference};
use lvk_tests::{TestDevice, device, device_with};

/// Ray flag: without a meaning to queries, which tell it nevertheless.
const SKIP_CLOSEST_HIT_SHADER: u32 = 8;
/// `LVK_CANDIDATE_TRIANGLE` of `ray_query.glsl`.
const CANDIDATE_TRIANGLE: u32 = 0;
/// `LVK_COMMITTED_TRIANGLE` of `ray_query.glsl`.
const COMMITTED_TRIANGLE: u32 = 1;
const RAYS: usize = 600;
/// Relative to the terms that are added up.
const ROUNDING: f64 = 1e-5;

/// Values of a hit, as `getters_query.comp.glsl` writes them.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
struct QueryResult {
    hit: HitRecord,
    kind: u32,
    sbt_offset: u32,
    object_origin: [f32; 3],
    object_direction: [f32; 3],
    object_to_world: [f32; 12],
    world_to_object: [f32; 12],
}

/// Values of a query, as it writes them.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
struct Told {
    flags: u32,
    t_min: f32,
    origin: [f32; 3],
    direction: [f32; 3],
    committed: QueryResult,
    candidate: QueryResult,
}

/// The push constants of `ray_records.glsl`.
#[repr(C)]
#[derive(Clone, Copy, NoUninit)]
struct Push {
    rays: u64,
    told: u64,
    tlas: u32,
    count: u32,
    mask: u32,
    flags: u32,
}

/// The device as it is, one that cuts meshes, and queries in software.
fn devices() -> Vec<TestDevice> {
    let profile = DeviceProfile { max_blas_primitives: 40, ..DeviceProfile::default() };
    let cut = device_with(|desc| desc.profile = Some(&profile));
    let software = device_with(|desc| desc.ray_query = RayQueryRequest::Software);
    let mut devices: Vec<_> = [device(), cut, software].into_iter().flatten().collect();
    devices.retain(|ctx| {
        let can = ctx.capabilities().ray_query;
        if !can {
            eprintln!("NOT TESTED, {} has no ray queries", ctx.capabilities().device_name);
        }
        can
    });
    devices
}

/// Models of two geometries, one opaque and one not, some moved in their model.
fn scene() -> RayScene {
    let moved = Affine3A::from_scale_rotation_translation(
        Vec3::new(0.9, -0.7, 1.1),
        Quat::from_rotation_x(0.8),
        Vec3::new(0.3, -0.2, 0.4),
    );
    let glass = |mesh, layout| Part { flags: GeometryFlags::empty(), ..Part::new(mesh, layout) };
    let models = vec![
        vec![
            Part::new(Mesh::torus(6), Layout::Indexed16),
            Part { transform: Some(moved), ..glass(Mesh::cube_grid(2), Layout::Unshared) },
        ],
        vec![glass(Mesh::sphere(6), Layout::Interleaved), Part::new(Mesh::terrain(5), Layout::Indexed32)],
    ];
    RayScene { models, placed: (0..12).map(instance_at).collect() }
}

/// Sheared, since it is stretched between two turns; mirrored on no, one, two and three axes.
fn instance_at(index: u32) -> Placed {
    let number = index as f32;
    let sign = |axis: u32| if (index / 2) >> axis & 1 == 0 { 1.0 } else { -1.0 };
    let scale = Vec3::new(0.6 * sign(0), 1.3 * sign(1), (0.8 + 0.05 * number) * sign(2));
    let turn = Quat::from_axis_angle(Vec3::new(0.6, 0.0, 0.8), 0.3 + 0.7 * number);
    let grid = Vec3::new((index % 3) as f32, (index / 3 % 2) as f32, (index / 6) as f32);
    let transform = Affine3A::from_translation(grid * 1.7 - 2.5)
        * Affine3A::from_quat(turn)
        * Affine3A::from_scale(scale)
        * Affine3A::from_rotation_z(1.1 * number);
    Placed {
        custom_index: 0x00ff_ff00 - 37 * index,
        hit_group_offset: 5 + 3 * index,
        flags: if index % 4 == 3 { InstanceFlags::FLIP_FACING } else { InstanceFlags::empty() },
        ..Placed::new(index as usize % 2, transform)
    }
}

fn pipeline(ctx: &Context, defines: &[(&str, &str)]) -> Result<Holder<ComputePipelineHandle>> {
    let text = include_str!("../../shaders/getters_query.comp.glsl");
    let module = shader_with(ctx, ShaderStage::Compute, text, defines)?;
    ctx.create_compute_pipeline(&ComputePipelineDesc { module: Some(*module), ..Default::default() })
}

fn ask(
    ctx: &Context,
    pipeline: &Holder<ComputePipelineHandle>,
    gpu: &GpuScene,
    rays: &[Ray],
    flags: u32,
) -> Result<Vec<Told>> {
    let mut told = vec![Told::zeroed(); rays.len()];
    let buffer = |data| ctx.create_buffer(&BufferDesc { data: Some(data), ..Default::default() });
    let (ray_buffer, told_buffer) =
        (buffer(bytemuck::cast_slice(rays))?, buffer(bytemuck::cast_slice(&told))?);
    let push = Push {
        rays: ctx.buffer_address(*ray_buffer)?,
        told: ctx.buffer_address(*told_buffer)?,
        tlas: gpu.tlas.index(),
        count: rays.len() as u32,
        mask: 0xff,
        flags,
    };
    let mut cmd = ctx.acquire_command_buffer()?;
    cmd.bind_compute_pipeline(**pipeline)?;
    cmd.push_constants(&push)?;
    let writes = Dependencies { buffers: &[*told_buffer], ..Default::default() };
    cmd.dispatch([push.count.div_ceil(64), 1, 1], &writes)?;
    ctx.submit(cmd)?;
    ctx.download_buffer(*told_buffer, 0, bytemuck::cast_slice_mut(&mut told))?;
    Ok(told)
}

/// Compares with numbers that may differ by so much each, and names what differs.
fn check(name: &str, found: &[f32], expected: &[f64], tolerance: f64) {
    let is_close = |(found, expected): (&f32, &f64)| (f64::from(*found) - expected).abs() <= tolerance;
    let same = found.len() == expected.len() && found.iter().zip(expected).all(is_close);
    assert!(same, "{name} is {found:?}, must be {expected:?} within {tolerance}");
}

/// Checks the values that the instance alone decides: its numbers and matrices, and the ray in its object space.
fn check_instance(scene: &RayScene, ray: &Ray, found: &QueryResult, what: &str) {
    let placed = &scene.placed[found.hit.instance as usize];
    let object_to_world = DAffine3::from_cols_array(&placed.transform.to_cols_array().map(f64::from));
    let world_to_object = object_to_world.inverse();
    let matrices = [
        ("ObjectToWorld", found.object_to_world, object_to_world),
        ("WorldToObject", found.world_to_object, world_to_object),
    ];
    for (name, found, expected) in matrices {
        let expected = expected.to_cols_array();
        check(&format!("{what}: {name}"), &found, &expected, ROUNDING * largest(&expected));
    }
    let (origin, direction) = (DVec3::from(ray.origin.map(f64::from)), ray.direction.map(f64::from).into());
    let tolerance = ROUNDING * largest(&world_to_object.to_cols_array()) * (1.0 + origin.length());
    let origin = world_to_object.transform_point3(origin).to_array();
    check(&format!("{what}: ObjectRayOrigin"), &found.object_origin, &origin, tolerance);
    let direction = world_to_object.transform_vector3(direction).to_array();
    check(&format!("{what}: ObjectRayDirection"), &found.object_direction, &direction, tolerance);
    assert_eq!(found.sbt_offset, placed.hit_group_offset, "{what}");
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(1.0, |most, value| most.max(value.abs()))
}

/// Checks the values of the ray, which no traversal may change.
fn check_ray(ray: &Ray, flags: u32, told: &Told, what: &str) {
    assert_eq!(told.flags, flags, "{what}: Flags");
    let found = (told.t_min, told.origin, told.direction);
    assert_eq!(
        found,
        (ray.t_min, ray.origin, ray.direction),
        "{what}: TMin, WorldRayOrigin, WorldRayDirection"
    );
}

/// The closest hit that counts, and a candidate among those that the ray meets.
fn check_hits(reference: &Reference, rays: &[Ray], all_told: &[Told], flags: u32, what: &str) -> usize {
    let how = How { flags, ..How::default() };
    let committed: Vec<_> = all_told.iter().map(|told| told.committed.hit).collect();
    let counts = |ids: &HitIds| ids.primitive.is_multiple_of(2);
    HitComparison::of_triangles(rays, &committed, |ray| {
        reference.closest_by_where(ray, how, |hit| hit.is_opaque || counts(&hit.ids))
    })
    .assert(&format!("{what}, committed"));
    let mut candidates = HitComparison::default();
    for (ray, told) in rays.iter().zip(all_told).filter(|(_, told)| told.candidate.hit.kind != MISSED) {
        let HitRecord { instance, custom_index, geometry, primitive, .. } = told.candidate.hit;
        let ids = HitIds { instance, custom_index, geometry, primitive };
        let is_met = |ray: &Ray| reference.closest_by_where(ray, how, |hit| !hit.is_opaque && hit.ids == ids);
        let one = std::slice::from_ref(ray);
        candidates.add(HitComparison::of_triangles(one, &[told.candidate.hit], is_met));
    }
    let count = candidates.rays;
    if count > 0 {
        candidates.assert(&format!("{what}, candidates"));
    }
    count
}

#[test]
fn queries_report_the_ray_the_hit_and_the_instance() -> Result<()> {
    let scene = scene();
    let reference = scene.reference();
    let (low, high) = reference.bounds();
    let rays = random_rays(41, RAYS, low.as_vec3(), high.as_vec3());
    for ctx in devices() {
        let gpu = scene.upload(&ctx)?;
        let any = pipeline(&ctx, &[])?;
        let opaque = pipeline(&ctx, &[("OPAQUE_ONLY", "")])?;
        let cases = [
            (&any, 0, 0),
            (&any, NO_OPAQUE | CULL_FRONT, 0),
            (&any, CULL_BACK | SKIP_CLOSEST_HIT_SHADER, 0),
            (&opaque, 0, OPAQUE),
        ];
        for (pipeline, asked, always) in cases {
            let flags = asked | always;
            let what = format!("{:?}, flags {flags:#x}", ctx.capabilities().ray_query_path);
            let all_told = ask(&ctx, pipeline, &gpu, &rays, asked)?;
            let candidates = check_hits(&reference, &rays, &all_told, flags, &what);
            assert_eq!(candidates > RAYS / 20, always == 0, "{what}: {candidates} candidates");
            for (index, (ray, told)) in rays.iter().zip(&all_told).enumerate() {
                check_ray(ray, flags, told, &format!("{what}, ray {index}"));
                for (which, found, kind) in [
                    ("committed", &told.committed, COMMITTED_TRIANGLE),
                    ("candidate", &told.candidate, CANDIDATE_TRIANGLE),
                ] {
                    if found.hit.kind != MISSED {
                        let what = format!("{what}, ray {index}, {which}");
                        assert_eq!(found.kind, kind, "{what}: Type");
                        check_instance(&scene, ray, found, &what);
                    }
                }
            }
        }
    }
    Ok(())
}

/// Undefined values are defined in the library's own traversal: it reads no memory out of bounds.
#[test]
fn misses_are_reported_as_zeros_in_software() -> Result<()> {
    let Some(ctx) = device_with(|desc| desc.ray_query = RayQueryRequest::Software) else { return Ok(()) };
    let gpu = scene().upload(&ctx)?;
    let empty = RayScene { placed: Vec::new(), ..scene() }.upload(&ctx)?;
    let away = Ray { t_max: 77.0, ..Ray::new(Vec3::splat(50.0), Vec3::X) };
    let backwards = Ray { t_min: 9.0, t_max: 2.0, ..Ray::new(Vec3::ZERO, Vec3::Y) };
    let rays = [away, backwards];
    for defines in [&[("OF_MISSES", "")][..], &[("OF_MISSES", ""), ("OPAQUE_ONLY", "")]] {
        let pipeline = pipeline(&ctx, defines)?;
        for gpu in [&gpu, &empty] {
            for (ray, told) in rays.iter().zip(ask(&ctx, &pipeline, gpu, &rays, 0)?) {
                for found in [told.committed, told.candidate] {
                    let hit = HitRecord { t: ray.t_max, kind: BACK, ..Zeroable::zeroed() };
                    let expected = QueryResult { hit, ..Zeroable::zeroed() };
                    assert_eq!(bytemuck::bytes_of(&found), bytemuck::bytes_of(&expected), "{found:?}");
                }
            }
        }
    }
    Ok(())
}
