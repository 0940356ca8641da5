//! The `hybrid_oit` sample: its node lists, shadows and images against a reference on the host.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use image::RgbaImage;
use lvk::glam::{DVec3, Vec2, Vec3};
use lvk::{Context, DeviceProfile};
use lvk_samples::app::sample_error::SampleError;
use lvk_samples::hybrid::RayPath;
use lvk_samples::hybrid_oit::{Glass, HybridOit, HybridOitConfig, Motion, OitScene};
use lvk_tests::hybrid::paths;
use lvk_tests::image_comparison::{
    ImageSimilarity, Tolerance, assert_matches_reference, assert_similar, reference_image,
};
use lvk_tests::oit_reference::{HostScene, OitRenderer, composite, composite_sorted, decode, encode, expose};
use lvk_tests::{device, device_with};

/// No multiple of a workgroup.
const SIZE: [u32; 2] = [163, 91];
const TIME_SECONDS: f64 = 1.9;

/// Tolerance between pipeline and query.
const SAME_RAYS: Tolerance = Tolerance { psnr: 50.0, ssim: 0.9999, differing_share: 1e-3, flip: 1e-3 };
/// Tolerance between lists sorted by the device and by the host.
const SAME_GLASS: Tolerance = Tolerance { psnr: 60.0, ssim: 0.999, differing_share: 2e-4, flip: 0.01 };
/// Tolerance between a device and one with fewer features.
const SAME_DEVICE: Tolerance = Tolerance { psnr: 60.0, ssim: 0.9999, differing_share: 1e-3, flip: 1e-3 };
const ACROSS_DRIVERS: Tolerance = Tolerance::ACROSS_DRIVERS;

/// Glass that is sunk into the floor, blocks and balls, so that shadow rays begin inside of it.
fn sunk() -> OitScene {
    let mut scene = OitScene::default();
    scene.glass.iter_mut().for_each(|glass| glass.motion.anchor.y = 0.25);
    scene
}

/// A sample a pixel and a ray a sample, for comparisons with the host.
fn plain(ctx: &Context) -> HybridOitConfig {
    let path = paths(ctx)[0];
    HybridOitConfig { supersampling: 1, shadow_rays: 1, ..HybridOitConfig::new(path, SIZE[0], SIZE[1]) }
}

/// Glass behind glass, in a row along the view and into each other, so that lists are longer than what is sorted at once.
fn crowd() -> OitScene {
    let mut scene = OitScene::default();
    let tints = [[0.9, 0.5, 0.6], [0.5, 0.9, 0.7], [0.6, 0.6, 0.95], [0.95, 0.9, 0.5]];
    scene.glass = (0..17)
        .map(|index| {
            let along = index as f32 / 17.0;
            let anchor = Vec3::new(0.4 - 0.3 * along, 2.2 + 0.9 * along, 5.0 - 5.5 * along);
            let orbit = Vec2::splat(0.1);
            let motion = Motion { anchor, orbit, orbit_phase: 2.4 * index as f32, ..Motion::default() };
            Glass { radius: 0.5 + 0.1 * (index % 5) as f32, tint: Vec3::from(tints[index % 4]), motion }
        })
        .collect();
    scene
}

#[test]
fn both_paths_give_the_same_image() {
    let Some(ctx) = device() else { return };
    let images = |seconds| -> Vec<RgbaImage> {
        let take = |path| {
            let config = HybridOitConfig::new(path, SIZE[0], SIZE[1]);
            OitRenderer::new(&ctx, &OitScene::default(), &config).render(seconds)
        };
        paths(&ctx).into_iter().map(take).collect()
    };
    for seconds in [0.0, 5.3] {
        let images = images(seconds);
        for other in &images[1..] {
            assert_similar("oit query", other, &images[0], &SAME_RAYS);
        }
    }
}

