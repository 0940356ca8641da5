//! Wrong use of ray tracing: each call returns a typed error that names the object, and the context stays usable.

use lvk::glam::{Affine3A, Vec3};
use lvk::{
    Aabbs, AccelStructHandle, BlasDesc, BlasGeometry, BufferDesc, BufferHandle, BufferUsage, BuildFlags,
    BuildMode, CommandBuffer, Context, Dependencies, Error, GeometryFlags, GeometryTransform, HitGroup,
    Holder, IndexFormat, Indices, InstanceFlags, RayTracingPipelineDesc, Result, ShaderModuleHandle,
    ShaderRecord, ShaderStage, TlasDesc, TlasInstance, Triangles,
};
use lvk_tests::device;
use lvk_tests::hit_comparison::HitComparison;
use lvk_tests::meshes::Mesh;
use lvk_tests::ray_scene::{GpuScene, Layout, Placed, RayScene, instances};
use lvk_tests::ray_tracer::{How, Method, RayTracer, shader};
use lvk_tests::rays::random_rays;

const RAY_GEN: &str = include_str!("../../shaders/closest.rgen.glsl");
const MISS: &str = include_str!("../../shaders/record.rmiss.glsl");
const HIT: &str = include_str!("../../shaders/record.rchit.glsl");

/// A callable shader, which needs some bytes of the stack.
const CALLABLE: &str = "layout(location = 0) callableDataInEXT vec4 data; void main() { data = vec4(1); }";

/// A scene that traces right as long as the context is in order.
struct Intact {
    ctx: Context,
    scene: RayScene,
    gpu: GpuScene,
    tracers: Vec<RayTracer>,
}

impl Intact {
    fn new(ctx: &Context) -> Result<Self> {
        let scene = RayScene::single(Mesh::sphere(6), Layout::Indexed16);
        let gpu = scene.upload(ctx)?;
        let tracers: Result<_> =
            Method::available(ctx).into_iter().map(|method| RayTracer::new(ctx, method)).collect();
        Ok(Self { ctx: ctx.clone(), scene, gpu, tracers: tracers? })
    }

    /// Fails unless acceleration structures can still be built and traced, the old ones too.
    fn check(&self) -> Result<()> {
        let rays = random_rays(61, 60, Vec3::NEG_ONE, Vec3::ONE);
        let reference = self.scene.reference();
        let fresh = self.scene.upload(&self.ctx)?;
        for tracer in &self.tracers {
            for gpu in [&self.gpu, &fresh] {
                let records = tracer.trace(&gpu.tlas, &rays, How::default())?;
                HitComparison::of_triangles(&rays, &records, |ray| reference.closest(ray, 0xff))
                    .assert("afterwards");
            }
        }
        Ok(())
    }

    /// Fails unless recording answers the error and the command buffer can still be submitted.
    fn refuse(&self, words: &str, record: impl FnOnce(&mut CommandBuffer) -> Result<()>) -> Result<()> {
        let mut cmd = self.ctx.acquire_command_buffer()?;
        refused(words, record(&mut cmd));
        self.ctx.submit(cmd)?;
        self.check()
    }
}

/// Fails unless the outcome is an error of the caller whose text has these words.
#[track_caller]
fn refused<T>(words: &str, outcome: Result<T>) {
    let error = outcome.err();
    assert!(error.is_some(), "this must fail: {words}");
    let Some(error) = error else { return };
    let of_caller = matches!(
        error,
        Error::InvalidUsage { .. }
            | Error::StaleHandle { .. }
            | Error::LimitExceeded { .. }
            | Error::PushConstants { .. }
    );
    assert!(of_caller, "{words}: {error:?}");
    assert!(error.to_string().contains(words), "no word of '{words}' in: {error}");
}

fn buffer(
    ctx: &Context,
    size_bytes: u64,
    usage: BufferUsage,
    debug_name: &str,
) -> Result<Holder<BufferHandle>> {
    let zeros = vec![0; size_bytes as usize];
    ctx.create_buffer(&BufferDesc { data: Some(&zeros), usage, debug_name, ..Default::default() })
}

fn blas(ctx: &Context, geometries: &[BlasGeometry]) -> Result<Holder<AccelStructHandle>> {
    ctx.create_blas(&BlasDesc { geometries, debug_name: "wrong", ..Default::default() })
}

