//! Images of the `rtx_ao` sample: its paths agree, it converges to a reference in f64, and its cache drops what has
//! moved.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use image::RgbaImage;
use image::imageops::{FilterType, resize};
use lvk::glam::{DAffine3, DVec3, Vec3};
use lvk::{Context, RayQueryRequest};
use lvk_samples::app::headless;
use lvk_samples::app::sample::{FrameTime, Sample};
use lvk_samples::app::sample_error::SampleError;
use lvk_samples::hybrid::RayPath;
use lvk_samples::rtx::RtxConfig;
use lvk_samples::rtx_ao::{RtxAo, RtxAoConfig, View};
use lvk_samples::scene::{Camera, Scene};
use lvk_tests::hybrid::paths;
use lvk_tests::image_comparison::{
    ImageSimilarity, Tolerance, assert_matches_reference, assert_similar, reference_image,
};
use lvk_tests::rays::Ray;
use lvk_tests::reference::{Geometry, Hit, Instance, Reference};
use lvk_tests::rtx_sample::software_device;
use lvk_tests::subprocess::on_swiftshader;
use lvk_tests::{device, device_with};

/// No multiple of a work group.
const SIZE: [u32; 2] = [158, 89];
const RADIUS: f32 = 1.8;
const SAME_RAYS: Tolerance = Tolerance { psnr: 50.0, ssim: 0.999, differing_share: 5e-3, flip: 2e-3 };
/// Tolerance between few passes and many, each pixel the average of sixteen.
const OTHER_NOISE: Tolerance = Tolerance { psnr: 32.0, ssim: 0.98, differing_share: 1.0, flip: 0.09 };

fn town(ctx: &Context, path: RayPath, passes: u32, rays: u32) -> RtxAo {
    let rtx = RtxConfig { path, width: SIZE[0], height: SIZE[1] };
    let config = RtxAoConfig { passes, rays, radius: Some(RADIUS), ..RtxAoConfig::new(rtx) };
    RtxAo::new(ctx, &Scene::town(), Some(&Scene::carousel()), &config).unwrap()
}

fn render_image(town: &mut RtxAo) -> RgbaImage {
    RgbaImage::from_raw(SIZE[0], SIZE[1], headless::picture(town).unwrap()).unwrap()
}

#[test]
fn all_paths_render_the_town() {
    let (Some(ctx), Some(other)) = (device(), software_device()) else { return };
    let mut all: Vec<_> = paths(&ctx).into_iter().map(|path| town(&ctx, path, 2, 1)).collect();
    all.push(town(&other, RayPath::Query, 2, 1));
    for phase in [0, 3] {
        let mut show = |town: &mut RtxAo| {
            town.update(FrameTime::from_frame(phase, 20));
            render_image(town)
        };
        let images: Vec<_> = all.iter_mut().map(&mut show).collect();
        for other in &images[1..] {
            assert_similar(&format!("town in frame {phase}"), other, &images[0], &SAME_RAYS);
        }
    }
}

#[test]
fn the_cache_forgets_what_has_moved() {
    let Some(ctx) = software_device() else { return };
    let mut town = town(&ctx, RayPath::Query, 2, 1);
    let start = *town.current_view();
    let first = render_image(&mut town);
    town.show(&start);
    assert_eq!(town.passes(), 2, "nothing moved");
    assert_ne!(render_image(&mut town), first, "four passes are not two");
    assert_eq!(town.passes(), 4);
    let moved = Camera { eye: [9.0, 6.0, 2.0], ..start.camera };
    for view in [View { camera: moved, ..start }, View { turns: 0.06, ..start }] {
        town.show(&view);
        assert_eq!(town.passes(), 0, "{view:?}");
        assert_ne!(render_image(&mut town), first, "{view:?}");
        town.show(&start);
        assert_eq!(render_image(&mut town), first, "back from {view:?}");
    }
    town.update(FrameTime::from_frame(0, 9));
    assert_eq!(render_image(&mut town), first, "a frame depends on its frame time alone");
}

/// The triangles of both bodies, where they are at the beginning.
struct World {
    scenes: [Scene; 2],
    reference: Reference,
}

