//! Images of the `sponza` sample: GPU culling keeps what a reference on the CPU keeps and changes no pixel, with one
//! and with four samples a pixel, by counted and by padded draws; shadows, holes and normal maps are right, and the
//! atrium equals the reference.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk_samples::app::sample_error::SampleError;
use std::sync::LazyLock;

use image::{Rgba, RgbaImage};
use lvk::{Context, DeviceProfile, FeatureSet, OptionalFeature};
use lvk_samples::app::headless;
use lvk_samples::app::sample::{FrameTime, Sample};
use lvk_samples::scene::{Camera, Scene};
use lvk_samples::sponza::{DrawPath, Frustum, Sponza, SponzaConfig};
use lvk_tests::image_comparison::{
    ImageSimilarity, Tolerance, assert_matches_reference, assert_similar, reference_image,
};
use lvk_tests::raster::has;
use lvk_tests::scene_normal_map::{Tilt, normal_map_scene};
use lvk_tests::scene_obj::obj_scene;
use lvk_tests::scene_shadow_mask::shadow_mask_scene;
use lvk_tests::subprocess::on_swiftshader;
use lvk_tests::{device, device_with};

const SIZE: [u32; 2] = [158, 89];
/// Tolerance on SwiftShader, which filters textures differently.
const OTHER_FILTERS: Tolerance = Tolerance { psnr: 30.0, ssim: 0.95, differing_share: 0.6, flip: 0.06 };

static ATRIUM: LazyLock<Scene> = LazyLock::new(Scene::atrium);
/// A scene of 15,000 triangles.
static TOWN: LazyLock<Scene> = LazyLock::new(Scene::town);

fn config(samples: u32) -> SponzaConfig {
    SponzaConfig { samples, shadow_size: 512, ..SponzaConfig::new(SIZE) }
}

fn make(ctx: &Context, scene: &Scene, config: &SponzaConfig) -> Sponza {
    Sponza::new(ctx, scene.clone(), config).unwrap()
}

fn image_of(sample: &mut Sponza, frame: u32) -> RgbaImage {
    sample.update(FrameTime::from_frame(frame, 100));
    image_now(sample)
}

fn image_now(sample: &mut Sponza) -> RgbaImage {
    RgbaImage::from_raw(SIZE[0], SIZE[1], headless::picture(sample).unwrap()).unwrap()
}

/// The ways to draw that the device has; says loudly which one is not tested.
fn draw_paths(ctx: &Context) -> Vec<DrawPath> {
    let counted = has(ctx, OptionalFeature::DrawIndirectCount).then_some(DrawPath::Counted);
    counted.into_iter().chain([DrawPath::Padded]).collect()
}

#[test]
fn culling_changes_no_pixel() {
    let Some(ctx) = device() else { return };
    for samples in [1, 4] {
        let town = SponzaConfig { triangles_per_draw: 64, ..config(samples) };
        let mut whole = make(&ctx, &TOWN, &SponzaConfig { culls: false, ..town });
        for path in draw_paths(&ctx) {
            let mut culled = make(&ctx, &TOWN, &SponzaConfig { draws: Some(path), ..town });
            assert_eq!(culled.draw_path(), path);
            for frame in [0, 20, 33, 60] {
                let (image, expected) = (image_of(&mut culled, frame), image_of(&mut whole, frame));
                let all = whole.draws().len() as u32;
                assert_eq!(whole.counts().unwrap(), [all; 2], "nothing is culled");
                let [camera, sun] = culled.counts().unwrap();
                assert!(camera > 0 && camera < all, "{camera} of {all} draws in frame {frame}");
                assert_eq!(sun, all, "the shadow map shows the whole scene");
                assert!(image == expected, "frame {frame}, {samples} samples, {path:?}");
            }
        }
    }
}

/// A box whose nearest corner is this close to a plane may go either way: the device rounds otherwise.
const MARGIN: f32 = 1e-4;

#[test]
fn the_gpu_leaves_what_the_cpu_leaves() {
    let Some(ctx) = device() else { return };
    for path in draw_paths(&ctx) {
        let config = SponzaConfig { draws: Some(path), triangles_per_draw: 16, ..config(1) };
        let mut sample = make(&ctx, &TOWN, &config);
        for frame in (0..100).step_by(7) {
            let _ = image_of(&mut sample, frame);
            for (view, frustum) in sample.frusta().iter().enumerate() {
                let found = sample.survivors(view).unwrap();
                assert_eq!(
                    found.len() as u32,
                    sample.counts().unwrap()[view],
                    "the count is that of the draws"
                );
                assert!(found.is_sorted(), "draws keep their order");
                check_survivors(&sample, frustum, &found);
            }
        }
        assert!(sample.survivors(0).unwrap().len() < sample.draws().len());
    }
}

