//! Samplers: filters, address modes, levels of detail and comparisons as shaders see them.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk::{
    AddressMode, BorderColor, CompareOp, Context, Dependencies, Error, Filter, Format, Holder,
    OptionalFeature, SamplerDesc, SamplerReductionMode, TextureDesc, TextureHandle, TextureKind,
    TextureRegion,
};
use lvk_tests::compute::Evaluator;
use lvk_tests::device;

/// Four texels in a row: 1, 2, 3 and 4.
fn row_texture(ctx: &Context) -> Holder<TextureHandle> {
    let data = [1.0_f32, 2.0, 3.0, 4.0];
    let desc = TextureDesc {
        format: Format::R32Float,
        extent: [4, 1],
        data: Some(bytemuck::cast_slice(&data)),
        ..Default::default()
    };
    ctx.create_texture(&desc).unwrap()
}

/// Samples `texture` at the u that `u` says for each invocation `i`, as far as `count`.
fn sample(ctx: &Context, texture: u32, desc: &SamplerDesc<'_>, u: &str, count: u32) -> Vec<f32> {
    let sampler = ctx.create_sampler(desc).unwrap();
    let expression = format!("textureBindless2DLod(a, b, vec2({u}, 0.5), 0.0)");
    let words = [texture, sampler.index(), 0];
    let found = Evaluator::new(ctx, &expression).run(ctx, words, count, &Dependencies::default());
    found.into_iter().map(|value| value[0]).collect()
}

fn nearest(address: AddressMode) -> SamplerDesc<'static> {
    SamplerDesc {
        mag_filter: Filter::Nearest,
        min_filter: Filter::Nearest,
        mip_filter: Filter::Nearest,
        address: [address; 3],
        ..Default::default()
    }
}

#[test]
fn nearest_takes_a_texel_and_linear_a_mean() {
    let Some(ctx) = device() else { return };
    let texture = row_texture(&ctx);
    let between = "(0.8 + i) / 4.0";
    let found = sample(&ctx, texture.index(), &nearest(AddressMode::ClampToEdge), between, 4);
    assert_eq!(found, [1.0, 2.0, 3.0, 4.0]);
    let linear = SamplerDesc { address: [AddressMode::ClampToEdge; 3], ..Default::default() };
    let found = sample(&ctx, texture.index(), &linear, between, 4);
    assert!(found.iter().zip([1.3, 2.3, 3.3, 4.0]).all(|(a, b)| (a - b).abs() < 0.01), "{found:?}");
}

#[test]
fn address_modes_say_what_lies_outside() {
    let Some(ctx) = device() else { return };
    let texture = row_texture(&ctx);
    let expected = [
        (AddressMode::Repeat, [3.0, 4.0, 1.0, 2.0, 3.0, 4.0, 1.0, 2.0]),
        (AddressMode::MirroredRepeat, [2.0, 1.0, 1.0, 2.0, 3.0, 4.0, 4.0, 3.0]),
        (AddressMode::ClampToEdge, [1.0, 1.0, 1.0, 2.0, 3.0, 4.0, 4.0, 4.0]),
        (AddressMode::ClampToBorder, [0.0, 0.0, 1.0, 2.0, 3.0, 4.0, 0.0, 0.0]),
    ];
    for (mode, expected) in expected {
        let found = sample(&ctx, texture.index(), &nearest(mode), "(float(i) - 1.5) / 4.0", 8);
        assert_eq!(found, expected, "{mode:?}");
    }
}

#[test]
fn address_modes_differ_along_the_axes() {
    let Some(ctx) = device() else { return };
    let data = [1.0_f32, 2.0, 3.0, 4.0];
    let data = Some(bytemuck::cast_slice(&data));
    let desc = TextureDesc { format: Format::R32Float, extent: [2, 2], data, ..Default::default() };
    let texture = ctx.create_texture(&desc).unwrap();
    let address = [AddressMode::Repeat, AddressMode::ClampToEdge, AddressMode::Repeat];
    let sampler = ctx.create_sampler(&SamplerDesc { address, ..nearest(AddressMode::Repeat) }).unwrap();
    let outside = Evaluator::new(&ctx, "textureBindless2D(a, b, vec2(1.25, 1.25))");
    let found = outside.run(&ctx, [texture.index(), sampler.index(), 0], 1, &Dependencies::default());
    assert_eq!(found[0][0], 3.0);
}