impl World {
    fn new() -> Self {
        let scenes = [Scene::town(), Scene::carousel()];
        let geometry = |scene: &Scene| {
            [Geometry {
                positions: scene.positions.iter().map(|position| Vec3::from(*position).as_dvec3()).collect(),
                triangles: scene.triangles.clone(),
                transform: DAffine3::IDENTITY,
                is_opaque: true,
            }]
        };
        let geometries = [geometry(&scenes[0]), geometry(&scenes[1])];
        let instance = |number: u32| Instance {
            geometries: &geometries[number as usize],
            transform: DAffine3::IDENTITY,
            custom_index: number,
            mask: 0xff,
            flip_facing: false,
            no_cull: false,
            force_opaque: None,
        };
        let reference = Reference::new(&[instance(0), instance(1)]);
        Self { scenes, reference }
    }

    /// Returns the end of a ray, and the geometric and the shading normal there, towards its origin.
    fn surface(&self, ray: &Ray, hit: &Hit) -> [DVec3; 3] {
        let scene = &self.scenes[hit.ids.custom_index as usize];
        let corners = scene.triangles[hit.ids.primitive as usize].map(|corner| corner as usize);
        let [a, b, c] = corners.map(|corner| Vec3::from(scene.positions[corner]).as_dvec3());
        let normals = corners.map(|corner| Vec3::from(scene.normals[corner]).as_dvec3());
        let [u, v] = hit.barycentrics;
        let between = |a: DVec3, b: DVec3, c: DVec3| a * (1.0 - u - v) + b * u + c * v;
        let geometric = (b - a).cross(c - a).normalize();
        let away = geometric.dot(Vec3::from(ray.direction).as_dvec3()) > 0.0;
        let geometric = if away { -geometric } else { geometric };
        let shading = between(normals[0], normals[1], normals[2]).normalize();
        let shading = if shading.dot(geometric) < 0.0 { -shading } else { shading };
        [between(a, b, c), geometric, shading]
    }

    /// The share of `count` cosine-weighted directions that are open; `None` where the ray is in doubt or meets nothing.
    fn openness(&self, ray: &Ray, count: u32) -> Option<f64> {
        let answer = self.reference.closest(ray, 0xff);
        let hit = answer.hit.filter(|_| answer.is_certain)?;
        let [point, geometric, normal] = self.surface(ray, &hit);
        let origin = (point + 1e-3 * f64::from(RADIUS) * geometric).as_vec3();
        let (across, along) = normal.any_orthonormal_pair();
        let is_open = |number: u32| {
            let place = |step: f64| (0.5 + step * f64::from(number)).fract();
            let (radius, angle) = (place(0.754_877_666).sqrt(), std::f64::consts::TAU * place(0.569_840_29));
            let up = (1.0 - radius * radius).sqrt();
            let direction = across * (radius * angle.cos()) + along * (radius * angle.sin()) + normal * up;
            let ray = Ray { t_max: RADIUS, ..Ray::new(origin, direction.as_vec3()) };
            self.reference.occluded(&ray, 0xff) == Some(false)
        };
        Some(f64::from((0..count).map(|number| u32::from(is_open(number))).sum::<u32>()) / f64::from(count))
    }
}

/// The ray through the middle of a pixel.
fn ray_through(camera: &Camera, [x, y]: [u32; 2]) -> Ray {
    let [right, up, forward] = camera.frame().map(Vec3::from);
    let half_height = (0.5 * camera.vertical_fov_degrees.to_radians()).tan();
    let place = |pixel: u32, size: u32| (pixel as f32 + 0.5) / size as f32 * 2.0 - 1.0;
    let across = place(x, SIZE[0]) * half_height * SIZE[0] as f32 / SIZE[1] as f32;
    let down = place(y, SIZE[1]) * half_height;
    Ray::new(camera.eye.into(), (forward + across * right - down * up).normalize())
}

/// Pixels in even surroundings, at an even distance from each other.
fn even_pixels(openness: &[f32]) -> Vec<[u32; 2]> {
    let at = |x: u32, y: u32| openness[(y * SIZE[0] + x) as usize];
    let is_even = |&[x, y]: &[u32; 2]| {
        let around = (0..9).map(|i| at(x + i % 3 - 1, y + i / 3 - 1));
        let (low, high) = around.fold((1.0_f32, 0.0_f32), |(low, high), one| (low.min(one), high.max(one)));
        high - low < 0.06 && low < 0.97
    };
    let grid = (5..SIZE[1] - 5).step_by(4).flat_map(|y| (5..SIZE[0] - 5).step_by(4).map(move |x| [x, y]));
    grid.filter(is_even).collect()
}

