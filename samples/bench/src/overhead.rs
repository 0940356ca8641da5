//! A ray traced frame by `lvk` and by hand-written Vulkan: same shaders, same triangles, same device.

use std::rc::Rc;

use lvk::ash::vk;
use lvk::{BufferDesc, BufferHandle, BufferUsage};
use lvk::{Context, Holder, MemoryKind, PrimitiveOrder};

use crate::args::TraceArgs;
use crate::error::BenchError;
use crate::hand_written::{
    RawAccelStruct, RawCommands, RawDevice, RawTracing, StackSize, instance_geometry, triangle_geometry,
};
use crate::instance_record::InstanceRecord;
use crate::measure::{Stopwatch, SubmissionTimes, interleave, median};
use crate::mesh::{BuiltMesh, Mesh, MeshBuffers};
use crate::pipelines::stages;
use crate::setup::{DefaultBy, Setup};
use crate::table::{Table, format_ms, format_ratio};
use crate::tracer::{MeshTracer, RayKind, TracedImage};
use lvk_samples::shaders::bench::BUILT_IN_NUMBERS;

/// Compares frames of primary rays.
pub(super) fn measure(setup: &Setup, args: &TraceArgs) -> Result<Table, BenchError> {
    let ctx = setup.open()?;
    let default_triangles = setup.default_for(&ctx, DefaultBy { quick: 2000, cpu: 20_000, gpu: 1_000_000 });
    let runs = setup.runs(&ctx, DefaultBy { quick: 2, cpu: 20, gpu: 500 });
    let mesh = Mesh::new(&args.mesh, args.camera, default_triangles)?;
    let size = setup.image_size(&ctx, &args.image);
    let what = format!("overhead: {}, {}x{} primary rays by pipeline", mesh.describe(), size[0], size[1]);
    let mut table = Table::new(
        setup.title(&ctx, &what),
        &["", "lvk", "hand-written", "ratio", "hand-written, stack size set"],
    );
    if ctx.capabilities().ray_tracing_pipeline {
        add_comparison_rows(&ctx, &mesh, size, runs, &mut table)?;
    } else {
        let device = &ctx.capabilities().device_name;
        table.add_note(format!("not measured: {device} has no ray tracing pipelines"));
    }
    table.add_note(format!("medians of {runs} interleaved frames, each followed by a wait; same SPIR-V"));
    table.add_note("limit: the trace within 2 % on the H200");
    table.add_note("the library sets the size of the stack for each trace; the driver computes it for the pipeline by hand");
    Ok(table)
}

fn add_comparison_rows(
    ctx: &Context,
    mesh: &Mesh,
    size: [u32; 2],
    runs: u32,
    table: &mut Table,
) -> Result<(), BenchError> {
    let stages = stages(BUILT_IN_NUMBERS);
    let words: lvk::Result<Vec<_>> =
        stages.iter().map(|stage| lvk::compile_glsl(&stage.module(), ctx.capabilities())).collect();
    let words = words?;
    let scene = BuiltMesh::new(ctx, MeshBuffers::new(ctx, mesh)?, PrimitiveOrder::Given)?;
    let image = TracedImage::new(ctx, mesh, size, scene.tlas.index())?;
    let raw_image = TracedImage::new(ctx, mesh, size, scene.tlas.index())?;
    let tracer = MeshTracer::from_spirv(ctx, &stages, &words)?;
    let raw = RawScene::new(ctx, mesh)?;
    let raw_tracer = |stack| RawTracing::new(&raw.device, &words, raw.tlas.raw, scene.tlas.index(), stack);
    let (raw_tracer, raw_with_stack) = (raw_tracer(StackSize::Default)?, raw_tracer(StackSize::Set)?);
    let stopwatch = Stopwatch::new(ctx)?;
    let by_hand = |tracer: &RawTracing| raw.commands.time(|cmd| tracer.trace(cmd, &raw_image.view, size));
    let samples: [Vec<_>; 3] = interleave(runs, |which| match which {
        0 => stopwatch.time(|cmd| tracer.record(cmd, &image, RayKind::Primary)),
        1 => by_hand(&raw_tracer),
        _ => by_hand(&raw_with_stack),
    })?;
    let [ours, theirs, with_stack] = samples.map(|samples| median(&samples));
    let mut row = |name: &str, time: fn(&SubmissionTimes) -> f64| {
        let [ours, theirs, with_stack] = [&ours, &theirs, &with_stack].map(time);
        let cells = [format_ms(ours), format_ms(theirs), format_ratio(ours / theirs), format_ms(with_stack)];
        table.add_row(name, cells);
    };
    row("trace (GPU)", |times| times.gpu);
    row("record and submit (CPU)", |times| times.cpu);
    row("recording the trace (CPU)", |times| times.record);
    row("until the GPU is done", |times| times.total);
    let differing = image.count_differing_pixels(&raw_image)?;
    table.add_row("differing pixels", [String::new(), format!("{differing} of {}", size[0] * size[1])]);
    Ok(())
}

/// The same triangles under one untransformed instance, built by hand-written Vulkan.
struct RawScene {
    device: Rc<RawDevice>,
    commands: RawCommands,
    tlas: RawAccelStruct,
    _blas: RawAccelStruct,
    _instance: Holder<BufferHandle>,
    _buffers: MeshBuffers,
}

impl RawScene {
    fn new(ctx: &Context, mesh: &Mesh) -> Result<Self, BenchError> {
        let flags = vk::BuildAccelerationStructureFlagsKHR::PREFER_FAST_TRACE;
        let device = RawDevice::new(ctx);
        let commands = RawCommands::new(&device)?;
        let buffers = MeshBuffers::new(ctx, mesh)?;
        ctx.wait(ctx.flush()?)?;
        let geometry = triangle_geometry(&device, &buffers)?;
        let blas = RawAccelStruct::new(&device, geometry, buffers.triangle_count, flags)?;
        let instance = create_instance_buffer(ctx, &blas)?;
        let geometry = instance_geometry(ctx.buffer_address(*instance)?);
        let tlas = RawAccelStruct::new(&device, geometry, 1, flags)?;
        commands.time(|commands| {
            blas.build(commands);
            tlas.build(commands);
        })?;
        Ok(Self { device, commands, tlas, _blas: blas, _instance: instance, _buffers: buffers })
    }
}

/// Creates a buffer with one instance of the BLAS.
fn create_instance_buffer(ctx: &Context, blas: &RawAccelStruct) -> lvk::Result<Holder<BufferHandle>> {
    let identity = lvk::transform_rows(&glam::Affine3A::IDENTITY);
    let record = InstanceRecord::new(identity, blas.address);
    ctx.create_buffer(&BufferDesc {
        usage: BufferUsage::ACCEL_INPUT,
        memory: MemoryKind::HostVisible,
        data: Some(bytemuck::bytes_of(&record)),
        debug_name: "instance",
        ..BufferDesc::default()
    })
}
