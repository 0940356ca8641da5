//! Images of the `triplanar` sample: textures are loaded and freed with frames in flight, only the bodies that sample
//! them change, and no memory is left.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use image::RgbaImage;
use lvk::{Context, DeviceProfile};
use lvk_samples::app::frame::Frame;
use lvk_samples::app::sample::{FrameTime, Sample};
use lvk_samples::triplanar::{Residency, Triplanar};
use lvk_tests::image_comparison::{Tolerance, assert_matches_reference, assert_similar, reference_image};
use lvk_tests::raster_sample::{ROUND, SIZE, assert_refuses_impossible_sizes, image_of};
use lvk_tests::subprocess::on_swiftshader;
use lvk_tests::{device, device_with};

/// Tolerance on SwiftShader, whose filters have fewer bits and another anisotropy.
const OTHER_DRIVER: Tolerance = Tolerance { psnr: 30.0, ssim: 0.95, differing_share: 0.9, flip: 0.06 };

fn sample(ctx: &Context) -> Triplanar {
    Triplanar::new(ctx, SIZE).unwrap()
}

fn number_of(name: &str) -> usize {
    Triplanar::texture_names().iter().position(|known| *known == name).unwrap()
}

fn all() -> std::ops::Range<usize> {
    0..Triplanar::texture_names().len()
}

/// Submits a frame without waiting for it.
fn send(sample: &mut Triplanar, frame: u32) {
    sample.update(FrameTime::from_frame(frame, ROUND));
    let mut frame = Frame::free(&sample.context().clone()).unwrap();
    sample.record(&mut frame).unwrap();
    frame.finish().unwrap();
}

/// The share of pixels in some columns that differ.
fn differing(one: &RgbaImage, other: &RgbaImage, columns: std::ops::Range<u32>) -> f32 {
    let pixels = columns.clone().flat_map(|x| (0..SIZE[1]).map(move |y| (x, y)));
    let count = pixels.filter(|(x, y)| one.get_pixel(*x, *y) != other.get_pixel(*x, *y)).count();
    count as f32 / (columns.len() as f32 * SIZE[1] as f32)
}

/// Images of the context that have a handle.
fn textures(ctx: &Context) -> usize {
    ctx.live_objects().iter().filter(|object| object.kind == "texture").count()
}

#[test]
fn textures_go_and_come_while_frames_are_on_their_way() {
    let Some(ctx) = device() else { return };
    let mut sample = sample(&ctx);
    let first = image_of(&mut sample, 0);
    let count = textures(&ctx);
    for round in 0..4 {
        send(&mut sample, round);
        all().for_each(|number| sample.unload(number));
        send(&mut sample, round);
        assert_eq!(textures(&ctx), count - all().len(), "all but the targets and the placeholder");
        all().for_each(|number| sample.load(number));
        assert!(all().all(|number| sample.residency(number) == Residency::Loading));
        send(&mut sample, round);
        // One that is given up before it has come, and asked for again.
        sample.unload(1);
        send(&mut sample, round);
        sample.load(1);
        sample.wait_for_textures().unwrap();
        send(&mut sample, round);
    }
    assert!(all().all(|number| sample.residency(number) == Residency::Resident));
    assert!(image_of(&mut sample, 0) == first, "what came back is what had gone");
    assert_eq!(textures(&ctx), count);
}

#[test]
fn a_frame_on_its_way_keeps_the_textures_it_samples() {
    let Some(ctx) = device() else { return };
    let mut sample = sample(&ctx);
    let whole = image_of(&mut sample, 0);
    sample.update(FrameTime::from_frame(0, ROUND));
    let mut frame = Frame::free(&ctx).unwrap();
    let image = sample.record(&mut frame).unwrap();
    frame.finish().unwrap();
    all().for_each(|number| sample.unload(number));
    let pixels = ctx.download_texture(image, &lvk::TextureRegion::default()).unwrap();
    assert!(pixels == *whole.as_raw());
}

#[test]
fn only_textured_surfaces_have_the_placeholder() {
    let Some(ctx) = device() else { return };
    let mut sample = sample(&ctx);
    let whole = image_of(&mut sample, 0);
    // Bricks are on the left, marble on the right.
    let (left, right) = (0..SIZE[0] / 3, 2 * SIZE[0] / 3..SIZE[0]);
    for (name, on, off) in [("brick", left.clone(), right.clone()), ("marble", right, left)] {
        sample.unload(number_of(name));
        let without = image_of(&mut sample, 0);
        assert!(differing(&whole, &without, on) > 0.1 && differing(&whole, &without, off) == 0.0, "{name}");
        sample.load(number_of(name));
        assert_eq!(sample.residency(number_of(name)), Residency::Loading);
        sample.wait_for_textures().unwrap();
        assert!(image_of(&mut sample, 0) == whole, "{name} is back");
    }
}

/// A texture that has been given up stays away, though its thread has made it.
#[test]
fn late_textures_are_dropped() {
    let Some(ctx) = device() else { return };
    let mut sample = sample(&ctx);
    let (brick, wood) = (number_of("brick"), number_of("wood"));
    let count = textures(&ctx);
    [brick, wood].into_iter().for_each(|number| sample.unload(number));
    sample.load(brick);
    sample.unload(brick);
    // Made after it, by the same thread.
    sample.load(wood);
    sample.wait_for_textures().unwrap();
    image_of(&mut sample, 0);
    assert_eq!((sample.residency(brick), sample.residency(wood)), (Residency::Unloaded, Residency::Resident));
    assert_eq!(textures(&ctx), count - 1);
    sample.load(brick);
    sample.load(999);
    sample.unload(999);
    assert_eq!(sample.residency(999), Residency::Unloaded);
    // The thread ends with the sample, whatever it is at.
    drop(sample);
    assert_eq!(textures(&ctx), 0);
}

#[test]
fn bodies_look_as_they_always_did() {
    let Some(ctx) = device() else { return };
    let mut sample = sample(&ctx);
    assert_matches_reference("triplanar_small", &image_of(&mut sample, 0));
    ["brick", "leaves"].into_iter().for_each(|name| sample.unload(number_of(name)));
    assert_matches_reference("triplanar_unloaded_small", &image_of(&mut sample, 0));
}

#[test]
fn a_device_without_optional_features_renders_them() {
    let profile = DeviceProfile::core_only();
    let Some(ctx) = device_with(|desc| desc.profile = Some(&profile)) else { return };
    let image = image_of(&mut sample(&ctx), 0);
    assert_similar("bodies without features", &image, &reference_image("triplanar_small"), &OTHER_DRIVER);
}

#[test]
fn another_driver_renders_them() {
    on_swiftshader(another_driver_renders_them, || {
        let Some(ctx) = device() else { return };
        let mut sample = sample(&ctx);
        let image = image_of(&mut sample, 0);
        all().for_each(|number| sample.unload(number));
        send(&mut sample, 5);
        all().for_each(|number| sample.load(number));
        send(&mut sample, 6);
        sample.wait_for_textures().unwrap();
        assert!(image_of(&mut sample, 0) == image);
        assert_similar("SwiftShader bodies", &image, &reference_image("triplanar_small"), &OTHER_DRIVER);
    });
}

#[test]
fn impossible_images_are_refused() {
    let Some(ctx) = device() else { return };
    assert_refuses_impossible_sizes(|size| Triplanar::new(&ctx, size));
}
