//! Images of the `yuv` sample: sampled colours equal those computed from the planes, in every format and by every
//! conversion, and the image equals the reference.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use image::RgbaImage;
use lvk::{Context, DeviceProfile, Error};
use lvk_samples::app::sample::Sample;
use lvk_samples::app::sample_error::SampleError;
use lvk_samples::yuv::{CONVERSIONS, SyntheticVideo, Yuv, YuvConfig, YuvFormat, YuvModel, YuvRange};
use lvk_tests::device::TestDevice;
use lvk_tests::device_with;
use lvk_tests::image_comparison::{
    ImageSimilarity, Tolerance, assert_matches_reference, assert_similar, reference_image, write_test_image,
};
use lvk_tests::raster_sample::{
    ROUND, SIZE, assert_loops_without_seam, assert_refuses_impossible_sizes, image_now, image_of,
};
use lvk_tests::subprocess::on_swiftshader;

/// As computed: but for the weights of colour differences between texels, which drivers round.
const AS_COMPUTED: Tolerance = Tolerance { psnr: 46.0, ssim: 0.998, differing_share: 0.2, flip: 0.025 };
/// As it was before it was encoded, when colour differences had the same size as the image.
const AS_SOURCE: Tolerance = Tolerance { psnr: 24.0, ssim: 0.9, differing_share: 1.0, flip: 0.1 };
const FRAME: u32 = 30;

fn yuv_device() -> Option<TestDevice> {
    device_with(|desc| desc.yuv = &CONVERSIONS)
}

/// A texel for each pixel.
fn usual() -> YuvConfig {
    YuvConfig { video_size: SIZE, ..YuvConfig::new(SIZE) }
}

fn sample(ctx: &Context, config: &YuvConfig) -> Yuv {
    Yuv::new(ctx, config).unwrap()
}

/// Numbers of a plane, 0 to 1.
fn decode_plane(plane: &[u8], format: YuvFormat) -> Vec<f64> {
    match format.bits() {
        8 => plane.iter().map(|byte| f64::from(*byte)).collect(),
        _ => plane.chunks(2).map(|two| f64::from(u16::from_le_bytes([two[0], two[1]]) >> 6)).collect(),
    }
}

/// Returns the colours of the planes: chroma samples are at every second texel of every second row.
fn computed(planes: &[Vec<u8>], config: &YuvConfig, format: YuvFormat) -> RgbaImage {
    let all: Vec<_> = planes.iter().map(|plane| decode_plane(plane, format)).collect();
    let [width, height] = config.video_size.map(|side| side as usize);
    let difference = |number: usize, column: usize, row: usize| {
        let at = row.min(height / 2 - 1) * (width / 2) + column.min(width / 2 - 1);
        if all.len() == 2 { all[1][2 * at + number] } else { all[1 + number][at] }
    };
    let between = |number: usize, x: usize, y: usize| {
        let corners = [(x / 2, y / 2), (x.div_ceil(2), y / 2), (x / 2, y.div_ceil(2))];
        let last = (x.div_ceil(2), y.div_ceil(2));
        corners.into_iter().chain([last]).map(|(x, y)| difference(number, x, y)).sum::<f64>() / 4.0
    };
    RgbaImage::from_fn(width as u32, height as u32, |x, y| {
        let (x, y) = (x as usize, y as usize);
        let code = [all[0][y * width + x], between(0, x, y), between(1, x, y)];
        let [red, green, blue] =
            decoded(code, config, format).map(|value| (255.0 * value.clamp(0.0, 1.0)).round() as u8);
        image::Rgba([red, green, blue, 255])
    })
}

/// The equations of BT.601, BT.709 and BT.2020.
fn decoded([y, cb, cr]: [f64; 3], config: &YuvConfig, format: YuvFormat) -> [f64; 3] {
    let step = f64::from(1 << (format.bits() - 8));
    let most = f64::from((1 << format.bits()) - 1);
    let (y, cb, cr) = match config.range {
        YuvRange::Narrow => {
            let part = |c: f64| (c / step - 128.0) / 224.0;
            ((y / step - 16.0) / 219.0, part(cb), part(cr))
        }
        YuvRange::Full => (y / most, (cb - 128.0 * step) / most, (cr - 128.0 * step) / most),
    };
    let (red, blue) = match config.model {
        YuvModel::Bt601 => (0.299, 0.114),
        YuvModel::Bt709 => (0.2126, 0.0722),
        YuvModel::Bt2020 => (0.2627, 0.0593),
    };
    let (r, b) = (y + 2.0 * (1.0 - red) * cr, y + 2.0 * (1.0 - blue) * cb);
    [r, (y - red * r - blue * b) / (1.0 - red - blue), b]
}

fn source() -> RgbaImage {
    let video = SyntheticVideo { size: SIZE, phase: FRAME as f32 / ROUND as f32 };
    RgbaImage::from_fn(SIZE[0], SIZE[1], |x, y| {
        let [red, green, blue] = (255.0 * video.color(x, y)).to_array().map(|value| value.round() as u8);
        image::Rgba([red, green, blue, 255])
    })
}

