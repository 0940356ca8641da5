//! Automatic barriers: a chain of commands gives the same results as running one command after the other, without
//! validation messages.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk::{
    BufferDesc, BufferHandle, BufferUsage, ColorAttachment, ColorLoadOp, CommandBuffer, Context,
    Dependencies, Error, Format, Holder, IndexFormat, MemoryKind, RenderPassDesc, RenderPipelineDesc,
    RenderPipelineHandle, TextureDesc, TextureRegion, TextureUsage,
};
use lvk_tests::compute::{Evaluator, compute_pipeline, read_vec4, read_words, vec4_buffer, words_buffer};
use lvk_tests::device;
use lvk_tests::queues::{step, step_pipeline, stepped};
use lvk_tests::raster::{COVER, PAINT, pixels, render_pipeline, target};

fn buffer(ctx: &Context, usage: BufferUsage, size_bytes: u64) -> Holder<BufferHandle> {
    ctx.create_buffer(&BufferDesc { size_bytes, usage, ..Default::default() }).unwrap()
}

#[test]
fn dispatches_that_pass_a_buffer_on_wait_for_each_other() {
    let Some(ctx) = device() else { return };
    let pipeline = step_pipeline(&ctx);
    let mut expected: Vec<u32> = (0..64).collect();
    let buffers = [words_buffer(&ctx, &expected), words_buffer(&ctx, &[0; 64])];
    for submission in 0..4 {
        let mut cmd = ctx.acquire_command_buffer().unwrap();
        for number in 10 * submission..10 * submission + 5 {
            let order = if number % 2 == 0 { [0, 1] } else { [1, 0] };
            // An odd number of steps a submission: the roles change with the submission as well.
            let order = if submission % 2 == 0 { order } else { [order[1], order[0]] };
            step(&ctx, &mut cmd, *pipeline, order.map(|at: usize| *buffers[at]), number);
            expected = stepped(&expected, number);
        }
        ctx.submit(cmd).unwrap();
    }
    let found = buffers.each_ref().map(|buffer| read_words(&ctx, **buffer, 64));
    assert!(found.contains(&expected), "neither buffer holds the last step");
}

#[test]
fn dispatches_take_their_size_from_a_dispatch() {
    let Some(ctx) = device() else { return };
    let arguments = buffer(&ctx, BufferUsage::INDIRECT, 16);
    let counter = words_buffer(&ctx, &[0]);
    let write = compute_pipeline(
        &ctx,
        "layout(local_size_x = 1) in;
         layout(buffer_reference, scalar) writeonly buffer Arguments { uvec3 groups; };
         layout(push_constant, scalar) uniform Push { Arguments arguments; uint count; };
         void main() { arguments.groups = uvec3(count, 2, 1); }",
    );
    let count = compute_pipeline(
        &ctx,
        "layout(local_size_x = 1) in;
         layout(buffer_reference, scalar) buffer Counter { uint count; };
         layout(push_constant, scalar) uniform Push { Counter counter; };
         void main() { atomicAdd(counter.count, 1); }",
    );
    let split = |address: u64| [address as u32, (address >> 32) as u32];
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    for groups in [3, 5, 7] {
        let [low, high] = split(ctx.buffer_address(*arguments).unwrap());
        cmd.bind_compute_pipeline(*write).unwrap();
        cmd.push_constants(&[low, high, groups]).unwrap();
        cmd.dispatch([1, 1, 1], &Dependencies { buffers: &[*arguments], ..Default::default() }).unwrap();
        cmd.bind_compute_pipeline(*count).unwrap();
        cmd.push_constants(&split(ctx.buffer_address(*counter).unwrap())).unwrap();
        let counts = Dependencies { buffers: &[*counter], ..Default::default() };
        cmd.dispatch_indirect(*arguments, 0, &counts).unwrap();
    }
    ctx.submit(cmd).unwrap();
    assert_eq!(read_words(&ctx, *counter, 1), [2 * (3 + 5 + 7)]);
}

/// Vertices, indices and arguments of a triangle over all pixels, written by one shader.
const WRITE_DRAW: &str = "
    layout(local_size_x = 1) in;
    layout(buffer_reference, scalar) writeonly buffer Draw { uint indices[3]; uint count; uint instances; uint firstIndex; int offset; uint firstInstance; vec2 corners[4]; };
    layout(push_constant, scalar) uniform Push { Draw draw; };
    void main() {
        draw.indices = uint[](3, 1, 2);
        draw.count = 3;
        draw.instances = 1;
        draw.firstIndex = 0;
        draw.offset = 0;
        draw.firstInstance = 0;
        draw.corners = vec2[](vec2(9), vec2(3, -1), vec2(-1, 3), vec2(-1, -1));
    }";
