//! Draws whose count a dispatch writes: of vertices, of indices and of meshes; and many pipelines created at once.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk::{
    BufferDesc, BufferHandle, BufferUsage, ColorAttachment, ComputePipelineDesc, Context, Dependencies,
    DeviceProfile, Error, Format, Holder, IndexFormat, IndirectCount, OptionalFeature, RenderPassDesc,
    RenderPipelineDesc, ShaderStage, SpecializationConstant, SpecializationValue,
};
use lvk_tests::compute::{compute_pipeline, module, read_words, words_buffer};
use lvk_tests::raster::{has, pixels, run_pass, staged_pipeline, target, unsupported, usage_error};
use lvk_tests::{device, device_with};

/// The pixel of the draw's first instance.
const VERTEX: &str = "
    void main() {
        vec2 corner = vec2(gl_VertexIndex & 1, (gl_VertexIndex >> 1) & 1) * 2.0;
        gl_Position = vec4((gl_InstanceIndex + corner.x) / 4.0 - 1.0, corner.y * 2.0 - 1.0, 0, 1);
    }";
const FRAGMENT: &str = "
    layout(location = 0) out vec4 result;
    void main() { result = vec4(1.0); }";

fn buffer(ctx: &Context, usage: BufferUsage, words: &[u32]) -> Holder<BufferHandle> {
    let data = Some(bytemuck::cast_slice(words));
    let desc = BufferDesc { usage, data, debug_name: "arguments", ..Default::default() };
    ctx.create_buffer(&desc).unwrap()
}

/// A dispatch writes the number 3 behind a first word.
fn count_written_by_a_dispatch(ctx: &Context, cmd: &mut lvk::CommandBuffer) -> Holder<BufferHandle> {
    let count = buffer(ctx, BufferUsage::INDIRECT | BufferUsage::STORAGE, &[9, 9]);
    let text = "
        layout(local_size_x = 1) in;
        layout(buffer_reference, scalar) buffer Words { uint at[]; };
        layout(push_constant, scalar) uniform Push { Words words; };
        void main() { words.at[1] = 3; }";
    cmd.bind_compute_pipeline(*compute_pipeline(ctx, text)).unwrap();
    cmd.push_constants(&ctx.buffer_address(*count).unwrap()).unwrap();
    cmd.dispatch([1; 3], &Dependencies { buffers: &[*count], ..Default::default() }).unwrap();
    count
}

enum Kind {
    Plain,
    Indexed,
    Mesh,
}

#[test]
fn a_dispatch_decides_how_many_draws_there_are() {
    let Some(ctx) = device().filter(|ctx| has(ctx, OptionalFeature::DrawIndirectCount)) else { return };
    let color = [Format::R32Float.into()];
    let desc = RenderPipelineDesc { color: &color, ..Default::default() };
    let stages = [(ShaderStage::Vertex, VERTEX), (ShaderStage::Fragment, FRAGMENT)];
    let vertices = staged_pipeline(&ctx, &stages, &desc).unwrap();
    let indices = buffer(&ctx, BufferUsage::INDEX, &[0, 1, 2]);
    // Of five draws, each of one instance, every other pixel would be drawn.
    let plain: Vec<u32> = (0..5).flat_map(|draw| [3, 1, 0, 2 * draw, 7]).collect();
    let indexed: Vec<u32> = (0..5).flat_map(|draw| [3, 1, 0, 0, 2 * draw]).collect();
    let mut kinds = vec![(Kind::Plain, plain), (Kind::Indexed, indexed)];
    let mesh = "
        layout(local_size_x = 1) in;
        layout(triangles, max_vertices = 3, max_primitives = 1) out;
        void main() {
            SetMeshOutputsEXT(3, 1);
            for (int i = 0; i < 3; ++i) {
                vec2 corner = vec2(i & 1, i >> 1) * 2.0;
                float x = gl_DrawID * 2 + corner.x;
                gl_MeshVerticesEXT[i].gl_Position = vec4(x / 4.0 - 1.0, corner.y * 2.0 - 1.0, 0, 1);
            }
            gl_PrimitiveTriangleIndicesEXT[0] = uvec3(0, 1, 2);
        }";
    let stages = [(ShaderStage::Mesh, mesh), (ShaderStage::Fragment, FRAGMENT)];
    let meshes = ctx.capabilities().mesh_shader.then(|| staged_pipeline(&ctx, &stages, &desc).unwrap());
    if meshes.is_some() {
        kinds.push((Kind::Mesh, [1, 1, 1, 9, 9].repeat(5)));
    } else {
        eprintln!("NOT TESTED, no mesh shaders");
    }
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    let count = count_written_by_a_dispatch(&ctx, &mut cmd);
    ctx.submit(cmd).unwrap();
    for (kind, words) in kinds {
        for max_draws in [2, 5] {
            let arguments = buffer(&ctx, BufferUsage::INDIRECT, &words);
            let drawn = target(&ctx, Format::R32Float, [8, 1]);
            let color = [ColorAttachment::clear(*drawn, [0.0; 4])];
            let draws = IndirectCount {
                arguments: *arguments,
                offset: 0,
                stride: 20,
                count: *count,
                count_offset: 4,
                max_draws,
            };
            run_pass(&ctx, &RenderPassDesc { color: &color, ..Default::default() }, |pass| match kind {
                Kind::Plain => {
                    pass.bind_render_pipeline(*vertices)?;
                    pass.draw_indirect_count(&draws)
                }
                Kind::Indexed => {
                    pass.bind_render_pipeline(*vertices)?;
                    pass.bind_index_buffer(*indices, 0, IndexFormat::U32)?;
                    pass.draw_indexed_indirect_count(&draws)
                }
                Kind::Mesh => {
                    pass.bind_render_pipeline(**meshes.as_ref().unwrap())?;
                    pass.draw_mesh_tasks_indirect_count(&draws)
                }
            });
            let found = pixels::<f32>(&ctx, *drawn);
            let expected: Vec<f32> =
                (0..8).map(|x| f32::from(u8::from(x % 2 == 0 && x / 2 < max_draws.min(3)))).collect();
            assert_eq!(found, expected, "{max_draws}");
        }
    }
}

