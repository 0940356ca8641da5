//! Images of the `reflections` sample: its rendering paths agree, and the images are right.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use image::RgbaImage;
use lvk::{Context, Dependencies, DeviceProfile};
use lvk_samples::app::headless;
use lvk_samples::app::sample::{FrameTime, Sample};
use lvk_samples::app::sample_error::SampleError;
use lvk_samples::hybrid::RayPath;
use lvk_samples::reflections::{
    CullingCost, FAR, RayCost, Reflections, ReflectionsConfig, SkinUpdate, reflection_range,
};
use lvk_samples::scene::Camera;
use lvk_samples::shaders::INCLUDES;
use lvk_tests::compute::{compute_pipeline, read_words, words_buffer};
use lvk_tests::hybrid::paths;
use lvk_tests::image_comparison::{
    ImageSimilarity, Tolerance, assert_matches_reference, assert_not_empty, assert_similar,
};
use lvk_tests::{device, device_with};

/// No multiple of a work group.
const SIZE: [u32; 2] = [162, 91];
/// Tolerance between two paths of one image.
const SAME_RAYS: Tolerance = Tolerance { psnr: 50.0, ssim: 0.999, differing_share: 2e-3, flip: 2e-3 };

fn config(path: RayPath) -> ReflectionsConfig {
    ReflectionsConfig { samples: 1, ..ReflectionsConfig::new(path, SIZE[0], SIZE[1]) }
}

fn hall(ctx: &Context, config: &ReflectionsConfig) -> Reflections {
    Reflections::new(ctx, config).unwrap()
}

fn image_at(hall: &mut Reflections, phase: f32) -> RgbaImage {
    hall.show(phase);
    render_image(hall)
}

fn render_image(hall: &mut Reflections) -> RgbaImage {
    let [width, height] = [hall.config().width, hall.config().height];
    RgbaImage::from_raw(width, height, headless::picture(hall).unwrap()).unwrap()
}

#[test]
fn both_paths_give_the_same_image() {
    let Some(ctx) = device() else { return };
    let paths = paths(&ctx);
    for phase in [0.0, 0.3] {
        let all: Vec<_> = paths.iter().map(|path| image_at(&mut hall(&ctx, &config(*path)), phase)).collect();
        assert_not_empty(&all[0], 2000);
        for other in &all[1..] {
            assert_similar(&format!("reflections at {phase} by query"), other, &all[0], &SAME_RAYS);
        }
    }
}

#[test]
fn a_frame_depends_on_its_phase_alone() {
    let Some(ctx) = device() else { return };
    let config = ReflectionsConfig { samples: 2, ..config(paths(&ctx)[0]) };
    let mut sequence = hall(&ctx, &config);
    let first = image_at(&mut sequence, 0.0);
    for frame in 1..4 {
        assert_ne!(image_at(&mut sequence, frame as f32 / 240.0), first, "something moves");
    }
    let fifth = image_at(&mut sequence, 5.0 / 240.0);
    assert_eq!(image_at(&mut hall(&ctx, &config), 5.0 / 240.0), fifth, "alone");
    assert_eq!(image_at(&mut sequence, 0.0), first, "back again");
}

#[test]
fn a_round_ends_where_it_began_without_a_seam() {
    let Some(ctx) = device() else { return };
    let mut hall = hall(&ctx, &config(paths(&ctx)[0]));
    let mut frame = |frame, frames_per_round| {
        hall.update(FrameTime::from_frame(frame, frames_per_round));
        render_image(&mut hall)
    };
    let first = frame(0, 240);
    assert_not_empty(&first, 2000);
    for round in [1, 7, 240] {
        assert!(frame(round, round) == first, "frame {round} of a round of as many is frame 0");
    }
    assert!(frame(242, 240) == frame(2, 240), "and so on");
    let [next, last] =
        [1, 239].map(|number| ImageSimilarity::measure(&frame(number, 240), &first).difference.psnr);
    assert!(next < 40.0, "something moves: {next} dB");
    assert!((next - last).abs() < 2.0, "{last} dB to the end of the round, {next} dB from its beginning on");
}

/// Sets a camera close to the basin.
fn look_at_serpent(hall: &mut Reflections, phase: f32) {
    hall.show(phase);
    hall.set_camera(&Camera::looking_at([-3.6, 1.0, -9.5], [2.0, 1.1, -9.5], 70.0));
}

#[test]
fn the_refitted_serpent_is_the_one_built_anew() {
    let Some(ctx) = device() else { return };
    for path in paths(&ctx) {
        let updated = |skin_update| {
            let mut hall = hall(&ctx, &ReflectionsConfig { skin_update, ..config(path) });
            // Several refits, each from the one before.
            for step in 0..4 {
                hall.show(0.15 * step as f32);
                render_image(&mut hall);
            }
            look_at_serpent(&mut hall, 0.6);
            render_image(&mut hall)
        };
        let (refitted, rebuilt) = (updated(SkinUpdate::Refit), updated(SkinUpdate::Rebuild));
        assert_not_empty(&refitted, 2000);
        let elsewhere = {
            let mut hall = hall(&ctx, &config(path));
            look_at_serpent(&mut hall, 0.0);
            render_image(&mut hall)
        };
        let moved = ImageSimilarity::measure(&refitted, &elsewhere);
        assert!(moved.difference.psnr < 28.0, "the serpent is large in the image, and swims: {moved}");
        let what = format!("refitted serpent {path:?}");
        assert_similar(
            &what,
            &refitted,
            &rebuilt,
            &Tolerance { psnr: 60.0, differing_share: 2e-4, ..SAME_RAYS },
        );
    }
}

