//! Graphics pipelines linked from parts: the same pixels with and without the extension, and parts that are shared.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::time::{Duration, Instant};

use lvk::test_hooks::graphics_part_count;
use lvk::{
    Blend, BufferDesc, BufferUsage, ColorAttachment, ColorTarget, CompareOp, Context, CullMode,
    DepthAttachment, DepthBias, DepthTest, DeviceProfile, FeatureSet, Format, Holder, OptionalFeature,
    RenderPassDesc, RenderPipelineDesc, RenderPipelineHandle, ShaderStage, SpecializationConstant,
    SpecializationValue, StencilFace, StencilOp, StencilTest, Topology, VertexAttribute, VertexBinding,
    VertexFormat,
};
use lvk_tests::compute::module;
use lvk_tests::raster::{COVER, PAINT, has, paint, pixels, run_pass, staged_pipeline, target};
use lvk_tests::{TestDevice, device, without_software};

const SIZE: [u32; 2] = [16, 16];
const DEPTH: Format = Format::D32FloatS8;

/// Scales its colour by a constant.
const SCALED: &str = "
    layout(push_constant, scalar) uniform Push { vec4 color; float depth; };
    layout(constant_id = 4) const float scale = 1.0;
    layout(location = 0) out vec4 result;
    void main() { result = color * scale; }";

const TRIANGLE: &str = "
    layout(push_constant, scalar) uniform Push { vec4 color; float depth; };
    layout(location = 0) in vec2 corner;
    void main() { gl_Position = vec4(corner, depth, 1.0); }";

/// Draws each patch at half its size.
const CONTROL: &str = "
    layout(vertices = 3) out;
    void main() {
        gl_out[gl_InvocationID].gl_Position = gl_in[gl_InvocationID].gl_Position;
        if (gl_InvocationID == 0) {
            gl_TessLevelInner[0] = 2.0;
            for (int i = 0; i < 3; ++i) gl_TessLevelOuter[i] = 2.0;
        }
    }";
const EVALUATION: &str = "
    layout(triangles) in;
    void main() {
        vec4 p = gl_TessCoord.x * gl_in[0].gl_Position + gl_TessCoord.y * gl_in[1].gl_Position
            + gl_TessCoord.z * gl_in[2].gl_Position;
        gl_Position = vec4(p.xy * 0.5, p.zw);
    }";

/// A device without the extension.
fn whole_device() -> Option<TestDevice> {
    let hidden = FeatureSet::NONE.with(OptionalFeature::GraphicsPipelineLibrary);
    let profile = DeviceProfile { name: "whole".into(), hidden, ..DeviceProfile::default() };
    without_software(|desc| desc.profile = Some(&profile))
}

/// Draws twice into one target, with a depth and stencil target that the pipeline may test. Returns the texels.
fn drawn(ctx: &Context, pipeline: RenderPipelineHandle, depth: bool) -> Vec<[u8; 4]> {
    let color = target(ctx, Format::Rgba8Unorm, SIZE);
    let tested = target(ctx, DEPTH, SIZE);
    let corners = [[-0.9_f32, -0.8], [0.7, -0.6], [0.1, 0.9]];
    let (usage, data) = (BufferUsage::VERTEX, Some(bytemuck::cast_slice(&corners)));
    let vertices = ctx.create_buffer(&BufferDesc { usage, data, ..Default::default() }).unwrap();
    let pass = RenderPassDesc {
        color: &[ColorAttachment::clear(*color, [0.25, 0.5, 0.0, 1.0])],
        depth: depth.then(|| DepthAttachment::clear(*tested, 0.5)),
        ..Default::default()
    };
    run_pass(ctx, &pass, |pass| {
        pass.bind_render_pipeline(pipeline)?;
        pass.bind_vertex_buffer(0, *vertices, 0)?;
        paint(pass, [0.2, 0.4, 0.6, 0.5], 0.4)?;
        paint(pass, [0.9, 0.1, 0.3, 0.25], 0.6)
    });
    pixels(ctx, *color)
}

