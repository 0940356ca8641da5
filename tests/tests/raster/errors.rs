//! Calls that a render pass refuses: wrong targets, missing bindings, areas outside of the targets. A refused call
//! records nothing.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::ops::Range;

use lvk::{
    BufferDesc, BufferUsage, ColorAttachment, ColorLoadOp, ColorTarget, CompareOp, Context, Dependencies,
    DepthAttachment, DepthLoadOp, DepthTest, Error, Format, IndexFormat, RenderPass, RenderPassDesc,
    RenderPipelineDesc, ShaderStage, TextureDesc, TextureUsage, VertexAttribute, VertexBinding, VertexFormat,
};
use lvk_tests::compute::module;
use lvk_tests::device;
use lvk_tests::raster::{COVER, PAINT, pixels, render_pipeline, staged_pipeline, target};

fn usage_error(result: lvk::Result<()>, words: &str) {
    match result {
        Err(Error::InvalidUsage { object, message }) => {
            let text = format!("{object}: {message}");
            assert!(text.contains(words), "'{text}' does not say '{words}'");
        }
        other => unreachable!("expected an error that says '{words}', not {other:?}"),
    }
}

#[test]
fn passes_with_unfit_targets_are_refused() {
    let Some(ctx) = device() else { return };
    let color = target(&ctx, Format::Rgba8Unorm, [4, 4]);
    let small = target(&ctx, Format::Rgba8Unorm, [2, 2]);
    let ids = target(&ctx, Format::R32Uint, [4, 4]);
    let depth = target(&ctx, Format::D32Float, [4, 4]);
    let sampled = ctx.create_texture(&TextureDesc { extent: [4, 4], ..Default::default() }).unwrap();
    let attach =
        |texture, load| ColorAttachment { texture, mip: 0, layer: 0, load, store: true, resolve: None };
    let clear = |texture| ColorAttachment::clear(texture, [0.0; 4]);
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    let mut begin = |color: &[ColorAttachment], depth: Option<DepthAttachment>, words: &str| {
        let desc = RenderPassDesc { color, depth, ..Default::default() };
        usage_error(cmd.begin_rendering(&desc).map(drop), words);
    };
    begin(&[], None, "a colour or a depth target");
    begin(&[clear(*color), clear(*small)], None, "[2, 2]");
    begin(&[clear(*color)], Some(DepthAttachment::clear(*color, 1.0)), "depth format");
    begin(&[clear(*depth)], None, "depth format");
    begin(&[clear(*ids)], None, "ClearUint");
    begin(&[attach(*color, ColorLoadOp::ClearUint([0; 4]))], None, "ColorLoadOp::Clear");
    begin(&[clear(*sampled)], None, "TARGET");
    begin(&[ColorAttachment { mip: 1, ..clear(*color) }], None, "mip 1");
    begin(&[ColorAttachment { layer: 1, ..clear(*color) }], None, "layer 1");
    begin(&[clear(*color), clear(*color)], None, "twice");
    begin(&[], Some(DepthAttachment::clear(*depth, 1.5)), "1.5");
    begin(
        &[],
        Some(DepthAttachment { load: DepthLoadOp::Clear(f32::NAN), ..DepthAttachment::clear(*depth, 0.0) }),
        "NaN",
    );
    let reads = Dependencies { sampled_images: &[*color], ..Default::default() };
    let feedback = RenderPassDesc { color: &[clear(*color)], dependencies: reads, ..Default::default() };
    usage_error(cmd.begin_rendering(&feedback).map(drop), "two ways");
    let many = vec![clear(*color); ctx.capabilities().limits.max_color_targets as usize + 1];
    let many = RenderPassDesc { color: &many, ..Default::default() };
    assert!(matches!(cmd.begin_rendering(&many), Err(Error::LimitExceeded { .. })));
    // The command buffer is as good as new.
    let good = [ColorAttachment::clear(*color, [1.0; 4])];
    drop(cmd.begin_rendering(&RenderPassDesc { color: &good, ..Default::default() }).unwrap());
    ctx.submit(cmd).unwrap();
    assert_eq!(pixels::<[u8; 4]>(&ctx, *color), [[255; 4]; 16]);
}