fn check_survivors(sample: &Sponza, frustum: &Frustum, found: &[u32]) {
    let (mut left, mut in_doubt) = (0, 0);
    for draw in sample.draws() {
        let is_found = found.binary_search(&draw.first_triangle).is_ok();
        left += usize::from(is_found);
        let margin = frustum.margin(draw.low, draw.high);
        if margin.abs() < MARGIN {
            in_doubt += 1;
        } else {
            assert_eq!(is_found, frustum.sees(draw.low, draw.high), "{draw:?} at {margin}");
        }
    }
    assert_eq!(left, found.len(), "a draw that there is not");
    assert!(in_doubt < 20, "{in_doubt} boxes are in doubt");
}

#[test]
fn the_atrium_looks_as_it_always_did() {
    let Some(ctx) = device() else { return };
    for (samples, name) in [(1, "sponza_one_sample"), (4, "sponza_small")] {
        let mut sample = make(&ctx, &ATRIUM, &SponzaConfig { shadow_size: 1024, ..config(samples) });
        assert_matches_reference(name, &image_of(&mut sample, 0));
    }
}

/// The floor is dark exactly where the board takes the sun from it, but for the hole.
#[test]
fn shadows_and_holes_are_where_they_belong() {
    let Some(ctx) = device() else { return };
    let scene = shadow_mask_scene();
    let mut sample = make(&ctx, &scene, &config(1));
    let image = image_of(&mut sample, 0);
    // Pixel of a point in the plane at this height, seen from 9 above.
    let camera = scene.cameras[0];
    let pixel = |x: f32, y: f32, z: f32| -> Rgba<u8> {
        let clip =
            camera.clip_from_view(SIZE[0] as f32 / SIZE[1] as f32, 0.1, 100.0) * camera.view_from_world();
        let at = clip.project_point3(lvk::glam::Vec3::new(x, y, z));
        let place = |ndc: f32, size: u32| ((0.5 + 0.5 * ndc) * size as f32) as u32;
        *image.get_pixel(place(at.x, SIZE[0]), place(at.y, SIZE[1]))
    };
    let is_red = |found: Rgba<u8>| found[0] / 2 > found[1];
    assert!(is_red(pixel(0.7, 2.0, 0.0)) && is_red(pixel(0.0, 2.0, 0.7)), "the board");
    assert!(!is_red(pixel(0.0, 2.0, 0.0)), "its hole shows the floor");
    // The sun stands to the right: shadows fall 1.5 to the left for 2 of height.
    let light = pixel(2.5, 0.0, 0.0);
    let bright = |found: Rgba<u8>| found[0] > light[0] - 12;
    assert!(
        !bright(pixel(-2.25, 0.0, 0.0)) && !bright(pixel(-1.5, 0.0, 0.7)) && !bright(pixel(-1.5, 0.0, -0.7))
    );
    assert!(bright(pixel(-1.5, 0.0, 0.0)), "light falls through the hole");
    assert!(bright(pixel(-3.0, 0.0, 0.0)) && bright(pixel(-1.5, 0.0, 1.5)), "beside the shadow");
}

/// However their images lie, also seen from aside; and without maps they are level.
#[test]
fn normal_maps_tilt_surfaces_as_vertex_normals_do() {
    let Some(ctx) = device() else { return };
    check_tilt(&ctx, &Tolerance::ACROSS_DRIVERS);
}

fn check_tilt(ctx: &Context, tolerance: &Tolerance) {
    let [by_map, by_corners] = [Tilt::Map, Tilt::Vertices].map(normal_map_scene);
    assert_eq!((by_map.normal_maps.len(), by_corners.normal_maps.len()), (1, 0));
    let level = SponzaConfig { normal_maps: false, ..config(4) };
    let mut samples = [(&by_map, config(4)), (&by_corners, config(4)), (&by_map, level)]
        .map(|(scene, config)| make(ctx, scene, &config));
    let aside = Camera::looking_at([3.0, 4.0, 5.0], [0.0, 0.0, 0.0], 60.0);
    for camera in [by_map.cameras[0], aside] {
        let [map, corners, level] = samples.each_mut().map(|sample| {
            sample.set_view(&camera);
            image_now(sample)
        });
        assert_similar("tilted tiles", &map, &corners, tolerance);
        let similarity = ImageSimilarity::measure(&map, &level);
        assert!(!similarity.is_within(&Tolerance { psnr: 35.0, ..Tolerance::default() }), "{similarity}");
    }
}

