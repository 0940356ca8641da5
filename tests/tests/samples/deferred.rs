//! Images of the `deferred` sample: equal by one pass and by several, equal to the reference, with few lights and
//! many, on devices with and without local reads.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use image::RgbaImage;
use lvk::{Context, DeviceProfile};
use lvk_samples::app::frame::Frame;
use lvk_samples::app::sample::{FrameTime, Sample};
use lvk_samples::app::sample_error::SampleError;
use lvk_samples::deferred::{Deferred, DeferredConfig, Passes, View};
use lvk_tests::image_comparison::{Tolerance, assert_matches_reference, assert_similar, reference_image};
use lvk_tests::raster_sample::{ROUND, SIZE, assert_refuses_impossible_sizes, image_of};
use lvk_tests::subprocess::on_swiftshader;
use lvk_tests::{device, device_with};

/// Tolerance on SwiftShader. Colours and edges of triangles round differently; lights are made of triangles that are a
/// pixel or two wide and as bright as can be.
const OTHER_DRIVER: Tolerance = Tolerance { psnr: 32.0, ssim: 0.98, differing_share: 0.1, flip: 0.03 };

fn config(passes: Passes) -> DeferredConfig {
    DeferredConfig { passes: Some(passes), ..DeferredConfig::new(SIZE) }
}

fn render_image(ctx: &Context, config: &DeferredConfig, frame: u32) -> RgbaImage {
    image_of(&mut Deferred::new(ctx, config).unwrap(), frame)
}

/// True if the device has both; says so where it has not.
fn has_both(ctx: &Context) -> bool {
    let both = Passes::supported(ctx).len() == 2;
    if !both {
        eprintln!("NOT TESTED, {} lacks dynamicRenderingLocalRead", ctx.capabilities().device_name);
    }
    both
}

fn assert_same_images(ctx: &Context, moments: &[(u32, View)]) {
    for (frame, view) in moments.iter().copied() {
        let [one, several] = [Passes::One, Passes::Several]
            .map(|passes| render_image(ctx, &DeferredConfig { view, ..config(passes) }, frame));
        assert!(one == several, "frame {frame}, {view:?}");
    }
}

#[test]
fn one_pass_renders_what_several_do() {
    let Some(ctx) = device() else { return };
    if has_both(&ctx) {
        let images = [(0, View::Picture), (37, View::Picture)];
        assert_same_images(&ctx, &images);
        let others = [View::Albedo, View::Normals, View::Roughness, View::Depth];
        assert_same_images(&ctx, &others.map(|view| (0, view)));
    }
}

#[test]
fn the_hall_looks_as_it_always_did() {
    let Some(ctx) = device() else { return };
    let passes = Passes::supported(&ctx)[0];
    assert_matches_reference("deferred_small", &render_image(&ctx, &config(passes), 0));
}

#[test]
fn another_driver_renders_it() {
    on_swiftshader(another_driver_renders_it, || {
        let Some(ctx) = device() else { return };
        let image = render_image(&ctx, &DeferredConfig::new(SIZE), 0);
        assert_similar("SwiftShader hall", &image, &reference_image("deferred_small"), &OTHER_DRIVER);
        if has_both(&ctx) {
            assert_same_images(&ctx, &[(0, View::Picture)]);
        }
    });
}

/// Sum of all channels of all pixels.
fn light_of(image: &RgbaImage) -> u64 {
    image.pixels().map(|pixel| pixel.0[..3].iter().map(|channel| u64::from(*channel)).sum::<u64>()).sum()
}

#[test]
fn every_light_adds_to_the_image() {
    let Some(ctx) = device() else { return };
    let with =
        |lights| light_of(&render_image(&ctx, &DeferredConfig { lights, ..DeferredConfig::new(SIZE) }, 0));
    let light = [1, 60, 700, 2000].map(with);
    assert!(light.is_sorted_by(|fewer, more| fewer < more), "{light:?}");
}

/// Each change follows a frame of the other path without a wait.
#[test]
fn paths_are_changed_in_a_sample_that_runs() {
    let Some(ctx) = device() else { return };
    if !has_both(&ctx) {
        return;
    }
    let mut sample = Deferred::new(&ctx, &config(Passes::One)).unwrap();
    let turns = [[Passes::One, Passes::Several], [Passes::Several, Passes::One]];
    for (round, [before, passes]) in (0..).zip(turns.repeat(2)) {
        let frame = 23 * round;
        sample.set_passes(Some(before));
        send(&mut sample, frame);
        assert_eq!(sample.passes(), before);
        sample.set_passes(Some(passes));
        let found = image_of(&mut sample, frame);
        assert_eq!(sample.passes(), passes);
        assert!(found == render_image(&ctx, &config(passes), frame), "frame {frame} by {passes:?}");
    }
}

/// Submits a frame without waiting for it.
fn send(sample: &mut Deferred, frame: u32) {
    sample.update(FrameTime::from_frame(frame, ROUND));
    let mut frame = Frame::free(&sample.context().clone()).unwrap();
    sample.record(&mut frame).unwrap();
    frame.finish().unwrap();
}

#[test]
fn a_round_has_no_seam() {
    let Some(ctx) = device() else { return };
    let mut sample = Deferred::new(&ctx, &DeferredConfig::new(SIZE)).unwrap();
    let first = image_of(&mut sample, 0);
    assert_ne!(image_of(&mut sample, 33), first);
    assert_eq!(image_of(&mut sample, ROUND), first);
}

#[test]
fn a_device_without_local_reads_goes_by_several_passes() {
    let profile = DeviceProfile::core_only();
    let Some(ctx) = device_with(|desc| desc.profile = Some(&profile)) else { return };
    let sample = Deferred::new(&ctx, &DeferredConfig::new(SIZE)).unwrap();
    assert_eq!(sample.passes(), Passes::Several);
    let error = Deferred::new(&ctx, &config(Passes::One)).err();
    match error {
        Some(SampleError::Missing { what, remedy, .. }) => {
            assert!(what.contains("dynamicRenderingLocalRead") && remedy.contains("--passes several"));
        }
        other => unreachable!("{other:?}"),
    }
}

#[test]
fn impossible_images_are_refused() {
    let Some(ctx) = device() else { return };
    assert_refuses_impossible_sizes(|extent| Deferred::new(&ctx, &DeferredConfig::new(extent)));
}
