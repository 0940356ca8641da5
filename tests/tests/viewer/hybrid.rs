//! The real-time method against the path tracer.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::sync::Arc;

use glam::Vec3;
use image::RgbaImage;
use lvk::{Context, RayQueryPath};
use lvk_gltf::{ImageData, Material, MipLevel, Model, TexelFormat, TextureRef, TextureTransform};
use lvk_samples::app::headless;
use lvk_samples::app::sample::Sample as _;
use lvk_samples::hybrid::RayPath;
use lvk_samples::scene::Camera;
use lvk_tests::device;
use lvk_tests::image_comparison::{Tolerance, assert_similar};
use lvk_tests::rtx_sample::software_device;
use lvk_viewer::light::{Environment, SunSetting};
use lvk_viewer::{Content, IndirectLight, LightRate, Method, PrimaryVisibility, ViewerConfig};

use crate::scenes::{
    Builder, View, assert_close, config, configured_viewer, matte, mean, radiance_by, viewer,
};
use crate::still_life::still_life;

const SIZE: [u32; 2] = [96, 64];

fn environment() -> Environment {
    Environment::day(&SunSetting::default())
}

fn view(samples: u32) -> View {
    View { camera: Camera::looking_at([1.5, 1.7, 4.5], [-0.2, 0.5, 0.0], 40.0), size: SIZE, samples }
}

fn picture(ctx: &Context, method: Method, model: &Model, view: &View) -> RgbaImage {
    let mut viewer = viewer(ctx, (method, RayPath::Query), model, &environment(), view);
    RgbaImage::from_raw(SIZE[0], SIZE[1], headless::picture(&mut viewer).unwrap()).unwrap()
}

/// A matte floor that fills the pictures of it.
fn broad_floor(color: [f32; 3]) -> Builder {
    Builder::default().quad(Vec3::new(-50.0, 0.0, 50.0), Vec3::X * 100.0, Vec3::NEG_Z * 100.0, matte(color))
}

#[test]
fn a_still_comes_close_to_the_reference() {
    let Some(ctx) = software_device() else { return };
    let model = still_life();
    let reference = picture(&ctx, Method::PathTrace, &model, &view(1024));
    let few = Tolerance { psnr: 22.0, ssim: 0.75, flip: 0.15, ..Tolerance::default() };
    assert_similar("four frames", &picture(&ctx, Method::Hybrid, &model, &view(4)), &reference, &few);
    let many = Tolerance { psnr: 29.5, ssim: 0.91, flip: 0.065, ..Tolerance::default() };
    assert_similar("64 frames", &picture(&ctx, Method::Hybrid, &model, &view(64)), &reference, &many);
    let most = Tolerance { psnr: 31.0, ssim: 0.93, flip: 0.052, ..Tolerance::default() };
    assert_similar("400 frames", &picture(&ctx, Method::Hybrid, &model, &view(400)), &reference, &most);
}

/// Light of one pixel in four by turns: four times as many frames have as many samples.
#[test]
fn a_still_at_a_quarter_of_the_rate_has_the_light_of_the_reference() {
    let Some(ctx) = software_device() else { return };
    let model = still_life();
    let reference = picture(&ctx, Method::PathTrace, &model, &view(1024));
    let quarter = |samples, indirect| {
        let usual = config((Method::Hybrid, RayPath::Query), &view(samples));
        let config = ViewerConfig { light_rate: LightRate::Quarter, indirect, ..usual };
        let mut viewer = configured_viewer(&ctx, &config, &model, &environment(), &view(samples));
        let pixels = headless::picture(&mut viewer).unwrap();
        (RgbaImage::from_raw(SIZE[0], SIZE[1], pixels).unwrap(), mean(&viewer.radiance().unwrap()))
    };
    let few = Tolerance { psnr: 22.0, ssim: 0.75, flip: 0.15, ..Tolerance::default() };
    assert_similar("16 frames", &quarter(16, IndirectLight::Paths).0, &reference, &few);
    let many = Tolerance { psnr: 29.5, ssim: 0.91, flip: 0.065, ..Tolerance::default() };
    assert_similar("256 frames", &quarter(256, IndirectLight::Paths).0, &reference, &many);
    for indirect in [IndirectLight::Cache, IndirectLight::AmbientOcclusion] {
        let usual = config((Method::Hybrid, RayPath::Query), &view(64));
        let config = ViewerConfig { indirect, ..usual };
        let mut viewer = configured_viewer(&ctx, &config, &model, &environment(), &view(64));
        headless::picture(&mut viewer).unwrap();
        let expected = mean(&viewer.radiance().unwrap());
        assert_close(&format!("{indirect:?}"), quarter(256, indirect).1, expected, 0.02);
    }
}