#[test]
fn geometry_that_does_not_fit_its_buffers_is_refused() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let intact = Intact::new(&ctx)?;
    let vertices = buffer(&ctx, 36 * 4, BufferUsage::ACCEL_INPUT, "few vertices")?;
    let indices = buffer(&ctx, 24, BufferUsage::ACCEL_INPUT, "few indices")?;
    let storage = buffer(&ctx, 256, BufferUsage::STORAGE, "no input")?;
    let good = Triangles::packed(*vertices, 12);
    let indexed = Triangles::indexed(*vertices, 12, *indices, 2);
    let index = |offset, format| Some(Indices { buffer: *indices, offset, format });
    let cases = [
        ("vertex stride is 13", Triangles { vertex_stride: 13, vertex_count: 3, triangle_count: 1, ..good }),
        ("vertex offset is 2", Triangles { vertex_offset: 2, vertex_count: 3, triangle_count: 1, ..good }),
        ("few vertices", Triangles { vertex_count: 13, ..good }),
        ("few vertices", Triangles { vertex_offset: 4, ..good }),
        ("few vertices", Triangles { vertex_offset: u64::MAX - 3, ..good }),
        ("vertex stride in bytes", Triangles { vertex_stride: u64::MAX - 3, ..good }),
        ("few vertices", Triangles { vertex_stride: 1 << 31, ..good }),
        ("5 triangles need three vertices", Triangles { triangle_count: 5, ..good }),
        // At the end of the buffer, as no vertex is before it.
        ("need at least one vertex", Triangles { vertex_count: 0, vertex_offset: 36 * 4, ..indexed }),
        ("wrong", Triangles { triangle_count: u32::MAX, ..good }),
        ("ACCEL_INPUT", Triangles { vertex_buffer: *storage, ..good }),
        ("few indices", Triangles { triangle_count: 3, ..indexed }),
        ("few indices", Triangles { indices: index(4, IndexFormat::U32), ..indexed }),
        ("index offset is 1", Triangles { indices: index(1, IndexFormat::U16), ..indexed }),
        ("index offset is 2", Triangles { indices: index(2, IndexFormat::U32), ..indexed }),
        (
            "ACCEL_INPUT",
            Triangles {
                indices: Some(Indices { buffer: *storage, offset: 0, format: IndexFormat::U16 }),
                ..indexed
            },
        ),
    ];
    for (words, triangles) in cases {
        refused(words, blas(&ctx, &[BlasGeometry::Triangles(triangles)]));
        refused(words, blas(&ctx, &[BlasGeometry::Triangles(indexed), BlasGeometry::Triangles(triangles)]));
        intact.check()?;
    }
    for number in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let transform = Some(GeometryTransform::Rows([number; 12]));
        let odd = BlasGeometry::Triangles(Triangles { transform, ..good });
        let geometries = [BlasGeometry::Triangles(good), odd];
        let words = "wrong: the transform of geometry 1 is not finite; give finite numbers";
        refused(words, blas(&ctx, &geometries));
        refused(
            words,
            ctx.blas_sizes(&BlasDesc { geometries: &geometries, debug_name: "wrong", ..Default::default() }),
        );
    }
    let _fits = blas(&ctx, &[BlasGeometry::Triangles(good), BlasGeometry::Triangles(indexed)])?;
    intact.check()
}

#[test]
fn aabbs_that_do_not_fit_their_buffer_are_refused() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let intact = Intact::new(&ctx)?;
    let boxes = buffer(&ctx, 24 * 4, BufferUsage::ACCEL_INPUT, "few boxes")?;
    let storage = buffer(&ctx, 256, BufferUsage::STORAGE, "no input")?;
    let good = Aabbs { buffer: *boxes, offset: 0, stride: 0, count: 4, flags: GeometryFlags::OPAQUE };
    let cases = [
        ("few boxes", Aabbs { count: 5, ..good }),
        ("few boxes", Aabbs { offset: 8, ..good }),
        ("few boxes", Aabbs { stride: 32, ..good }),
        ("box offset is 4", Aabbs { offset: 4, count: 1, ..good }),
        ("box stride is 28", Aabbs { stride: 28, count: 1, ..good }),
        ("", Aabbs { stride: u64::MAX - 7, ..good }),
        ("ACCEL_INPUT", Aabbs { buffer: *storage, ..good }),
    ];
    for (words, aabbs) in cases {
        refused(words, blas(&ctx, &[BlasGeometry::Aabbs(aabbs)]));
        intact.check()?;
    }
    let vertices = buffer(&ctx, 36, BufferUsage::ACCEL_INPUT, "vertices")?;
    let triangles = BlasGeometry::Triangles(Triangles::packed(*vertices, 3));
    refused("cannot share a structure", blas(&ctx, &[BlasGeometry::Aabbs(good), triangles]));
    refused("at least one geometry", blas(&ctx, &[]));
    let both = BuildFlags::FAST_BUILD | BuildFlags::FAST_TRACE;
    let desc = BlasDesc { geometries: &[triangles], flags: both, ..Default::default() };
    refused("either FAST_TRACE or FAST_BUILD", ctx.create_blas(&desc));
    let tlas = TlasDesc { flags: both, ..Default::default() };
    refused("either FAST_TRACE or FAST_BUILD", ctx.create_tlas(&tlas));
    intact.check()
}

