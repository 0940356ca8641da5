//! Shader selection: hit groups, miss shaders, callables, intersection shaders, ray generation shaders, and the bytes
//! of their shader records.

use lvk::glam::{Affine3A, Quat, Vec3};
use lvk::{
    BlasDesc, Context, HitGroup, Holder, RayTracingPipelineDesc, Result, ShaderModuleHandle, ShaderRecord,
    ShaderStage, TlasDesc,
};
use lvk_tests::hit_comparison::HitComparison;
use lvk_tests::meshes::Mesh;
use lvk_tests::ray_scene::{GpuScene, Layout, Part, Placed, RayScene, instances};
use lvk_tests::ray_tracer::{How, Method, RayTracer, shader, shader_with};
use lvk_tests::rays::{Ray, random_rays};
use lvk_tests::reference::{Reference, Sphere};
use lvk_tests::sphere_scene::{GROUPS, SphereModel};
use lvk_tests::{TestDevice, device};

const RAY_GEN: &str = include_str!("../../shaders/closest.rgen.glsl");
const MISS: &str = include_str!("../../shaders/record.rmiss.glsl");
const HIT: &str = include_str!("../../shaders/record.rchit.glsl");

/// The tag is read from the group's record, 1000 is added by the second of the two shaders.
const TAGGED_HIT: &str = r#"
    #include "ray_records.glsl"
    layout(shaderRecordEXT, scalar) buffer Record { uint tag; };
    layout(location = 0) rayPayloadInEXT HitRecord record;
    void main() {
        record = HitRecord(gl_HitTEXT, vec2(0), tag + ADD, lvkInstanceId(tlas), gl_InstanceCustomIndexEXT,
                           gl_GeometryIndexEXT, lvkPrimitiveIndex(tlas));
    }"#;

/// A context with ray tracing pipelines, or a word about why there is none.
fn pipeline_device() -> Option<TestDevice> {
    device().filter(|ctx| Method::available(ctx).contains(&Method::Pipeline))
}

/// Three instances side by side, of two geometries each, with hit-group offsets 4, 0 and 2.
fn scene() -> RayScene {
    let parts = vec![
        Part::new(Mesh::sphere(8), Layout::Indexed16),
        Part {
            transform: Some(Affine3A::from_translation(Vec3::Y * 1.8)),
            ..Part::new(Mesh::torus(8), Layout::Indexed16)
        },
    ];
    let place = |(index, hit_group_offset): (usize, u32)| {
        let transform = Affine3A::from_translation(Vec3::X * index as f32 * 2.3);
        Placed { hit_group_offset, custom_index: 5 + index as u32, ..Placed::new(0, transform) }
    };
    RayScene { models: vec![parts], placed: [4, 0, 2].into_iter().enumerate().map(place).collect() }
}

fn rays_for(reference: &Reference) -> Vec<Ray> {
    let (low, high) = reference.bounds();
    random_rays(41, 1_000, low.as_vec3(), high.as_vec3())
}

/// A scene on the GPU, its reference, and rays to trace.
struct Traced {
    scene: RayScene,
    gpu: GpuScene,
    reference: Reference,
    rays: Vec<Ray>,
}

impl Traced {
    fn new(ctx: &Context, scene: RayScene) -> Result<Self> {
        let (gpu, reference) = (scene.upload(ctx)?, scene.reference());
        let rays = rays_for(&reference);
        Ok(Self { scene, gpu, reference, rays })
    }
}

/// Returns a tracer with one hit shader for all geometries and instances of the [`scene`].
fn tracer_with(
    ctx: &Context,
    ray_gen: &[Holder<ShaderModuleHandle>],
    miss: &[Holder<ShaderModuleHandle>],
    hit: &Holder<ShaderModuleHandle>,
    callable: &[Holder<ShaderModuleHandle>],
) -> Result<RayTracer> {
    let [ray_gen, miss, callable] =
        [ray_gen, miss, callable].map(|all| all.iter().map(|module| **module).collect::<Vec<_>>());
    let pipeline = ctx.create_ray_tracing_pipeline(&RayTracingPipelineDesc {
        ray_gen: &ray_gen,
        miss: &miss,
        hit_groups: &[HitGroup { closest_hit: Some(**hit), ..Default::default() }; 5],
        callable: &callable,
        ..Default::default()
    })?;
    Ok(RayTracer::from_pipeline(ctx, pipeline))
}