#[test]
fn levels_of_detail_are_biased_and_clamped() {
    let Some(ctx) = device() else { return };
    let desc = TextureDesc { format: Format::R32Float, extent: [8, 8], mips: 0, ..Default::default() };
    let texture = ctx.create_texture(&desc).unwrap();
    for mip in 0..4 {
        let values = vec![mip as f32; 1 << (2 * (3 - mip))];
        let region = TextureRegion { mip, ..Default::default() };
        ctx.upload_texture(*texture, &region, bytemuck::cast_slice(&values)).unwrap();
    }
    let lods = |desc: SamplerDesc<'_>| {
        let sampler = ctx.create_sampler(&desc).unwrap();
        let expression = "textureBindless2DLod(a, b, vec2(0.5), 0.5 * i)";
        let words = [texture.index(), sampler.index(), 0];
        let found = Evaluator::new(&ctx, expression).run(&ctx, words, 7, &Dependencies::default());
        found.into_iter().map(|value| value[0]).collect::<Vec<_>>()
    };
    let close =
        |a: &[f32], b: &[f32]| a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() < 0.01);
    let plain = lods(SamplerDesc::default());
    assert!(close(&plain, &[0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0]), "{plain:?}");
    let clamped = lods(SamplerDesc { lod_range: [1.0, 2.0], ..Default::default() });
    assert!(close(&clamped, &[1.0, 1.0, 1.0, 1.5, 2.0, 2.0, 2.0]), "{clamped:?}");
    let biased = lods(SamplerDesc { lod_bias: 1.0, ..Default::default() });
    assert!(close(&biased, &[1.0, 1.5, 2.0, 2.5, 3.0, 3.0, 3.0]), "{biased:?}");
}

#[test]
fn comparison_samplers_compare_the_reference_with_the_texel() {
    let Some(ctx) = device() else { return };
    let data = Some(bytemuck::cast_slice(&[0.5_f32]));
    let depth = TextureDesc { format: Format::D32Float, data, ..Default::default() };
    let depth = ctx.create_texture(&depth).unwrap();
    let expected = [
        (CompareOp::Never, [0.0, 0.0, 0.0]),
        (CompareOp::Less, [1.0, 0.0, 0.0]),
        (CompareOp::Equal, [0.0, 1.0, 0.0]),
        (CompareOp::LessOrEqual, [1.0, 1.0, 0.0]),
        (CompareOp::Greater, [0.0, 0.0, 1.0]),
        (CompareOp::NotEqual, [1.0, 0.0, 1.0]),
        (CompareOp::GreaterOrEqual, [0.0, 1.0, 1.0]),
        (CompareOp::Always, [1.0, 1.0, 1.0]),
    ];
    let compare = Evaluator::new(&ctx, "vec4(textureBindless2DShadow(a, b, vec3(0.5, 0.5, 0.25 * (i + 1))))");
    for (op, expected) in expected {
        let sampler = SamplerDesc { compare: Some(op), ..nearest(AddressMode::ClampToEdge) };
        let sampler = ctx.create_sampler(&sampler).unwrap();
        let words = [depth.index(), sampler.index(), 0];
        let found = compare.run(&ctx, words, 3, &Dependencies::default());
        assert_eq!(found.iter().map(|value| value[0]).collect::<Vec<_>>(), expected, "{op:?}");
    }
}

#[test]
fn odd_numbers_are_errors_or_clamped() {
    let Some(ctx) = device() else { return };
    let wrong = [
        SamplerDesc { lod_range: [2.0, 1.0], ..Default::default() },
        SamplerDesc { lod_range: [f32::NAN, 1.0], ..Default::default() },
        SamplerDesc { lod_bias: f32::NAN, ..Default::default() },
        SamplerDesc { max_anisotropy: f32::NAN, ..Default::default() },
    ];
    for desc in wrong {
        let made = ctx.create_sampler(&SamplerDesc { debug_name: "odd one", ..desc });
        assert!(matches!(&made, Err(Error::InvalidUsage { object, .. }) if object == "odd one"), "{made:?}");
    }
    for max_anisotropy in [-1.0, 0.0, 1.0e9, f32::INFINITY] {
        drop(ctx.create_sampler(&SamplerDesc { max_anisotropy, ..Default::default() }).unwrap());
    }
    let limit = ctx.capabilities().limits.max_lod_bias;
    for lod_bias in [limit, -limit] {
        drop(ctx.create_sampler(&SamplerDesc { lod_bias, ..Default::default() }).unwrap());
    }
    let compared = SamplerDesc {
        compare: Some(CompareOp::Less),
        reduction: SamplerReductionMode::Min,
        ..Default::default()
    };
    for desc in [
        SamplerDesc { lod_bias: limit + 0.5, ..Default::default() },
        SamplerDesc { lod_bias: f32::NEG_INFINITY, ..Default::default() },
        compared,
    ] {
        let error = ctx.create_sampler(&desc).unwrap_err();
        assert!(matches!(error, Error::InvalidUsage { .. }), "{error}");
    }
}

