//! Blending: every factor and operation, constants, dual-source blending, write masks and eight targets, against the
//! formulas.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk::{
    Blend, BlendComponent, BlendFactor, BlendOp, ColorAttachment, ColorLoadOp, ColorTarget, ColorWriteMask,
    Context, DeviceProfile, Format, Holder, OptionalFeature, RenderPassDesc, RenderPipelineDesc,
    RenderPipelineHandle, ShaderStage,
};
use lvk_tests::raster::{
    COVER, PAINT, has, paint, pixels, run_pass, staged_pipeline, target, unsupported, usage_error,
};
use lvk_tests::{device, device_with};

const FORMAT: Format = Format::Rgba32Float;
const SOURCE: [f32; 4] = [0.25, 0.5, 1.0, 0.375];
const TARGET: [f32; 4] = [0.5, 0.125, 0.75, 0.625];
const CONSTANTS: [f32; 4] = [0.125, 0.875, 0.25, 0.5];
const SECOND: [f32; 4] = [0.75, 0.0625, 0.5, 0.25];

/// As [`PAINT`], with a second source.
const PAINT_TWO: &str = "
    layout(push_constant, scalar) uniform Push { vec4 color; float depth; };
    layout(location = 0, index = 0) out vec4 result;
    layout(location = 0, index = 1) out vec4 second;
    void main() { result = color; second = vec4(0.75, 0.0625, 0.5, 0.25); }";

const FACTORS: [BlendFactor; 19] = [
    BlendFactor::Zero,
    BlendFactor::One,
    BlendFactor::SrcColor,
    BlendFactor::OneMinusSrcColor,
    BlendFactor::DstColor,
    BlendFactor::OneMinusDstColor,
    BlendFactor::SrcAlpha,
    BlendFactor::OneMinusSrcAlpha,
    BlendFactor::DstAlpha,
    BlendFactor::OneMinusDstAlpha,
    BlendFactor::ConstantColor,
    BlendFactor::OneMinusConstantColor,
    BlendFactor::ConstantAlpha,
    BlendFactor::OneMinusConstantAlpha,
    BlendFactor::SrcAlphaSaturate,
    BlendFactor::Src1Color,
    BlendFactor::OneMinusSrc1Color,
    BlendFactor::Src1Alpha,
    BlendFactor::OneMinusSrc1Alpha,
];

fn factor(factor: BlendFactor, channel: usize) -> f32 {
    match factor {
        BlendFactor::Zero => 0.0,
        BlendFactor::One => 1.0,
        BlendFactor::SrcColor => SOURCE[channel],
        BlendFactor::OneMinusSrcColor => 1.0 - SOURCE[channel],
        BlendFactor::DstColor => TARGET[channel],
        BlendFactor::OneMinusDstColor => 1.0 - TARGET[channel],
        BlendFactor::SrcAlpha => SOURCE[3],
        BlendFactor::OneMinusSrcAlpha => 1.0 - SOURCE[3],
        BlendFactor::DstAlpha => TARGET[3],
        BlendFactor::OneMinusDstAlpha => 1.0 - TARGET[3],
        BlendFactor::ConstantColor => CONSTANTS[channel],
        BlendFactor::OneMinusConstantColor => 1.0 - CONSTANTS[channel],
        BlendFactor::ConstantAlpha => CONSTANTS[3],
        BlendFactor::OneMinusConstantAlpha => 1.0 - CONSTANTS[3],
        BlendFactor::SrcAlphaSaturate if channel == 3 => 1.0,
        BlendFactor::SrcAlphaSaturate => SOURCE[3].min(1.0 - TARGET[3]),
        BlendFactor::Src1Color => SECOND[channel],
        BlendFactor::OneMinusSrc1Color => 1.0 - SECOND[channel],
        BlendFactor::Src1Alpha => SECOND[3],
        BlendFactor::OneMinusSrc1Alpha => 1.0 - SECOND[3],
    }
}

/// One channel after the blend.
fn expected(blend: Blend, channel: usize) -> f32 {
    let part = if channel == 3 { blend.alpha } else { blend.color };
    let source = SOURCE[channel] * factor(part.source, channel);
    let target = TARGET[channel] * factor(part.target, channel);
    match part.op {
        BlendOp::Add => source + target,
        BlendOp::Subtract => source - target,
        BlendOp::ReverseSubtract => target - source,
        BlendOp::Min => SOURCE[channel].min(TARGET[channel]),
        BlendOp::Max => SOURCE[channel].max(TARGET[channel]),
    }
}

fn is_second(factor: BlendFactor) -> bool {
    use BlendFactor::{OneMinusSrc1Alpha, OneMinusSrc1Color, Src1Alpha, Src1Color};
    matches!(factor, Src1Color | OneMinusSrc1Color | Src1Alpha | OneMinusSrc1Alpha)
}