/// Invocations take pixels in another order where these take turns: each pixel has one, in pictures of odd sides too.
#[test]
fn every_pixel_shows_its_surface_at_any_rate() {
    let Some(ctx) = software_device() else { return };
    let model = still_life();
    for size in [[95, 63], [96, 63], [95, 64], [1, 3], [3, 1]] {
        for content in [Content::Normals, Content::Albedo] {
            let [full, quarter] = [LightRate::Full, LightRate::Quarter].map(|light_rate| {
                // From the second frame on most pixels find no light at a quarter of the rate.
                let view = View { size, ..view(3) };
                let usual = config((Method::Hybrid, RayPath::Query), &view);
                let config = ViewerConfig { light_rate, content, ..usual };
                let mut viewer = configured_viewer(&ctx, &config, &model, &environment(), &view);
                headless::picture(&mut viewer).unwrap();
                viewer.radiance().unwrap()
            });
            // The number of a sample decides by chance what a veil shows.
            let differing = full.iter().zip(&quarter).filter(|(full, quarter)| full != quarter).count();
            assert!(20 * differing <= full.len(), "{content:?}, {size:?}: {differing} pixels differ");
        }
    }
}

/// The numbers of samples differ by the rate: a still begins anew, so that none comes twice.
#[test]
fn a_still_begins_anew_at_another_rate() {
    let Some(ctx) = software_device() else { return };
    let model = still_life();
    let config = config((Method::Hybrid, RayPath::Query), &view(1));
    let config = ViewerConfig { is_progressive: true, ..config };
    let shown = |rates: &[LightRate]| {
        let mut viewer = configured_viewer(&ctx, &config, &model, &environment(), &view(1));
        for &light_rate in rates {
            viewer.configure(&ViewerConfig { light_rate, ..config }).unwrap();
            for _ in 0..5 {
                headless::picture(&mut viewer).unwrap();
            }
        }
        viewer.radiance().unwrap()
    };
    for [first, second] in [[LightRate::Full, LightRate::Quarter], [LightRate::Quarter, LightRate::Full]] {
        assert_eq!(shown(&[first, second]), shown(&[second]), "{first:?}, then {second:?}");
    }
}

/// A matte floor under an even sky receives the light of the sky, and none that other layers would mirror.
#[test]
fn views_of_light_show_what_surfaces_receive() {
    let Some(ctx) = software_device() else { return };
    let floor = broad_floor([0.2, 0.5, 0.8]);
    let (model, sky) = (floor.model(), Environment::uniform([1.0, 2.0, 3.0]));
    let view =
        View { camera: Camera::looking_at([0.0, 2.0, 0.5], [0.0; 3], 40.0), size: [24, 16], samples: 64 };
    for (content, expected) in [(Content::Matte, [1.0, 2.0, 3.0]), (Content::Mirrored, [0.0; 3])] {
        let config = ViewerConfig { content, ..config((Method::Hybrid, RayPath::Query), &view) };
        let mut viewer = configured_viewer(&ctx, &config, &model, &sky, &view);
        headless::picture(&mut viewer).unwrap();
        assert_close(&format!("{content:?}"), mean(&viewer.radiance().unwrap()), expected, 0.02);
    }
}

/// Texels that are read by the second set of texture coordinates are as fine as those that are read by the first.
#[test]
fn mips_are_those_of_the_set_of_texture_coordinates() {
    let Some(ctx) = software_device() else { return };
    let stripes = (0..64 * 64).flat_map(|texel| if texel % 64 % 2 == 0 { [255; 4] } else { [0, 0, 0, 255] });
    let level = MipLevel { width: 64, height: 64, bytes: stripes.collect() };
    let data = Arc::new(ImageData { format: TexelFormat::Rgba8, mips: vec![level] });
    let often = TextureTransform { offset: [0.0; 2], rotation: 0.0, scale: [20.0; 2] };
    let shown = |tex_coord: usize| {
        let texture = TextureRef { image: 0, sampler: 0, tex_coord, transform: Some(often) };
        let floor = Material { unlit: true, base_color_texture: Some(texture), ..matte([1.0; 3]) };
        let mut model = Builder::default()
            .quad(Vec3::new(-10.0, 0.0, 10.0), Vec3::X * 20.0, Vec3::NEG_Z * 20.0, floor)
            .image(&data)
            .model();
        if tex_coord == 1 {
            // The first set has the same texels everywhere.
            model.meshes[0].primitives[0].tex_coords.insert(0, vec![[0.0; 2]; 4]);
        }
        let camera = Camera::looking_at([0.0, 3.0, 8.0], [0.0; 3], 50.0);
        let view = View { camera, size: [48, 32], samples: 1 };
        radiance_by(&ctx, (Method::Hybrid, RayPath::Query), &model, &environment(), &view)
    };
    assert_eq!(shown(1), shown(0));
}