#[test]
fn pipelines_must_have_the_formats_of_the_pass() {
    let Some(ctx) = device() else { return };
    let depth_test = Some(DepthTest { format: Format::D32Float, compare: CompareOp::Less, write: true });
    let make = |formats: &[Format], depth| {
        let color: Vec<ColorTarget> = formats.iter().map(|format| (*format).into()).collect();
        let desc = RenderPipelineDesc { color: &color, depth, debug_name: "odd one", ..Default::default() };
        render_pipeline(&ctx, COVER, PAINT, &desc)
    };
    let wrong = [
        make(&[Format::Bgra8Unorm], None),
        make(&[Format::Rgba8Unorm, Format::Rgba8Unorm], None),
        make(&[], depth_test),
        make(&[Format::Rgba8Unorm], depth_test),
    ];
    let color = target(&ctx, Format::Rgba8Unorm, [4, 4]);
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    let color = [ColorAttachment::clear(*color, [0.0; 4])];
    let mut pass = cmd.begin_rendering(&RenderPassDesc { color: &color, ..Default::default() }).unwrap();
    for pipeline in &wrong {
        usage_error(pass.bind_render_pipeline(**pipeline), "odd one: it draws to");
    }
    usage_error(pass.draw(0..3, 0..1), "bind a render pipeline first");
}

#[test]
fn draws_without_their_inputs_are_refused() {
    let Some(ctx) = device() else { return };
    let vertex = "
        layout(push_constant, scalar) uniform Push { vec4 color; float depth; };
        layout(location = 0) in vec2 a;
        layout(location = 1) in vec2 b;
        void main() { gl_Position = vec4(a + b, depth, 1); }";
    let attribute =
        |binding| VertexAttribute { location: binding, binding, format: VertexFormat::F32x2, offset: 0 };
    let desc = RenderPipelineDesc {
        vertex_bindings: &[VertexBinding { stride: 8, per_instance: false }; 2],
        vertex_attributes: &[attribute(0), attribute(1)],
        color: &[Format::Rgba8Unorm.into()],
        debug_name: "two buffers",
        ..Default::default()
    };
    let pipeline = render_pipeline(&ctx, vertex, PAINT, &desc);
    let with =
        |usage| ctx.create_buffer(&BufferDesc { size_bytes: 64, usage, ..Default::default() }).unwrap();
    let (vertices, indices, plain) =
        (with(BufferUsage::VERTEX), with(BufferUsage::INDEX), with(BufferUsage::STORAGE));
    let arguments = with(BufferUsage::INDIRECT);
    let target = target(&ctx, Format::Rgba8Unorm, [4, 4]);
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    let color = [ColorAttachment::clear(*target, [0.0; 4])];
    let mut pass = cmd.begin_rendering(&RenderPassDesc { color: &color, ..Default::default() }).unwrap();
    usage_error(pass.push_constants(&[0.0_f32; 5]), "bind a pipeline first");
    pass.bind_render_pipeline(*pipeline).unwrap();
    usage_error(pass.draw(0..3, 0..1), "two buffers: it reads 2 vertex buffers");
    usage_error(pass.bind_vertex_buffer(0, *plain, 0), "VERTEX");
    usage_error(pass.bind_vertex_buffer(0, *vertices, 64), "outside");
    usage_error(pass.bind_vertex_buffer(0, *vertices, 2), "no multiple of 4");
    usage_error(pass.bind_vertex_buffer(16, *vertices, 0), "vertex slot 16");
    usage_error(pass.bind_vertex_buffer(u32::MAX, *vertices, 0), "vertex slot");
    pass.bind_vertex_buffer(1, *vertices, 0).unwrap();
    usage_error(pass.draw(0..3, 0..1), "2 vertex buffers");
    pass.bind_vertex_buffer(0, *vertices, 0).unwrap();
    usage_error(pass.draw(0..3, 0..1), "20 bytes of push constants, but 0 were pushed");
    pass.push_constants(&[0.0_f32; 5]).unwrap();
    usage_error(pass.draw_indexed(0..3, 0, 0..1), "bind an index buffer first");
    usage_error(pass.draw_indexed_indirect(*arguments, 0, 1, 20), "bind an index buffer first");
    usage_error(pass.bind_index_buffer(*vertices, 0, IndexFormat::U16), "INDEX");
    usage_error(pass.bind_index_buffer(*indices, 3, IndexFormat::U16), "multiple of 2");
    usage_error(pass.bind_index_buffer(*indices, 64, IndexFormat::U16), "outside");
    pass.bind_index_buffer(*indices, 4, IndexFormat::U32).unwrap();
    usage_error(pass.draw_indexed(0..16, 0, 0..1), "15 are bound");
    usage_error(pass.draw_indexed(0..u32::MAX, 0, 0..1), "15 are bound");
    usage_error(pass.draw_indirect(*plain, 0, 1, 16), "INDIRECT");
    usage_error(pass.draw_indirect(*arguments, 2, 1, 16), "multiple of 4");
    usage_error(pass.draw_indirect(*arguments, 0, 1, 12), "stride 12");
    usage_error(pass.draw_indirect(*arguments, 0, 2, 18), "stride 18");
    usage_error(pass.draw_indirect(*arguments, 0, 5, 16), "outside");
    usage_error(pass.draw_indirect(*arguments, 0, u32::MAX, u32::MAX - 3), "outside");
    usage_error(pass.draw_indexed_indirect(*arguments, 48, 1, 20), "outside");
    pass.draw(0..3, 0..1).unwrap();
    pass.draw_indexed(0..15, 0, 0..1).unwrap();
    drop(pass);
    ctx.submit(cmd).unwrap();
}