/// One wrong description among good ones: nothing of the batch comes to be.
#[test]
fn a_batch_with_one_mistake_is_refused_whole() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let intact = Intact::new(&ctx)?;
    let vertices = buffer(&ctx, 36, BufferUsage::ACCEL_INPUT, "vertices")?;
    let good = [BlasGeometry::Triangles(Triangles::packed(*vertices, 3))];
    let wrong = [BlasGeometry::Triangles(Triangles::packed(*vertices, 6))];
    let desc = |geometries| BlasDesc { geometries, ..Default::default() };
    refused("vertices", ctx.create_blas_batch(&[desc(&good[..]), desc(&wrong[..]), desc(&good[..])]));
    assert!(ctx.create_blas_batch(&[])?.is_empty());
    intact.check()
}

#[test]
fn refits_that_are_not_possible_are_refused() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let intact = Intact::new(&ctx)?;
    let (model, tlas) = (*intact.gpu.models[0], *intact.gpu.tlas);
    let one = TlasInstance::new(model);
    let updatable = ctx.create_tlas(&TlasDesc {
        instances: &[one; 3],
        capacity: 6,
        flags: BuildFlags::ALLOW_UPDATE,
        debug_name: "of six",
        ..Default::default()
    })?;
    intact.refuse("ALLOW_UPDATE", |cmd| cmd.build_blas(&[model], BuildMode::Refit))?;
    intact.refuse("ALLOW_UPDATE", |cmd| cmd.update_tlas(tlas, &[one], BuildMode::Refit))?;
    for count in [0, 2, 4] {
        let other = vec![one; count];
        intact.refuse("so rebuild", |cmd| cmd.update_tlas(*updatable, &other, BuildMode::Refit))?;
    }
    for mode in [BuildMode::Refit, BuildMode::Rebuild] {
        let words = "of six: instance count is 7, the TLAS was created for at most 6; create it with a larger \
                     TlasDesc::capacity";
        intact.refuse(words, |cmd| cmd.update_tlas(*updatable, &[one; 7], mode))?;
    }
    intact.refuse("instance count is 2", |cmd| cmd.update_tlas(tlas, &[one; 2], BuildMode::Rebuild))?;
    let mut cmd = ctx.acquire_command_buffer()?;
    cmd.update_tlas(*updatable, &[one; 3], BuildMode::Refit)?;
    ctx.submit(cmd)?;
    intact.check()
}

#[test]
fn the_wrong_level_and_stale_accel_structs_are_refused() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let intact = Intact::new(&ctx)?;
    let (model, tlas) = (*intact.gpu.models[0], *intact.gpu.tlas);
    let stale = {
        let vertices = buffer(&ctx, 36, BufferUsage::ACCEL_INPUT, "vertices")?;
        *blas(&ctx, &[BlasGeometry::Triangles(Triangles::packed(*vertices, 3))])?
    };
    let (top, gone) = (TlasInstance::new(tlas), TlasInstance::new(stale));
    let bottom = TlasInstance::new(model);
    let rebuild = BuildMode::Rebuild;
    intact.refuse("a top-level structure is needed", |cmd| cmd.update_tlas(model, &[], rebuild))?;
    intact.refuse("a bottom-level structure is needed", |cmd| cmd.build_blas(&[tlas], rebuild))?;
    intact.refuse("a bottom-level structure is needed", |cmd| cmd.update_tlas(tlas, &[top], rebuild))?;
    intact.refuse("acceleration structure", |cmd| cmd.update_tlas(tlas, &[gone], rebuild))?;
    intact.refuse("acceleration structure", |cmd| cmd.build_blas(&[model, stale], rebuild))?;
    intact.refuse("acceleration structure", |cmd| cmd.update_tlas(stale, &[bottom], rebuild))?;
    intact.refuse("listed twice", |cmd| cmd.build_blas(&[model, model], rebuild))?;
    for instances in [[bottom, top], [bottom, gone]] {
        refused("structure", ctx.create_tlas(&TlasDesc { instances: &instances, ..Default::default() }));
        intact.check()?;
    }
    refused("capacity", ctx.create_tlas(&TlasDesc { capacity: u32::MAX, ..Default::default() }));
    intact.check()
}

