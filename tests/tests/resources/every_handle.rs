//! Every call that takes a handle, with a destroyed one and with one of another context. The test
//! `documents::bad_input` compares the names here with the public interface.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk::ash::vk;
use lvk::{
    AccelStructHandle, BlasDesc, BlasGeometry, BufferCopy, BufferDesc, BufferHandle, BufferUsage, BuildMode,
    ClearValue, ColorAttachment, CommandBuffer, ComputePipelineDesc, ComputePipelineHandle, Context,
    Dependencies, DeviceInstances, Error, Filter, Format, Holder, IndexFormat, IndirectCount,
    OptionalFeature, QueryPoolDesc, QueryPoolHandle, Queue, RayTracingLibraryDesc, RayTracingLibraryHandle,
    RayTracingPipelineDesc, RayTracingPipelineHandle, RenderPassDesc, RenderPipelineDesc,
    RenderPipelineHandle, Result, SamplerDesc, SamplerHandle, ShaderModuleHandle, ShaderStage, TextureHandle,
    TextureRange, TextureRegion, TextureViewDesc, TlasDesc, TlasInstance, Triangles,
};
use lvk_tests::compute::{compute_pipeline, module};
use lvk_tests::device;
use lvk_tests::raster::{render_pipeline, staged_pipeline, target};

const NOTHING: &str = "layout(local_size_x = 1) in; void main() {}";
const CORNER: &str = "void main() { gl_Position = vec4(0, 0, 0, 1); }";
const WHITE: &str = "layout(location = 0) out vec4 color; void main() { color = vec4(1); }";
const NO_MESH: &str = "layout(local_size_x = 1) in;
    layout(triangles, max_vertices = 3, max_primitives = 1) out;
    void main() { SetMeshOutputsEXT(0, 0); }";

