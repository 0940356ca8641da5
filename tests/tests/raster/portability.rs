//! Features that devices with `VK_KHR_portability_subset` may lack: without them each use is refused, with its object,
//! the feature and the way around it.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk::{
    Aspect, Blend, BlendComponent, BlendFactor, Channel, ColorAttachment, ColorTarget, CompareOp, Context,
    DeviceProfile, FeatureSet, Format, OptionalFeature, PolygonMode, RenderPassDesc, RenderPipelineDesc,
    SamplerDesc, ShaderModuleDesc, ShaderSource, ShaderStage, Swizzle, TextureDesc, TextureKind,
    TextureUsage, TextureViewDesc, Topology, VertexAttribute, VertexBinding, VertexFormat,
};
use lvk_tests::raster::{COVER, PAINT, expect_drawing, has, run_pass, staged_pipeline, target, unsupported};
use lvk_tests::{TestDevice, device, device_with};

const GREY: Swizzle = Swizzle { green: Channel::Red, blue: Channel::Red, ..Swizzle::IDENTITY };

/// A device without any of the features.
fn minimum() -> Option<TestDevice> {
    let profile = DeviceProfile::portability_minimum();
    device_with(|desc| desc.profile = Some(&profile))
}

fn pipeline(ctx: &Context, desc: &RenderPipelineDesc<'_>) -> lvk::Result<()> {
    let stages = [(ShaderStage::Vertex, COVER), (ShaderStage::Fragment, PAINT)];
    staged_pipeline(ctx, &stages, desc).map(drop)
}

#[test]
fn devices_that_implement_all_of_vulkan_have_all_features() {
    let Some(ctx) = device() else { return };
    let caps = ctx.capabilities();
    if caps.portability_subset {
        eprintln!("NOT TESTED, {} implements a subset of Vulkan", caps.device_name);
        return;
    }
    assert!(FeatureSet::PORTABILITY.iter().all(|feature| caps.has(feature)), "{:?}", caps.optional);
    assert_eq!(caps.limits.vertex_stride_alignment, 1);
}

#[test]
fn without_them_plain_drawing_works() {
    let Some(ctx) = minimum() else { return };
    expect_drawing(&ctx);
    let target = target(&ctx, Format::Rgba8Unorm, [2, 2]);
    let color = [ColorAttachment::clear(*target, [0.0; 4])];
    run_pass(&ctx, &RenderPassDesc { color: &color, ..Default::default() }, |pass| {
        pass.stencil_reference(7, 7)?;
        let refused = pass.stencil_reference(7, 8);
        unsupported(
            refused,
            "separateStencilMaskRef: the device profile 'portability-minimum' hides it; draw",
        );
        Ok(())
    });
}

#[test]
fn states_of_pipelines_are_refused_by_name() {
    let (Some(ctx), Some(whole)) = (minimum(), device()) else { return };
    let color = [Format::Rgba8Unorm.into()];
    let plain = RenderPipelineDesc { color: &color, debug_name: "state", ..Default::default() };
    let alpha = BlendComponent::sum(BlendFactor::ConstantAlpha, BlendFactor::OneMinusConstantAlpha);
    let blended = [ColorTarget::blended(Format::Rgba8Unorm, Blend::both(alpha))];
    pipeline(&ctx, &plain).unwrap();
    for (desc, feature, words) in [
        (
            RenderPipelineDesc { topology: Topology::TriangleFan, ..plain },
            OptionalFeature::TriangleFans,
            "the topology TriangleFan of pipeline 'state'",
        ),
        (
            RenderPipelineDesc { polygon: PolygonMode::Point, ..plain },
            OptionalFeature::PointPolygons,
            "the polygon mode Point of pipeline 'state'",
        ),
        (
            RenderPipelineDesc { color: &blended, ..plain },
            OptionalFeature::ConstantAlphaColorBlend,
            "a colour blend factor of constant alpha of pipeline 'state'",
        ),
    ] {
        unsupported(pipeline(&ctx, &desc), words);
        unsupported(pipeline(&ctx, &desc), feature.vulkan_name());
        if has(&whole, feature) {
            pipeline(&whole, &desc).unwrap();
        }
    }
}

#[test]
fn strides_are_multiples_of_the_alignment() {
    let (Some(ctx), Some(whole)) = (minimum(), device()) else { return };
    let color = [Format::Rgba8Unorm.into()];
    let attributes = [VertexAttribute { format: VertexFormat::Unorm8x4, ..Default::default() }];
    let with_stride = |ctx: &Context, stride| {
        let bindings = [VertexBinding { stride, per_instance: false }];
        let desc = RenderPipelineDesc {
            color: &color,
            vertex_bindings: &bindings,
            vertex_attributes: &attributes,
            debug_name: "packed",
            ..Default::default()
        };
        pipeline(ctx, &desc)
    };
    with_stride(&ctx, 4).unwrap();
    unsupported(with_stride(&ctx, 6), "the stride 6 of vertex binding 0 of pipeline 'packed'");
    unsupported(with_stride(&ctx, 6), "multiples of 4 bytes");
    if whole.capabilities().limits.vertex_stride_alignment <= 2 {
        with_stride(&whole, 6).unwrap();
    }
}