const DRAW_WRITTEN: &str = "
    layout(location = 0) in vec2 corner;
    void main() { gl_Position = vec4(corner, 0, 1); }";
const SEVEN: &str = "layout(location = 0) out vec4 result; void main() { result = vec4(7); }";

/// A pipeline that draws vertices of a buffer, two floats each, and writes 7 to every pixel.
fn sevens_pipeline(ctx: &Context) -> Holder<RenderPipelineHandle> {
    let attribute = lvk::VertexAttribute { format: lvk::VertexFormat::F32x2, ..Default::default() };
    let desc = RenderPipelineDesc {
        vertex_bindings: &[lvk::VertexBinding { stride: 8, per_instance: false }],
        vertex_attributes: &[attribute],
        color: &[Format::R32Float.into()],
        ..Default::default()
    };
    render_pipeline(ctx, DRAW_WRITTEN, SEVEN, &desc)
}

#[test]
fn draws_take_everything_from_a_dispatch_they_declare() {
    let Some(ctx) = device() else { return };
    let usage = BufferUsage::INDEX | BufferUsage::VERTEX | BufferUsage::INDIRECT;
    let draw = buffer(&ctx, usage, 64);
    let write = compute_pipeline(&ctx, WRITE_DRAW);
    let pipeline = sevens_pipeline(&ctx);
    let target = target(&ctx, Format::R32Float, [4, 4]);
    let color = [ColorAttachment::clear(*target, [0.0; 4])];
    let declared = Dependencies { read_buffers: &[*draw], ..Default::default() };
    let draw_all = |cmd: &mut CommandBuffer, desc: &RenderPassDesc<'_>| {
        let mut pass = cmd.begin_rendering(desc).unwrap();
        pass.bind_render_pipeline(*pipeline).unwrap();
        pass.bind_index_buffer(*draw, 0, IndexFormat::U32).unwrap();
        pass.bind_vertex_buffer(0, *draw, 32).unwrap();
        pass.draw_indexed_indirect(*draw, 12, 1, 20).unwrap();
    };
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    cmd.bind_compute_pipeline(*write).unwrap();
    cmd.push_constants(&ctx.buffer_address(*draw).unwrap()).unwrap();
    cmd.dispatch([1, 1, 1], &Dependencies { buffers: &[*draw], ..Default::default() }).unwrap();
    let silent = RenderPassDesc { color: &color, ..Default::default() };
    let mut pass = cmd.begin_rendering(&silent).unwrap();
    pass.bind_render_pipeline(*pipeline).unwrap();
    let refused = [pass.bind_index_buffer(*draw, 0, IndexFormat::U32), pass.bind_vertex_buffer(0, *draw, 32)];
    for result in refused {
        assert!(
            matches!(&result, Err(Error::InvalidUsage { message, .. }) if message.contains("dependencies"))
        );
    }
    drop(pass);
    draw_all(&mut cmd, &RenderPassDesc { dependencies: declared, ..silent });
    ctx.submit(cmd).unwrap();
    assert_eq!(pixels::<f32>(&ctx, *target), [7.0; 16]);
    // In a later command buffer the library knows without being told.
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    draw_all(&mut cmd, &silent);
    ctx.submit(cmd).unwrap();
    assert_eq!(pixels::<f32>(&ctx, *target), [7.0; 16]);
}

#[test]
fn draws_read_copied_data_without_declaring_it() {
    let Some(ctx) = device() else { return };
    let corners = [[-1.0_f32, -1.0], [3.0, -1.0], [-1.0, 3.0]];
    let source = BufferDesc {
        data: Some(bytemuck::cast_slice(&corners)),
        memory: MemoryKind::HostVisible,
        ..Default::default()
    };
    let source = ctx.create_buffer(&source).unwrap();
    let vertices = buffer(&ctx, BufferUsage::VERTEX, 24);
    let pipeline = sevens_pipeline(&ctx);
    let target = target(&ctx, Format::R32Float, [2, 2]);
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    for round in 0..2 {
        if round == 1 {
            cmd.fill_buffer(*vertices, 0, 24, 0).unwrap();
        }
        cmd.copy_buffer(*source, 0, *vertices, 0, 24).unwrap();
        let color = [ColorAttachment::clear(*target, [0.0; 4])];
        let mut pass = cmd.begin_rendering(&RenderPassDesc { color: &color, ..Default::default() }).unwrap();
        pass.bind_render_pipeline(*pipeline).unwrap();
        pass.bind_vertex_buffer(0, *vertices, 0).unwrap();
        pass.draw(0..3, 0..1).unwrap();
    }
    ctx.submit(cmd).unwrap();
    assert_eq!(pixels::<f32>(&ctx, *target), [7.0; 4]);
}

