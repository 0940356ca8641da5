//! Instances that a compute shader writes in the command buffer that builds and traces their TLAS.

use bytemuck::NoUninit;
use lvk::glam::{Affine3A, Vec3};
use lvk::{
    BufferDesc, BufferHandle, BufferUsage, BuildFlags, BuildMode, CommandBuffer, ComputePipelineDesc,
    ComputePipelineHandle, Context, Dependencies, DeviceInstances, DeviceProfile, Error, Holder,
    InstanceFlags, Result, ShaderStage, TlasDesc,
};
use lvk_tests::accel_backend::builds_device_accel_structs;
use lvk_tests::hit_check::{HitCheck, rays_for};
use lvk_tests::hit_comparison::HitComparison;
use lvk_tests::meshes::Mesh;
use lvk_tests::ray_scene::{GpuScene, Layout, Part, Placed, RayScene};
use lvk_tests::ray_tracer::{How, shader_with};
use lvk_tests::{TestDevice, device, device_with};

const RECORD_BYTES: u64 = 64;
const WIDTH: u32 = 6;
/// Bytes before the first record.
const OFFSET: u64 = 48;

/// Push constants of `instances.comp.glsl`.
#[repr(C)]
#[derive(Clone, Copy, NoUninit)]
struct Push {
    records: u64,
    count: u32,
    models: u32,
    turn: [f32; 2],
}

/// Writes records into a buffer of its own.
struct Writer {
    pipeline: Holder<ComputePipelineHandle>,
    records: Holder<BufferHandle>,
    address: u64,
}

impl Writer {
    fn new(ctx: &Context, room: u32) -> Result<Self> {
        let text = include_str!("../../shaders/instances.comp.glsl");
        let width = WIDTH.to_string();
        let module = shader_with(ctx, ShaderStage::Compute, text, &[("WIDTH", &width)])?;
        let desc = ComputePipelineDesc { module: Some(*module), ..Default::default() };
        let pipeline = ctx.create_compute_pipeline(&desc)?;
        let size_bytes = OFFSET + u64::from(room) * RECORD_BYTES;
        let desc = BufferDesc { size_bytes, debug_name: "records", ..Default::default() };
        let records = ctx.create_buffer(&desc)?;
        let address = ctx.buffer_address(*records)? + OFFSET;
        Ok(Self { pipeline, records, address })
    }

    /// Records the writing of records and the update of the acceleration structure.
    fn update(
        &self,
        cmd: &mut CommandBuffer,
        gpu: &GpuScene,
        count: u32,
        turn: f32,
        mode: BuildMode,
    ) -> Result<()> {
        let blas: Vec<_> = gpu.models.iter().map(|model| **model).collect();
        let models = blas.len() as u32;
        cmd.bind_compute_pipeline(*self.pipeline)?;
        let (sine, cosine) = turn.sin_cos();
        let turn = [cosine, sine];
        cmd.push_constants(&Push { records: self.address, count, models, turn })?;
        let writes = Dependencies { buffers: &[*self.records], ..Default::default() };
        cmd.dispatch([count.div_ceil(64), 1, 1], &writes)?;
        let instances = DeviceInstances { buffer: *self.records, offset: OFFSET, count, blas: &blas };
        cmd.update_tlas_from_buffer(*gpu.tlas, &instances, mode)
    }
}

/// The same instances. The reference has no instance for an acceleration structure that is not there, so it gets one that no ray sees.
fn scene(models: &[Vec<Part>], count: u32, turn: f32) -> RayScene {
    let place = |i: u32| {
        let to = Vec3::new((i % WIDTH) as f32, (i / WIDTH) as f32, (i % 3) as f32) * 3.0;
        let transform = Affine3A::from_translation(to) * Affine3A::from_rotation_x(turn);
        Placed {
            custom_index: 0xff_ffff - i,
            mask: if i % 7 == 3 { 0 } else { (1 + i % 255) as u8 },
            flags: if i % 5 == 2 { InstanceFlags::FLIP_FACING } else { InstanceFlags::empty() },
            ..Placed::new(i as usize % models.len(), transform)
        }
    };
    RayScene { models: models.to_vec(), placed: (0..count).map(place).collect() }
}