/// Calls `test` with an open pass on a target of 4 x 4 pixels. Nothing of it is submitted.
fn in_small_pass(test: impl FnOnce(&mut RenderPass<'_>)) {
    let Some(ctx) = device() else { return };
    let target = target(&ctx, Format::Rgba8Unorm, [4, 4]);
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    let color = [ColorAttachment::clear(*target, [0.0; 4])];
    test(&mut cmd.begin_rendering(&RenderPassDesc { color: &color, ..Default::default() }).unwrap());
}

#[test]
fn viewports_and_scissors_outside_are_refused() {
    in_small_pass(|pass| {
        for rectangle in
            [[0.0, 0.0, f32::NAN, 1.0], [0.0, f32::INFINITY, 1.0, 1.0], [0.0; 4], [0.0, 0.0, -1.0, 1.0]]
        {
            usage_error(pass.viewport(rectangle, [0.0, 1.0]), "viewport");
        }
        for depth in [[-0.1, 1.0], [0.0, 1.1], [f32::NAN, 1.0]] {
            usage_error(pass.viewport([0.0, 0.0, 4.0, 4.0], depth), "depths");
        }
        for (offset, extent) in [([0, 0], [5, 4]), ([4, 0], [1, 1]), ([u32::MAX, 0], [2, 1])] {
            usage_error(pass.scissor(offset, extent), "scissor");
        }
        pass.scissor([4, 4], [0, 0]).unwrap();
    });
}

/// Limits of Vulkan that a viewport must keep too, whatever the target.
#[test]
fn viewports_beyond_the_device_are_refused() {
    in_small_pass(|pass| {
        for rectangle in
            [[0.0, 0.0, 1.0e9, 4.0], [-1.0e9, 0.0, 4.0, 4.0], [0.0, 1.0e9, 4.0, -4.0], [0.0, 0.0, 4.0, 1.0e9]]
        {
            usage_error(pass.viewport(rectangle, [0.0, 1.0]), "viewport");
        }
    });
}

#[test]
fn unfit_pipelines_are_refused() {
    let Some(ctx) = device() else { return };
    let vertex = module(&ctx, ShaderStage::Vertex, "void main() { gl_Position = vec4(0, 0, 0, 1); }");
    let fragment = module(&ctx, ShaderStage::Fragment, "void main() {}");
    let make = |desc: RenderPipelineDesc<'_>| {
        let vertex = desc.vertex.or(Some(*vertex));
        ctx.create_render_pipeline(&RenderPipelineDesc { vertex, debug_name: "odd one", ..desc }).map(drop)
    };
    let none = RenderPipelineDesc { debug_name: "odd one", ..Default::default() };
    usage_error(ctx.create_render_pipeline(&none).map(drop), "odd one: give the pipeline a vertex shader");
    usage_error(
        make(RenderPipelineDesc { vertex: Some(*fragment), ..Default::default() }),
        "a Vertex module",
    );
    usage_error(
        make(RenderPipelineDesc { fragment: Some(*vertex), ..Default::default() }),
        "a Fragment module",
    );
    let attribute = VertexAttribute { location: 0, binding: 0, format: VertexFormat::F32x3, offset: 4 };
    let one = [attribute];
    usage_error(make(RenderPipelineDesc { vertex_attributes: &one, ..Default::default() }), "does not exist");
    let tight = [VertexBinding { stride: 12, per_instance: false }];
    let desc = RenderPipelineDesc { vertex_attributes: &one, vertex_bindings: &tight, ..Default::default() };
    usage_error(make(desc), "beyond the stride");
    let unsupported = [
        RenderPipelineDesc { color: &[Format::D32Float.into()], ..Default::default() },
        RenderPipelineDesc {
            depth: Some(DepthTest { format: Format::Rgba8Unorm, compare: CompareOp::Less, write: true }),
            ..Default::default()
        },
    ];
    for desc in unsupported {
        assert!(matches!(make(desc), Err(Error::Unsupported { .. })));
    }
    let many = vec![ColorTarget::from(Format::Rgba8Unorm); 9];
    let wide = [VertexBinding { stride: 1 << 20, per_instance: false }];
    let far = [VertexAttribute { location: 99, offset: 0, ..attribute }];
    let over = [
        RenderPipelineDesc { color: &many, ..Default::default() },
        RenderPipelineDesc { vertex_bindings: &wide, ..Default::default() },
        RenderPipelineDesc { vertex_bindings: &tight, vertex_attributes: &far, ..Default::default() },
    ];
    for desc in over {
        assert!(matches!(make(desc), Err(Error::LimitExceeded { .. })));
    }
}

