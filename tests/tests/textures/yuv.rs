//! Y'CbCr textures: converted by BT.601, BT.709 and BT.2020, copied plane by plane, and refused where the device has
//! no conversion.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk::{
    Aspect, ComputePipelineDesc, Context, Dependencies, Error, Filter, Format, Holder, ShaderStage,
    SpecializationConstant, SpecializationValue, TextureDesc, TextureHandle, TextureKind, TextureRegion,
    TextureUsage, TextureViewDesc, YuvConversion, YuvModel, YuvRange,
};
use lvk_tests::compute::{Evaluator, module, read_vec4, vec4_buffer};
use lvk_tests::device::{TestDevice, device_with};
use lvk_tests::noise::noise;
use lvk_tests::subprocess::on_swiftshader;

const WIDTH: u32 = 8;
const HEIGHT: u32 = 4;
const FORMATS: [Format; 4] = [Format::Nv12, Format::Yuv420p8, Format::P010, Format::Yuv420p10];
const MODELS: [YuvModel; 3] = [YuvModel::Bt601, YuvModel::Bt709, YuvModel::Bt2020];

/// An image of one code for each texel of Y, Cb and Cr, of 8 or 10 bits.
struct Picture {
    bits: u32,
    codes: [Vec<u16>; 3],
}

impl Picture {
    fn new(format: Format, seed: u32) -> Self {
        let bits = if matches!(format, Format::Nv12 | Format::Yuv420p8) { 8 } else { 10 };
        let codes = [32, 8, 8].map(|count| {
            let bytes = noise(seed + count, count as usize);
            bytes.into_iter().map(|byte| u16::from(byte) << (bits - 8)).collect()
        });
        Self { bits, codes }
    }

    /// The planes as they lie in memory.
    fn planes(&self, format: Format) -> Vec<Vec<u8>> {
        let [y, cb, cr] = &self.codes;
        let both: Vec<u16> = cb.iter().zip(cr).flat_map(|(cb, cr)| [*cb, *cr]).collect();
        let planes = match format {
            Format::Nv12 | Format::P010 => vec![y.clone(), both],
            _ => vec![y.clone(), cb.clone(), cr.clone()],
        };
        let bytes = |code: u16| match self.bits {
            8 => vec![code as u8],
            _ => (code << 6).to_le_bytes().to_vec(),
        };
        planes.into_iter().map(|plane| plane.into_iter().flat_map(bytes).collect()).collect()
    }

    /// Returns the possible colours of a texel: between two chroma samples either is the nearest.
    fn colors(&self, model: YuvModel, range: YuvRange, i: usize) -> Vec<[f64; 3]> {
        let places = |place: usize, side: u32| [place / 2, place.div_ceil(2).min(side as usize / 2 - 1)];
        let (columns, rows) = (places(i % WIDTH as usize, WIDTH), places(i / WIDTH as usize, HEIGHT));
        let chroma =
            rows.into_iter().flat_map(|row| columns.map(|column| row * (WIDTH as usize / 2) + column));
        chroma.map(|chroma| self.color(model, range, i, chroma)).collect()
    }

    /// The colour of a texel with these colour differences.
    fn color(&self, model: YuvModel, range: YuvRange, i: usize, chroma: usize) -> [f64; 3] {
        let [y, cb, cr] = [self.codes[0][i], self.codes[1][chroma], self.codes[2][chroma]].map(f64::from);
        let step = f64::from(1 << (self.bits - 8));
        let most = f64::from((1 << self.bits) - 1);
        let middle = f64::from(1 << (self.bits - 1));
        let (y, [cb, cr]) = match range {
            YuvRange::Narrow => {
                ((y - 16.0 * step) / (219.0 * step), [cb, cr].map(|c| (c - middle) / (224.0 * step)))
            }
            YuvRange::Full => (y / most, [cb, cr].map(|c| (c - middle) / most)),
        };
        let (red, blue) = match model {
            YuvModel::Bt601 => (0.299, 0.114),
            YuvModel::Bt709 => (0.2126, 0.0722),
            YuvModel::Bt2020 => (0.2627, 0.0593),
        };
        let r = y + 2.0 * (1.0 - red) * cr;
        let b = y + 2.0 * (1.0 - blue) * cb;
        [r, (y - red * r - blue * b) / (1.0 - red - blue), b].map(|channel| channel.clamp(0.0, 1.0))
    }
}