/// A dark floor in bright exposure returns all of the light that the path tracer finds, though it is far from the first bound of a path.
#[test]
fn dark_surfaces_in_bright_exposure_keep_their_light() {
    let Some(ctx) = software_device() else { return };
    let floor = broad_floor([0.02; 3]);
    let (model, down) = (floor.model(), Camera::looking_at([0.0, 2.0, 0.5], [0.0, 0.0, 0.0], 40.0));
    let shown = |method, samples| {
        let view = View { camera: down, size: [24, 16], samples };
        let mut viewer = viewer(&ctx, (method, RayPath::Query), &model, &environment(), &view);
        viewer.configure(&ViewerConfig { exposure_stops: 5.0, ..*viewer.config() }).unwrap();
        headless::picture(&mut viewer).unwrap();
        mean(&viewer.radiance().unwrap())
    };
    assert_close("a dark floor", shown(Method::Hybrid, 64), shown(Method::PathTrace, 256), 0.02);
}

/// Bright strips that are narrower than a pixel: the picture is the plain mean over the frames, not one in which bright light counts less.
#[test]
fn a_still_of_bright_strips_has_the_light_of_the_reference() {
    let Some(ctx) = software_device() else { return };
    let glowing = Material { emissive: [1.0; 3], emissive_strength: 8.0, ..matte([0.0; 3]) };
    let strips = (0..12).fold(Builder::default(), |builder, number| {
        let corner = Vec3::new(-2.0, 0.31 * number as f32 - 1.8, 0.0);
        builder.quad(corner, Vec3::new(4.0, 0.3, 0.0), Vec3::Y * 0.08, glowing.clone())
    });
    let (model, dark) = (strips.model(), Environment::uniform([0.0; 3]));
    let camera = Camera::looking_at([0.0, 0.0, 5.0], [0.0; 3], 40.0);
    let light = |method, samples| {
        let view = View { camera, size: [32, 24], samples };
        mean(&radiance_by(&ctx, (method, RayPath::Query), &model, &dark, &view))
    };
    assert_close("strips", light(Method::Hybrid, 64), light(Method::PathTrace, 256), 0.02);
}

/// A wall beside a floor whose image repeats so often that scattered rays read its smallest mip level. Of nine texels the middle one alone is
/// bright, and the only one that a blit would leave.
#[test]
fn the_smallest_mip_of_an_image_of_odd_sides_has_its_light() {
    let Some(ctx) = software_device() else { return };
    let bytes = (0..9).flat_map(|texel| if texel == 4 { [255; 4] } else { [0, 0, 0, 255] }).collect();
    let level = MipLevel { width: 3, height: 3, bytes };
    let data = Arc::new(ImageData { format: TexelFormat::Rgba8, mips: vec![level] });
    let often = TextureTransform { offset: [0.0; 2], rotation: 0.0, scale: [400.0; 2] };
    let texture = TextureRef { image: 0, sampler: 0, tex_coord: 0, transform: Some(often) };
    let floor = Material { base_color_texture: Some(texture), ..matte([1.0; 3]) };
    let model = Builder::default()
        .quad(Vec3::new(-10.0, 0.0, 20.0), Vec3::X * 20.0, Vec3::NEG_Z * 20.0, floor)
        .quad(Vec3::new(-10.0, 0.0, 0.0), Vec3::X * 20.0, Vec3::Y * 4.0, matte([0.8; 3]))
        .image(&data)
        .model();
    // The sun stands behind the wall: it shines on the floor, and not on the wall.
    let behind = SunSetting { elevation_degrees: 60.0, azimuth_degrees: 180.0, ..SunSetting::default() };
    let environment = Environment { sun: Environment::day(&behind).sun, ..Environment::uniform([0.0; 3]) };
    let camera = Camera::looking_at([0.0, 1.5, 4.0], [0.0, 1.5, 0.0], 20.0);
    let light = |method, samples| {
        let view = View { camera, size: [24, 16], samples };
        mean(&radiance_by(&ctx, (method, RayPath::Query), &model, &environment, &view))
    };
    assert_close("the wall", light(Method::Hybrid, 64), light(Method::PathTrace, 512), 0.06);
}