#[test]
fn render_sample_store_copy_and_download_in_one_command_buffer() {
    let Some(ctx) = device() else { return };
    let desc = RenderPipelineDesc { color: &[Format::R32Float.into()], ..Default::default() };
    let paint = render_pipeline(&ctx, COVER, PAINT, &desc);
    let drawn = target(&ctx, Format::R32Float, [4, 4]);
    let usage = TextureUsage::STORAGE | TextureUsage::SAMPLED;
    let stored = TextureDesc { format: Format::R32Float, extent: [4, 4], usage, ..Default::default() };
    let stored = ctx.create_texture(&stored).unwrap();
    let copied =
        ctx.create_texture(&TextureDesc { format: Format::R32Float, extent: [4, 4], ..Default::default() });
    let copied = copied.unwrap();
    let double = Evaluator::new(
        &ctx,
        "vec4(1); ivec2 at = ivec2(i % 4, i / 4);
         imageStore(kImages2D[b], at, 2.0 * textureBindlessFetch2D(a, at, 0) + float(i))",
    );
    let ones = vec4_buffer(&ctx, 16);
    let bytes =
        ctx.create_buffer(&BufferDesc { size_bytes: 64, memory: MemoryKind::Readback, ..Default::default() });
    let bytes = bytes.unwrap();
    for value in [10.0_f32, 20.0, 30.0] {
        let mut cmd = ctx.acquire_command_buffer().unwrap();
        let color = [ColorAttachment::clear(*drawn, [0.0; 4])];
        let mut pass = cmd.begin_rendering(&RenderPassDesc { color: &color, ..Default::default() }).unwrap();
        pass.bind_render_pipeline(*paint).unwrap();
        pass.push_constants(&[value, 0.0, 0.0, 0.0, 0.0]).unwrap();
        pass.draw(0..3, 0..1).unwrap();
        drop(pass);
        let uses =
            Dependencies { sampled_images: &[*drawn], storage_images: &[*stored], ..Default::default() };
        double.record(&ctx, &mut cmd, [drawn.index(), stored.index(), 0], (*ones, 16), &uses);
        let whole = TextureRegion::default();
        cmd.copy_texture(*stored, &whole, *copied, &whole).unwrap();
        cmd.copy_texture_to_buffer(*copied, &whole, *bytes, 0).unwrap();
        ctx.submit(cmd).unwrap();
        let mut found = [0.0_f32; 16];
        ctx.download_buffer(*bytes, 0, bytemuck::cast_slice_mut(&mut found)).unwrap();
        assert_eq!(found, std::array::from_fn(|i| 2.0 * value + i as f32));
    }
}

#[test]
fn uploads_wait_for_the_shaders_that_still_read() {
    let Some(ctx) = device() else { return };
    let pipeline = step_pipeline(&ctx);
    let source = words_buffer(&ctx, &[1; 64]);
    let results: Vec<_> = (0..5).map(|_| words_buffer(&ctx, &[0; 64])).collect();
    for (value, result) in (2..).zip(&results) {
        ctx.upload_buffer(*source, 0, bytemuck::cast_slice(&[value; 64])).unwrap();
        let mut cmd = ctx.acquire_command_buffer().unwrap();
        step(&ctx, &mut cmd, *pipeline, [*source, **result], 1);
        ctx.submit(cmd).unwrap();
    }
    for (value, result) in (2..).zip(&results) {
        assert_eq!(read_words(&ctx, **result, 64), [3 * value + 1; 64]);
    }
}

#[test]
fn the_order_of_submission_counts_and_not_the_order_of_recording() {
    let Some(ctx) = device() else { return };
    let pipeline = step_pipeline(&ctx);
    let first: Vec<u32> = (0..64).map(|i| i * i).collect();
    let [a, b, c] = [words_buffer(&ctx, &first), words_buffer(&ctx, &[0; 64]), words_buffer(&ctx, &[0; 64])];
    let mut late = ctx.acquire_command_buffer().unwrap();
    let mut early = ctx.acquire_command_buffer().unwrap();
    step(&ctx, &mut late, *pipeline, [*b, *c], 5);
    step(&ctx, &mut early, *pipeline, [*a, *b], 9);
    ctx.submit(early).unwrap();
    ctx.submit(late).unwrap();
    assert_eq!(read_words(&ctx, *c, 64), stepped(&stepped(&first, 9), 5));
}

