//! Layered targets and multiview: the layers that draws write, and the counts of queries and of the profiler.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk::{
    ColorAttachment, CompareOp, Context, DepthAttachment, DepthTest, DeviceProfile, Error, Format, Holder,
    OptionalFeature, QueryKind, QueryPoolDesc, RenderPassDesc, RenderPipelineDesc, ShaderStage, TextureDesc,
    TextureHandle, TextureKind, TextureRegion, TextureUsage,
};
use lvk_tests::raster::{COVER, PAINT, has, paint, run_pass, staged_pipeline, unsupported, usage_error};
use lvk_tests::{device, device_with};

/// As [`COVER`], for each instance into the layer of its number.
const BY_INSTANCE: &str = "
    #extension GL_ARB_shader_viewport_layer_array : require
    layout(push_constant, scalar) uniform Push { vec4 color; float depth; };
    void main() {
        gl_Layer = gl_InstanceIndex;
        gl_Position = vec4(vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1) * 4.0 - 1.0, depth, 1.0);
    }";

/// The layer's number and 10.
const NUMBER: &str = "
    layout(location = 0) out vec4 result;
    void main() { result = vec4(10 + gl_Layer); }";

fn texture(ctx: &Context, kind: TextureKind, format: Format, mips: u32) -> Holder<TextureHandle> {
    let desc = TextureDesc {
        kind,
        format,
        extent: [4, 4],
        mips,
        usage: TextureUsage::TARGET | TextureUsage::SAMPLED,
        debug_name: "layered",
        ..Default::default()
    };
    ctx.create_texture(&desc).unwrap()
}

/// The first texel of a layer, or of a slice.
fn texel(ctx: &Context, texture: TextureHandle, kind: TextureKind, mip: u32, layer: u32) -> f32 {
    let volume = matches!(kind, TextureKind::D3 { .. });
    let (layer, z) = if volume { (0, layer) } else { (layer, 0) };
    let region = TextureRegion { mip, layer, z, depth: u32::from(volume), ..Default::default() };
    let bytes = ctx.download_texture(texture, &region).unwrap();
    let texels: Vec<f32> = bytemuck::pod_collect_to_vec(&bytes);
    assert!(texels.iter().all(|value| value.to_bits() == texels[0].to_bits()), "{texels:?}");
    texels[0]
}

/// Arrays, cubes and volumes, from a layer and a mip that are not the first. Layers that no draw names are cleared, and
/// those outside of the pass stay.
#[test]
fn draws_choose_their_layer() {
    let Some(ctx) = device() else { return };
    if !has(&ctx, OptionalFeature::ShaderOutputLayer) || !has(&ctx, OptionalFeature::GeometryShader) {
        return;
    }
    let color = [Format::R32Float.into()];
    let stages = [(ShaderStage::Vertex, BY_INSTANCE), (ShaderStage::Fragment, NUMBER)];
    let desc = RenderPipelineDesc { color: &color, ..Default::default() };
    let pipeline = staged_pipeline(&ctx, &stages, &desc).unwrap();
    for (kind, count) in
        [(TextureKind::D2Array { layers: 5 }, 5), (TextureKind::Cube, 6), (TextureKind::D3 { depth: 8 }, 4)]
    {
        let drawn = texture(&ctx, kind, Format::R32Float, 2);
        for layer in 0..count {
            let color = [ColorAttachment { mip: 1, layer, ..ColorAttachment::clear(*drawn, [1.0; 4]) }];
            run_pass(&ctx, &RenderPassDesc { color: &color, ..Default::default() }, |_| Ok(()));
        }
        let color = [ColorAttachment { mip: 1, layer: 1, ..ColorAttachment::clear(*drawn, [2.0; 4]) }];
        run_pass(&ctx, &RenderPassDesc { color: &color, layers: 3, ..Default::default() }, |pass| {
            pass.bind_render_pipeline(*pipeline)?;
            pass.push_constants(&[0.0_f32; 5])?;
            pass.draw(0..3, 0..1)?;
            pass.draw(0..3, 2..3)
        });
        let found: Vec<f32> = (0..4).map(|layer| texel(&ctx, *drawn, kind, 1, layer)).collect();
        assert_eq!(found, [1.0, 10.0, 2.0, 12.0], "{kind:?}");
    }
}