#[test]
fn samplers_run_out_and_are_freed() {
    let Some(ctx) = device() else { return };
    let limit = ctx.capabilities().limits.max_bindless_samplers;
    let mut samplers: Vec<_> =
        (1..limit).map(|_| ctx.create_sampler(&SamplerDesc::default()).unwrap()).collect();
    let error = ctx.create_sampler(&SamplerDesc::default()).unwrap_err();
    assert!(matches!(error, Error::LimitExceeded { .. }), "{error}");
    samplers.truncate(samplers.len() / 2);
    ctx.wait_idle().unwrap();
    let texture = row_texture(&ctx);
    let found = sample(&ctx, texture.index(), &nearest(AddressMode::Repeat), "(0.5 + i) / 4.0", 4);
    assert_eq!(found, [1.0, 2.0, 3.0, 4.0]);
}

/// Returns the sampled colour beyond the edge of one texel of 0.5.
fn beyond(ctx: &Context, border: BorderColor) -> [f32; 4] {
    let data = Some(&[128; 4][..]);
    let texture = ctx.create_texture(&TextureDesc { data, ..Default::default() }).unwrap();
    let sampler = SamplerDesc { border, ..nearest(AddressMode::ClampToBorder) };
    let sampler = ctx.create_sampler(&sampler).unwrap();
    let fetch = Evaluator::new(ctx, "textureBindless2DLod(a, b, vec2(1.5, 0.5), 0.0)");
    fetch.run(ctx, [texture.index(), sampler.index(), 0], 1, &Dependencies::default())[0]
}

#[test]
fn borders_have_the_colour_asked_for() {
    let Some(ctx) = device() else { return };
    let colors = [
        (BorderColor::TransparentBlack, [0.0; 4]),
        (BorderColor::OpaqueBlack, [0.0, 0.0, 0.0, 1.0]),
        (BorderColor::OpaqueWhite, [1.0; 4]),
    ];
    for (border, expected) in colors {
        assert_eq!(beyond(&ctx, border), expected, "{border:?}");
    }
    // Colours that texels can store: some devices round to them.
    let color = [64.0, 127.0, 191.0, 32.0].map(|byte: f32| byte / 255.0);
    let own = SamplerDesc { border: BorderColor::Custom(color), ..Default::default() };
    if !ctx.capabilities().has(OptionalFeature::CustomBorderColorWithoutFormat) {
        let error = ctx.create_sampler(&own).unwrap_err();
        assert!(matches!(error, Error::Unsupported { .. }), "{error}");
        return;
    }
    let found = beyond(&ctx, own.border);
    assert!(found.iter().zip(color).all(|(found, asked)| (found - asked).abs() < 1e-5), "{found:?}");
    let limit = ctx.capabilities().limits.max_custom_borders;
    let few = limit.min(ctx.capabilities().limits.max_bindless_samplers - 2);
    ctx.wait_idle().unwrap();
    let samplers: Vec<_> = (0..few).map(|_| ctx.create_sampler(&own).unwrap()).collect();
    if few == limit {
        let error = ctx.create_sampler(&own).unwrap_err();
        assert!(matches!(error, Error::LimitExceeded { .. }), "{error}");
    }
    drop(samplers);
    ctx.wait_idle().unwrap();
    drop(ctx.create_sampler(&own).unwrap());
}

#[test]
fn without_optional_features_samplers_are_refused_by_name() {
    let hidden = lvk::DeviceProfile::core_only();
    let Some(ctx) = lvk_tests::device::device_with(|desc| desc.profile = Some(&hidden)) else { return };
    let refused = [
        (nearest(AddressMode::MirrorClampToEdge), "samplerMirrorClampToEdge"),
        (SamplerDesc { reduction: SamplerReductionMode::Max, ..Default::default() }, "samplerFilterMinmax"),
        (SamplerDesc { border: BorderColor::Custom([0.0; 4]), ..Default::default() }, "customBorderColors"),
    ];
    for (desc, feature) in refused {
        let error = ctx.create_sampler(&desc).unwrap_err();
        assert!(matches!(error, Error::Unsupported { .. }) && error.to_string().contains(feature), "{error}");
    }
    for format in [Format::Bc1RgbUnorm, Format::Etc2Rgb8Unorm, Format::Astc4x4Unorm, Format::A8Unorm] {
        let error = ctx.create_texture(&TextureDesc { format, ..Default::default() }).unwrap_err();
        assert!(matches!(error, Error::Unsupported { .. }), "{format:?}: {error}");
    }
}