/// Answers of calls, by the call's name in the public interface.
type Answers = Vec<(&'static str, Result<()>)>;

/// An object of each kind. Kinds that the device lacks are `None`.
struct Objects {
    buffer: Holder<BufferHandle>,
    texture: Holder<TextureHandle>,
    sampler: Holder<SamplerHandle>,
    queries: Holder<QueryPoolHandle>,
    module: Holder<ShaderModuleHandle>,
    compute: Holder<ComputePipelineHandle>,
    render: Holder<RenderPipelineHandle>,
    mesh: Option<Holder<RenderPipelineHandle>>,
    blas: Option<Holder<AccelStructHandle>>,
    tlas: Option<Holder<AccelStructHandle>>,
    rays: Option<Holder<RayTracingPipelineHandle>>,
    library: Option<Holder<RayTracingLibraryHandle>>,
    /// True if numbers of draws may come from buffers.
    counts: bool,
}

impl Objects {
    fn new(ctx: &Context) -> Self {
        let caps = ctx.capabilities();
        let traces = caps.ray_tracing_pipeline || caps.ray_query;
        let usage = match traces {
            true => BufferUsage::all(),
            false => BufferUsage::all() - BufferUsage::ACCEL_INPUT,
        };
        let buffer = BufferDesc { size_bytes: 1024, usage, debug_name: "theirs", ..Default::default() };
        let buffer = ctx.create_buffer(&buffer).unwrap();
        let format = [Format::Rgba8Unorm.into()];
        let drawn = RenderPipelineDesc { color: &format, ..Default::default() };
        let blas = traces.then(|| new_blas(ctx, *buffer).unwrap());
        let tlas = blas.as_ref().map(|blas| {
            let instances = [TlasInstance::new(**blas)];
            ctx.create_tlas(&TlasDesc { instances: &instances, ..Default::default() }).unwrap()
        });
        let ray_gen = caps.ray_tracing_pipeline.then(|| module(ctx, ShaderStage::RayGen, "void main() {}"));
        let mesh = [(ShaderStage::Mesh, NO_MESH), (ShaderStage::Fragment, WHITE)];
        Self {
            texture: target(ctx, Format::Rgba8Unorm, [4, 4]),
            sampler: ctx.create_sampler(&SamplerDesc::default()).unwrap(),
            queries: ctx.create_query_pool(&QueryPoolDesc::default()).unwrap(),
            module: module(ctx, ShaderStage::Compute, NOTHING),
            compute: compute_pipeline(ctx, NOTHING),
            render: render_pipeline(ctx, CORNER, WHITE, &drawn),
            mesh: caps.mesh_shader.then(|| staged_pipeline(ctx, &mesh, &drawn).unwrap()),
            rays: ray_gen.as_ref().map(|shader| new_rays(ctx, **shader).unwrap()),
            library: ray_gen.as_ref().filter(|_| caps.pipeline_libraries).map(|shader| {
                let desc = RayTracingLibraryDesc { ray_gen: &[**shader], ..Default::default() };
                ctx.create_ray_tracing_library(&desc).unwrap()
            }),
            counts: caps.has(OptionalFeature::DrawIndirectCount),
            buffer,
            blas,
            tlas,
        }
    }

    fn handles(&self) -> Handles {
        Handles {
            buffer: *self.buffer,
            texture: *self.texture,
            sampler: *self.sampler,
            queries: *self.queries,
            module: *self.module,
            compute: *self.compute,
            render: *self.render,
            blas: self.blas.as_deref().copied(),
            tlas: self.tlas.as_deref().copied(),
            rays: self.rays.as_deref().copied(),
            library: self.library.as_deref().copied(),
        }
    }
}

/// The handles of [`Objects`].
#[derive(Clone, Copy)]
struct Handles {
    buffer: BufferHandle,
    texture: TextureHandle,
    sampler: SamplerHandle,
    queries: QueryPoolHandle,
    module: ShaderModuleHandle,
    compute: ComputePipelineHandle,
    render: RenderPipelineHandle,
    blas: Option<AccelStructHandle>,
    tlas: Option<AccelStructHandle>,
    rays: Option<RayTracingPipelineHandle>,
    library: Option<RayTracingLibraryHandle>,
}

fn new_blas(ctx: &Context, vertices: BufferHandle) -> Result<Holder<AccelStructHandle>> {
    let geometries = [BlasGeometry::Triangles(Triangles::packed(vertices, 3))];
    ctx.create_blas(&BlasDesc { geometries: &geometries, ..Default::default() })
}

fn new_rays(ctx: &Context, ray_gen: ShaderModuleHandle) -> Result<Holder<RayTracingPipelineHandle>> {
    ctx.create_ray_tracing_pipeline(&RayTracingPipelineDesc { ray_gen: &[ray_gen], ..Default::default() })
}

fn buffers_and_textures(ctx: &Context, bad: &Handles) -> Answers {
    let (buffer, texture) = (bad.buffer, bad.texture);
    let whole = TextureRegion::default();
    let view = TextureViewDesc { texture: Some(texture), ..Default::default() };
    // SAFETY: the handle is refused.
    let acquired = unsafe { ctx.acquire_texture(texture, vk::ImageLayout::GENERAL) };
    vec![
        ("Context::buffer_address", ctx.buffer_address(buffer).map(drop)),
        ("Context::buffer_address_at", ctx.buffer_address_at(buffer, 0).map(drop)),
        ("Context::map_buffer", ctx.map_buffer(buffer).map(drop)),
        ("Context::upload_buffer", ctx.upload_buffer(buffer, 0, &[0])),
        ("Context::download_buffer", ctx.download_buffer(buffer, 0, &mut [0])),
        ("Context::read_buffer_later", ctx.read_buffer_later(buffer, 0..1).map(drop)),
        ("Context::upload_texture", ctx.upload_texture(texture, &whole, &[0; 64])),
        ("Context::download_texture", ctx.download_texture(texture, &whole).map(drop)),
        ("Context::read_texture_later", ctx.read_texture_later(texture, &whole).map(drop)),
        ("Context::create_texture_view", ctx.create_texture_view(&view).map(drop)),
        ("Context::acquire_texture", acquired),
        ("Context::raw_buffer", ctx.raw_buffer(buffer).map(drop)),
        ("Context::raw_image", ctx.raw_image(texture).map(drop)),
        ("Context::raw_image_view", ctx.raw_image_view(texture).map(drop)),
        ("Context::raw_target_view", ctx.raw_target_view(texture, 0, 0).map(drop)),
        ("Context::raw_sampler", ctx.raw_sampler(bad.sampler).map(drop)),
        ("Context::raw_compute_pipeline", ctx.raw_compute_pipeline(bad.compute).map(drop)),
        ("Context::raw_render_pipeline", ctx.raw_render_pipeline(bad.render).map(drop)),
    ]
}

fn modules_and_queries(ctx: &Context, bad: &Handles) -> Answers {
    let compute = ComputePipelineDesc { module: Some(bad.module), ..Default::default() };
    let render = RenderPipelineDesc { vertex: Some(bad.module), ..Default::default() };
    let first = |mut results: Vec<Result<()>>| results.remove(0);
    let computes = ctx.create_compute_pipelines(&[compute]).into_iter().map(|made| made.map(drop)).collect();
    let renders = ctx.create_render_pipelines(&[render]).into_iter().map(|made| made.map(drop)).collect();
    let in_background = ctx.create_render_pipeline_in_background(&render).map(drop);
    vec![
        ("Context::create_compute_pipeline", ctx.create_compute_pipeline(&compute).map(drop)),
        ("Context::create_compute_pipelines", first(computes)),
        (
            "Context::create_compute_pipeline_in_background",
            ctx.create_compute_pipeline_in_background(&compute).map(drop),
        ),
        ("Context::create_render_pipeline", ctx.create_render_pipeline(&render).map(drop)),
        ("Context::create_render_pipelines", first(renders)),
        ("Context::create_render_pipeline_in_background", in_background),
        ("Context::read_queries", ctx.read_queries(bad.queries, 0, &mut [None])),
        ("Context::statistics", ctx.statistics(bad.queries, 0).map(drop)),
        ("Context::timestamps_ms", ctx.timestamps_ms(bad.queries, 0, 1).map(drop)),
    ]
}

#[cfg(unix)]
fn shared_memory(ctx: &Context, cmd: &mut CommandBuffer, bad: &Handles) -> Answers {
    let layout = vk::ImageLayout::GENERAL;
    // SAFETY: the handles are refused.
    let acquired = unsafe {
        [cmd.acquire_external_buffer(bad.buffer), cmd.acquire_external_texture(bad.texture, layout)]
    };
    let [buffer, texture] = acquired;
    vec![
        ("Context::export_buffer", ctx.export_buffer(bad.buffer).map(drop)),
        ("Context::export_texture", ctx.export_texture(bad.texture).map(drop)),
        ("CommandBuffer::release_external_buffer", cmd.release_external_buffer(bad.buffer)),
        ("CommandBuffer::release_external_texture", cmd.release_external_texture(bad.texture, layout)),
        ("CommandBuffer::acquire_external_buffer", buffer),
        ("CommandBuffer::acquire_external_texture", texture),
    ]
}

#[cfg(not(unix))]
fn shared_memory(_: &Context, _: &mut CommandBuffer, _: &Handles) -> Answers {
    Vec::new()
}

fn transfers(cmd: &mut CommandBuffer, good: &Handles, bad: &Handles) -> Answers {
    let (buffer, texture, fine, shown) = (bad.buffer, bad.texture, good.buffer, good.texture);
    let (whole, all) = (TextureRegion::default(), TextureRange::default());
    let copy = [BufferCopy { source_offset: 0, target_offset: 64, size: 4 }];
    let clear = ClearValue::Color([0.0; 4]);
    vec![
        ("CommandBuffer::copy_buffer", cmd.copy_buffer(buffer, 0, fine, 0, 4)),
        ("CommandBuffer::copy_buffer", cmd.copy_buffer(fine, 0, buffer, 0, 4)),
        ("CommandBuffer::copy_buffer_regions", cmd.copy_buffer_regions(buffer, fine, &copy)),
        ("CommandBuffer::copy_buffer_regions", cmd.copy_buffer_regions(fine, buffer, &copy)),
        ("CommandBuffer::fill_buffer", cmd.fill_buffer(buffer, 0, 4, 0)),
        ("CommandBuffer::update_buffer", cmd.update_buffer(buffer, 0, &[0; 4])),
        ("CommandBuffer::copy_buffer_to_texture", cmd.copy_buffer_to_texture(buffer, 0, shown, &whole)),
        ("CommandBuffer::copy_buffer_to_texture", cmd.copy_buffer_to_texture(fine, 0, texture, &whole)),
        ("CommandBuffer::copy_texture_to_buffer", cmd.copy_texture_to_buffer(texture, &whole, fine, 0)),
        ("CommandBuffer::copy_texture_to_buffer", cmd.copy_texture_to_buffer(shown, &whole, buffer, 0)),
        ("CommandBuffer::copy_texture", cmd.copy_texture(texture, &whole, shown, &whole)),
        ("CommandBuffer::copy_texture", cmd.copy_texture(shown, &whole, texture, &whole)),
        ("CommandBuffer::resolve_texture", cmd.resolve_texture(texture, &whole, shown, &whole)),
        ("CommandBuffer::resolve_texture", cmd.resolve_texture(shown, &whole, texture, &whole)),
        ("CommandBuffer::blit_texture", cmd.blit_texture(texture, &whole, shown, &whole, Filter::Nearest)),
        ("CommandBuffer::blit_texture", cmd.blit_texture(shown, &whole, texture, &whole, Filter::Nearest)),
        ("CommandBuffer::update_texture", cmd.update_texture(texture, &whole, &[0; 64])),
        ("CommandBuffer::clear_texture", cmd.clear_texture(texture, clear, &all)),
        ("CommandBuffer::generate_mipmaps", cmd.generate_mipmaps(texture)),
        ("CommandBuffer::release_texture", cmd.release_texture(texture, vk::ImageLayout::GENERAL)),
    ]
}

fn queries_and_dispatches(cmd: &mut CommandBuffer, good: &Handles, bad: &Handles) -> Answers {
    let none = Dependencies::default();
    let color = [ColorAttachment::clear(bad.texture, [0.0; 4])];
    let pass = RenderPassDesc { color: &color, ..Default::default() };
    let mut answers = vec![
        ("CommandBuffer::reset_queries", cmd.reset_queries(bad.queries, 0..1)),
        ("CommandBuffer::write_timestamp", cmd.write_timestamp(bad.queries, 0)),
        ("CommandBuffer::begin_query", cmd.begin_query(bad.queries, 0)),
        ("CommandBuffer::end_query", cmd.end_query(bad.queries, 0)),
        ("CommandBuffer::begin_rendering", cmd.begin_rendering(&pass).map(drop)),
        ("CommandBuffer::bind_compute_pipeline", cmd.bind_compute_pipeline(bad.compute)),
    ];
    cmd.bind_compute_pipeline(good.compute).unwrap();
    answers.push(("CommandBuffer::dispatch_indirect", cmd.dispatch_indirect(bad.buffer, 0, &none)));
    for dependencies in [
        Dependencies { buffers: &[bad.buffer], ..none },
        Dependencies { read_buffers: &[bad.buffer], ..none },
        Dependencies { sampled_images: &[bad.texture], ..none },
        Dependencies { storage_images: &[bad.texture], ..none },
    ] {
        answers.push(("CommandBuffer::dispatch", cmd.dispatch([1, 1, 1], &dependencies)));
        answers
            .push(("CommandBuffer::dispatch_indirect", cmd.dispatch_indirect(good.buffer, 0, &dependencies)));
        let pass = RenderPassDesc { dependencies, ..pass };
        answers.push(("CommandBuffer::begin_rendering", cmd.begin_rendering(&pass).map(drop)));
    }
    answers
}

fn passes(cmd: &mut CommandBuffer, good: &Objects, bad: &Handles) -> Answers {
    let color = [ColorAttachment::clear(*good.texture, [0.0; 4])];
    let mut pass = cmd.begin_rendering(&RenderPassDesc { color: &color, ..Default::default() }).unwrap();
    let mut answers = vec![
        ("RenderPass::bind_render_pipeline", pass.bind_render_pipeline(bad.render)),
        ("RenderPass::begin_query", pass.begin_query(bad.queries, 0)),
        ("RenderPass::end_query", pass.end_query(bad.queries, 0)),
        ("RenderPass::write_timestamp", pass.write_timestamp(bad.queries, 0)),
        ("RenderPass::bind_vertex_buffer", pass.bind_vertex_buffer(0, bad.buffer, 0)),
        ("RenderPass::bind_index_buffer", pass.bind_index_buffer(bad.buffer, 0, IndexFormat::U32)),
    ];
    pass.bind_render_pipeline(*good.render).unwrap();
    pass.bind_index_buffer(*good.buffer, 0, IndexFormat::U32).unwrap();
    let counted = |arguments, count| IndirectCount {
        arguments,
        offset: 0,
        stride: 64,
        count,
        count_offset: 0,
        max_draws: 1,
    };
    let counts = [counted(bad.buffer, *good.buffer), counted(*good.buffer, bad.buffer)];
    let counts = if good.counts { &counts[..] } else { &[] };
    answers.push(("RenderPass::draw_indirect", pass.draw_indirect(bad.buffer, 0, 1, 16)));
    answers.push(("RenderPass::draw_indexed_indirect", pass.draw_indexed_indirect(bad.buffer, 0, 1, 20)));
    for counts in counts {
        answers.push(("RenderPass::draw_indirect_count", pass.draw_indirect_count(counts)));
        answers.push(("RenderPass::draw_indexed_indirect_count", pass.draw_indexed_indirect_count(counts)));
    }
    if let Some(mesh) = &good.mesh {
        pass.bind_render_pipeline(**mesh).unwrap();
        let drawn = pass.draw_mesh_tasks_indirect(bad.buffer, 0, 1, 12);
        answers.push(("RenderPass::draw_mesh_tasks_indirect", drawn));
        for counts in counts {
            let drawn = pass.draw_mesh_tasks_indirect_count(counts);
            answers.push(("RenderPass::draw_mesh_tasks_indirect_count", drawn));
        }
    }
    answers
}

fn accel_structs(ctx: &Context, cmd: &mut CommandBuffer, good: &Handles, bad: &Handles) -> Answers {
    let (Some(blas), Some(tlas), Some(lower), Some(upper)) = (bad.blas, bad.tlas, good.blas, good.tlas)
    else {
        return Vec::new();
    };
    let instances = [TlasInstance::new(blas)];
    let from = |buffer, blas| DeviceInstances { buffer, offset: 0, count: 1, blas };
    let tlas_desc = TlasDesc { instances: &instances, ..Default::default() };
    let geometries = [BlasGeometry::Triangles(Triangles::packed(bad.buffer, 3))];
    let desc = BlasDesc { geometries: &geometries, ..Default::default() };
    let rebuild = BuildMode::Rebuild;
    let mut from_buffer = |tlas, instances| cmd.update_tlas_from_buffer(tlas, &instances, rebuild);
    let from_buffers = [
        from_buffer(tlas, from(good.buffer, &[lower])),
        from_buffer(upper, from(bad.buffer, &[lower])),
        from_buffer(upper, from(good.buffer, &[blas])),
    ];
    let bytes = ctx.serialize_blas(lower).unwrap();
    // SAFETY: the bytes are those of a BLAS of this device.
    let load = |bytes| unsafe { ctx.load_blas(&desc, bytes) };
    // SAFETY: as before.
    let load_or_create = |bytes| unsafe { ctx.load_or_create_blas(&desc, bytes) };
    let mut answers = vec![
        ("Context::load_blas", load(&bytes).map(drop)),
        ("Context::load_or_create_blas", load_or_create(Some(&bytes)).map(drop)),
        ("Context::load_or_create_blas", load_or_create(None).map(drop)),
        ("Context::create_blas", ctx.create_blas(&desc).map(drop)),
        ("Context::create_blas_batch", ctx.create_blas_batch(&[desc]).map(drop)),
        ("Context::create_blas_batch_on", ctx.create_blas_batch_on(Queue::Compute, &[desc]).map(drop)),
        ("Context::blas_sizes", ctx.blas_sizes(&desc).map(drop)),
        ("Context::create_tlas", ctx.create_tlas(&tlas_desc).map(drop)),
        ("Context::accel_struct_info", ctx.accel_struct_info(blas).map(drop)),
        ("Context::accel_struct_sizes", ctx.accel_struct_sizes(blas).map(drop)),
        ("Context::accel_struct_addresses", ctx.accel_struct_addresses(blas).map(drop)),
        ("Context::raw_accel_structs", ctx.raw_accel_structs(blas).map(drop)),
        ("Context::build_progress", ctx.build_progress(&[blas]).map(drop)),
        ("Context::compact", ctx.compact(&[blas])),
        ("Context::serialize_blas", ctx.serialize_blas(blas).map(drop)),
        ("CommandBuffer::build_blas", cmd.build_blas(&[lower, blas], rebuild)),
        ("CommandBuffer::update_tlas", cmd.update_tlas(tlas, &[], rebuild)),
        ("CommandBuffer::update_tlas", cmd.update_tlas(upper, &instances, rebuild)),
    ];
    answers.extend(from_buffers.map(|answer| ("CommandBuffer::update_tlas_from_buffer", answer)));
    answers
}

fn rays(ctx: &Context, cmd: &mut CommandBuffer, good: &Handles, bad: &Handles) -> Answers {
    let (Some(pipeline), Some(fine), Some(tlas)) = (bad.rays, good.rays, bad.tlas) else { return Vec::new() };
    let none = Dependencies::default();
    let declared = Dependencies { acceleration_structures: &[tlas], ..none };
    let shaders = [bad.module];
    let desc = RayTracingPipelineDesc { ray_gen: &shaders, ..Default::default() };
    let library = RayTracingLibraryDesc { ray_gen: &shaders, ..Default::default() };
    let pending = ctx.create_ray_tracing_pipeline_in_background(&desc).map(drop);
    let bound = cmd.bind_ray_tracing_pipeline(pipeline);
    cmd.bind_ray_tracing_pipeline(fine).unwrap();
    let mut answers = vec![
        ("Context::create_ray_tracing_pipeline", ctx.create_ray_tracing_pipeline(&desc).map(drop)),
        ("Context::create_ray_tracing_pipeline_in_background", pending),
        ("Context::raw_ray_tracing_pipeline", ctx.raw_ray_tracing_pipeline(pipeline).map(drop)),
        ("Context::ray_tracing_stack_bytes", ctx.ray_tracing_stack_bytes(pipeline).map(drop)),
        ("CommandBuffer::bind_ray_tracing_pipeline", bound),
        ("CommandBuffer::trace_rays", cmd.trace_rays([1, 1, 1], &declared)),
        ("CommandBuffer::trace_rays_with", cmd.trace_rays_with(0, [1, 1, 1], &declared)),
        ("CommandBuffer::trace_rays_indirect", cmd.trace_rays_indirect(0, bad.buffer, 0, &none)),
        ("CommandBuffer::trace_rays_indirect", cmd.trace_rays_indirect(0, good.buffer, 0, &declared)),
    ];
    if let Some(linked) = bad.library {
        let linked = RayTracingPipelineDesc { libraries: &[linked], ..Default::default() };
        let made = ctx.create_ray_tracing_pipeline(&linked).map(drop);
        answers.push(("Context::create_ray_tracing_pipeline", made));
        let made = ctx.create_ray_tracing_library(&library).map(drop);
        answers.push(("Context::create_ray_tracing_library", made));
    }
    answers
}

/// Calls everything with the handles of `bad`. The command buffer stays as good as new.
fn answers(ctx: &Context, good: &Objects, bad: &Handles) -> Answers {
    let handles = good.handles();
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    let mut all = buffers_and_textures(ctx, bad);
    all.extend(modules_and_queries(ctx, bad));
    all.extend(shared_memory(ctx, &mut cmd, bad));
    all.extend(transfers(&mut cmd, &handles, bad));
    all.extend(queries_and_dispatches(&mut cmd, &handles, bad));
    all.extend(passes(&mut cmd, good, bad));
    all.extend(accel_structs(ctx, &mut cmd, &handles, bad));
    all.extend(rays(ctx, &mut cmd, &handles, bad));
    ctx.submit(cmd).unwrap();
    all
}

#[test]
fn every_call_refuses_destroyed_handles_by_name() {
    let Some(ctx) = device() else { return };
    let (good, bad) = (Objects::new(&ctx), Objects::new(&ctx));
    let handles = bad.handles();
    ctx.wait_idle().unwrap();
    drop(bad);
    for (call, answer) in answers(&ctx, &good, &handles) {
        assert!(matches!(answer, Err(Error::StaleHandle { name: Some(_), .. })), "{call}: {answer:?}");
    }
}

#[test]
fn every_call_refuses_handles_of_another_context() {
    let (Some(ctx), Some(other)) = (device(), device()) else { return };
    let (good, theirs) = (Objects::new(&ctx), Objects::new(&other));
    for (call, answer) in answers(&ctx, &good, &theirs.handles()) {
        assert!(matches!(answer, Err(Error::ForeignHandle { .. })), "{call}: {answer:?}");
    }
    other.wait_idle().unwrap();
}
