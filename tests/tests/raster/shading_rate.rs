//! Fragment shading rates: sizes by pipeline, draw, primitive and attachment, their combiners, and refused calls.
//! Only the images need a device with shading rates.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk::{
    ColorAttachment, Context, DeviceProfile, FeatureSet, Format, Holder, OptionalFeature, RenderPass,
    RenderPassDesc, RenderPipelineDesc, RenderPipelineHandle, ShaderModuleDesc, ShaderSource, ShaderStage,
    ShadingRate, ShadingRateAttachment, ShadingRateCombiner, ShadingRateLimits, TextureDesc, TextureHandle,
    TextureKind, TextureUsage,
};
use lvk_tests::raster::{
    COVER, PAINT, has, paint, pixels, run_pass, staged_pipeline, target, unsupported, usage_error,
};
use lvk_tests::{device, device_with};

const SIZE: [u32; 2] = [64, 32];

/// The place of the fragment, which is the middle of its pixels, and its size as the shader knows it.
const PLACE: &str = "
    #extension GL_EXT_fragment_shading_rate : require
    layout(location = 0) out vec4 result;
    void main() {
        ivec2 size = ivec2(1) << (ivec2(gl_ShadingRateEXT >> 2, gl_ShadingRateEXT) & 3);
        result = vec4(gl_FragCoord.xy, size);
    }";

/// As [`COVER`], of the rate that is pushed as a colour.
const BY_PRIMITIVE: &str = "
    #extension GL_EXT_fragment_shading_rate : require
    layout(push_constant, scalar) uniform Push { vec4 color; float depth; };
    void main() {
        gl_Position = vec4(vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1) * 4.0 - 1.0, depth, 1.0);
        gl_PrimitiveShadingRateEXT = int(color.r);
    }";

fn pipeline(ctx: &Context, vertex: &str, rate: ShadingRate) -> Holder<RenderPipelineHandle> {
    let color = [Format::Rgba32Float.into()];
    let stages = [(ShaderStage::Vertex, vertex), (ShaderStage::Fragment, PLACE)];
    let desc = RenderPipelineDesc { color: &color, shading_rate: Some(rate), ..Default::default() };
    staged_pipeline(ctx, &stages, &desc).unwrap()
}