/// Geometry shaders choose too; a depth target has as many layers.
#[test]
fn a_geometry_shader_fills_layers_with_depths_of_their_own() {
    let Some(ctx) = device().filter(|ctx| has(ctx, OptionalFeature::GeometryShader)) else { return };
    let geometry = "
        layout(triangles, invocations = 3) in;
        layout(triangle_strip, max_vertices = 3) out;
        void main() {
            for (int i = 0; i < 3; ++i) {
                gl_Layer = gl_InvocationID;
                gl_Position = gl_in[i].gl_Position;
                gl_Position.z += 0.25 * gl_InvocationID;
                EmitVertex();
            }
        }";
    let color = [Format::R32Float.into()];
    let depth = Some(DepthTest { format: Format::D32Float, compare: CompareOp::Less, write: true });
    let stages =
        [(ShaderStage::Vertex, COVER), (ShaderStage::Geometry, geometry), (ShaderStage::Fragment, NUMBER)];
    let desc = RenderPipelineDesc { color: &color, depth, ..Default::default() };
    let pipeline = staged_pipeline(&ctx, &stages, &desc).unwrap();
    let kind = TextureKind::D2Array { layers: 3 };
    let (drawn, tested) =
        (texture(&ctx, kind, Format::R32Float, 1), texture(&ctx, kind, Format::D32Float, 1));
    let color = [ColorAttachment::clear(*drawn, [0.0; 4])];
    let depth = Some(DepthAttachment::clear(*tested, 0.5));
    run_pass(&ctx, &RenderPassDesc { color: &color, depth, layers: 3, ..Default::default() }, |pass| {
        pass.bind_render_pipeline(*pipeline)?;
        paint(pass, [0.0; 4], 0.125)
    });
    let of = |texture: &Holder<TextureHandle>| -> Vec<f32> {
        (0..3).map(|layer| texel(&ctx, **texture, kind, 0, layer)).collect()
    };
    assert_eq!((of(&drawn), of(&tested)), (vec![10.0, 11.0, 0.0], vec![0.125, 0.375, 0.5]));
}

const BY_VIEW: &str = "
    #extension GL_EXT_multiview : require
    layout(push_constant, scalar) uniform Push { vec4 color; float depth; };
    layout(location = 0) out vec4 result;
    void main() { result = color + vec4(gl_ViewIndex); }";

/// Views 0 and 2: the layer between is left alone.
#[test]
fn each_view_is_drawn_to_its_layer() {
    let Some(ctx) = device().filter(|ctx| has(ctx, OptionalFeature::Multiview)) else { return };
    let view_mask = 0b101;
    let vertex = "
        #extension GL_EXT_multiview : require
        layout(push_constant, scalar) uniform Push { vec4 color; float depth; };
        void main() {
            vec2 corner = vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1);
            gl_Position = vec4(corner * 4.0 - 1.0, depth * (gl_ViewIndex + 1), 1.0);
        }";
    let color = [Format::R32Float.into()];
    let depth = Some(DepthTest { format: Format::D32Float, compare: CompareOp::Less, write: true });
    let stages = [(ShaderStage::Vertex, vertex), (ShaderStage::Fragment, BY_VIEW)];
    let desc = RenderPipelineDesc { color: &color, depth, view_mask, ..Default::default() };
    let pipeline = staged_pipeline(&ctx, &stages, &desc).unwrap();
    let kind = TextureKind::D2Array { layers: 3 };
    let (drawn, tested) =
        (texture(&ctx, kind, Format::R32Float, 1), texture(&ctx, kind, Format::D32Float, 1));
    let clear_all = [ColorAttachment::clear(*drawn, [5.0; 4])];
    run_pass(&ctx, &RenderPassDesc { color: &clear_all, layers: 3, ..Default::default() }, |_| Ok(()));
    let color = [ColorAttachment::clear(*drawn, [6.0; 4])];
    let depth = Some(DepthAttachment::clear(*tested, 0.5));
    run_pass(&ctx, &RenderPassDesc { color: &color, depth, view_mask, ..Default::default() }, |pass| {
        pass.bind_render_pipeline(*pipeline)?;
        paint(pass, [20.0; 4], 0.125)?;
        paint(pass, [30.0; 4], 0.25)
    });
    let found: Vec<f32> = (0..3).map(|layer| texel(&ctx, *drawn, kind, 0, layer)).collect();
    assert_eq!(found, [20.0, 5.0, 22.0]);
    let depths = [0, 2].map(|layer| texel(&ctx, *tested, kind, 0, layer));
    assert_eq!(depths, [0.125, 0.375]);
}