#[test]
fn textures_keep_their_layout_when_recorded_and_submitted_in_different_orders() {
    let Some(ctx) = device() else { return };
    let usage = TextureUsage::all() - TextureUsage::SHADING_RATE;
    let desc = TextureDesc { format: Format::R32Float, extent: [2, 2], usage, mips: 2, ..Default::default() };
    let texture = ctx.create_texture(&desc).unwrap();
    let store = Evaluator::new(&ctx, "vec4(1); imageStore(kImages2D[a], ivec2(i % 2, i / 2), vec4(b + i))");
    let fetch = Evaluator::new(&ctx, "textureBindlessFetch2D(a, ivec2(i % 2, i / 2), 0)");
    let (ones, result) = (vec4_buffer(&ctx, 4), vec4_buffer(&ctx, 4));
    let [mut sampling, mut storing, mut clearing] = [(); 3].map(|()| ctx.acquire_command_buffer().unwrap());
    let reads = Dependencies { sampled_images: &[*texture], ..Default::default() };
    fetch.record(&ctx, &mut sampling, [texture.index(), 0, 0], (*result, 4), &reads);
    let writes = Dependencies { storage_images: &[*texture], ..Default::default() };
    store.record(&ctx, &mut storing, [texture.index(), 50, 0], (*ones, 4), &writes);
    let load = ColorLoadOp::Clear([1.0; 4]);
    let color = [ColorAttachment { texture: *texture, mip: 1, layer: 0, load, store: true, resolve: None }];
    drop(clearing.begin_rendering(&RenderPassDesc { color: &color, ..Default::default() }).unwrap());
    for cmd in [clearing, storing, sampling] {
        ctx.submit(cmd).unwrap();
    }
    let found: Vec<_> = read_vec4(&ctx, *result, 4).iter().map(|value| value[0]).collect();
    assert_eq!(found, [50.0, 51.0, 52.0, 53.0]);
    let mip = TextureRegion { mip: 1, ..Default::default() };
    assert_eq!(ctx.download_texture(*texture, &mip).unwrap(), 1.0_f32.to_le_bytes());
}

#[test]
fn one_command_cannot_use_a_texture_in_two_layouts() {
    let Some(ctx) = device() else { return };
    let desc = TextureDesc {
        format: Format::R32Float,
        usage: TextureUsage::all() - TextureUsage::SHADING_RATE,
        mips: 1,
        ..Default::default()
    };
    let texture = ctx.create_texture(&desc).unwrap();
    let other = ctx.create_texture(&desc).unwrap();
    let pipeline = compute_pipeline(&ctx, "layout(local_size_x = 1) in; void main() {}");
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    cmd.bind_compute_pipeline(*pipeline).unwrap();
    let both = Dependencies {
        sampled_images: &[*texture],
        storage_images: &[*other, *texture],
        ..Default::default()
    };
    let conflict = |result: lvk::Result<()>| match result {
        Err(Error::InvalidUsage { message, .. }) => assert!(message.contains("two ways"), "{message}"),
        other => unreachable!("{other:?}"),
    };
    conflict(cmd.dispatch([1, 1, 1], &both));
    let color = [ColorAttachment::clear(*texture, [0.0; 4])];
    for dependencies in [
        Dependencies { sampled_images: &[*texture], ..Default::default() },
        Dependencies { storage_images: &[*texture], ..Default::default() },
    ] {
        let desc = RenderPassDesc { color: &color, dependencies, ..Default::default() };
        conflict(cmd.begin_rendering(&desc).map(drop));
    }
    // Naming the same use twice is no conflict, and refused commands left nothing behind.
    let twice = Dependencies { sampled_images: &[*texture, *texture], ..Default::default() };
    cmd.dispatch([1, 1, 1], &twice).unwrap();
    ctx.submit(cmd).unwrap();
}

#[test]
fn mapped_memory_contains_what_shaders_wrote() {
    let Some(ctx) = device() else { return };
    let pipeline = step_pipeline(&ctx);
    let first: Vec<u32> = (0..64).collect();
    let source = words_buffer(&ctx, &first);
    for memory in [MemoryKind::HostVisible, MemoryKind::Readback] {
        let target =
            ctx.create_buffer(&BufferDesc { size_bytes: 256, memory, ..Default::default() }).unwrap();
        for number in [1, 2, 3] {
            let mut cmd = ctx.acquire_command_buffer().unwrap();
            step(&ctx, &mut cmd, *pipeline, [*source, *target], number);
            ctx.submit(cmd).unwrap();
            assert_eq!(read_words(&ctx, *target, 64), stepped(&first, number), "{memory:?}");
        }
    }
}