fn models() -> Vec<Vec<Part>> {
    vec![
        vec![Part::new(Mesh::torus(6), Layout::Indexed16), Part::new(Mesh::cube_grid(1), Layout::Unshared)],
        vec![Part::new(Mesh::sphere(5), Layout::Indexed32)],
        vec![Part::new(Mesh::cube_grid(2), Layout::Interleaved)],
    ]
}

/// Plain acceleration structures; where the device has its own, some that are cut into many parts, with room for them all, and some that may
/// move.
fn devices() -> Vec<(TestDevice, BuildFlags, u32)> {
    let profile = DeviceProfile { max_blas_primitives: 32, ..DeviceProfile::default() };
    let (trace, build) = (BuildFlags::FAST_TRACE, BuildFlags::FAST_BUILD);
    let plain = device().map(|ctx| (ctx, build, 1));
    let ordered = device().map(|ctx| (ctx, trace, 1));
    let has_own = |ctx: &TestDevice| builds_device_accel_structs(ctx);
    let moving = device().filter(has_own).map(|ctx| (ctx, trace | BuildFlags::ALLOW_COMPACTION, 1));
    let cut = device_with(|desc| desc.profile = Some(&profile)).filter(has_own).map(|ctx| (ctx, trace, 16));
    [plain, ordered, moving, cut].into_iter().flatten().collect()
}

fn upload(ctx: &Context, flags: BuildFlags, parts_per_instance: u32, capacity: u32) -> Result<GpuScene> {
    let empty = RayScene { models: models(), placed: Vec::new() };
    let gpu = empty.upload_with(ctx, flags, BuildFlags::default(), 0)?;
    let desc =
        TlasDesc { capacity, parts_per_instance, flags: BuildFlags::ALLOW_UPDATE, ..Default::default() };
    Ok(GpuScene { tlas: ctx.create_tlas(&desc)?, ..gpu })
}

/// More and fewer of them, rebuilt and refitted, all without a wait between writing, building and tracing.
#[test]
fn instances_written_by_a_dispatch_are_traced_in_the_same_submission() -> Result<()> {
    use BuildMode::{Auto, Rebuild, Refit};
    for (ctx, flags, parts) in devices() {
        let writer = Writer::new(&ctx, 40)?;
        let check = HitCheck::new(&ctx)?;
        let gpu = upload(&ctx, flags, parts, 40)?;
        let steps =
            [(24, 0.0, Rebuild), (24, 0.5, Refit), (40, 0.2, Rebuild), (40, 0.9, Auto { max_refits: 3 })];
        for (count, turn, mode) in
            steps.into_iter().chain([(1, 0.3, Auto { max_refits: 3 }), (13, 1.5, Rebuild)])
        {
            let scene = scene(&models(), count, turn);
            let reference = scene.reference();
            let rays = rays_for(&reference);
            for (method, tracer) in check.tracers() {
                let trace_buffers = tracer.buffers(&rays)?;
                let mut cmd = ctx.acquire_command_buffer()?;
                writer.update(&mut cmd, &gpu, count, turn, mode)?;
                tracer.record(&mut cmd, &gpu.tlas, &trace_buffers, How::default())?;
                ctx.submit(cmd)?;
                HitComparison::of_triangles(&rays, &tracer.read(&trace_buffers)?, |ray| {
                    reference.closest(ray, 0xff)
                })
                .assert(&format!("{count} written, {mode:?}, {flags:?}, {parts} parts, by {method:?}"));
            }
        }
    }
    Ok(())
}

/// The records of one buffer change from frame to frame, and the GPU may be frames behind.
#[test]
fn every_frame_in_flight_has_records_of_its_own() -> Result<()> {
    for (ctx, flags, parts) in devices() {
        let writer = Writer::new(&ctx, 12)?;
        let check = HitCheck::new(&ctx)?;
        let gpu = upload(&ctx, flags, parts, 12)?;
        for (method, tracer) in check.tracers() {
            let mut frames = Vec::new();
            for number in 0..5_u32 {
                ctx.next_frame()?;
                let (count, turn) = (7 + number, number as f32 * 0.4);
                let reference = scene(&models(), count, turn).reference();
                let rays = rays_for(&reference);
                let trace_buffers = tracer.buffers(&rays)?;
                let mut cmd = ctx.acquire_command_buffer()?;
                writer.update(&mut cmd, &gpu, count, turn, BuildMode::Rebuild)?;
                tracer.record(&mut cmd, &gpu.tlas, &trace_buffers, How::default())?;
                ctx.submit(cmd)?;
                frames.push((trace_buffers, rays, reference));
            }
            for (number, (trace_buffers, rays, reference)) in frames.iter().enumerate() {
                HitComparison::of_triangles(rays, &tracer.read(trace_buffers)?, |ray| {
                    reference.closest(ray, 0xff)
                })
                .assert(&format!("frame {number}, {flags:?}, {parts} parts, by {method:?}"));
            }
        }
    }
    Ok(())
}