/// Compiles a shader once for each value of a definition.
fn shader_for_each(
    ctx: &Context,
    stage: ShaderStage,
    source: &str,
    define: &str,
    values: &[&str],
) -> Result<Vec<Holder<ShaderModuleHandle>>> {
    values.iter().map(|value| shader_with(ctx, stage, source, &[(define, value)])).collect()
}

fn ray_gens(ctx: &Context, all: &[&[(&str, &str)]]) -> Result<Vec<Holder<ShaderModuleHandle>>> {
    all.iter().map(|defines| shader_with(ctx, ShaderStage::RayGen, RAY_GEN, defines)).collect()
}

#[test]
fn instance_ray_and_geometry_choose_the_hit_group() -> Result<()> {
    let Some(ctx) = pipeline_device() else { return Ok(()) };
    let strides: [(u32, u32); 3] = [(0, 0), (0, 1), (1, 1)];
    let ray_gens =
        ray_gens(&ctx, &[&[], &[("SBT_STRIDE", "1")], &[("SBT_OFFSET", "1"), ("SBT_STRIDE", "1")]])?;
    let miss = shader(&ctx, ShaderStage::Miss, MISS)?;
    let plain = shader_with(&ctx, ShaderStage::ClosestHit, TAGGED_HIT, &[("ADD", "0")])?;
    let adding = shader_with(&ctx, ShaderStage::ClosestHit, TAGGED_HIT, &[("ADD", "1000")])?;
    // Records of all lengths: the longest decides the stride.
    let records: Vec<Vec<u8>> = (0..7_u32)
        .map(|group| [&(50 + group).to_ne_bytes()[..], &vec![0xee; group as usize * 11]].concat())
        .collect();
    let groups: Vec<_> = (0..7)
        .map(|group| HitGroup {
            closest_hit: Some([*plain, *adding][group % 2]),
            record: ShaderRecord::from_bytes(&records[group]),
            ..Default::default()
        })
        .collect();
    let ray_gen: Vec<_> = ray_gens.iter().map(|module| **module).collect();
    let pipeline = ctx.create_ray_tracing_pipeline(&RayTracingPipelineDesc {
        ray_gen: &ray_gen,
        miss: &[*miss],
        hit_groups: &groups,
        ..Default::default()
    })?;
    let Traced { scene, gpu, reference, rays } = Traced::new(&ctx, scene())?;
    let tracer = RayTracer::from_pipeline(&ctx, pipeline);
    for (ray_gen, (offset, stride)) in (0..).zip(strides) {
        let records = tracer.trace(&gpu.tlas, &rays, How { ray_gen, ..How::default() })?;
        HitComparison::of_shapes(&rays, &records, |ray| reference.closest(ray, 0xff)).assert("hit groups");
        let hits: Vec<_> = records.iter().filter(|record| record.kind != 0).collect();
        for hit in hits {
            let group = scene.placed[hit.instance as usize].hit_group_offset + offset + stride * hit.geometry;
            let tag = 50 + group + 1000 * (group % 2);
            assert_eq!(hit.kind, tag, "instance {}, geometry {}", hit.instance, hit.geometry);
        }
    }
    Ok(())
}