fn mean_error(openness: &[f32], expected: &[([u32; 2], f64)]) -> f64 {
    let error =
        |([x, y], value): &([u32; 2], f64)| (f64::from(openness[(y * SIZE[0] + x) as usize]) - value).abs();
    expected.iter().map(error).sum::<f64>() / expected.len() as f64
}

#[test]
fn it_converges_to_the_reference() {
    let Some(ctx) = software_device() else { return };
    let mut town = town(&ctx, RayPath::Query, 6, 4);
    let mut shown = None;
    let mut after = |passes: u32| {
        while town.passes() < passes {
            shown = Some(render_image(&mut town));
        }
        (shown.clone().unwrap(), town.openness().unwrap())
    };
    let [few, more, most] = [6, 24, 96].map(&mut after);
    let psnr = |one: &RgbaImage, other: &RgbaImage| ImageSimilarity::measure(one, other).difference.psnr;
    let (first, second) = (psnr(&few.0, &more.0), psnr(&more.0, &most.0));
    eprintln!("6 to 24 passes: {first:.1} dB, 24 to 96: {second:.1} dB");
    assert!(first > 26.0 && second > first + 3.0, "{first} dB, then {second} dB");

    let world = World::new();
    let camera = town.current_view().camera;
    let pixels = even_pixels(&most.1);
    let found =
        pixels.iter().filter_map(|&pixel| Some((pixel, world.openness(&ray_through(&camera, pixel), 1024)?)));
    let expected: Vec<_> = found.collect();
    let errors = [&few.1, &more.1, &most.1].map(|openness| mean_error(openness, &expected));
    eprintln!("mean errors at {} pixels: {errors:?}", expected.len());
    assert!(expected.len() >= 40);
    assert!(errors[0] > errors[1] && errors[1] > errors[2] && errors[2] < 0.012, "{errors:?}");
}

#[test]
fn the_town_looks_as_it_always_did() {
    let Some(ctx) = device() else { return };
    assert_matches_reference("rtx_ao_small", &render_image(&mut town(&ctx, paths(&ctx)[0], 16, 2)));
}

fn small(image: &RgbaImage) -> RgbaImage {
    resize(image, SIZE[0] / 4, SIZE[1] / 4, FilterType::Triangle)
}

/// The next test, on the usual driver.
#[test]
fn few_passes_render_the_same_but_for_noise_and_nothing_else_does() {
    let Some(ctx) = software_device() else { return };
    let expected = small(&reference_image("rtx_ao_small"));
    let noisy = small(&render_image(&mut town(&ctx, RayPath::Query, 2, 2)));
    assert_similar("town by few passes", &noisy, &expected, &OTHER_NOISE);
    let rtx = RtxConfig { path: RayPath::Query, width: SIZE[0], height: SIZE[1] };
    let config = RtxAoConfig { passes: 2, radius: Some(0.2), ..RtxAoConfig::new(rtx) };
    let open = RtxAo::new(&ctx, &Scene::town(), Some(&Scene::carousel()), &config);
    let similarity = ImageSimilarity::measure(&small(&render_image(&mut open.unwrap())), &expected);
    assert!(!similarity.is_within(&OTHER_NOISE), "without occlusion: {similarity}");
    eprintln!("without occlusion: {similarity}");
}

/// Rays take SwiftShader seconds for each pass.
#[test]
#[ignore = "a minute, of the check swiftshader of .ci/slow"]
fn a_driver_without_ray_tracing_renders_the_town() {
    on_swiftshader(a_driver_without_ray_tracing_renders_the_town, || {
        let Some(ctx) = device_with(|desc| desc.ray_query = RayQueryRequest::Auto) else { return };
        let image = render_image(&mut town(&ctx, RayPath::Query, 2, 2));
        assert_similar(
            "SwiftShader town",
            &small(&image),
            &small(&reference_image("rtx_ao_small")),
            &OTHER_NOISE,
        );
    });
}

#[test]
fn impossible_images_are_refused() {
    let Some(ctx) = device() else { return };
    let config = RtxAoConfig::new(RtxConfig { path: paths(&ctx)[0], width: 0, height: 8 });
    let error = RtxAo::new(&ctx, &Scene::carousel(), None, &config).err();
    assert!(matches!(error, Some(SampleError::BadSize { .. })), "{error:?}");
}