fn pipeline(ctx: &Context, fragment: &str, color: &[ColorTarget]) -> Holder<RenderPipelineHandle> {
    let stages = [(ShaderStage::Vertex, COVER), (ShaderStage::Fragment, fragment)];
    staged_pipeline(ctx, &stages, &RenderPipelineDesc { color, ..Default::default() }).unwrap()
}

fn blended(ctx: &Context, blend: Blend, fragment: &str) -> [f32; 4] {
    let pipeline = pipeline(ctx, fragment, &[ColorTarget::blended(FORMAT, blend)]);
    let drawn = target(ctx, FORMAT, [1, 1]);
    let color = [ColorAttachment::clear(*drawn, TARGET)];
    run_pass(ctx, &RenderPassDesc { color: &color, ..Default::default() }, |pass| {
        pass.blend_constants(CONSTANTS);
        pass.bind_render_pipeline(*pipeline)?;
        paint(pass, SOURCE, 0.0)
    });
    pixels::<[f32; 4]>(ctx, *drawn)[0]
}

fn expect_blend(ctx: &Context, blend: Blend, fragment: &str) {
    let found = blended(ctx, blend, fragment);
    for (channel, found) in found.into_iter().enumerate() {
        let expected = expected(blend, channel);
        assert!((found - expected).abs() < 1e-5, "{blend:?} channel {channel}: {found}, not {expected}");
    }
}

/// Each factor stands once before the source's colour and once before the target's alpha, or the other way round.
#[test]
fn every_factor_and_operation_is_what_its_formula_says() {
    let Some(ctx) = device() else { return };
    let second = has(&ctx, OptionalFeature::DualSourceBlend);
    let ops = [BlendOp::Add, BlendOp::Subtract, BlendOp::ReverseSubtract];
    for (index, first) in FACTORS.into_iter().enumerate() {
        let other = FACTORS[(index + 7) % FACTORS.len()];
        let two = is_second(first) || is_second(other);
        if two && !second {
            continue;
        }
        let op = ops[index % 3];
        let blend = Blend {
            color: BlendComponent { source: first, target: other, op },
            alpha: BlendComponent { source: other, target: first, op: ops[(index + 1) % 3] },
        };
        expect_blend(&ctx, blend, if two { PAINT_TWO } else { PAINT });
    }
    for op in [BlendOp::Min, BlendOp::Max] {
        let part = BlendComponent { source: BlendFactor::Zero, target: BlendFactor::One, op };
        expect_blend(&ctx, Blend::both(part), PAINT);
    }
}

#[test]
fn constants_are_those_set_last_and_survive_other_pipelines() {
    let Some(ctx) = device() else { return };
    let part = BlendComponent::sum(BlendFactor::ConstantColor, BlendFactor::Zero);
    let scaled = pipeline(&ctx, PAINT, &[ColorTarget::blended(FORMAT, Blend::both(part))]);
    let plain = pipeline(&ctx, PAINT, &[FORMAT.into()]);
    let drawn = target(&ctx, FORMAT, [4, 1]);
    let color = [ColorAttachment::clear(*drawn, [9.0; 4])];
    run_pass(&ctx, &RenderPassDesc { color: &color, ..Default::default() }, |pass| {
        let mut column = 0..;
        let mut next = |pass: &mut lvk::RenderPass<'_>| {
            pass.scissor([column.next().unwrap(), 0], [1, 1])?;
            paint(pass, [1.0, 2.0, 3.0, 4.0], 0.0)
        };
        pass.bind_render_pipeline(*scaled)?;
        next(pass)?;
        pass.blend_constants([0.5; 4]);
        next(pass)?;
        pass.bind_render_pipeline(*plain)?;
        next(pass)?;
        pass.bind_render_pipeline(*scaled)?;
        next(pass)
    });
    let scale = |by: f32| [1.0, 2.0, 3.0, 4.0].map(|value: f32| value * by);
    assert_eq!(pixels::<[f32; 4]>(&ctx, *drawn), [scale(0.0), scale(0.5), scale(1.0), scale(0.5)]);
}

#[test]
fn masks_choose_the_channels_that_are_written() {
    let Some(ctx) = device() else { return };
    for mask in [ColorWriteMask::empty(), ColorWriteMask::RED | ColorWriteMask::BLUE, ColorWriteMask::ALPHA] {
        let color = [ColorTarget { write: mask, ..ColorTarget::new(FORMAT) }];
        let pipeline = pipeline(&ctx, PAINT, &color);
        let drawn = target(&ctx, FORMAT, [1, 1]);
        let color = [ColorAttachment::clear(*drawn, TARGET)];
        run_pass(&ctx, &RenderPassDesc { color: &color, ..Default::default() }, |pass| {
            pass.bind_render_pipeline(*pipeline)?;
            paint(pass, SOURCE, 0.0)
        });
        let expected: Vec<f32> = (0..4)
            .map(|channel| if mask.bits() >> channel & 1 == 1 { SOURCE[channel] } else { TARGET[channel] })
            .collect();
        assert_eq!(pixels::<[f32; 4]>(&ctx, *drawn)[0].to_vec(), expected, "{mask:?}");
    }
}