#[test]
fn culling_leaves_out_small_things_and_nothing_else() {
    let Some(ctx) = device() else { return };
    let path = paths(&ctx)[0];
    let with = |min_angle| {
        let mut hall = hall(&ctx, &ReflectionsConfig { min_angle, ..config(path) });
        let image = image_at(&mut hall, 0.0);
        (hall.instance_count(), image)
    };
    let (all, whole) = with(0.0);
    let (usual, culled) = with(ReflectionsConfig::DEFAULT_MIN_ANGLE);
    let (few, empty) = with(0.1);
    eprintln!("{all:?} {usual:?} {few:?}");
    assert_eq!((all.kept, all.total), (usual.total, few.total));
    assert!(usual.kept * 10 < usual.total * 8, "{usual:?}: culling saves something");
    assert!(few.kept < usual.kept && few.kept > 10, "{few:?}: large things stay");
    let tolerance = Tolerance { psnr: 38.0, ssim: 0.99, differing_share: 0.02, flip: 0.01 };
    assert_similar("culled hall", &culled, &whole, &tolerance);
    let similarity = ImageSimilarity::measure(&empty, &whole);
    assert!(similarity.difference.psnr < 60.0, "larger things do show: {similarity}");
}

#[test]
fn measuring_the_gain_of_culling_changes_nothing() {
    let Some(ctx) = device() else { return };
    let mut hall = hall(&ctx, &config(paths(&ctx)[0]));
    let before = image_at(&mut hall, 0.0);
    let Some(cost) = CullingCost::measure(&hall, 2).unwrap() else {
        return eprintln!("NOT TESTED, {} has no timestamps", ctx.capabilities().device_name);
    };
    for RayCost { build_ms, rays_ms } in [cost.culled, cost.whole] {
        assert!(build_ms > 0.0 && rays_ms > 0.0, "{cost}");
    }
    assert_eq!(CullingCost::measure(&hall, 0).unwrap(), None);
    assert!(render_image(&mut hall) == before);
}

/// The length of rays for roughness 0, 0.01 and so on to 1, by the shaders' own text.
fn ranges_by_shader(ctx: &Context) -> Vec<f32> {
    let (_, rule) = INCLUDES.iter().find(|(name, _)| *name == "reflections/ray_range.glsl").unwrap();
    let main = "
        layout(local_size_x = 1) in;
        layout(buffer_reference, scalar) writeonly buffer Ranges { float at[]; };
        layout(push_constant, scalar) uniform Push { Ranges ranges; };
        void main() {
            uint place = gl_WorkGroupID.x;
            ranges.at[place] = reflectionRange(float(place) / 100.0);
        }";
    let pipeline = compute_pipeline(ctx, &format!("{rule}{main}"));
    let buffer = words_buffer(ctx, &[0; 101]);
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    cmd.bind_compute_pipeline(*pipeline).unwrap();
    cmd.push_constants(&ctx.buffer_address(*buffer).unwrap()).unwrap();
    cmd.dispatch([101, 1, 1], &Dependencies { buffers: &[*buffer], ..Dependencies::default() }).unwrap();
    ctx.submit(cmd).unwrap();
    read_words(ctx, *buffer, 101).into_iter().map(f32::from_bits).collect()
}

#[test]
fn shaders_shorten_rays_by_the_rule() {
    let Some(ctx) = device() else { return };
    let ranges = ranges_by_shader(&ctx);
    assert!(ranges.windows(2).all(|pair| pair[1] <= pair[0]), "{ranges:?}");
    for (step, range) in ranges.iter().enumerate() {
        // Beside its steps, where division rounds to either side.
        if ![8, 70].contains(&step) {
            let expected = reflection_range(step as f32 / 100.0);
            assert!((range - expected).abs() <= 1e-4 * FAR, "{step} %: {range} instead of {expected}");
        }
    }
}

#[test]
fn a_phone_renders_the_same() {
    let phone = DeviceProfile::mali_g715();
    let Some(ctx) = device() else { return };
    let Some(rehearsal) = device_with(|desc| desc.profile = Some(&phone)) else { return };
    let path = RayPath::choose(None, rehearsal.capabilities()).unwrap();
    assert_eq!(path, RayPath::Query, "the phone has no ray tracing pipelines");
    if !ctx.capabilities().ray_query {
        eprintln!("NOT TESTED, {} has no ray queries", ctx.capabilities().device_name);
        return;
    }
    let expected = image_at(&mut hall(&ctx, &config(path)), 1.0);
    let image = image_at(&mut hall(&rehearsal, &config(path)), 1.0);
    assert_similar("hall on a phone", &image, &expected, &Tolerance { psnr: 60.0, ..SAME_RAYS });
}

#[test]
fn impossible_images_are_refused() {
    let Some(ctx) = device() else { return };
    let config = config(paths(&ctx)[0]);
    let refused = |config| Reflections::new(&ctx, &config).err();
    for samples in [0, ReflectionsConfig::MAX_SAMPLES + 1] {
        let error = refused(ReflectionsConfig { samples, ..config });
        assert!(matches!(error, Some(SampleError::OutOfRange { .. })), "{error:?}");
    }
    for (width, height) in [(0, 8), (8, 0), (1 << 30, 8)] {
        let error = refused(ReflectionsConfig { width, height, ..config });
        assert!(matches!(error, Some(SampleError::BadSize { .. })), "{error:?}");
    }
}

#[test]
fn the_hall_looks_as_it_always_did() {
    let Some(ctx) = device() else { return };
    let config = ReflectionsConfig { samples: 4, ..config(paths(&ctx)[0]) };
    let image = image_at(&mut hall(&ctx, &config), 0.0);
    assert_matches_reference("reflections_small", &image);
}
