//! Images of the `omni_shadows` sample: shadows equal those that rays find, for every method to draw the cube map,
//! and equal the reference.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use image::RgbaImage;
use lvk::glam::Vec3;
use lvk::{
    AccelStructHandle, BlasDesc, BlasGeometry, BufferDesc, BufferUsage, Context, DeviceProfile, Holder,
    TlasDesc, TlasInstance, Triangles,
};
use lvk_samples::app::sample::Sample;
use lvk_samples::app::sample_error::SampleError;
use lvk_samples::omni_shadows::{OmniShadows, OmniShadowsConfig, ShadowFaces, ShadowFilter};
use lvk_samples::scene::Camera;
use lvk_tests::image_comparison::{Tolerance, assert_matches_reference, assert_similar, reference_image};
use lvk_tests::raster_sample::{
    SIZE, assert_loops_without_seam, assert_refuses_impossible_sizes, image_now, image_of,
};
use lvk_tests::ray_tracer::{FRONT, How, MISSED, Method, RayTracer};
use lvk_tests::rays::Ray;
use lvk_tests::subprocess::on_swiftshader;
use lvk_tests::{device, device_with};

/// Tolerance on SwiftShader, which has other sample positions and filters comparisons with fewer bits.
const OTHER_DRIVER: Tolerance = Tolerance { psnr: 36.0, ssim: 0.98, differing_share: 0.4, flip: 0.04 };

fn usual() -> OmniShadowsConfig {
    OmniShadowsConfig { shadow_size: 512, ..OmniShadowsConfig::new(SIZE) }
}

fn lamp(ctx: &Context, config: &OmniShadowsConfig) -> OmniShadows {
    OmniShadows::new(ctx, config).unwrap()
}

#[test]
fn one_pass_and_six_give_the_same_image() {
    let Some(ctx) = device() else { return };
    let image = |faces| {
        let mut sample = lamp(&ctx, &OmniShadowsConfig { faces, shows_cube: true, ..usual() });
        assert_eq!(sample.is_multiview(), faces == ShadowFaces::Multiview);
        image_of(&mut sample, 21)
    };
    assert!(image(ShadowFaces::Multiview) == image(ShadowFaces::Single));
}

#[test]
fn devices_without_multiview_draw_face_by_face() {
    let Some(ctx) = device() else { return };
    let profile = DeviceProfile::core_only();
    let Some(bare) = device_with(|desc| desc.profile = Some(&profile)) else { return };
    let asked =
        OmniShadows::new(&bare, &OmniShadowsConfig { faces: ShadowFaces::Multiview, ..usual() }).err();
    assert!(matches!(asked, Some(SampleError::Missing { .. })), "{asked:?}");
    let mut sample = lamp(&bare, &usual());
    assert!(!sample.is_multiview());
    assert!(image_of(&mut sample, 0) == image_of(&mut lamp(&ctx, &usual()), 0));
}

/// Triangles as a structure of their own.
fn accel_structs(
    ctx: &Context,
    triangles: &[[[f32; 3]; 3]],
) -> (Holder<AccelStructHandle>, Holder<AccelStructHandle>) {
    let corners = ctx
        .create_buffer(&BufferDesc {
            usage: BufferUsage::ACCEL_INPUT,
            data: Some(bytemuck::cast_slice(triangles)),
            ..BufferDesc::default()
        })
        .unwrap();
    let geometry = BlasGeometry::Triangles(Triangles::packed(*corners, 3 * triangles.len() as u32));
    let blas = ctx.create_blas(&BlasDesc { geometries: &[geometry], ..BlasDesc::default() }).unwrap();
    let instances = [TlasInstance::new(*blas)];
    (ctx.create_tlas(&TlasDesc { instances: &instances, ..TlasDesc::default() }).unwrap(), blas)
}

fn pixel_rays(camera: &Camera) -> Vec<Ray> {
    let [right, up, forward] = camera.frame().map(Vec3::from);
    let half = (0.5 * camera.vertical_fov_degrees.to_radians()).tan();
    let [width, height] = SIZE.map(|side| side as f32);
    let through = |pixel: u32| {
        let (x, y) = ((pixel % SIZE[0]) as f32 + 0.5, (pixel / SIZE[0]) as f32 + 0.5);
        let side = half * width / height * (2.0 * x / width - 1.0);
        Ray::new(camera.eye.into(), forward + side * right - half * (2.0 * y / height - 1.0) * up)
    };
    (0..SIZE[0] * SIZE[1]).map(through).collect()
}

/// True if each pixel lies in shadow as rays find it; `None` where that cannot be told, or the lamp is behind the surface.
fn traced_shadows(ctx: &Context, sample: &mut OmniShadows) -> Vec<Option<bool>> {
    let [casters, others] = sample.triangles();
    let everything = [&casters[..], &others[..]].concat();
    let (all, _all_blas) = accel_structs(ctx, &everything);
    let (blockers, _blockers_blas) = accel_structs(ctx, &casters);
    let tracer = RayTracer::new(ctx, Method::available(ctx)[0]).unwrap();
    let rays = pixel_rays(&sample.view().unwrap());
    let lamp = Vec3::from(sample.lamp());
    let found = tracer.trace(&all, &rays, How::default()).unwrap();
    let mut towards = Vec::new();
    let mut is_known = Vec::new();
    for (ray, hit) in rays.iter().zip(&found) {
        let [a, b, c] = everything[hit.primitive as usize % everything.len()].map(Vec3::from);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let at = Vec3::from(ray.origin) + hit.t * Vec3::from(ray.direction);
        let way = lamp - at;
        is_known.push(hit.kind == FRONT && normal.dot(way.normalize_or_zero()) > 0.15);
        towards.push(Ray { t_max: 1.0, ..Ray::new(at + 4e-3 * normal, way) });
    }
    let hits = tracer.trace(&blockers, &towards, How::shadows()).unwrap();
    is_known.into_iter().zip(hits).map(|(known, hit)| known.then_some(hit.kind != MISSED)).collect()
}