#[test]
fn mirrors_and_reductions_take_the_texels_they_name() {
    let Some(ctx) = device() else { return };
    let texture = row_texture(&ctx);
    let optional = |feature| {
        let has = ctx.capabilities().has(feature);
        if !has {
            eprintln!("NOT TESTED, the device lacks {feature:?}");
        }
        has
    };
    if optional(OptionalFeature::MirrorClampToEdge) {
        let desc = nearest(AddressMode::MirrorClampToEdge);
        let found = sample(&ctx, texture.index(), &desc, "(i - 5.5) / 4.0", 12);
        assert_eq!(found, [4.0, 4.0, 4.0, 3.0, 2.0, 1.0, 1.0, 2.0, 3.0, 4.0, 4.0, 4.0]);
    }
    if optional(OptionalFeature::FilterMinMax) && ctx.format_support(Format::R32Float).unwrap().min_max {
        for (reduction, expected) in
            [(SamplerReductionMode::Min, [1.0, 2.0, 3.0]), (SamplerReductionMode::Max, [2.0, 3.0, 4.0])]
        {
            let address = [AddressMode::ClampToEdge; 3];
            let desc = SamplerDesc { reduction, address, ..Default::default() };
            assert_eq!(sample(&ctx, texture.index(), &desc, "(0.9 + i) / 4.0", 3), expected, "{reduction:?}");
        }
    }
}

#[test]
fn helpers_of_further_shapes_compare_and_gather() {
    let Some(ctx) = device() else { return };
    let values: Vec<f32> = (0..24).map(|i| i as f32 / 24.0).collect();
    let make = |kind, format| {
        let data = Some(bytemuck::cast_slice(&values));
        ctx.create_texture(&TextureDesc { kind, format, extent: [2, 2], data, ..Default::default() }).unwrap()
    };
    let cube = make(TextureKind::Cube, Format::D32Float);
    let array = make(TextureKind::D2Array { layers: 6 }, Format::D32Float);
    let greater = SamplerDesc { compare: Some(CompareOp::Greater), ..nearest(AddressMode::ClampToEdge) };
    let greater = ctx.create_sampler(&greater).unwrap();
    let none = Dependencies::default();
    let words = |texture: u32| [texture, greater.index(), 0];
    // The face -Z holds texels 20 to 23 of 24, the layer 5 likewise.
    let shadow =
        Evaluator::new(&ctx, "vec4(textureBindlessCubeShadow(a, b, vec4(0.5, 0.5, -1, (18.5 + i) / 24.0)))");
    let found: Vec<f32> = shadow.run(&ctx, words(cube.index()), 5, &none).iter().map(|v| v[0]).collect();
    let first = found.iter().position(|passed| *passed == 1.0).unwrap();
    assert!((2..=5).contains(&first) && found[first..].iter().all(|passed| *passed == 1.0), "{found:?}");
    let shadow = Evaluator::new(
        &ctx,
        "vec4(textureBindless2DArrayShadow(a, b, vec4(0.25, 0.25, 5, (18.5 + i) / 24.0)))",
    );
    let found: Vec<f32> = shadow.run(&ctx, words(array.index()), 4, &none).iter().map(|v| v[0]).collect();
    assert_eq!(found, [0.0, 0.0, 1.0, 1.0]);
    let data: Vec<u8> = (0..16).collect();
    let texture =
        ctx.create_texture(&TextureDesc { extent: [2, 2], data: Some(&data), ..Default::default() });
    let texture = texture.unwrap();
    let sampler = ctx.create_sampler(&nearest(AddressMode::ClampToEdge)).unwrap();
    let gather = Evaluator::new(&ctx, "255.0 * textureBindless2DGatherChannel(a, b, vec2(0.5), 2)");
    let [found] = gather.run(&ctx, [texture.index(), sampler.index(), 0], 1, &none)[..] else {
        unreachable!()
    };
    assert_eq!(found.map(f32::round), [10.0, 14.0, 6.0, 2.0]);
}