/// The pass must declare a count that the same command buffer wrote; its error says so.
#[test]
fn a_number_written_in_the_same_command_buffer_is_declared() {
    let Some(ctx) = device().filter(|ctx| has(ctx, OptionalFeature::DrawIndirectCount)) else { return };
    let color = [Format::R32Float.into()];
    let stages = [(ShaderStage::Vertex, VERTEX), (ShaderStage::Fragment, FRAGMENT)];
    let desc = RenderPipelineDesc { color: &color, ..Default::default() };
    let pipeline = staged_pipeline(&ctx, &stages, &desc).unwrap();
    let words: Vec<u32> = (0..5).flat_map(|draw| [3, 1, 0, draw]).collect();
    let arguments = buffer(&ctx, BufferUsage::INDIRECT, &words);
    let drawn = target(&ctx, Format::R32Float, [8, 1]);
    let color = [ColorAttachment::clear(*drawn, [0.0; 4])];
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    let count = count_written_by_a_dispatch(&ctx, &mut cmd);
    let draws = IndirectCount {
        arguments: *arguments,
        offset: 0,
        stride: 16,
        count: *count,
        count_offset: 4,
        max_draws: 5,
    };
    let mut pass = cmd.begin_rendering(&RenderPassDesc { color: &color, ..Default::default() }).unwrap();
    pass.bind_render_pipeline(*pipeline).unwrap();
    usage_error(pass.draw_indirect_count(&draws), "list it in the pass's dependencies");
    drop(pass);
    let dependencies = Dependencies { read_buffers: &[*count], ..Default::default() };
    let desc = RenderPassDesc { color: &color, dependencies, ..Default::default() };
    let mut pass = cmd.begin_rendering(&desc).unwrap();
    usage_error(pass.draw_indirect_count(&draws), "bind a render pipeline first");
    pass.bind_render_pipeline(*pipeline).unwrap();
    for (wrong, words) in [
        (IndirectCount { count_offset: 2, ..draws }, "multiple of 4"),
        (IndirectCount { count_offset: 8, ..draws }, "arguments"),
        (IndirectCount { stride: 12, ..draws }, "at least 16"),
        (IndirectCount { max_draws: 6, ..draws }, "arguments"),
    ] {
        usage_error(pass.draw_indirect_count(&wrong), words);
    }
    let too_many = IndirectCount { max_draws: u32::MAX, ..draws };
    match pass.draw_indirect_count(&too_many) {
        Err(Error::LimitExceeded { .. } | Error::InvalidUsage { .. }) => {}
        other => unreachable!("{other:?}"),
    }
    usage_error(pass.draw_indexed_indirect_count(&draws), "bind an index buffer");
    usage_error(pass.draw_mesh_tasks_indirect_count(&draws), "mesh shader");
    pass.draw_indirect_count(&draws).unwrap();
    drop(pass);
    ctx.submit(cmd).unwrap();
    assert_eq!(pixels::<f32>(&ctx, *drawn), [1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let profile = DeviceProfile::core_only();
    let Some(bare) = device_with(|desc| desc.profile = Some(&profile)) else { return };
    let color = [Format::R32Float.into()];
    let desc = RenderPipelineDesc { color: &color, ..Default::default() };
    let pipeline = staged_pipeline(&bare, &stages, &desc).unwrap();
    let (arguments, count) =
        (buffer(&bare, BufferUsage::INDIRECT, &words), buffer(&bare, BufferUsage::INDIRECT, &[1]));
    let drawn = target(&bare, Format::R32Float, [1, 1]);
    let color = [ColorAttachment::clear(*drawn, [0.0; 4])];
    run_pass(&bare, &RenderPassDesc { color: &color, ..Default::default() }, |pass| {
        pass.bind_render_pipeline(*pipeline)?;
        let draws = IndirectCount { arguments: *arguments, count: *count, count_offset: 0, ..draws };
        unsupported(pass.draw_indirect_count(&draws), "drawIndirectCount");
        Ok(())
    });
}

/// Thirty-two compute and eight graphics pipelines, told apart by a constant, one of them wrong.
#[test]
fn pipelines_made_at_once_are_those_made_one_by_one() {
    let Some(ctx) = device() else { return };
    let text = "
        layout(local_size_x = 1) in;
        layout(constant_id = 0) const uint number = 0;
        layout(buffer_reference, scalar) buffer Words { uint at[]; };
        layout(push_constant, scalar) uniform Push { Words words; };
        void main() { words.at[number] = number * number + 1; }";
    let compute = module(&ctx, ShaderStage::Compute, text);
    let constants: Vec<[SpecializationConstant; 1]> = (0..32)
        .map(|number| [SpecializationConstant { id: 0, value: SpecializationValue::U32(number) }])
        .collect();
    let descs: Vec<_> = constants
        .iter()
        .enumerate()
        .map(|(number, specialization)| ComputePipelineDesc {
            module: (number != 7).then_some(*compute),
            specialization,
            debug_name: "one of many",
            ..Default::default()
        })
        .collect();
    let made = ctx.create_compute_pipelines(&descs);
    assert_eq!(made.len(), 32);
    let words = words_buffer(&ctx, &[0; 32]);
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    for (number, pipeline) in made.into_iter().enumerate() {
        if number == 7 {
            usage_error(pipeline, "give the pipeline a compute shader");
            continue;
        }
        cmd.bind_compute_pipeline(*pipeline.unwrap()).unwrap();
        cmd.push_constants(&ctx.buffer_address(*words).unwrap()).unwrap();
        cmd.dispatch([1; 3], &Dependencies { buffers: &[*words], ..Default::default() }).unwrap();
    }
    ctx.submit(cmd).unwrap();
    let expected: Vec<u32> = (0..32).map(|n| if n == 7 { 0 } else { n * n + 1 }).collect();
    assert_eq!(read_words(&ctx, *words, 32), expected);

    let fragment = "
        layout(constant_id = 0) const uint number = 0;
        layout(location = 0) out vec4 result;
        void main() { result = vec4(number); }";
    let vertex = module(&ctx, ShaderStage::Vertex, VERTEX);
    let fragment = module(&ctx, ShaderStage::Fragment, fragment);
    let color = [Format::R32Float.into()];
    let descs: Vec<_> = constants[1..9]
        .iter()
        .map(|specialization| RenderPipelineDesc {
            vertex: Some(*vertex),
            fragment: Some(*fragment),
            color: &color,
            specialization,
            ..Default::default()
        })
        .collect();
    let drawn = target(&ctx, Format::R32Float, [8, 1]);
    let color = [ColorAttachment::clear(*drawn, [0.0; 4])];
    let made: Vec<_> = ctx.create_render_pipelines(&descs).into_iter().map(Result::unwrap).collect();
    run_pass(&ctx, &RenderPassDesc { color: &color, ..Default::default() }, |pass| {
        for (number, pipeline) in (0..).zip(&made) {
            pass.bind_render_pipeline(**pipeline)?;
            pass.draw(0..3, number..number + 1)?;
        }
        Ok(())
    });
    let expected: Vec<f32> = (1..9).map(|number| number as f32).collect();
    assert_eq!(pixels::<f32>(&ctx, *drawn), expected);
    assert!(ctx.create_render_pipelines(&[]).is_empty());
}