/// Every list holds the places where its pixel's ray enters and leaves glass in front of what is opaque, and no other.
#[test]
fn lists_hold_every_crossing_in_front() {
    let Some(ctx) = device() else { return };
    for (scene, least) in [(OitScene::default(), 3000), (crowd(), 10_000)] {
        let mut room = OitRenderer::new(&ctx, &scene, &plain(&ctx));
        room.render(TIME_SECONDS);
        let (lists, opaque) = (room.sample.glass_lists().unwrap(), room.sample.positions().unwrap());
        let host = HostScene::new(&scene, TIME_SECONDS);
        let (mut compared, mut doubtful) = (0, 0);
        for (sample, position) in opaque.iter().enumerate() {
            let pixel = [sample as u32 % SIZE[0], sample as u32 / SIZE[0]];
            let Some(expected) = crossings(&host, pixel, position[3]) else {
                doubtful += 1;
                continue;
            };
            let mut found: Vec<f64> =
                lists.nodes_of(sample).iter().map(|node| f64::from(node.distance)).collect();
            found.sort_by(f64::total_cmp);
            assert_eq!(found.len(), expected.len(), "pixel {pixel:?}: {found:?}, must be {expected:?}");
            for (found, expected) in found.iter().zip(&expected) {
                assert!((found - expected).abs() < 2e-3, "pixel {pixel:?}: {found}, must be {expected}");
            }
            compared += found.len();
        }
        assert!(
            compared > least && doubtful * 10 < SIZE[0] * SIZE[1],
            "{compared} nodes, {doubtful} pixels out"
        );
    }
}

/// Distances of what a pixel's list must hold; `None` where rounding decides.
fn crossings(host: &HostScene, pixel: [u32; 2], opaque: f32) -> Option<Vec<f64>> {
    let (origin, direction) = host.camera_ray(pixel, SIZE);
    let end = if opaque > 0.0 { f64::from(opaque) } else { f64::INFINITY };
    let mut is_doubtful = false;
    let glass = host.spheres.iter().filter(|sphere| sphere.absorption.is_some());
    let mut all: Vec<f64> = glass
        .filter_map(|sphere| sphere.crossing(origin, direction, &mut is_doubtful))
        .flatten()
        .inspect(|distance| assert!(*distance > 0.0))
        .collect();
    is_doubtful |= all.iter().any(|distance| (distance - end).abs() < 2e-3);
    all.retain(|distance| *distance < end);
    all.sort_by(f64::total_cmp);
    (!is_doubtful).then_some(all)
}

/// A pool without nodes gives the image behind the glass; what the host sees of it through the lists that it sorts is
/// the image with glass. Lists taken as they come give another.
#[test]
fn the_image_equals_one_of_sorted_lists() {
    let Some(ctx) = device() else { return };
    for (name, scene, longest) in [("room", OitScene::default(), 4), ("crowd", crowd(), 17)] {
        for side in [1, 2] {
            let config = HybridOitConfig { supersampling: side, ..plain(&ctx) };
            let mut room =
                OitRenderer::new(&ctx, &scene, &HybridOitConfig { node_capacity: Some(1 << 19), ..config });
            let image = room.render(TIME_SECONDS);
            let lists = room.sample.glass_lists().unwrap();
            let behind = image_behind_glass(&ctx, &scene, side, 1);
            // Without glass nothing is sorted, and the 8 bits of samples would only add their rounding.
            let without = image_behind_glass(&ctx, &scene, 1, side);
            let has_glass = |[x, y]: [u32; 2]| {
                let samples =
                    (0..side * side).map(|i| (side * y + i / side) * side * SIZE[0] + side * x + i % side);
                samples.into_iter().any(|sample| !lists.nodes_of(sample as usize).is_empty())
            };
            let mut found_longest = 0;
            let mut seen = |is_sorted: bool| {
                let radiance = |sample: [u32; 2]| {
                    let mut nodes = lists.nodes_of((sample[1] * side * SIZE[0] + sample[0]) as usize);
                    found_longest = found_longest.max(nodes.len());
                    let background = behind.get_pixel(sample[0], sample[1]);
                    let background = [0, 1, 2].map(|channel| decode(background[channel]));
                    if is_sorted {
                        return composite_sorted(&nodes, background);
                    }
                    nodes.reverse();
                    composite(&nodes, background)
                };
                let mut image = averaged(side, radiance);
                for (x, y, pixel) in image.enumerate_pixels_mut().filter(|(x, y, _)| !has_glass([*x, *y])) {
                    *pixel = *without.get_pixel(x, y);
                }
                image
            };
            let (sorted, as_they_came) = (seen(true), seen(false));
            let what = format!("{name}, {side} x {side} samples");
            assert_similar(&what, &image, &sorted, &SAME_GLASS);
            let unsorted = ImageSimilarity::measure(&image, &as_they_came).difference.psnr;
            assert!(unsorted < 45.0, "{what}: order makes no difference, so nothing was tested: {unsorted}");
            assert!(found_longest >= longest, "the longest list has {found_longest} nodes");
        }
    }
}