#[test]
fn every_format_and_conversion_is_as_computed() {
    let Some(ctx) = yuv_device() else { return };
    let formats = sample(&ctx, &usual()).formats().to_vec();
    assert!(formats.contains(&YuvFormat::Nv12) && formats.contains(&YuvFormat::I420), "{formats:?}");
    for missing in YuvFormat::ALL.iter().filter(|format| !formats.contains(format)) {
        eprintln!("NOT TESTED, the device has no {missing:?}");
    }
    let source = source();
    for format in formats {
        for model in YuvModel::ALL {
            for range in [YuvRange::Narrow, YuvRange::Full] {
                let config = YuvConfig { format: Some(format), model, range, ..usual() };
                let mut sample = sample(&ctx, &config);
                let image = image_of(&mut sample, FRAME);
                let what = format!("{format:?} {model:?} {range:?}");
                assert_similar(&what, &image, &computed(&sample.planes(), &config, format), &AS_COMPUTED);
                assert_similar(&format!("{what} source"), &image, &source, &AS_SOURCE);
            }
        }
    }
}

/// Proves that the comparison above notices a wrong matrix or range.
#[test]
fn other_conversions_render_other_images() {
    let Some(ctx) = yuv_device() else { return };
    let mut sample = sample(&ctx, &usual());
    let (image, planes, format) = (image_of(&mut sample, FRAME), sample.planes(), sample.format());
    for (model, range) in [
        (YuvModel::Bt601, YuvRange::Narrow),
        (YuvModel::Bt2020, YuvRange::Narrow),
        (YuvModel::Bt709, YuvRange::Full),
    ] {
        let other = computed(&planes, &YuvConfig { model, range, ..usual() }, format);
        let similarity = ImageSimilarity::measure(&image, &other);
        assert!(!similarity.is_within(&AS_COMPUTED), "{model:?} {range:?}: {similarity}");
    }
}

#[test]
fn the_next_format_follows_and_the_first_comes_again() {
    let Some(ctx) = yuv_device() else { return };
    let mut sample = sample(&ctx, &usual());
    let formats = sample.formats().to_vec();
    let first = image_of(&mut sample, FRAME);
    for number in 1..=formats.len() {
        sample.next();
        let image = image_now(&mut sample);
        assert_eq!(sample.format(), formats[number % formats.len()]);
        assert_similar("the next format", &image, &source(), &AS_SOURCE);
    }
    assert!(image_now(&mut sample) == first);
}

/// Pixels that show planes are grey.
#[test]
fn planes_are_drawn_as_greys() {
    let Some(ctx) = yuv_device() else { return };
    let image = image_of(&mut sample(&ctx, &YuvConfig { shows_planes: true, ..usual() }), FRAME);
    write_test_image("yuv planes", &image);
    let place = |share: f32, side: u32| (share * side as f32) as u32;
    for which in [0.1, 0.4, 0.7] {
        for across in [0.06, 0.15, 0.25] {
            let pixel = image.get_pixel(place(across, SIZE[0]), place(which, SIZE[1]));
            let [red, green, blue, _] = pixel.0;
            assert!(red.abs_diff(green) <= 1 && green.abs_diff(blue) <= 1, "{which} {across}: {pixel:?}");
        }
    }
}

#[test]
fn a_round_has_no_seam() {
    let Some(ctx) = yuv_device() else { return };
    assert_loops_without_seam(&mut sample(&ctx, &usual()));
}

#[test]
fn the_card_looks_as_it_always_did() {
    let Some(ctx) = yuv_device() else { return };
    let config = YuvConfig { shows_planes: true, ..usual() };
    assert_matches_reference("yuv_small", &image_of(&mut sample(&ctx, &config), FRAME));
}

#[test]
fn another_driver_renders_it() {
    on_swiftshader(another_driver_renders_it, || {
        let Some(ctx) = yuv_device() else { return };
        let mut sample = sample(&ctx, &YuvConfig { shows_planes: true, ..usual() });
        let image = image_of(&mut sample, FRAME);
        assert_similar("SwiftShader card", &image, &reference_image("yuv_small"), &AS_COMPUTED);
    });
}

#[test]
fn devices_without_conversions_are_refused_by_name() {
    let profile = DeviceProfile::core_only();
    let Some(ctx) = device_with(|desc| (desc.yuv, desc.profile) = (&CONVERSIONS, Some(&profile))) else {
        return;
    };
    for format in [None, Some(YuvFormat::P010)] {
        match Yuv::new(&ctx, &YuvConfig { format, ..usual() }).err() {
            Some(SampleError::Device(Error::Unsupported { .. })) => {}
            other => unreachable!("{format:?}: {other:?}"),
        }
    }
}

#[test]
fn impossible_images_are_refused() {
    let Some(ctx) = yuv_device() else { return };
    assert_refuses_impossible_sizes(|extent| Yuv::new(&ctx, &YuvConfig { extent, ..usual() }));
}