#[test]
fn the_miss_index_chooses_the_miss_shader() -> Result<()> {
    const TAGGED_MISS: &str = r#"
        #include "ray_records.glsl"
        layout(location = 0) rayPayloadInEXT HitRecord record;
        void main() { record = kNoHit; record.t = -TAG; }"#;
    let Some(ctx) = pipeline_device() else { return Ok(()) };
    let ray_gens = ray_gens(&ctx, &[&[("MISS_INDEX", "0")], &[("MISS_INDEX", "1")], &[("MISS_INDEX", "2")]])?;
    let misses = shader_for_each(&ctx, ShaderStage::Miss, TAGGED_MISS, "TAG", &["7", "8", "9"])?;
    let hit = shader(&ctx, ShaderStage::ClosestHit, HIT)?;
    let tracer = tracer_with(&ctx, &ray_gens, &misses, &hit, &[])?;
    let Traced { gpu, reference, rays, .. } = Traced::new(&ctx, scene())?;
    for (ray_gen, t) in [(0, -7.0), (2, -9.0), (1, -8.0)] {
        let records = tracer.trace(&gpu.tlas, &rays, How { ray_gen, ..How::default() })?;
        HitComparison::of_triangles(&rays, &records, |ray| reference.closest(ray, 0xff))
            .assert("miss shaders");
        let misses: Vec<_> = records.iter().filter(|record| record.kind == 0).collect();
        assert!(!misses.is_empty() && misses.iter().all(|record| record.t == t));
    }
    Ok(())
}

#[test]
fn a_hit_shader_calls_the_callable_it_names() -> Result<()> {
    const CALLING_HIT: &str = r#"
        #include "ray_records.glsl"
        layout(location = 0) rayPayloadInEXT HitRecord record;
        layout(location = 3) callableDataEXT uint value;
        void main() {
            value = lvkPrimitiveIndex(tlas);
            executeCallableEXT(lvkPrimitiveIndex(tlas) % 3, 3);
            record = HitRecord(gl_HitTEXT, vec2(0), 1 + value, lvkInstanceId(tlas), gl_InstanceCustomIndexEXT,
                               gl_GeometryIndexEXT, lvkPrimitiveIndex(tlas));
        }"#;
    const CALLABLE: &str = r"
        layout(location = 3) callableDataInEXT uint value;
        void main() { value = CHANGED; }";
    let Some(ctx) = pipeline_device() else { return Ok(()) };
    let ray_gen = shader(&ctx, ShaderStage::RayGen, RAY_GEN)?;
    let miss = shader(&ctx, ShaderStage::Miss, MISS)?;
    let hit = shader(&ctx, ShaderStage::ClosestHit, CALLING_HIT)?;
    let changed = ["value * 5", "value + 70000", "value ^ 0x3ff"];
    let callables = shader_for_each(&ctx, ShaderStage::Callable, CALLABLE, "CHANGED", &changed)?;
    let tracer = tracer_with(&ctx, &[ray_gen], &[miss], &hit, &callables)?;
    let Traced { gpu, reference, rays, .. } = Traced::new(&ctx, scene())?;
    let records = tracer.trace(&gpu.tlas, &rays, How::default())?;
    HitComparison::of_shapes(&rays, &records, |ray| reference.closest(ray, 0xff)).assert("callables");
    for hit in records.iter().filter(|record| record.kind != 0) {
        let value = hit.primitive;
        let changed = [value * 5, value + 70_000, value ^ 0x3ff][value as usize % 3];
        assert_eq!(hit.kind, 1 + changed);
    }
    Ok(())
}