/// Every location that the shader reads must be an attribute, and no location may be one twice.
#[test]
fn shaders_get_every_attribute_they_read() {
    let Some(ctx) = device() else { return };
    let vertex = "layout(location = 2) in vec2 a; void main() { gl_Position = vec4(a, 0, 1); }";
    let vertex = module(&ctx, ShaderStage::Vertex, vertex);
    let attribute = VertexAttribute { location: 2, binding: 0, format: VertexFormat::F32x2, offset: 0 };
    let bindings = [VertexBinding { stride: 8, per_instance: false }];
    for attributes in [[].as_slice(), &[attribute, attribute]] {
        let desc = RenderPipelineDesc {
            vertex: Some(*vertex),
            vertex_bindings: &bindings,
            vertex_attributes: attributes,
            depth: Some(DepthTest { format: Format::D32Float, compare: CompareOp::Less, write: true }),
            ..Default::default()
        };
        let made = ctx.create_render_pipeline(&desc).map(drop);
        assert!(matches!(made, Err(Error::InvalidUsage { .. })), "{attributes:?}: {made:?}");
    }
}

/// An output that does not match the input of the next stage is an error that names both; a wider one is not.
#[test]
fn stages_must_pass_on_what_the_next_stage_reads() {
    let Some(ctx) = device() else { return };
    let color = [Format::Rgba32Float.into()];
    let create = |outputs: &str, inputs: &str| {
        let vertex = format!("{outputs} void main() {{ gl_Position = vec4(0); a = TYPE(1); }}");
        let kind = outputs.split_whitespace().rev().nth(1).unwrap();
        let fragment =
            format!("{inputs} layout(location = 0) out vec4 result; void main() {{ result = vec4(a.x); }}");
        let stages =
            [(ShaderStage::Vertex, &*vertex.replace("TYPE", kind)), (ShaderStage::Fragment, &*fragment)];
        let desc = RenderPipelineDesc { color: &color, debug_name: "surface", ..Default::default() };
        staged_pipeline(&ctx, &stages, &desc).map(drop)
    };
    let vec3 = "layout(location = 1) in vec3 a;";
    create("layout(location = 1) out vec3 a;", vec3).unwrap();
    create("layout(location = 1) out vec4 a;", vec3).unwrap();
    // Two outputs are the words of one input.
    let halves = "layout(location = 1, component = 2) out vec2 b; layout(location = 1) out vec2 a;";
    create(halves, "layout(location = 1) in vec4 a;").unwrap();
    let start = "surface: fragment shader 'test shader' reads 3 32-bit floats at location 1, component 0 ('a'), but \
                 vertex shader 'test shader' before it";
    for (outputs, words) in [
        ("layout(location = 1) out vec2 a;", "has 2 32-bit floats at location 1, component 0"),
        ("layout(location = 1) flat out ivec3 a;", "has 3 32-bit integers at location 1, component 0"),
        ("layout(location = 2) out vec3 a;", "writes nothing there"),
    ] {
        usage_error(create(outputs, vec3), &format!("{start} {words}; declare the output like the input"));
    }
}