/// A context with every format in every model and range, to the nearest texel.
fn yuv_device() -> Option<(TestDevice, Vec<YuvConversion>)> {
    let mut all = Vec::new();
    for format in FORMATS {
        for model in MODELS {
            for range in [YuvRange::Narrow, YuvRange::Full] {
                all.push(YuvConversion {
                    model,
                    range,
                    filter: Filter::Nearest,
                    ..YuvConversion::new(format)
                });
            }
        }
    }
    all.push(YuvConversion::new(Format::Nv12));
    let ctx = device_with(|desc| desc.yuv = &all)?;
    Some((ctx, all))
}

fn desc(format: Format, data: &[u8]) -> TextureDesc<'_> {
    TextureDesc {
        format,
        extent: [WIDTH, HEIGHT],
        data: Some(data),
        debug_name: "picture",
        ..Default::default()
    }
}

/// The colours of texels of textures in Y'CbCr, one after the other, by constants of specialisation.
fn colors(ctx: &Context, textures: &[Holder<TextureHandle>]) -> Vec<Vec<[f32; 4]>> {
    let count = WIDTH * HEIGHT;
    let numbers = 0..textures.len();
    let constants: String =
        numbers.clone().map(|n| format!("layout(constant_id = {n}) const uint picture{n} = 0;")).collect();
    let samples: String = numbers
        .map(|n| format!("result.values[{n} * {count} + i] = textureBindlessYUV(kYuv, picture{n}, uv);"))
        .collect();
    let text = format!(
        "LVK_YUV_TEXTURES(kYuv);
         layout(local_size_x = 1) in;
         {constants}
         layout(buffer_reference, scalar) writeonly buffer Result {{ vec4 values[]; }};
         layout(push_constant, scalar) uniform Push {{ Result result; }};
         void main() {{
             uint i = gl_GlobalInvocationID.x;
             vec2 uv = (vec2(i % {WIDTH}, i / {WIDTH}) + 0.5) / vec2({WIDTH}, {HEIGHT});
             {samples}
         }}"
    );
    let module = module(ctx, ShaderStage::Compute, &text);
    let constant = |(id, texture): (u32, &Holder<TextureHandle>)| SpecializationConstant {
        id,
        value: SpecializationValue::U32(texture.index()),
    };
    let constants: Vec<_> = (0..).zip(textures).map(constant).collect();
    let desc =
        ComputePipelineDesc { module: Some(*module), specialization: &constants, ..Default::default() };
    let pipeline = ctx.create_compute_pipeline(&desc).unwrap();
    let all = count * textures.len() as u32;
    let result = vec4_buffer(ctx, all);
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    cmd.bind_compute_pipeline(*pipeline).unwrap();
    cmd.push_constants(&ctx.buffer_address(*result).unwrap()).unwrap();
    let sampled: Vec<_> = textures.iter().map(|texture| **texture).collect();
    let dependencies = Dependencies { buffers: &[*result], sampled_images: &sampled, ..Default::default() };
    cmd.dispatch([count, 1, 1], &dependencies).unwrap();
    ctx.submit(cmd).unwrap();
    read_vec4(ctx, *result, all).chunks(count as usize).map(<[_]>::to_vec).collect()
}