/// Every query takes one slot for each view: the result is their sum, and the slots behind are free.
#[test]
fn queries_and_stamps_count_all_views() {
    let Some(ctx) = device().filter(|ctx| has(ctx, OptionalFeature::Multiview)) else { return };
    let view_mask = 0b111;
    let color = [Format::R32Float.into()];
    let stages = [(ShaderStage::Vertex, COVER), (ShaderStage::Fragment, BY_VIEW)];
    let desc = RenderPipelineDesc { color: &color, view_mask, ..Default::default() };
    let pipeline = staged_pipeline(&ctx, &stages, &desc).unwrap();
    let drawn = texture(&ctx, TextureKind::D2Array { layers: 3 }, Format::R32Float, 1);
    let pool =
        |kind, count| ctx.create_query_pool(&QueryPoolDesc { kind, count, debug_name: "by view" }).unwrap();
    let occlusion = pool(QueryKind::Occlusion { precise: ctx.capabilities().precise_occlusion }, 5);
    let times = pool(QueryKind::Timestamps, 4);
    ctx.set_profiling(true).unwrap();
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    let color = [ColorAttachment::clear(*drawn, [0.0; 4])];
    let desc = RenderPassDesc { color: &color, view_mask, debug_name: "views", ..Default::default() };
    let mut pass = cmd.begin_rendering(&desc).unwrap();
    pass.bind_render_pipeline(*pipeline).unwrap();
    usage_error(pass.begin_query(*occlusion, 3), "by view");
    usage_error(pass.write_timestamp(*times, 2), "by view");
    pass.begin_query(*occlusion, 1).unwrap();
    pass.write_timestamp(*times, 1).unwrap();
    pass.push_label("inside");
    paint(&mut pass, [1.0; 4], 0.0).unwrap();
    pass.pop_label();
    pass.end_query(*occlusion, 1).unwrap();
    usage_error(pass.write_timestamp(*times, 1), "reset");
    drop(pass);
    usage_error(cmd.write_timestamp(*times, 3), "reset");
    cmd.write_timestamp(*times, 0).unwrap();
    ctx.submit(cmd).unwrap();
    ctx.wait_idle().unwrap();
    ctx.set_profiling(false).unwrap();
    let mut counts = [None; 4];
    ctx.read_queries(*occlusion, 1, &mut counts).unwrap();
    let sum: u64 = counts[..3].iter().map(|count| count.unwrap()).sum();
    let pixels = 3 * 16;
    assert!(if ctx.capabilities().precise_occlusion { sum == pixels } else { sum > 0 }, "{counts:?}");
    assert_eq!(counts[3], None);
    let mut stamps = [None; 4];
    ctx.read_queries(*times, 0, &mut stamps).unwrap();
    assert!(stamps.iter().all(Option::is_some), "{stamps:?}");
    let profile = ctx.last_profile().unwrap().unwrap();
    let views = &profile.scopes[0];
    assert_eq!((&*views.name, &*views.children[0].name), ("views", "inside"));
    assert!(views.children[0].ms <= views.ms, "{profile:?}");
}