#[test]
fn usages_of_targets_are_checked_by_format() {
    let Some(ctx) = device() else { return };
    let context: &Context = &ctx;
    let desc = TextureDesc { format: Format::D32Float, usage: TextureUsage::TARGET, ..Default::default() };
    let depth = context.create_texture(&desc).unwrap();
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    let color = [ColorAttachment::clear(*depth, [0.0; 4])];
    let desc = RenderPassDesc { color: &color, ..Default::default() };
    usage_error(cmd.begin_rendering(&desc).map(drop), "depth format");
}

/// Ranges that Rust takes for empty, in a pass that can draw.
#[test]
fn reversed_ranges_and_long_constants_are_refused() {
    let Some(ctx) = device() else { return };
    let desc =
        RenderPipelineDesc { color: &[Format::Rgba8Unorm.into()], debug_name: "plain", ..Default::default() };
    let pipeline = render_pipeline(&ctx, COVER, PAINT, &desc);
    let usage = BufferUsage::INDEX;
    let indices = ctx.create_buffer(&BufferDesc { size_bytes: 64, usage, ..Default::default() }).unwrap();
    let target = target(&ctx, Format::Rgba8Unorm, [4, 4]);
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    let color = [ColorAttachment::clear(*target, [0.0; 4])];
    let mut pass = cmd.begin_rendering(&RenderPassDesc { color: &color, ..Default::default() }).unwrap();
    pass.bind_render_pipeline(*pipeline).unwrap();
    match pass.push_constants(&[0.0_f32; 9]) {
        Err(Error::PushConstants { pipeline, expected: 20, size: 36, .. }) => assert_eq!(pipeline, "plain"),
        other => unreachable!("{other:?}"),
    }
    pass.push_constants(&[0.0_f32; 5]).unwrap();
    pass.bind_index_buffer(*indices, 0, IndexFormat::U32).unwrap();
    let (reversed, one) = (Range { start: 3, end: 0 }, 0..1);
    usage_error(
        pass.draw(reversed.clone(), one.clone()),
        "draw: the range 3..0 of vertices ends before it begins",
    );
    usage_error(pass.draw(0..3, reversed.clone()), "3..0 of instances");
    usage_error(pass.draw_indexed(reversed.clone(), 0, one), "draw_indexed: the range 3..0 of indices");
    usage_error(pass.draw_indexed(0..3, 0, reversed), "3..0 of instances");
    pass.draw(2..2, 0..1).unwrap();
    pass.draw_indexed(7..7, 0, 5..5).unwrap();
    drop(pass);
    ctx.submit(cmd).unwrap();
    assert_eq!(pixels::<[u8; 4]>(&ctx, *target), [[0; 4]; 16]);
}