/// Renders the scene without glass, in an image `times` as large.
fn image_behind_glass(ctx: &Context, scene: &OitScene, times: u32, supersampling: u32) -> RgbaImage {
    let [width, height] = SIZE.map(|pixels| times * pixels);
    let config = HybridOitConfig { width, height, supersampling, node_capacity: Some(0), ..plain(ctx) };
    OitRenderer::new(ctx, scene, &config).render(TIME_SECONDS)
}

/// The image of samples, `side` a pixel along each side.
fn averaged(side: u32, mut radiance: impl FnMut([u32; 2]) -> [f64; 3]) -> RgbaImage {
    RgbaImage::from_fn(SIZE[0], SIZE[1], |x, y| {
        let mut sum = [0.0; 3];
        for sample in 0..side * side {
            let color = radiance([side * x + sample % side, side * y + sample / side]);
            sum = std::array::from_fn(|channel| sum[channel] + expose(color[channel]));
        }
        let [red, green, blue] = sum.map(|sum| encode(sum / f64::from(side * side)).round() as u8);
        image::Rgba([red, green, blue, 255])
    })
}

/// Nodes that do not fit are counted, and the lists use every node of the pool once and no other memory.
#[test]
fn a_pool_that_runs_out_is_counted_and_safe() {
    let Some(ctx) = device() else { return };
    let scene = OitScene::default();
    let config = plain(&ctx);
    let mut whole = OitRenderer::new(&ctx, &scene, &config);
    let complete = whole.render(TIME_SECONDS);
    let asked = whole.sample.node_use().unwrap();
    assert_eq!(asked.lost(), 0);
    assert_eq!(whole.sample.glass_lists().unwrap().linked_count(), asked.asked as usize);
    for capacity in [0, 1, 1000, asked.asked] {
        let config = HybridOitConfig { node_capacity: Some(capacity), ..config };
        let mut room = OitRenderer::new(&ctx, &scene, &config);
        let image = room.render(TIME_SECONDS);
        let nodes = room.sample.node_use().unwrap();
        assert_eq!((nodes.asked, nodes.capacity), (asked.asked, capacity));
        assert_eq!(nodes.lost(), asked.asked - capacity);
        assert_eq!(room.sample.glass_lists().unwrap().linked_count(), capacity as usize);
        assert_eq!(image == complete, capacity == asked.asked, "{capacity} nodes");
    }
}

/// Rays from every surface to the sun, blocked by blocks and balls, tinted by glass. A surface never shades itself: that
/// would show as light that is missing here.
#[test]
fn shadows_are_those_the_host_computes() {
    let Some(ctx) = device() else { return };
    for scene in [OitScene::default(), sunk()] {
        for path in paths(&ctx) {
            let mut room = OitRenderer::new(&ctx, &scene, &HybridOitConfig { path, ..plain(&ctx) });
            room.render(TIME_SECONDS);
            let (positions, sunlight) = (room.sample.positions().unwrap(), room.sample.sunlight().unwrap());
            let host = HostScene::new(&scene, TIME_SECONDS);
            let mut counts = ShadowCounts::default();
            for (position, found) in
                positions.iter().zip(&sunlight).filter(|(at, _)| at[3] > 0.0 && at[3] < 30.0)
            {
                let point = DVec3::new(position[0].into(), position[1].into(), position[2].into());
                let found = DVec3::new(found[0].into(), found[1].into(), found[2].into());
                match expected_sunlight(&host, &scene, point) {
                    None => counts.doubtful += 1,
                    Some(expected) => {
                        let error = (found - expected).abs().max_element();
                        assert!(error < 3e-3, "{path:?} at {point}: {found}, must be {expected}");
                        counts.add(expected);
                    }
                }
            }
            eprintln!("{path:?}: {counts:?}");
            assert!(counts.lit > 2000 && counts.dark > 500 && counts.tinted > 500 && counts.doubtful < 500);
        }
    }
}

/// Numbers of compared points.
#[derive(Debug, Default)]
struct ShadowCounts {
    lit: u32,
    dark: u32,
    tinted: u32,
    doubtful: u32,
}

impl ShadowCounts {
    fn add(&mut self, light: DVec3) {
        match light.max_element() {
            0.0 => self.dark += 1,
            1.0 => self.lit += 1,
            _ => self.tinted += 1,
        }
    }
}

