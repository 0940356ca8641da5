//! Mip levels of textures that come and go within a budget.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::sync::Arc;

use glam::Vec3;
use lvk::Context;
use lvk_gltf::{
    AlphaMode, ColorSpace, Filter, Image, ImageData, Material, MipLevel, Model, Sampler, TexelFormat,
    TextureRef,
};
use lvk_samples::app::headless;
use lvk_samples::app::sample::Sample as _;
use lvk_samples::app::sample_error::SampleError;
use lvk_samples::hybrid::RayPath;
use lvk_samples::scene::Camera;
use lvk_tests::device;
use lvk_tests::rtx_sample::{contexts_and_paths, software_device};
use lvk_viewer::light::Environment;
use lvk_viewer::{Method, TextureMemory, Viewer, ViewerConfig, ViewerScene};

use crate::scenes::{Builder, View, matte};

const MIB: u64 = 1 << 20;
/// Side of the textures, in texels.
const SIDE: u32 = 512;
/// Walls behind each other, each with a texture of its own.
const WALLS: usize = 6;

/// Squares of two colours of which the fine levels show the most.
fn checks(source: usize, side: u32, color: [u8; 3]) -> Image {
    let texel = |place: u32| {
        let is_dark = (place / side / 3 + place % side / 3).is_multiple_of(2);
        let [red, green, blue] = if is_dark { color.map(|channel| channel / 3) } else { color };
        [red, green, blue, 255]
    };
    let bytes = (0..side * side).flat_map(texel).collect();
    let data =
        ImageData { format: TexelFormat::Rgba8, mips: vec![MipLevel { width: side, height: side, bytes }] };
    Image {
        name: Some(format!("checks {source}")),
        source,
        color_space: ColorSpace::Srgb,
        data: Arc::new(data),
    }
}

/// An image whose file has its levels, each of another colour.
fn levels_of_a_file(source: usize) -> Image {
    let level = |mip: u32| {
        let side = SIDE >> mip;
        let color = [200 - 20 * mip as u8, 40 + 20 * mip as u8, 90, 255];
        MipLevel { width: side, height: side, bytes: color.repeat((side * side) as usize) }
    };
    let data = ImageData { format: TexelFormat::Rgba8, mips: (0..=SIDE.ilog2()).map(level).collect() };
    Image { name: None, source, color_space: ColorSpace::Linear, data: Arc::new(data) }
}

fn textured(image: usize, sampler: usize, alpha_mode: AlphaMode) -> Material {
    let texture = TextureRef { image, sampler, tex_coord: 0, transform: None };
    Material { base_color_texture: Some(texture), alpha_mode, ..matte([1.0; 3]) }
}

/// A floor, and walls beside each other that get farther away and smaller in the picture.
fn gallery() -> Model {
    let floor = textured(WALLS, 0, AlphaMode::Opaque);
    let builder = Builder::default().quad(
        Vec3::new(-20.0, 0.0, 0.0),
        Vec3::Z * -60.0 + Vec3::Z * 64.0,
        Vec3::X * 40.0,
        floor,
    );
    let walls = (0..WALLS).map(|wall| {
        let corner = Vec3::new(wall as f32 * 0.9 - 2.5, 0.0, -((1 << wall) as f32));
        let alpha_mode = if wall == 1 { AlphaMode::Mask { cutoff: 0.5 } } else { AlphaMode::Opaque };
        (corner, textured(wall, 0, alpha_mode))
    });
    let builder = walls.fold(builder, |builder, (corner, material)| {
        builder.quad(corner, Vec3::X * 0.8, Vec3::Y * 0.8, material)
    });
    let mut model = builder.model();
    // A device makes the levels of all but one, which has levels with odd sides.
    let side = |wall| if wall == 2 { SIDE - 12 } else { SIDE };
    let color = |wall| [230, 200 - 20 * wall as u8, 40 * wall as u8];
    model.images = (0..WALLS).map(|wall| checks(wall, side(wall), color(wall))).collect();
    model.images.push(levels_of_a_file(WALLS));
    model.samplers = vec![Sampler::default()];
    model
}

fn view(samples: u32) -> View {
    View { camera: Camera::looking_at([0.0, 1.0, 4.0], [0.0, 0.4, 0.0], 45.0), size: [96, 64], samples }
}

fn viewer(
    ctx: &Context,
    (method, path): (Method, RayPath),
    model: &Model,
    budget: Option<u64>,
) -> Result<Viewer, SampleError> {
    let scene = ViewerScene {
        name: "gallery".to_owned(),
        model: model.clone(),
        environment: Environment::uniform([1.0; 3]),
        disc_radius: 0.1,
    };
    let View { camera, size: [width, height], samples } = view(2);
    let usual = ViewerConfig::new(path, width, height);
    let config = ViewerConfig { method, samples, bounces: 4, texture_budget: budget, ..usual };
    let mut viewer = Viewer::new(ctx, scene, &config)?;
    viewer.set_view(&camera);
    Ok(viewer)
}

/// The radiance of a still, and what its textures take.
fn still(
    ctx: &Context,
    by: (Method, RayPath),
    model: &Model,
    budget: Option<u64>,
) -> (Vec<[f32; 3]>, Option<TextureMemory>) {
    let mut viewer = viewer(ctx, by, model, budget).unwrap();
    headless::picture(&mut viewer).unwrap();
    (viewer.radiance().unwrap(), viewer.texture_memory())
}

/// Bytes of all levels of all images.
fn whole(model: &Model) -> u64 {
    let bytes = |image: &Image| {
        let side = image.data.extent()[0];
        (0..=side.ilog2()).map(|mip| 4 * u64::from(side >> mip).pow(2)).sum::<u64>()
    };
    model.images.iter().map(bytes).sum()
}