fn check_conversions(ctx: &Context, all: &[YuvConversion]) {
    let (mut textures, mut images) = (Vec::new(), Vec::new());
    for (seed, (number, conversion)) in (0..).zip(all.iter().enumerate()) {
        let YuvConversion { format, filter, .. } = *conversion;
        if filter == Filter::Linear {
            continue;
        }
        let image = Picture::new(format, 40 * seed);
        let data = image.planes(format).concat();
        match ctx.create_texture(&TextureDesc { conversion: Some(number), ..desc(format, &data) }) {
            Ok(texture) => {
                textures.push(texture);
                images.push((conversion, image));
            }
            Err(Error::Unsupported { why, .. }) => {
                assert!(!matches!(format, Format::Nv12 | Format::Yuv420p8), "{format:?}: {why}");
                eprintln!("NOT TESTED, {format:?}: {why}");
            }
            Err(other) => unreachable!("{conversion:?}: {other}"),
        }
    }
    assert!(images.len() >= 12, "the formats of 8 bits in all models and ranges");
    for ((conversion, image), found) in images.iter().zip(colors(ctx, &textures)) {
        for (i, found) in found.into_iter().enumerate() {
            let expected = image.colors(conversion.model, conversion.range, i);
            let far = |(found, expected): (&f32, &f64)| (f64::from(found.clamp(0.0, 1.0)) - expected).abs();
            let close = |color: &[f64; 3]| found.iter().zip(color).map(far).all(|far| far < 2.0 / 255.0);
            assert!(expected.iter().any(close), "{conversion:?} {i}: {found:?} not {expected:?}");
        }
    }
}

#[test]
fn colours_are_those_of_the_standards() {
    let Some((ctx, all)) = yuv_device() else { return };
    check_conversions(&ctx, &all);
}

#[test]
fn colours_are_those_of_the_standards_on_another_driver() {
    on_swiftshader(colours_are_those_of_the_standards_on_another_driver, || {
        let Some((ctx, all)) = yuv_device() else { return };
        check_conversions(&ctx, &all[..12]);
    });
}

#[test]
fn planes_are_moved_and_seen_one_by_one() {
    let Some((ctx, _)) = yuv_device() else { return };
    for format in FORMATS {
        let image = Picture::new(format, 7);
        let planes = image.planes(format);
        let data = planes.concat();
        let Ok(texture) = ctx.create_texture(&desc(format, &data)) else {
            eprintln!("NOT TESTED, the device lacks {format:?}");
            continue;
        };
        for (number, expected) in (0..).zip(&planes) {
            let whole = TextureRegion { aspect: Aspect::Plane(number), ..Default::default() };
            assert_eq!(&ctx.download_texture(*texture, &whole).unwrap(), expected, "{format:?} {number}");
            let part = TextureRegion { offset: [1, 1], extent: [2, 1], ..whole };
            let size = ctx.download_texture(*texture, &part).unwrap().len();
            ctx.upload_texture(*texture, &part, &vec![0x40; size]).unwrap();
            assert_eq!(ctx.download_texture(*texture, &part).unwrap(), vec![0x40; size]);
            let view =
                TextureViewDesc { texture: Some(*texture), aspect: whole.aspect, ..Default::default() };
            let view = ctx.create_texture_view(&view).unwrap();
            let fetch = Evaluator::new(&ctx, "textureBindlessFetch2D(a, ivec2(1, 1), 0)");
            let found = fetch.run(&ctx, [view.index(), 0, 0], 1, &Dependencies::default())[0][0];
            let expected = if image.bits == 8 { 64.0 / 255.0 } else { f32::from(0x4040_u16) / 65_535.0 };
            assert!((found - expected).abs() < 1e-3, "{format:?} {number}: {found}");
            let through = TextureRegion { aspect: Aspect::Main, ..part };
            assert_eq!(ctx.download_texture(*view, &through).unwrap(), vec![0x40; size]);
        }
        let wide = TextureRegion { aspect: Aspect::Plane(1), extent: [5, 1], ..Default::default() };
        for wrong in [TextureRegion::default(), wide, TextureRegion { aspect: Aspect::Plane(3), ..wide }] {
            let result = ctx.download_texture(*texture, &wrong);
            assert!(matches!(result, Err(Error::InvalidUsage { .. })), "{wrong:?}: {result:?}");
        }
    }
}