/// The image of a pass.
fn drawn(
    ctx: &Context,
    shading_rate: Option<ShadingRateAttachment>,
    record: impl FnOnce(&mut RenderPass<'_>) -> lvk::Result<()>,
) -> Vec<[f32; 4]> {
    let texture = target(ctx, Format::Rgba32Float, SIZE);
    let color = [ColorAttachment::clear(*texture, [0.0; 4])];
    run_pass(ctx, &RenderPassDesc { color: &color, shading_rate, ..Default::default() }, record);
    pixels(ctx, *texture)
}

/// Fails unless the pixels of each row from `columns` on lie in fragments of this size, whose middle they have.
fn assert_fragments(found: &[[f32; 4]], columns: std::ops::Range<u32>, size: [u32; 2], what: &str) {
    let [width, height] = SIZE;
    for (x, y) in (0..height).flat_map(|y| columns.clone().map(move |x| (x, y))) {
        let middle =
            [(x, size[0]), (y, size[1])].map(|(at, side)| (at / side * side) as f32 + side as f32 / 2.0);
        let expected = [middle[0], middle[1], size[0] as f32, size[1] as f32];
        assert_eq!(found[(y * width + x) as usize], expected, "{what}: pixel {x} {y}");
    }
}

/// Returns the rate that a device grants: the largest of its sizes that is nowhere larger than the requested one.
fn granted(ctx: &Context, wish: [u32; 2]) -> [u32; 2] {
    let fits = |size: &[u32; 2]| size[0] <= wish[0] && size[1] <= wish[1];
    let sizes = ctx.shading_rates().iter().filter(|known| known.samples & 1 != 0).map(|known| known.size);
    sizes.filter(fits).max_by_key(|size| (size[0] * size[1], size[0])).unwrap_or([1, 1])
}

#[test]
fn the_sizes_of_a_device_are_listed_from_large_to_small() {
    let Some(ctx) = device() else { return };
    let (sizes, limits) = (ctx.shading_rates(), ctx.capabilities().limits.shading_rate);
    if !ctx.capabilities().has(OptionalFeature::PipelineShadingRate) {
        assert_eq!((sizes.len(), limits), (0, ShadingRateLimits::default()));
        return;
    }
    assert_eq!(sizes.last().map(|known| known.size), Some([1, 1]), "{sizes:?}");
    for needed in [[2, 1], [2, 2]] {
        assert!(sizes.iter().any(|known| known.size == needed && known.samples & 1 != 0), "{sizes:?}");
    }
    assert!(sizes.windows(2).all(|pair| pair[0].size >= pair[1].size), "{sizes:?}");
    assert!(sizes.iter().all(|known| known.size[0] <= limits.max_size[0]), "{sizes:?}, {limits:?}");
}

#[test]
fn pipelines_and_draws_have_a_rate() {
    let Some(ctx) = device().filter(|ctx| has(ctx, OptionalFeature::PipelineShadingRate)) else { return };
    for known in ctx.shading_rates().iter().filter(|known| known.samples & 1 != 0) {
        let pipeline = pipeline(&ctx, COVER, ShadingRate::new(known.size));
        let found = drawn(&ctx, None, |pass| {
            pass.bind_render_pipeline(*pipeline)?;
            paint(pass, [0.0; 4], 0.0)
        });
        assert_fragments(&found, 0..SIZE[0], known.size, "by pipeline");
    }
    let (fine, coarse) = (pipeline(&ctx, COVER, ShadingRate::default()), [2, 2]);
    let found = drawn(&ctx, None, |pass| {
        pass.bind_render_pipeline(*fine)?;
        pass.shading_rate(ShadingRate::new(coarse))?;
        pass.scissor([0, 0], [32, SIZE[1]])?;
        paint(pass, [0.0; 4], 0.0)?;
        pass.bind_render_pipeline(*fine)?;
        pass.scissor([32, 0], [32, SIZE[1]])?;
        paint(pass, [0.0; 4], 0.0)
    });
    assert_fragments(&found, 0..32, coarse, "by draw");
    assert_fragments(&found, 32..64, [1, 1], "the next pipeline brings its own");
}

/// The rate of a texel for the left half of the image and single pixels for the right one, and all combinations.
#[test]
fn attachment_and_primitive_rates_are_combined_by_their_formulas() {
    let Some(ctx) = device() else { return };
    if !has(&ctx, OptionalFeature::AttachmentShadingRate) || !has(&ctx, OptionalFeature::PrimitiveShadingRate)
    {
        return;
    }
    let limits = ctx.capabilities().limits.shading_rate;
    let texel = limits.min_texel;
    let extent = [SIZE[0].div_ceil(texel[0]), SIZE[1].div_ceil(texel[1])];
    let by_texture = granted(&ctx, [2, 4]);
    let rate = |column: u32| if column * texel[0] < 32 { by_texture } else { [1, 1] };
    let data: Vec<u8> =
        (0..extent[0] * extent[1]).map(|at| ShadingRate::texel(rate(at % extent[0])).unwrap()).collect();
    let rates = ctx
        .create_texture(&TextureDesc {
            format: Format::R8Uint,
            extent,
            usage: TextureUsage::SHADING_RATE,
            data: Some(&data),
            ..Default::default()
        })
        .unwrap();
    let attachment = ShadingRateAttachment::new(*rates, texel);
    let combine = |by: ShadingRateCombiner, first: [u32; 2], second: [u32; 2]| {
        std::array::from_fn(|axis| match by {
            ShadingRateCombiner::Keep => first[axis],
            ShadingRateCombiner::Replace => second[axis],
            ShadingRateCombiner::Min => first[axis].min(second[axis]),
            ShadingRateCombiner::Max => first[axis].max(second[axis]),
            ShadingRateCombiner::Multiply => (first[axis] * second[axis]).min(4),
        })
    };
    use ShadingRateCombiner::{Keep, Max, Min, Multiply, Replace};
    let kinds = if limits.combines { &[Keep, Replace, Min, Max, Multiply][..] } else { &[Keep, Replace] };
    let by_draw = [1, 2];
    let by_primitive = [2, 1];
    let pipeline = pipeline(&ctx, BY_PRIMITIVE, ShadingRate::new(by_draw));
    for (primitive, attached) in kinds.iter().flat_map(|a| kinds.iter().map(move |b| (*a, *b))) {
        let found = drawn(&ctx, Some(attachment), |pass| {
            pass.bind_render_pipeline(*pipeline)?;
            pass.shading_rate(ShadingRate { size: by_draw, primitive, attachment: attached })?;
            paint(pass, [f32::from(ShadingRate::texel(by_primitive).unwrap()), 0.0, 0.0, 0.0], 0.0)
        });
        let what = format!("{primitive:?}, then {attached:?}");
        let first = combine(primitive, by_draw, by_primitive);
        assert_fragments(&found, 0..32, granted(&ctx, combine(attached, first, by_texture)), &what);
        assert_fragments(&found, 32..64, granted(&ctx, combine(attached, first, [1, 1])), &what);
    }
}

#[test]
fn wrong_attachments_are_refused() {
    let Some(ctx) = device().filter(|ctx| has(ctx, OptionalFeature::AttachmentShadingRate)) else { return };
    let plain = TextureDesc {
        format: Format::R8Uint,
        extent: [1, 1],
        usage: TextureUsage::SHADING_RATE,
        debug_name: "rates",
        ..Default::default()
    };
    let wrong = "rates: textures of shading rates are D2 or D2Array";
    usage_error(ctx.create_texture(&TextureDesc { format: Format::R8Unorm, ..plain }), wrong);
    usage_error(ctx.create_texture(&TextureDesc { kind: TextureKind::D3 { depth: 2 }, ..plain }), wrong);
    let rates = ctx.create_texture(&plain).unwrap();
    let other = target(&ctx, Format::R8Uint, [64, 64]);
    let image = target(&ctx, Format::Rgba32Float, SIZE);
    let color = [ColorAttachment::clear(*image, [0.0; 4])];
    let begin = |texture: TextureHandle, texel: [u32; 2], words: &str| {
        let shading_rate = Some(ShadingRateAttachment::new(texture, texel));
        let mut cmd = ctx.acquire_command_buffer().unwrap();
        let desc = RenderPassDesc { color: &color, shading_rate, ..Default::default() };
        usage_error(cmd.begin_rendering(&desc).map(drop), words);
    };
    let texel = ctx.capabilities().limits.shading_rate.min_texel;
    begin(*rates, [3, 3], "rates: a texel stands for [3, 3] pixels, but the device takes powers of two");
    begin(*rates, texel, "rates: it has [1, 1] texels, but the pass needs");
    begin(*other, texel, "create the texture with TextureUsage(SHADING_RATE)");
    let large = ctx.create_texture(&TextureDesc { extent: [64, 64], ..plain }).unwrap();
    let attachment = ShadingRateAttachment::new(*large, texel);
    let formats = [Format::Rgba32Float.into()];
    let stages = [(ShaderStage::Vertex, COVER), (ShaderStage::Fragment, PAINT)];
    let desc = RenderPipelineDesc { color: &formats, debug_name: "without", ..Default::default() };
    let without = staged_pipeline(&ctx, &stages, &desc).unwrap();
    drawn(&ctx, Some(attachment), |pass| {
        usage_error(
            pass.bind_render_pipeline(*without),
            "without: the pass takes shading rates from a texture",
        );
        Ok(())
    });
}

#[test]
fn wrong_rates_are_refused() {
    let Some(ctx) = device() else { return };
    let color = [Format::Rgba32Float.into()];
    let stages = [(ShaderStage::Vertex, COVER), (ShaderStage::Fragment, PAINT)];
    let plain = RenderPipelineDesc { color: &color, debug_name: "coarse", ..Default::default() };
    let plain_pipeline = staged_pipeline(&ctx, &stages, &plain).unwrap();
    drawn(&ctx, None, |pass| {
        usage_error(pass.shading_rate(ShadingRate::new([2, 2])), "bind a render pipeline first");
        pass.bind_render_pipeline(*plain_pipeline)?;
        usage_error(pass.shading_rate(ShadingRate::new([2, 2])), "coarse: it has no shading rate to replace");
        Ok(())
    });
    if !has(&ctx, OptionalFeature::PipelineShadingRate) {
        return;
    }
    let of = |size| RenderPipelineDesc { shading_rate: Some(ShadingRate::new(size)), ..plain };
    usage_error(staged_pipeline(&ctx, &stages, &of([3, 1])), "coarse: fragments are 1, 2 or 4 pixels");
    let made = staged_pipeline(&ctx, &stages, &of([2, 2])).unwrap();
    drawn(&ctx, None, |pass| {
        pass.bind_render_pipeline(*made)?;
        usage_error(pass.shading_rate(ShadingRate::new([1, 8])), "not [1, 8]");
        pass.shading_rate(ShadingRate::new([1, 1]))
    });
}

/// Under a profile that hides the rates of primitives and attachments.
#[test]
fn combinations_that_the_device_lacks_are_refused() {
    let hidden = FeatureSet::NONE
        .with(OptionalFeature::PrimitiveShadingRate)
        .with(OptionalFeature::AttachmentShadingRate);
    let profile = DeviceProfile { name: "rates of draws".into(), hidden, ..Default::default() };
    let Some(ctx) = device_with(|desc| desc.profile = Some(&profile)) else { return };
    if !has(&ctx, OptionalFeature::PipelineShadingRate) {
        return;
    }
    let pipeline = pipeline(&ctx, COVER, ShadingRate::default());
    drawn(&ctx, None, |pass| {
        pass.bind_render_pipeline(*pipeline)?;
        let (replace, keep) = (ShadingRateCombiner::Replace, ShadingRate::default());
        let by_primitive = ShadingRate { primitive: replace, ..keep };
        unsupported(pass.shading_rate(by_primitive), OptionalFeature::PrimitiveShadingRate.vulkan_name());
        let by_attachment = ShadingRate { attachment: replace, ..keep };
        unsupported(pass.shading_rate(by_attachment), OptionalFeature::AttachmentShadingRate.vulkan_name());
        pass.shading_rate(keep)
    });
}

/// Under a profile that hides them, or on a device without: every word of rates says so by name.
#[test]
fn devices_without_rates_say_so() {
    let profile = DeviceProfile::core_only();
    let Some(ctx) = device_with(|desc| desc.profile = Some(&profile)) else { return };
    assert_eq!((ctx.shading_rates().len(), ctx.capabilities().limits.shading_rate), (0, Default::default()));
    let color = [Format::Rgba32Float.into()];
    let stages = [(ShaderStage::Vertex, COVER), (ShaderStage::Fragment, PAINT)];
    let rate = Some(ShadingRate::new([2, 2]));
    let desc =
        RenderPipelineDesc { color: &color, shading_rate: rate, debug_name: "coarse", ..Default::default() };
    unsupported(staged_pipeline(&ctx, &stages, &desc), "the shading rate [2, 2] of 'coarse'");
    unsupported(staged_pipeline(&ctx, &stages, &desc), "pipelineFragmentShadingRate");
    let desc = TextureDesc {
        format: Format::R8Uint,
        usage: TextureUsage::SHADING_RATE,
        debug_name: "rates",
        ..Default::default()
    };
    unsupported(ctx.create_texture(&desc), "the usage SHADING_RATE of texture 'rates'");
    for (stage, text) in [(ShaderStage::Vertex, BY_PRIMITIVE), (ShaderStage::Fragment, PLACE)] {
        let desc = ShaderModuleDesc {
            stage,
            source: ShaderSource::Glsl(text),
            debug_name: "asks for rates",
            ..Default::default()
        };
        unsupported(ctx.create_shader_module(&desc), "FragmentShadingRateKHR of shader 'asks for rates'");
    }
    let other = target(&ctx, Format::R8Uint, [4, 4]);
    let image = target(&ctx, Format::Rgba32Float, SIZE);
    let color = [ColorAttachment::clear(*image, [0.0; 4])];
    let shading_rate = Some(ShadingRateAttachment::new(*other, [16, 16]));
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    let desc = RenderPassDesc { color: &color, shading_rate, ..Default::default() };
    usage_error(cmd.begin_rendering(&desc).map(drop), "create the texture with TextureUsage(SHADING_RATE)");
}