#[test]
fn a_budget_that_suffices_changes_no_pixel() {
    let Some(ctx) = device() else { return };
    let software = software_device();
    let model = gallery();
    for (ctx, path) in contexts_and_paths(&ctx, software.as_deref()) {
        let (all, none) = still(ctx, (Method::Hybrid, path), &model, None);
        assert_eq!(none, None);
        let (streamed, memory) = still(ctx, (Method::Hybrid, path), &model, Some(whole(&model)));
        let memory = memory.unwrap();
        assert!(all == streamed, "by {path:?} the pictures differ");
        assert_eq!(memory.coarse_count, 0, "{memory:?}");
        assert!(memory.resident * 2 < whole(&model), "what is far away is coarse: {memory:?}");
        eprintln!("{path:?}: {memory:?} of {}", whole(&model));
    }
}

#[test]
fn the_path_tracer_reads_the_finest_levels_of_what_it_meets() {
    let Some(ctx) = device() else { return };
    let model = gallery();
    let by = (Method::PathTrace, RayPath::Query);
    let (all, _) = still(&ctx, by, &model, None);
    let (streamed, memory) = still(&ctx, by, &model, Some(whole(&model)));
    assert!(all == streamed, "{memory:?}");
    assert_eq!(memory.unwrap().coarse_count, 0);
}

#[test]
fn a_small_budget_is_kept_and_shows_coarser_textures() {
    let Some(ctx) = device() else { return };
    let model = gallery();
    let by = (Method::Hybrid, RayPath::Query);
    let (all, enough) = {
        let (_, memory) = still(&ctx, by, &model, Some(whole(&model)));
        (still(&ctx, by, &model, None).0, memory.unwrap().resident)
    };
    let budget = enough / 3;
    let (streamed, memory) = still(&ctx, by, &model, Some(budget));
    let memory = memory.unwrap();
    assert!(memory.resident <= budget && memory.resident * 2 > budget, "{memory:?}");
    assert!(memory.coarse_count > 0, "{memory:?}");
    assert!(all != streamed);
    let pairs = || all.iter().flatten().zip(streamed.iter().flatten());
    let error = pairs().map(|(a, b)| f64::from((a - b).abs())).sum::<f64>() / pairs().count() as f64;
    let brightness =
        all.iter().flatten().map(|value| f64::from(*value)).sum::<f64>() / pairs().count() as f64;
    assert!(error < 0.1 * brightness, "{error} of {brightness}");
}

#[test]
fn a_still_does_not_depend_on_the_one_before() {
    let Some(ctx) = device() else { return };
    let model = gallery();
    let budget = Some(MIB);
    let mut viewer = viewer(&ctx, (Method::Hybrid, RayPath::Query), &model, budget).unwrap();
    let first = headless::picture(&mut viewer).unwrap();
    viewer.set_view(&Camera::looking_at([-2.1, 0.4, 0.0], [-2.1, 0.4, -1.0], 45.0));
    assert!(headless::picture(&mut viewer).unwrap() != first);
    viewer.set_view(&view(1).camera);
    assert!(headless::picture(&mut viewer).unwrap() == first);
}

#[test]
fn a_budget_below_what_always_stays_is_refused() {
    let Some(ctx) = device() else { return };
    let mut model = gallery();
    // A sampler without mip levels reads the largest ones, which therefore stay.
    model.samplers = vec![Sampler { mip_filter: None, min_filter: Filter::Linear, ..Sampler::default() }];
    let by = (Method::Hybrid, RayPath::Query);
    let error = viewer(&ctx, by, &model, Some(2 * MIB)).err().unwrap();
    let SampleError::OutOfRange { setting, value: 2, min, .. } = error else { unreachable!("{error}") };
    assert_eq!((setting, u64::from(min)), ("--texture-budget", whole(&model).div_ceil(MIB)));
    let (all, _) = still(&ctx, by, &model, None);
    let (pinned, memory) = still(&ctx, by, &model, Some(whole(&model)));
    assert!(all == pinned && memory.unwrap().resident == whole(&model), "{memory:?}");
}

#[test]
fn frames_of_a_window_load_what_they_show_and_drop_what_they_do_not() {
    let Some(ctx) = device() else { return };
    let model = gallery();
    let budget = 3 * MIB;
    let mut viewer = viewer(&ctx, (Method::Hybrid, RayPath::Query), &model, Some(budget)).unwrap();
    viewer.configure(&ViewerConfig { is_progressive: true, ..*viewer.config() }).unwrap();
    // Right before one wall and then before another; both do not fit.
    for x in [-2.1, 0.6] {
        viewer.set_view(&Camera::looking_at([x, 0.4, 4.0], [x, 0.4, 0.0], 4.0));
        let mut is_fine = false;
        for _ in 0..600 {
            headless::picture(&mut viewer).unwrap();
            let memory = viewer.texture_memory().unwrap();
            assert!(memory.resident <= budget, "{memory:?}");
            is_fine = memory.coarse_count == 0 && viewer.config().is_progressive && memory.resident > MIB;
            if is_fine {
                break;
            }
        }
        assert!(is_fine, "{:?}", viewer.texture_memory());
    }
}

#[test]
fn models_without_images_have_a_budget_too() {
    let Some(ctx) = device() else { return };
    let model = Builder::default().quad(Vec3::ZERO, Vec3::X, Vec3::Y, matte([0.5; 3])).model();
    let (all, _) = still(&ctx, (Method::Hybrid, RayPath::Query), &model, None);
    let (streamed, memory) = still(&ctx, (Method::Hybrid, RayPath::Query), &model, Some(0));
    assert!(all == streamed);
    assert_eq!(memory, Some(TextureMemory { budget: 0, resident: 0, coarse_count: 0 }));
}