#[test]
fn slots_run_out_and_are_freed_and_empty_ones_are_black() {
    let Some(ctx) = device_with(|desc| desc.max_yuv_textures = 2) else { return };
    let data = [128; 48];
    let make = || ctx.create_texture(&desc(Format::Nv12, &data));
    let (first, second) = (make().unwrap(), make().unwrap());
    let error = make().unwrap_err();
    assert!(matches!(error, Error::LimitExceeded { limit: 2, .. }), "{error}");
    assert_ne!(first.index(), second.index());
    let first = [first];
    let grey = colors(&ctx, &first)[0][5];
    let [first] = first;
    let expected = (128.0 - 16.0) / 219.0;
    assert!(grey[..3].iter().all(|channel| (channel - expected).abs() < 2.0 / 255.0), "{grey:?}");
    let index = first.index();
    drop(first);
    ctx.wait_idle().unwrap();
    let third = make().unwrap();
    assert_eq!(third.index(), index);
    let other = ctx.create_texture(&desc(Format::Yuv420p8, &data)).unwrap();
    assert!(other.index() != second.index() && other.index() != third.index());
}

#[test]
fn usages_that_ycbcr_textures_exclude_are_errors() {
    let conversions = [YuvConversion::new(Format::Nv12), YuvConversion::new(Format::R8Unorm)];
    let Some(ctx) = device_with(|desc| desc.yuv = &conversions) else { return };
    let data = [0; 48];
    let plain = desc(Format::Nv12, &data);
    let wrong = [
        TextureDesc { extent: [7, 4], data: None, ..plain },
        TextureDesc { extent: [8, 3], data: None, ..plain },
        TextureDesc { kind: TextureKind::Cube, extent: [4, 4], data: None, ..plain },
        TextureDesc { mips: 2, data: None, ..plain },
        TextureDesc { usage: TextureUsage::SAMPLED | TextureUsage::STORAGE, ..plain },
        TextureDesc { usage: TextureUsage::TARGET, ..plain },
        TextureDesc { view_formats: &[Format::R8Unorm], ..plain },
        TextureDesc { generate_mips: true, ..plain },
        TextureDesc { data: Some(&data[..32]), ..plain },
        TextureDesc { conversion: Some(1), ..plain },
        TextureDesc { conversion: Some(9), ..plain },
        TextureDesc { format: Format::Yuv420p8, ..plain },
    ];
    for (index, desc) in wrong.iter().enumerate() {
        let error = ctx.create_texture(desc).unwrap_err();
        assert!(
            matches!(&error, Error::InvalidUsage { object, .. } if object == "picture"),
            "{index}: {error}"
        );
    }
    let texture = ctx.create_texture(&plain).unwrap();
    let view = TextureViewDesc { texture: Some(*texture), ..Default::default() };
    assert!(matches!(ctx.create_texture_view(&view), Err(Error::InvalidUsage { .. })));
    let stored = TextureViewDesc { aspect: Aspect::Plane(0), usage: Some(TextureUsage::STORAGE), ..view };
    assert!(matches!(ctx.create_texture_view(&stored), Err(Error::InvalidUsage { .. })));
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    let (whole, range) = (TextureRegion::default(), lvk::TextureRange::default());
    assert!(cmd.clear_texture(*texture, lvk::ClearValue::Color([0.0; 4]), &range).is_err());
    assert!(cmd.blit_texture(*texture, &whole, *texture, &whole, Filter::Nearest).is_err());
    assert!(cmd.generate_mipmaps(*texture).is_err());
}

#[test]
fn without_conversions_the_textures_are_refused() {
    let hidden = lvk::DeviceProfile::core_only();
    let Some(ctx) = device_with(|desc| desc.profile = Some(&hidden)) else { return };
    let error = ctx.create_texture(&desc(Format::Nv12, &[0; 48])).unwrap_err();
    assert!(matches!(error, Error::Unsupported { .. }), "{error}");
    drop(ctx.create_texture(&TextureDesc::default()).unwrap());
}