#[test]
fn instances_that_do_not_fit_their_bits_are_refused() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let intact = Intact::new(&ctx)?;
    let good = TlasInstance::new(*intact.gpu.models[0]);
    let mut transform = good.transform;
    transform[7] = f32::INFINITY;
    let cases = [
        ("24 bits", TlasInstance { custom_index: 1 << 24, ..good }),
        ("24 bits", TlasInstance { hit_group_offset: u32::MAX, ..good }),
        ("not finite", TlasInstance { transform, ..good }),
        (
            "FORCE_OPAQUE",
            TlasInstance { flags: InstanceFlags::FORCE_OPAQUE | InstanceFlags::FORCE_NO_OPAQUE, ..good },
        ),
    ];
    for (words, instance) in cases {
        intact.refuse(words, |cmd| cmd.update_tlas(*intact.gpu.tlas, &[instance], BuildMode::Rebuild))?;
        refused(
            "instance 1",
            ctx.create_tlas(&TlasDesc { instances: &[good, instance], ..Default::default() }),
        );
    }
    intact.check()
}

#[test]
fn a_rebuild_from_destroyed_buffers_is_refused() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let intact = Intact::new(&ctx)?;
    let mut scene = RayScene::single(Mesh::torus(6), Layout::Indexed16);
    scene.placed = vec![Placed::new(0, Affine3A::IDENTITY)];
    let mut gpu = scene.upload(&ctx)?;
    gpu.buffers[0].indices = None;
    intact.refuse("buffer", |cmd| cmd.build_blas(&[*gpu.models[0]], BuildMode::Rebuild))?;
    let mut cmd = ctx.acquire_command_buffer()?;
    cmd.update_tlas(*gpu.tlas, &instances(&scene.placed, &gpu.models), BuildMode::Rebuild)?;
    ctx.submit(cmd)?;
    let reference = scene.reference();
    let rays = random_rays(62, 200, Vec3::NEG_ONE, Vec3::ONE);
    for tracer in &intact.tracers {
        let records = tracer.trace(&gpu.tlas, &rays, How::default())?;
        HitComparison::of_triangles(&rays, &records, |ray| reference.closest(ray, 0xff))
            .assert("what was built");
    }
    Ok(())
}

struct Modules {
    ray_gen: Holder<ShaderModuleHandle>,
    miss: Holder<ShaderModuleHandle>,
    hit: Holder<ShaderModuleHandle>,
}

impl Modules {
    fn new(ctx: &Context) -> Result<Self> {
        Ok(Self {
            ray_gen: shader(ctx, ShaderStage::RayGen, RAY_GEN)?,
            miss: shader(ctx, ShaderStage::Miss, MISS)?,
            hit: shader(ctx, ShaderStage::ClosestHit, HIT)?,
        })
    }
}