#[test]
fn views_and_layers_that_cannot_be_are_refused() {
    let Some(ctx) = device() else { return };
    if !has(&ctx, OptionalFeature::Multiview) || !has(&ctx, OptionalFeature::ShaderOutputLayer) {
        return;
    }
    let drawn = texture(&ctx, TextureKind::D2Array { layers: 3 }, Format::R32Float, 1);
    let color = [ColorAttachment { layer: 1, ..ColorAttachment::clear(*drawn, [0.0; 4]) }];
    let plain = RenderPassDesc { color: &color, ..Default::default() };
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    usage_error(cmd.begin_rendering(&RenderPassDesc { layers: 3, ..plain }), "layer 3");
    usage_error(cmd.begin_rendering(&RenderPassDesc { view_mask: 0b100, ..plain }), "layer 3");
    usage_error(cmd.begin_rendering(&RenderPassDesc { view_mask: 1, layers: 2, ..plain }), "leave layers 0");
    let limits = &ctx.capabilities().limits;
    let too_many = |result: lvk::Result<lvk::RenderPass<'_>>, limit: u32| match result.map(drop) {
        Err(Error::LimitExceeded { limit: found, .. }) => assert_eq!(found, u64::from(limit)),
        other => unreachable!("{other:?}"),
    };
    too_many(cmd.begin_rendering(&RenderPassDesc { layers: u32::MAX, ..plain }), limits.max_target_layers);
    if limits.max_views < 32 {
        too_many(cmd.begin_rendering(&RenderPassDesc { view_mask: 1 << 31, ..plain }), limits.max_views);
    }
    let twice = [ColorAttachment::clear(*drawn, [0.0; 4]), color[0]];
    usage_error(cmd.begin_rendering(&RenderPassDesc { color: &twice, layers: 2, ..plain }), "twice");
    let formats = [Format::R32Float.into()];
    let desc = RenderPipelineDesc { color: &formats, debug_name: "seen", ..Default::default() };
    let layered = [(ShaderStage::Vertex, BY_INSTANCE), (ShaderStage::Fragment, PAINT)];
    let with_views = RenderPipelineDesc { view_mask: 3, ..desc };
    usage_error(staged_pipeline(&ctx, &layered, &with_views), "gl_Layer");
    let stages = [(ShaderStage::Vertex, COVER), (ShaderStage::Fragment, PAINT)];
    let one = staged_pipeline(&ctx, &stages, &desc).unwrap();
    let two = staged_pipeline(&ctx, &stages, &with_views).unwrap();
    let mut pass = cmd.begin_rendering(&plain).unwrap();
    usage_error(pass.bind_render_pipeline(*two), "the views 0b11");
    drop(pass);
    let mut pass = cmd.begin_rendering(&RenderPassDesc { view_mask: 0b11, ..plain }).unwrap();
    usage_error(pass.bind_render_pipeline(*one), "but the pass has");
    pass.bind_render_pipeline(*two).unwrap();
    drop(pass);
    ctx.submit(cmd).unwrap();
    let profile = DeviceProfile::core_only();
    let Some(bare) = device_with(|desc| desc.profile = Some(&profile)) else { return };
    unsupported(staged_pipeline(&bare, &stages, &with_views), "multiview");
    let drawn = texture(&bare, TextureKind::D2, Format::R32Float, 1);
    let color = [ColorAttachment::clear(*drawn, [0.0; 4])];
    let mut cmd = bare.acquire_command_buffer().unwrap();
    let views = RenderPassDesc { color: &color, view_mask: 1, ..Default::default() };
    unsupported(cmd.begin_rendering(&views), "multiview");
}