/// Rays and the rasteriser may disagree at edges of triangles alone. Of the first frame of a still life with masks and panes.
#[test]
fn rays_find_the_surfaces_that_the_rasteriser_finds() {
    let Some(ctx) = software_device() else { return };
    let model = still_life();
    let mut viewers = [PrimaryVisibility::Rays, PrimaryVisibility::Raster].map(|primary| {
        let config = ViewerConfig { primary, ..config((Method::Hybrid, RayPath::Query), &view(1)) };
        configured_viewer(&ctx, &config, &model, &environment(), &view(1))
    });
    let contents = [Content::Normals, Content::Roughness, Content::Albedo];
    let rates = [LightRate::Full, LightRate::Quarter];
    for (light_rate, content) in rates.into_iter().flat_map(|rate| contents.map(|content| (rate, content))) {
        let [rays, raster] = viewers.each_mut().map(|viewer| {
            viewer.configure(&ViewerConfig { content, light_rate, ..*viewer.config() }).unwrap();
            headless::picture(viewer).unwrap();
            viewer.radiance().unwrap()
        });
        let differ = |(a, b): (&[f32; 3], &[f32; 3])| a.iter().zip(b).any(|(a, b)| (a - b).abs() > 0.02);
        let differing = rays.iter().zip(&raster).filter(|pixels| differ(*pixels)).count();
        assert!(100 * differing < rays.len(), "{content:?}: {differing} of {}", rays.len());
    }
}

#[test]
fn a_moving_camera_leaves_no_trail() {
    let Some(ctx) = software_device() else { return };
    let model = still_life();
    let reference = picture(&ctx, Method::PathTrace, &model, &view(256));
    let full = Tolerance { psnr: 27.0, ssim: 0.87, flip: 0.09, ..Tolerance::default() };
    let quarter = Tolerance { psnr: 26.0, ssim: 0.84, flip: 0.105, ..Tolerance::default() };
    for (light_rate, moving) in [(LightRate::Full, full), (LightRate::Quarter, quarter)] {
        let mut viewer = viewer(&ctx, (Method::Hybrid, RayPath::Query), &model, &environment(), &view(1));
        viewer.configure(&ViewerConfig { is_progressive: true, light_rate, ..*viewer.config() }).unwrap();
        let end = view(1).camera;
        let mut last = Vec::new();
        for frame in (0..24_u8).rev() {
            let [x, y, z] = end.eye;
            viewer.set_view(&Camera { eye: [x - 0.04 * f32::from(frame), y, z], ..end });
            last = headless::picture(&mut viewer).unwrap();
        }
        let last = RgbaImage::from_raw(SIZE[0], SIZE[1], last).unwrap();
        assert_similar(&format!("after 24 frames of motion, {light_rate:?}"), &last, &reference, &moving);
    }
}

#[test]
fn views_of_data_show_what_they_say() {
    let Some(ctx) = software_device() else { return };
    let mut viewer = viewer(&ctx, (Method::Hybrid, RayPath::Query), &still_life(), &environment(), &view(1));
    // The lowest pixels show the floor: it faces +y, is of roughness 0.5, and nothing moves.
    let at = (SIZE[0] * (SIZE[1] - 1) + SIZE[0] / 2) as usize;
    let mut floor = |content| {
        viewer.configure(&ViewerConfig { content, ..*viewer.config() }).unwrap();
        headless::picture(&mut viewer).unwrap();
        viewer.radiance().unwrap()[at]
    };
    let is_near = |a: [f32; 3], b: [f32; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 0.01);
    assert!(is_near(floor(Content::Normals), [0.5, 1.0, 0.5]));
    assert!(is_near(floor(Content::Roughness), [0.5; 3]));
    assert!(is_near(floor(Content::Motion), [0.5; 3]));
    let albedo = floor(Content::Albedo);
    assert!((0.55..0.7).contains(&albedo[0]), "{albedo:?}");
}

#[test]
fn steps_of_rays_are_counted_in_software_alone() {
    let (Some(software), Some(hardware)) = (software_device(), device()) else { return };
    let model = still_life();
    for ctx in [&*software, &*hardware] {
        let is_counted = ctx.capabilities().ray_query_path == RayQueryPath::Software;
        let mut viewer = viewer(ctx, (Method::Hybrid, RayPath::Query), &model, &environment(), &view(1));
        viewer.configure(&ViewerConfig { content: Content::Steps, ..*viewer.config() }).unwrap();
        headless::picture(&mut viewer).unwrap();
        let radiance = viewer.radiance().unwrap();
        if !is_counted {
            assert!(radiance.iter().all(|pixel| *pixel == [0.0; 3]));
            continue;
        }
        // The box of glass in the middle is behind more bounds than the sky in the corner.
        let bright = |x: u32, y: u32| radiance[(SIZE[0] * y + x) as usize].iter().sum::<f32>();
        let (sky, glass) = (bright(1, 1), bright(SIZE[0] / 3, SIZE[1] / 2));
        assert!(sky > 0.0 && glass > 1.5 * sky, "{sky} {glass}");
    }
}