#[test]
fn pipelines_without_sense_are_refused() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    if !Method::available(&ctx).contains(&Method::Pipeline) {
        return Ok(());
    }
    let intact = Intact::new(&ctx)?;
    let modules = Modules::new(&ctx)?;
    let (ray_gen, miss, hit) = ([*modules.ray_gen], [*modules.miss], *modules.hit);
    let groups = [HitGroup { closest_hit: Some(hit), ..Default::default() }];
    let good = RayTracingPipelineDesc {
        ray_gen: &ray_gen,
        miss: &miss,
        hit_groups: &groups,
        debug_name: "wrong",
        ..Default::default()
    };
    let limits = &ctx.capabilities().limits;
    let long = vec![0; (limits.sbt_max_stride - limits.sbt_handle_bytes + 1) as usize];
    let any_hit = [HitGroup { any_hit: Some(hit), ..Default::default() }];
    let intersection = [HitGroup { intersection: Some(hit), ..Default::default() }];
    let too_long = [HitGroup { record: ShaderRecord::from_bytes(&long), ..groups[0] }];
    let cases = [
        ("at least one ray generation shader", RayTracingPipelineDesc { ray_gen: &[], ..good }),
        ("recursion depth", RayTracingPipelineDesc { max_recursion: limits.max_ray_recursion + 1, ..good }),
        ("recursion depth of 0", RayTracingPipelineDesc { max_recursion: 0, ..good }),
        (
            "hit attributes in bytes",
            RayTracingPipelineDesc { max_hit_attribute_bytes: limits.max_hit_attribute_bytes + 1, ..good },
        ),
        ("RayGen module is needed", RayTracingPipelineDesc { ray_gen: &miss, ..good }),
        ("Miss module is needed", RayTracingPipelineDesc { miss: &ray_gen, ..good }),
        ("Callable module is needed", RayTracingPipelineDesc { callable: &miss, ..good }),
        ("AnyHit module is needed", RayTracingPipelineDesc { hit_groups: &any_hit, ..good }),
        ("Intersection module is needed", RayTracingPipelineDesc { hit_groups: &intersection, ..good }),
        ("hit group record", RayTracingPipelineDesc { hit_groups: &too_long, ..good }),
    ];
    for (words, desc) in cases {
        refused(words, ctx.create_ray_tracing_pipeline(&desc));
        intact.check()?;
    }
    let calls = shader(&ctx, ShaderStage::Callable, CALLABLE)?;
    let deep = RayTracingPipelineDesc { callable: &[*calls], max_callable_depth: u32::MAX, ..good };
    let what = match ctx.capabilities().ray_tracing_pipeline_path.is_lowered() {
        true => "wrong: depth of callable shaders is 4294967295, ",
        false => "wrong: stack of one ray in bytes",
    };
    refused(what, ctx.create_ray_tracing_pipeline(&deep));
    drop(modules);
    refused("shader module", ctx.create_ray_tracing_pipeline(&good));
    intact.check()
}

#[test]
fn traces_that_cannot_run_are_refused() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    if !Method::available(&ctx).contains(&Method::Pipeline) {
        return Ok(());
    }
    let intact = Intact::new(&ctx)?;
    let modules = Modules::new(&ctx)?;
    let pipeline = ctx.create_ray_tracing_pipeline(&RayTracingPipelineDesc {
        ray_gen: &[*modules.ray_gen],
        miss: &[*modules.miss],
        hit_groups: &[HitGroup { closest_hit: Some(*modules.hit), ..Default::default() }],
        ..Default::default()
    })?;
    let none = Dependencies::default();
    intact.refuse("bind a ray tracing pipeline first", |cmd| cmd.trace_rays([1, 1, 1], &none))?;
    intact.refuse("bind a pipeline first", |cmd| cmd.push_constants(&[0_u32; 8]))?;
    intact.refuse("32 bytes of push constants", |cmd| {
        cmd.bind_ray_tracing_pipeline(*pipeline)?;
        cmd.trace_rays([1, 1, 1], &none)
    })?;
    intact.refuse("declares 32 bytes", |cmd| {
        cmd.bind_ray_tracing_pipeline(*pipeline)?;
        cmd.push_constants(&[0_u32; 12])
    })?;
    let pushed = |cmd: &mut CommandBuffer| {
        cmd.bind_ray_tracing_pipeline(*pipeline)?;
        cmd.push_constants(&[0_u32; 8])
    };
    intact.refuse("ray generation shader 1 does not exist", |cmd| {
        pushed(cmd)?;
        cmd.trace_rays_with(1, [1, 1, 1], &none)
    })?;
    for size in [[u32::MAX; 3], [u32::MAX, 2, 1]] {
        intact.refuse("number of rays", |cmd| {
            pushed(cmd)?;
            cmd.trace_rays(size, &none)
        })?;
    }
    let gone = *buffer(&ctx, 4, BufferUsage::STORAGE, "gone")?;
    intact.refuse("buffer", |cmd| {
        pushed(cmd)?;
        cmd.trace_rays([1, 1, 1], &Dependencies { buffers: &[gone], ..none })
    })?;
    let stale = *pipeline;
    drop(pipeline);
    intact.refuse("ray tracing pipeline", |cmd| cmd.bind_ray_tracing_pipeline(stale))?;
    let mut cmd = ctx.acquire_command_buffer()?;
    refused("ray tracing pipeline", cmd.trace_rays([1, 1, 1], &none));
    drop(cmd);
    intact.check()
}