#[test]
fn samples_filter_shadows_and_frame_time_count() {
    let Some(ctx) = device() else { return };
    let mut sample = make(&ctx, &TOWN, &config(4));
    let first = image_of(&mut sample, 0);
    assert_ne!(image_of(&mut sample, 30), first, "the camera moves");
    assert_eq!(image_of(&mut sample, 100), first, "a round has no seam");
    for other in
        [config(1), SponzaConfig { filter: 0, ..config(4) }, SponzaConfig { shadow_size: 64, ..config(4) }]
    {
        assert_ne!(image_of(&mut make(&ctx, &TOWN, &other), 0), first, "{other:?}");
    }
    let one_draw = SponzaConfig { triangles_per_draw: u32::MAX, ..config(4) };
    let mut one_draw = make(&ctx, &obj_scene(), &one_draw);
    let mut many = make(&ctx, &obj_scene(), &SponzaConfig { triangles_per_draw: 16, ..config(4) });
    assert!(many.draws().len() > 5 * one_draw.draws().len());
    assert_similar(
        "draws of other sizes",
        &image_of(&mut many, 0),
        &image_of(&mut one_draw, 0),
        &Tolerance::ACROSS_DRIVERS,
    );
}

#[test]
fn devices_without_counts_pad_their_draws_and_refuse_to_count() {
    let profile = DeviceProfile {
        hidden: FeatureSet::NONE.with(OptionalFeature::DrawIndirectCount),
        ..DeviceProfile::default()
    };
    let Some(ctx) = device_with(|desc| desc.profile = Some(&profile)) else { return };
    let mut sample = make(&ctx, &TOWN, &config(4));
    assert_eq!(sample.draw_path(), DrawPath::Padded);
    let Some(other) = device() else { return };
    assert!(image_of(&mut sample, 0) == image_of(&mut make(&other, &TOWN, &config(4)), 0));
    let counted = SponzaConfig { draws: Some(DrawPath::Counted), ..config(4) };
    let error = Sponza::new(&ctx, obj_scene(), &counted).err().unwrap();
    assert!(matches!(error, SampleError::Missing { .. }), "{error}");
    let text = error.to_string();
    assert!(text.contains(&ctx.capabilities().device_name) && text.contains("--draws padded"), "{text}");
}

#[test]
#[ignore = "a minute, of the check swiftshader of .ci/slow"]
fn a_driver_without_ray_tracing_and_counts_renders_the_atrium() {
    on_swiftshader(a_driver_without_ray_tracing_and_counts_renders_the_atrium, || {
        let Some(ctx) = device() else { return };
        assert!(!ctx.capabilities().has(OptionalFeature::DrawIndirectCount));
        let mut sample = make(&ctx, &ATRIUM, &SponzaConfig { shadow_size: 1024, ..config(4) });
        assert_eq!(sample.draw_path(), DrawPath::Padded);
        assert_similar(
            "SwiftShader atrium",
            &image_of(&mut sample, 0),
            &reference_image("sponza_small"),
            &OTHER_FILTERS,
        );
        check_tilt(&ctx, &Tolerance::ACROSS_DRIVERS);
        let frustum = sample.frusta()[0];
        check_survivors(&sample, &frustum, &sample.survivors(0).unwrap());
    });
}

#[test]
fn impossible_images_are_refused() {
    let Some(ctx) = device() else { return };
    for extent in [[0, 8], [8, 0], [1 << 30, 8]] {
        let error = Sponza::new(&ctx, obj_scene(), &SponzaConfig::new(extent)).err();
        assert!(matches!(error, Some(SampleError::BadSize { .. })), "{error:?}");
    }
    for samples in [0, 2, 3, 64] {
        let error = Sponza::new(&ctx, obj_scene(), &config(samples)).err();
        assert!(matches!(error, Some(SampleError::Missing { .. })), "{error:?}");
    }
    let mut broken = obj_scene();
    broken.triangles[3][1] = u32::MAX;
    let error = Sponza::new(&ctx, broken, &config(1)).err();
    assert!(matches!(error, Some(SampleError::BrokenScene(_))), "{error:?}");
}