/// The hit shader goes on behind what was hit and reports the next surface.
#[test]
fn a_hit_shader_traces_a_ray_of_its_own() -> Result<()> {
    const DEEPER_HIT: &str = r#"
        #include "ray_records.glsl"
        layout(location = 0) rayPayloadInEXT HitRecord record;
        layout(location = 1) rayPayloadEXT HitRecord next;
        void main() {
            traceRayEXT(kTLAS[tlas], flags, mask, 1, 0, 1, gl_WorldRayOriginEXT, gl_HitTEXT + 0.01,
                        gl_WorldRayDirectionEXT, gl_RayTmaxEXT + 50.0, 1);
            record = next;
            record.barycentrics.x = gl_HitTEXT;
        }"#;
    const DEEPEST_HIT: &str = r#"
        #include "ray_records.glsl"
        layout(location = 1) rayPayloadInEXT HitRecord next;
        void main() {
            next = HitRecord(gl_HitTEXT, vec2(0), kFront, lvkInstanceId(tlas), gl_InstanceCustomIndexEXT,
                             gl_GeometryIndexEXT, lvkPrimitiveIndex(tlas));
        }"#;
    const NEXT_MISS: &str = r#"
        #include "ray_records.glsl"
        layout(location = 1) rayPayloadInEXT HitRecord next;
        void main() { next = kNoHit; }"#;
    let Some(ctx) = pipeline_device() else { return Ok(()) };
    if ctx.capabilities().limits.max_ray_recursion < 2 {
        eprintln!("NOT TESTED, {} traces no rays from hit shaders", ctx.capabilities().device_name);
        return Ok(());
    }
    let ray_gen = shader(&ctx, ShaderStage::RayGen, RAY_GEN)?;
    let misses = [shader(&ctx, ShaderStage::Miss, MISS)?, shader(&ctx, ShaderStage::Miss, NEXT_MISS)?];
    let hits = [
        shader(&ctx, ShaderStage::ClosestHit, DEEPER_HIT)?,
        shader(&ctx, ShaderStage::ClosestHit, DEEPEST_HIT)?,
    ];
    let groups = hits.each_ref().map(|hit| HitGroup { closest_hit: Some(**hit), ..Default::default() });
    let pipeline = ctx.create_ray_tracing_pipeline(&RayTracingPipelineDesc {
        ray_gen: &[*ray_gen],
        miss: &misses.each_ref().map(|miss| **miss),
        hit_groups: &groups,
        max_recursion: 2,
        ..Default::default()
    })?;
    let single = RayScene::single(Mesh::torus(10), Layout::Indexed16);
    let Traced { gpu, reference, rays, .. } = Traced::new(&ctx, single)?;
    let records = RayTracer::from_pipeline(&ctx, pipeline).trace(&gpu.tlas, &rays, How::default())?;
    let first = rays.iter().zip(&records).filter(|(_, record)| record.barycentrics[0] > 0.0);
    let (behind, records): (Vec<_>, Vec<_>) = first
        .map(|(ray, record)| {
            let t = record.barycentrics[0];
            (Ray { t_min: t + 0.01, t_max: t + 50.0, ..*ray }, *record)
        })
        .unzip();
    assert!(behind.len() > 200);
    HitComparison::of_shapes(&behind, &records, |ray| reference.closest(ray, 0xff))
        .assert("behind the first hit");
    Ok(())
}

/// Five spheres each in two geometries of AABBs; two instances with radii of their own.
#[test]
fn an_intersection_shader_hits_spheres_in_aabbs() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let spheres = SphereModel::new(5);
    let (_buffers, geometries) = spheres.aabb_geometries(&ctx)?;
    let model = [ctx.create_blas(&BlasDesc { geometries: &geometries, ..Default::default() })?];
    let turn = Quat::from_rotation_y(0.7);
    let places = [
        Affine3A::from_scale_rotation_translation(Vec3::splat(0.8), turn, Vec3::new(-1.0, 0.5, 0.0)),
        Affine3A::from_scale_rotation_translation(
            Vec3::splat(1.3),
            turn.inverse(),
            Vec3::new(5.0, 0.0, -1.0),
        ),
    ];
    let place = |(index, transform): (u32, &Affine3A)| Placed {
        hit_group_offset: 1 - index,
        custom_index: 900 + index,
        ..Placed::new(0, *transform)
    };
    let placed: Vec<_> = (0..).zip(&places).map(place).collect();
    let tlas = ctx.create_tlas(&TlasDesc { instances: &instances(&placed, &model), ..Default::default() })?;
    let expected = spheres.spheres(&placed);
    let rays = random_rays(51, 2_000, Vec3::new(-2.0, -1.0, -4.0), Vec3::new(10.0, 5.0, 5.0));
    for method in Method::available(&ctx) {
        let tracer = spheres.tracer(&ctx, method)?;
        let records = tracer.trace(&tlas, &rays, How::default())?;
        HitComparison::of_shapes(&rays, &records, |ray| Sphere::closest(&expected, ray))
            .assert(&format!("spheres by {method:?}"));
        for hit in records.iter().filter(|record| record.kind != 0) {
            let (radius, tag) = GROUPS[1 - hit.instance as usize];
            assert_eq!((hit.kind, hit.barycentrics), (tag, [radius, tag as f32]));
        }
    }
    Ok(())
}