/// Compares the pixels that are in shadow with what rays find, but for those at edges. Answers how many are lit and how many
/// not.
fn check_shadows(ctx: &Context, view: &Camera) -> [usize; 2] {
    let config = |filter| OmniShadowsConfig { filter, haze: 0.0, shadow_size: 2048, ..usual() };
    let [mut lit, mut shadowed] =
        [ShadowFilter::Off, ShadowFilter::Hard].map(|filter| lamp(ctx, &config(filter)));
    let images = [&mut lit, &mut shadowed].map(|sample| {
        sample.set_view(view);
        image_now(sample)
    });
    let expected = traced_shadows(ctx, &mut shadowed);
    let (width, mut counts, mut wrong) = (SIZE[0] as usize, [0, 0], Vec::new());
    for (x, y, pixel) in images[0].enumerate_pixels() {
        let (x, y) = (x as usize, y as usize);
        if x == 0 || y == 0 || x + 1 == width || y + 1 == SIZE[1] as usize {
            continue;
        }
        let around = (y - 1..=y + 1).flat_map(|y| (x - 1..=x + 1).map(move |x| y * width + x));
        let Some(is_dark) = expected[y * width + x] else { continue };
        if around.into_iter().any(|at| expected[at] != Some(is_dark)) {
            continue;
        }
        counts[usize::from(is_dark)] += 1;
        let other = images[1].get_pixel(x as u32, y as u32);
        if is_dark != (pixel != other) {
            wrong.push((x, y));
        }
    }
    let checked = counts[0] + counts[1];
    assert!(
        wrong.len() * 50 <= checked,
        "{} of {checked} pixels: {:?}",
        wrong.len(),
        &wrong[..20.min(wrong.len())]
    );
    counts
}

/// Cases: views from the middle of the interior to all six sides.
#[test]
fn shadows_are_those_that_rays_find() {
    let Some(ctx) = device() else { return };
    let usual = lamp(&ctx, &usual()).view().unwrap();
    let views = [
        usual,
        Camera::looking_at([0.3, 1.4, -1.5], [0.0, 2.0, 4.6], 100.0),
        Camera::looking_at([2.0, 0.8, 1.0], [-1.0, 4.4, -1.5], 90.0),
        Camera::looking_at([-1.0, 2.0, 3.0], [4.2, 0.4, -1.0], 90.0),
        Camera::looking_at([1.0, 2.0, 3.0], [-4.2, 1.0, -1.0], 90.0),
    ];
    for view in views {
        let [lit, dark] = check_shadows(&ctx, &view);
        eprintln!("{lit} pixels lit, {dark} in shadow");
        assert!(lit > 2000 && dark > 100, "{lit} lit, {dark} dark");
    }
}

#[test]
fn a_larger_lamp_makes_softer_edges_and_no_other_light() {
    let Some(ctx) = device() else { return };
    let image = |filter, lamp_radius| {
        image_of(&mut lamp(&ctx, &OmniShadowsConfig { filter, lamp_radius, haze: 0.0, ..usual() }), 0)
    };
    let hard = image(ShadowFilter::Linear, 0.0);
    let [sharp, soft] = [0.002, 0.05].map(|radius| image(ShadowFilter::Soft, radius));
    let [near, far] = [&sharp, &soft].map(edges);
    assert!(far < 0.8 * near, "edges of {far} are no softer than of {near}");
    let [dim, bright] = [&hard, &soft].map(mean);
    assert!((dim - bright).abs() < 6.0, "{dim}, {bright} of 255");
}

/// Mean difference of pixels side by side.
fn edges(image: &RgbaImage) -> f64 {
    let rows = image.rows().map(|row| row.map(|pixel| f64::from(pixel[1])).collect::<Vec<_>>());
    let steps = rows.flat_map(|row| row.windows(2).map(|pair| (pair[0] - pair[1]).abs()).collect::<Vec<_>>());
    steps.sum::<f64>() / f64::from(SIZE[0] * SIZE[1])
}

fn mean(image: &RgbaImage) -> f64 {
    image.pixels().map(|pixel| f64::from(pixel[1])).sum::<f64>() / f64::from(SIZE[0] * SIZE[1])
}

#[test]
fn a_round_has_no_seam() {
    let Some(ctx) = device() else { return };
    assert_loops_without_seam(&mut lamp(&ctx, &usual()));
}

#[test]
fn the_lamp_looks_as_it_always_did() {
    let Some(ctx) = device() else { return };
    assert_matches_reference("omni_shadows_small", &image_of(&mut lamp(&ctx, &usual()), 0));
}

#[test]
fn another_driver_renders_it() {
    on_swiftshader(another_driver_renders_it, || {
        let Some(ctx) = device() else { return };
        let image = image_of(&mut lamp(&ctx, &usual()), 0);
        assert_similar("SwiftShader lamp", &image, &reference_image("omni_shadows_small"), &OTHER_DRIVER);
    });
}

#[test]
fn impossible_images_are_refused() {
    let Some(ctx) = device() else { return };
    assert_refuses_impossible_sizes(|extent| {
        OmniShadows::new(&ctx, &OmniShadowsConfig { extent, ..usual() })
    });
}