/// Calls `check` with stages and descriptions that exercise each part.
fn for_each_case(
    ctx: &Context,
    mut check: impl FnMut(&str, &[(ShaderStage, &str)], &RenderPipelineDesc<'_>),
) {
    use ShaderStage::{Fragment, TessControl, TessEval, Vertex};
    let plain = [ColorTarget::new(Format::Rgba8Unorm)];
    let blended = [ColorTarget::blended(Format::Rgba8Unorm, Blend::ALPHA)];
    let depth = DepthTest { format: DEPTH, compare: CompareOp::Less, write: true };
    let face =
        StencilFace { pass: StencilOp::IncrementWrap, compare: CompareOp::Equal, ..Default::default() };
    let half = [SpecializationConstant { id: 4, value: SpecializationValue::F32(0.5) }];
    let bindings = [VertexBinding { stride: 8, per_instance: false }];
    let attributes = [VertexAttribute { format: VertexFormat::F32x2, ..Default::default() }];
    let base = RenderPipelineDesc { color: &plain, debug_name: "case", ..Default::default() };
    let input = RenderPipelineDesc { vertex_bindings: &bindings, vertex_attributes: &attributes, ..base };
    let cover = [(Vertex, COVER), (Fragment, PAINT)];
    let triangle = [(Vertex, TRIANGLE), (Fragment, PAINT)];
    check("plain", &cover, &base);
    check("vertices", &triangle, &input);
    check("culled", &triangle, &RenderPipelineDesc { cull: CullMode::Back, ..input });
    check("lines", &triangle, &RenderPipelineDesc { topology: Topology::LineStrip, ..input });
    check("blended", &cover, &RenderPipelineDesc { color: &blended, ..base });
    check(
        "constant",
        &[(Vertex, COVER), (Fragment, SCALED)],
        &RenderPipelineDesc { specialization: &half, ..base },
    );
    check("no output", &[(Vertex, COVER), (Fragment, "void main() {}")], &base);
    check("depth", &cover, &RenderPipelineDesc { depth: Some(depth), ..base });
    let biased = DepthBias { constant: 1e6, ..Default::default() };
    check("bias", &cover, &RenderPipelineDesc { depth: Some(depth), depth_bias: Some(biased), ..base });
    let stencil = Some(StencilTest::both(face));
    check("stencil", &cover, &RenderPipelineDesc { depth: Some(depth), stencil, color: &blended, ..base });
    if has(ctx, OptionalFeature::TessellationShader) {
        let stages = [(Vertex, TRIANGLE), (TessControl, CONTROL), (TessEval, EVALUATION), (Fragment, PAINT)];
        check("patches", &stages, &RenderPipelineDesc { topology: Topology::Patches { points: 3 }, ..input });
    }
}

#[test]
fn linked_pipelines_draw_what_whole_ones_draw() {
    let Some(ctx) = device() else { return };
    let Some(whole_only) = whole_device() else { return };
    assert!(!whole_only.capabilities().has(OptionalFeature::GraphicsPipelineLibrary));
    let linked = has(&ctx, OptionalFeature::GraphicsPipelineLibrary);
    let mut images = Vec::new();
    for_each_case(&ctx, |name, stages, desc| {
        let depth = desc.depth.is_some();
        let whole = staged_pipeline(&ctx, stages, desc).unwrap();
        let expected = drawn(&ctx, *whole, depth);
        let desc = RenderPipelineDesc { fast_link: true, ..*desc };
        let before = graphics_part_count(&ctx);
        let fast = staged_pipeline(&ctx, stages, &desc).unwrap();
        assert_eq!(graphics_part_count(&ctx) > before, linked, "{name}");
        assert!(drawn(&ctx, *fast, depth) == expected, "{name}: linked");
        let fallback = staged_pipeline(&whole_only, stages, &desc).unwrap();
        assert_eq!(graphics_part_count(&whole_only), 0);
        assert!(drawn(&whole_only, *fallback, depth) == expected, "{name}: without the extension");
        images.push(expected);
    });
    images.sort_unstable();
    images.dedup();
    assert!(images.len() >= 8, "the cases differ: {}", images.len());
}

#[test]
fn pipelines_share_parts_as_long_as_one_of_them_lives() {
    let Some(ctx) = device() else { return };
    if !has(&ctx, OptionalFeature::GraphicsPipelineLibrary) {
        return;
    }
    let vertex = module(&ctx, ShaderStage::Vertex, COVER);
    let fragment = module(&ctx, ShaderStage::Fragment, PAINT);
    let plain = [ColorTarget::new(Format::Rgba8Unorm)];
    let blended = [ColorTarget::blended(Format::Rgba8Unorm, Blend::ALPHA)];
    let desc = RenderPipelineDesc {
        vertex: Some(*vertex),
        fragment: Some(*fragment),
        color: &plain,
        fast_link: true,
        ..Default::default()
    };
    let create = |desc: &RenderPipelineDesc<'_>| ctx.create_render_pipeline(desc).unwrap();
    let first = create(&desc);
    assert_eq!(graphics_part_count(&ctx), 4);
    let same = create(&RenderPipelineDesc { debug_name: "same", ..desc });
    assert_eq!(graphics_part_count(&ctx), 4);
    let other = create(&RenderPipelineDesc { color: &blended, ..desc });
    assert_eq!(graphics_part_count(&ctx), 5, "only the output differs");
    let background =
        ctx.create_render_pipeline_in_background(&RenderPipelineDesc { cull: CullMode::Back, ..desc });
    let background = background.unwrap().wait().unwrap();
    assert_eq!(graphics_part_count(&ctx), 6, "only the rasterisation differs");
    drop((first, same));
    ctx.wait_idle().unwrap();
    assert_eq!(graphics_part_count(&ctx), 6, "the others hold them");
    drop((other, background));
    ctx.wait_idle().unwrap();
    drop(create(&RenderPipelineDesc { fast_link: false, ..desc }));
    ctx.wait_idle().unwrap();
    assert_eq!(graphics_part_count(&ctx), 0);
}

#[test]
fn wrong_constants_are_refused_as_in_whole_pipelines() {
    let Some(ctx) = device() else { return };
    let color = [ColorTarget::new(Format::Rgba8Unorm)];
    let constants = [SpecializationConstant { id: 77, value: SpecializationValue::U32(1) }];
    let desc = RenderPipelineDesc {
        color: &color,
        specialization: &constants,
        fast_link: true,
        debug_name: "odd",
        ..Default::default()
    };
    let stages = [(ShaderStage::Vertex, COVER), (ShaderStage::Fragment, PAINT)];
    let error = staged_pipeline(&ctx, &stages, &desc).unwrap_err().to_string();
    assert!(error.contains("odd") && error.contains("77"), "{error}");
}

/// Prints what creation costs by either way: eight vertex shaders by eight fragment shaders.
#[test]
#[ignore = "a measurement"]
fn time_of_whole_and_of_linked_pipelines() {
    let Some(ctx) = device() else { return };
    for fast_link in [false, true, false, true] {
        let shader = |stage, index: u32| {
            let mut text = if stage == ShaderStage::Vertex { COVER } else { PAINT }.to_owned();
            let work =
                format!("float work = {index}.5; for (int i = 0; i < 9; ++i) work = sin(work + float(i));");
            text = text.replace("void main() {", &format!("void main() {{ {work}"));
            text = text.replace("result = color", "result = color * work");
            text = text.replace("depth, 1.0)", "depth + work * 0.001, 1.0)");
            module(&ctx, stage, &text)
        };
        let vertices: Vec<_> = (0..8).map(|index| shader(ShaderStage::Vertex, index)).collect();
        let fragments: Vec<_> = (0..8).map(|index| shader(ShaderStage::Fragment, index)).collect();
        let color = [ColorTarget::new(Format::Rgba8Unorm)];
        let mut times = Vec::new();
        let mut pipelines: Vec<Holder<RenderPipelineHandle>> = Vec::new();
        for (vertex, fragment) in vertices.iter().flat_map(|v| fragments.iter().map(move |f| (v, f))) {
            let (vertex, fragment) = (Some(**vertex), Some(**fragment));
            let desc =
                RenderPipelineDesc { vertex, fragment, color: &color, fast_link, ..Default::default() };
            let start = Instant::now();
            pipelines.push(ctx.create_render_pipeline(&desc).unwrap());
            times.push(start.elapsed());
        }
        let total: Duration = times.iter().sum();
        let draws = Instant::now();
        drawn(&ctx, *pipelines[9], false);
        eprintln!(
            "{}: linked {fast_link}: 64 pipelines {:.2} ms, first {:.2} ms, median of the last 49 {:.3} ms, first draw {:.2} ms",
            ctx.capabilities().device_name,
            total.as_secs_f64() * 1e3,
            times[0].as_secs_f64() * 1e3,
            {
                let mut last = times[15..].to_vec();
                last.sort_unstable();
                last[last.len() / 2].as_secs_f64() * 1e3
            },
            draws.elapsed().as_secs_f64() * 1e3,
        );
    }
}