/// Targets of different formats, blends and masks, all drawn to at once.
#[test]
fn eight_targets_get_what_is_theirs() {
    let Some(ctx) = device() else { return };
    let count = ctx.capabilities().limits.max_color_targets;
    if count < 8 {
        eprintln!("NOT TESTED, {} has {count} colour targets", ctx.capabilities().device_name);
        return;
    }
    let outputs: String = (0..8).map(|i| format!("layout(location = {i}) out vec4 out{i};\n")).collect();
    let writes: String = (0..8).map(|i| format!("out{i} = vec4({i}.5, {}, 0, 1);\n", i * i)).collect();
    let fragment = format!("{outputs} void main() {{ {writes} }}");
    let formats: Vec<Format> =
        (0..8).map(|i| if i % 2 == 0 { Format::Rgba32Float } else { Format::Rg32Float }).collect();
    let targets: Vec<ColorTarget> = (0..8)
        .map(|i| match i {
            2 => ColorTarget::blended(formats[2], Blend::ADDITIVE),
            3 => ColorTarget { write: ColorWriteMask::GREEN, ..ColorTarget::new(formats[3]) },
            _ => formats[i].into(),
        })
        .collect();
    let pipeline = pipeline(&ctx, &fragment, &targets);
    let drawn: Vec<_> = formats.iter().map(|format| target(&ctx, *format, [2, 2])).collect();
    let color: Vec<_> = drawn.iter().map(|texture| ColorAttachment::clear(**texture, [7.0; 4])).collect();
    run_pass(&ctx, &RenderPassDesc { color: &color, ..Default::default() }, |pass| {
        pass.bind_render_pipeline(*pipeline)?;
        paint(pass, [0.0; 4], 0.0)
    });
    for (i, texture) in drawn.iter().enumerate() {
        let found = pixels::<f32>(&ctx, **texture);
        let value = [i as f32 + 0.5, (i * i) as f32, 0.0, 1.0];
        let value = match i {
            2 => value.map(|channel| channel + 7.0),
            3 => [7.0, value[1], 0.0, 0.0],
            _ => value,
        };
        let channels = if i % 2 == 0 { 4 } else { 2 };
        let expected: Vec<f32> = value[..channels].repeat(4);
        assert_eq!(found, expected, "target {i}");
    }
}

#[test]
fn second_sources_are_refused_where_they_cannot_be() {
    let Some(ctx) = device() else { return };
    let part = BlendComponent::sum(BlendFactor::Src1Color, BlendFactor::One);
    let two = ColorTarget::blended(Format::Rgba8Unorm, Blend { color: part, ..Blend::ALPHA });
    let make = |ctx: &Context, fragment, color: &[ColorTarget]| {
        let stages = [(ShaderStage::Vertex, COVER), (ShaderStage::Fragment, fragment)];
        let desc = RenderPipelineDesc { color, debug_name: "two sources", ..Default::default() };
        staged_pipeline(ctx, &stages, &desc)
    };
    if has(&ctx, OptionalFeature::DualSourceBlend) {
        usage_error(make(&ctx, PAINT, &[two]), "index = 1");
        usage_error(make(&ctx, PAINT_TWO, &[two, Format::Rgba8Unorm.into()]), "one colour target");
    }
    let integers = ColorTarget::blended(Format::R32Uint, Blend::ALPHA);
    unsupported(make(&ctx, PAINT, &[integers]), "blending into R32Uint");
    let profile = DeviceProfile::core_only();
    let Some(bare) = device_with(|desc| desc.profile = Some(&profile)) else { return };
    unsupported(make(&bare, PAINT_TWO, &[two]), "dualSrcBlend: the device profile 'core-only' hides it");
}

/// Loaded contents are blended with, too.
#[test]
fn blending_goes_on_in_the_next_pass() {
    let Some(ctx) = device() else { return };
    let adding = pipeline(&ctx, PAINT, &[ColorTarget::blended(FORMAT, Blend::ADDITIVE)]);
    let drawn = target(&ctx, FORMAT, [1, 1]);
    let mut color = [ColorAttachment::clear(*drawn, [0.0; 4])];
    for _ in 0..3 {
        run_pass(&ctx, &RenderPassDesc { color: &color, ..Default::default() }, |pass| {
            pass.bind_render_pipeline(*adding)?;
            paint(pass, [1.0, 2.0, 0.0, 0.5], 0.0)
        });
        color[0].load = ColorLoadOp::Load;
    }
    assert_eq!(pixels::<[f32; 4]>(&ctx, *drawn), [[3.0, 6.0, 0.0, 1.5]]);
}