#[test]
fn tessellation_into_lines_and_points_is_refused() {
    let Some(ctx) = minimum().filter(|ctx| has(ctx, OptionalFeature::TessellationShader)) else { return };
    let control = "
        layout(vertices = 1) out;
        void main() { gl_TessLevelOuter = float[](2.0, 2.0, 2.0, 2.0); gl_TessLevelInner = float[](2.0, 2.0); }";
    let color = [Format::Rgba8Unorm.into()];
    let topology = Topology::Patches { points: 1 };
    let desc = RenderPipelineDesc { color: &color, topology, debug_name: "patches", ..Default::default() };
    for (mode, feature) in [
        ("isolines", Some(OptionalFeature::TessellationIsolines)),
        ("quads, point_mode", Some(OptionalFeature::TessellationPointMode)),
        ("triangles", None),
    ] {
        let eval =
            format!("layout({mode}) in; void main() {{ gl_Position = vec4(gl_TessCoord.xy, 0.0, 1.0); }}");
        let stages = [
            (ShaderStage::Vertex, COVER),
            (ShaderStage::TessControl, control),
            (ShaderStage::TessEval, &eval),
            (ShaderStage::Fragment, PAINT),
        ];
        let made = staged_pipeline(&ctx, &stages, &desc);
        match feature {
            Some(feature) => unsupported(made, feature.vulkan_name()),
            None => drop(made.unwrap()),
        }
    }
}

#[test]
fn interpolation_functions_are_refused() {
    let Some(ctx) = minimum() else { return };
    let source = "
        layout(location = 0) in vec2 at;
        layout(location = 0) out vec4 result;
        void main() { result = interpolateAtOffset(at, vec2(0.25)).xyxy; }";
    let desc = ShaderModuleDesc {
        stage: ShaderStage::Fragment,
        source: ShaderSource::Glsl(source),
        debug_name: "offset",
        ..Default::default()
    };
    unsupported(ctx.create_shader_module(&desc), "shaderSampleRateInterpolationFunctions");
}

#[test]
fn shapes_and_views_of_textures_are_refused_by_name() {
    let (Some(ctx), Some(whole)) = (minimum(), device()) else { return };
    let plain = TextureDesc {
        format: Format::Rgba8Unorm,
        extent: [8, 8],
        usage: TextureUsage::SAMPLED,
        debug_name: "texels",
        ..Default::default()
    };
    for (desc, feature) in [
        (TextureDesc { swizzle: GREY, ..plain }, OptionalFeature::ViewSwizzle),
        (
            TextureDesc { view_formats: &[Format::R32Uint], ..plain },
            OptionalFeature::ViewFormatReinterpretation,
        ),
        (
            TextureDesc {
                kind: TextureKind::D2Array { layers: 2 },
                samples: 4,
                usage: TextureUsage::TARGET,
                ..plain
            },
            OptionalFeature::MultisampledArrays,
        ),
        (
            TextureDesc { kind: TextureKind::D3 { depth: 2 }, usage: TextureUsage::TARGET, ..plain },
            OptionalFeature::View2dOf3d,
        ),
    ] {
        unsupported(ctx.create_texture(&desc), "of texture 'texels'");
        unsupported(ctx.create_texture(&desc), feature.vulkan_name());
        if has(&whole, feature) {
            drop(whole.create_texture(&desc).unwrap());
        }
    }
    let encoded = ctx.create_texture(&TextureDesc { view_formats: &[Format::Rgba8Srgb], ..plain }).unwrap();
    let view = |swizzle, format| {
        let texture = Some(*encoded);
        let aspect = Aspect::Main;
        ctx.create_texture_view(&TextureViewDesc {
            texture,
            swizzle,
            format,
            aspect,
            debug_name: "part",
            ..Default::default()
        })
    };
    drop(view(Swizzle::IDENTITY, Some(Format::Rgba8Srgb)).unwrap());
    unsupported(view(GREY, None), "the swizzle of texture view 'part'");
}

#[test]
fn comparing_and_biased_samplers_are_refused_by_name() {
    let (Some(ctx), Some(whole)) = (minimum(), device()) else { return };
    let plain = SamplerDesc { debug_name: "reads", ..Default::default() };
    drop(ctx.create_sampler(&plain).unwrap());
    for (desc, feature) in [
        (SamplerDesc { compare: Some(CompareOp::Less), ..plain }, OptionalFeature::ComparisonSamplers),
        (SamplerDesc { lod_bias: 0.5, ..plain }, OptionalFeature::SamplerLodBias),
    ] {
        unsupported(ctx.create_sampler(&desc), "of sampler 'reads'");
        unsupported(ctx.create_sampler(&desc), feature.vulkan_name());
        if has(&whole, feature) {
            drop(whole.create_sampler(&desc).unwrap());
        }
    }
    assert!(ctx.capabilities().limits.max_lod_bias.abs() < f32::EPSILON);
}
