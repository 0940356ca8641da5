//! Images of the `hello_triangle` sample: every pixel has the computed colour, with every optional feature and with
//! hardly any.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};
use image::RgbaImage;
use lvk::{Context, DeviceProfile};
use lvk_samples::hello_triangle::HelloTriangle;
use lvk_tests::image_comparison::{Tolerance, assert_matches_reference, assert_similar, reference_image};
use lvk_tests::raster_sample::{
    ROUND, SIZE, assert_loops_without_seam, assert_refuses_impossible_sizes, image_of,
};
use lvk_tests::subprocess::on_swiftshader;
use lvk_tests::{device, device_with};

/// Tolerance on SwiftShader, which rounds colours differently and has other sample positions.
const OTHER_DRIVER: Tolerance = Tolerance { psnr: 40.0, ssim: 0.99, differing_share: 0.05, flip: 0.01 };
/// Colours of the corners, in linear light.
const COLORS: [Vec3; 3] = [Vec3::new(0.9, 0.02, 0.08), Vec3::new(0.0, 0.62, 0.2), Vec3::new(0.03, 0.12, 1.0)];
const BACKDROP: Vec3 = Vec3::new(0.012, 0.014, 0.022);

fn triangle(ctx: &Context) -> HelloTriangle {
    HelloTriangle::new(ctx, SIZE).unwrap_or_else(|error| unreachable!("{error}"))
}

fn encoded(linear: Vec3) -> [u8; 3] {
    let curve = |value: f32| match value {
        ..=0.003_130_8 => 12.92 * value,
        _ => 1.055 * value.powf(1.0 / 2.4) - 0.055,
    };
    linear.to_array().map(|value| (255.0 * curve(value)).round() as u8)
}

/// Corners in pixels, where the animation is at `phase`.
fn vertices_at(phase: f32) -> [Vec2; 3] {
    let size = Vec2::new(SIZE[0] as f32, SIZE[1] as f32);
    [0.0, 1.0, 2.0].map(|number| {
        let angle = TAU * (phase + number / 3.0);
        0.5 * size + 0.5 * 0.85 * size.y * Vec2::new(angle.sin(), -angle.cos())
    })
}

/// Fails unless all pixels that no edge touches have the colour they should. Answers how many lie in the triangle.
fn assert_painted(image: &RgbaImage, phase: f32) -> u32 {
    let [a, b, c] = vertices_at(phase);
    let area = (b - a).perp_dot(c - a);
    let pixel_share = a.distance(b) / area.abs();
    let mut inside = 0;
    for (x, y, pixel) in image.enumerate_pixels() {
        let at = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
        let shares = [(b, c), (c, a), (a, b)].map(|(from, to)| (to - from).perp_dot(at - from) / area);
        let least = shares.into_iter().fold(f32::INFINITY, f32::min);
        if least.abs() < pixel_share {
            continue;
        }
        let color = COLORS.iter().zip(shares).map(|(color, share)| *color * share).sum();
        inside += u32::from(least > 0.0);
        let expected = encoded(if least > 0.0 { color } else { BACKDROP });
        let differs = |channel: usize| pixel[channel].abs_diff(expected[channel]) > 2;
        assert!(!(0..3).any(differs) && pixel[3] == 255, "({x}, {y}): {pixel:?}, not {expected:?}");
    }
    inside
}

#[test]
fn every_pixel_is_as_computed() {
    let Some(ctx) = device() else { return };
    let mut sample = triangle(&ctx);
    for frame in [0, 13, 71] {
        let inside = assert_painted(&image_of(&mut sample, frame), frame as f32 / ROUND as f32);
        assert!(inside > 1000, "{inside} pixels in the triangle");
    }
}

#[test]
fn a_round_has_no_seam() {
    let Some(ctx) = device() else { return };
    assert_loops_without_seam(&mut triangle(&ctx));
}

#[test]
fn the_triangle_looks_as_it_always_did() {
    let Some(ctx) = device() else { return };
    assert_matches_reference("hello_triangle_small", &image_of(&mut triangle(&ctx), 0));
}

#[test]
fn a_device_without_optional_features_renders_it() {
    let profile = DeviceProfile::core_only();
    let Some(ctx) = device_with(|desc| desc.profile = Some(&profile)) else { return };
    assert_painted(&image_of(&mut triangle(&ctx), 0), 0.0);
}

#[test]
fn another_driver_renders_it() {
    on_swiftshader(another_driver_renders_it, || {
        let Some(ctx) = device() else { return };
        let image = image_of(&mut triangle(&ctx), 0);
        assert_painted(&image, 0.0);
        assert_similar(
            "SwiftShader triangle",
            &image,
            &reference_image("hello_triangle_small"),
            &OTHER_DRIVER,
        );
    });
}

#[test]
fn impossible_images_are_refused() {
    let Some(ctx) = device() else { return };
    assert_refuses_impossible_sizes(|size| HelloTriangle::new(&ctx, size));
}