#[test]
fn mistakes_with_device_instances_are_refused() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let gpu = upload(&ctx, BuildFlags::default(), 1, 8)?;
    let writer = Writer::new(&ctx, 12)?;
    let buffer = |usage| {
        let desc = BufferDesc { size_bytes: 1024, usage, debug_name: "not storage", ..Default::default() };
        ctx.create_buffer(&desc)
    };
    let input = buffer(BufferUsage::ACCEL_INPUT)?;
    let gone = *buffer(BufferUsage::STORAGE)?;
    let stale = {
        let other = upload(&ctx, BuildFlags::default(), 1, 1)?;
        [*other.models[0]]
    };
    let blas = [*gpu.models[0]];
    let top = [*gpu.tlas];
    let good = DeviceInstances { buffer: *writer.records, offset: 0, count: 8, blas: &blas };
    let cases = [
        ("instance count is 9", DeviceInstances { count: 9, ..good }),
        ("multiple of 16", DeviceInstances { offset: 8, ..good }),
        ("records", DeviceInstances { offset: 320, ..good }),
        ("records", DeviceInstances { offset: u64::MAX - 15, ..good }),
        ("not storage", DeviceInstances { buffer: *input, ..good }),
        ("buffer", DeviceInstances { buffer: gone, ..good }),
        ("acceleration structure", DeviceInstances { blas: &stale, ..good }),
        ("a bottom-level structure is needed", DeviceInstances { blas: &top, ..good }),
    ];
    for (words, instances) in cases {
        let mut cmd = ctx.acquire_command_buffer()?;
        let error = cmd.update_tlas_from_buffer(*gpu.tlas, &instances, BuildMode::Rebuild).err();
        let of_caller = matches!(
            error,
            Some(Error::InvalidUsage { .. } | Error::StaleHandle { .. } | Error::LimitExceeded { .. })
        );
        assert!(of_caller, "{words}: {error:?}");
        let text = error.map(|error| error.to_string()).unwrap_or_default();
        assert!(text.contains(words), "no word of '{words}' in: {text}");
        ctx.submit(cmd)?;
    }
    let mut cmd = ctx.acquire_command_buffer()?;
    writer.update(&mut cmd, &gpu, 8, 0.1, BuildMode::Rebuild)?;
    assert!(
        cmd.update_tlas_from_buffer(*gpu.tlas, &DeviceInstances { count: 5, ..good }, BuildMode::Refit)
            .is_err()
    );
    ctx.submit(cmd)?;
    HitCheck::new(&ctx)?.scene("afterwards", &gpu.tlas, &scene(&models(), 8, 0.1))
}

/// No records, and records that may refer to nothing.
#[test]
fn none_and_homeless_instances_are_missed() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let gpu = upload(&ctx, BuildFlags::default(), 1, 8)?;
    let writer = Writer::new(&ctx, 8)?;
    let rays = rays_for(&scene(&models(), 8, 0.0).reference());
    let check = HitCheck::new(&ctx)?;
    for (count, blas) in [(0, vec![*gpu.models[0]]), (0, Vec::new()), (8, Vec::new())] {
        let mut cmd = ctx.acquire_command_buffer()?;
        writer.update(&mut cmd, &gpu, 8, 0.0, BuildMode::Rebuild)?;
        let instances = DeviceInstances { buffer: *writer.records, offset: OFFSET, count, blas: &blas };
        cmd.update_tlas_from_buffer(*gpu.tlas, &instances, BuildMode::Rebuild)?;
        ctx.submit(cmd)?;
        for (method, tracer) in check.tracers() {
            let records = tracer.trace(&gpu.tlas, &rays, How::default())?;
            assert!(records.iter().all(|record| record.kind == 0), "{count} of {} by {method:?}", blas.len());
        }
    }
    Ok(())
}