/// The sunlight at a point of an opaque surface; `None` where rounding decides.
fn expected_sunlight(host: &HostScene, scene: &OitScene, point: DVec3) -> Option<DVec3> {
    let normal = host.normal_at(point);
    let cosine = normal.dot(scene.sun.direction.as_dvec3().normalize());
    if cosine.abs() < 5e-3 {
        return None;
    }
    if cosine < 0.0 {
        return Some(DVec3::ZERO);
    }
    let found = host.sunlight(point + 1e-4 * normal);
    (!found.is_doubtful).then_some(found.light)
}

#[test]
fn a_frame_is_the_same_alone_and_in_a_sequence() {
    let Some(ctx) = device() else { return };
    let scene = OitScene::default();
    for path in paths(&ctx) {
        let config = HybridOitConfig { path, ..plain(&ctx) };
        let at = |frame: u32| f64::from(frame) / 30.0;
        let mut sequence = OitRenderer::new(&ctx, &scene, &config);
        let frames: Vec<_> = (100..104).map(|frame| sequence.render(at(frame))).collect();
        assert_ne!(frames[0], frames[1], "the animation stands still");
        let alone = OitRenderer::new(&ctx, &scene, &config).render(at(103));
        assert_eq!(alone, frames[3], "{path:?}");
        assert_eq!(sequence.render(at(103 + 240)), frames[3], "{path:?}: a round later");
        assert_eq!(sequence.render(at(100)), frames[0], "{path:?}: back in time");
    }
}

#[test]
fn a_phone_would_render_the_same() {
    let Some(ctx) = device() else { return };
    let scene = OitScene::default();
    let image = |ctx: &Context| OitRenderer::new(ctx, &scene, &plain(ctx)).render(TIME_SECONDS);
    let expected = image(&ctx);
    let profile = DeviceProfile::mali_g715();
    let Some(phone) = device_with(|desc| desc.profile = Some(&profile)) else { return };
    assert_eq!(paths(&phone), [RayPath::Query]);
    assert_similar("oit as on a phone", &image(&phone), &expected, &SAME_DEVICE);
}

#[test]
fn scenes_without_sense_are_refused() {
    let Some(ctx) = device() else { return };
    let mistakes: [fn(&mut OitScene); 5] = [
        |scene| scene.glass.clear(),
        |scene| scene.balls[0].radius = f32::NAN,
        |scene| scene.glass[1].tint.x = 0.0,
        |scene| scene.glass[1].motion.anchor.y = f32::INFINITY,
        |scene| scene.sun.direction = Vec3::ZERO,
    ];
    for mistake in mistakes {
        let mut scene = OitScene::default();
        mistake(&mut scene);
        let refused = HybridOit::new(&ctx, &scene, &plain(&ctx)).err();
        assert!(matches!(refused, Some(SampleError::BrokenScene(_))), "{refused:?}");
    }
}

#[test]
fn the_image_matches_the_reference() {
    let Some(ctx) = device() else { return };
    let image = small_image(&ctx, &OitScene::default());
    assert_matches_reference("hybrid_oit_small", &image);
}

/// Name of a mistake, and the change of the scene that makes it.
type Mistake = (&'static str, fn(&mut OitScene));

/// A mistake in a shader differs from the reference by more than another driver's rounding.
#[test]
fn the_reference_image_detects_small_mistakes() {
    let Some(ctx) = device() else { return };
    let expected = reference_image("hybrid_oit_small");
    let mistakes: [Mistake; 5] = [
        ("paler glass", |scene| scene.glass.iter_mut().for_each(|glass| glass.tint = glass.tint.powf(0.8))),
        ("moved sun", |scene| scene.sun.direction.x += 0.06),
        ("dimmer sun", |scene| scene.sun.color *= 0.9),
        ("one ball less", |scene| scene.balls.truncate(5)),
        ("one sphere less", |scene| scene.glass.truncate(13)),
    ];
    for (what, mistake) in mistakes {
        let mut wrong = OitScene::default();
        mistake(&mut wrong);
        let similarity = ImageSimilarity::measure(&small_image(&ctx, &wrong), &expected);
        eprintln!("{what}: {similarity}");
        assert!(!similarity.is_within(&ACROSS_DRIVERS), "{what} goes unnoticed: {similarity}");
    }
}

fn small_image(ctx: &Context, scene: &OitScene) -> RgbaImage {
    let config = HybridOitConfig::new(paths(ctx)[0], 240, 135);
    OitRenderer::new(ctx, scene, &config).render(TIME_SECONDS)
}
