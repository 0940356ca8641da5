//! Cost of a texture, a submission, a draw and a dispatch beside many textures.

use std::time::Instant;

use lvk::{Context, Dependencies, Format, Holder, TextureDesc, TextureHandle, TextureUsage};

use super::curve::{Curve, Expected, Unit};
use super::effort::Effort;
use super::group::{Group, GroupKey};
use super::live_objects::{AT_ONCE, create_and_destroy, empty_submission, scattered, submit_empty};
use crate::cpu_overhead::{DrawScene, Push};
use crate::error::BenchError;
use crate::hand_written::{RawCommands, RawDevice};
use crate::measure::elapsed_ms;
use crate::setup::Setup;
use crate::table::format_grouped;

/// Textures that a dispatch names.
const NAMED: usize = 16;
/// Dispatches of one sample.
const DISPATCHES: u32 = 100;
/// Textures of the scene and of the library, beside those that are counted.
const OTHERS: u64 = 100;

pub(super) fn measure(setup: &Setup, effort: Effort) -> Result<Group, BenchError> {
    let wanted = GroupKey::Textures.sizes(effort.quick);
    let spare = u64::from(AT_ONCE) + OTHERS;
    let ctx = setup.open_for_textures((wanted[wanted.len() - 1] + spare) as u32)?;
    let limit = u64::from(ctx.capabilities().limits.max_bindless_textures);
    let sizes: Vec<u64> = wanted.iter().copied().filter(|size| size + spare <= limit).collect();
    let scene = DrawScene::new(&ctx)?;
    let by_hand = RawCommands::new(&RawDevice::new(&ctx))?;
    let mut curves = curves();
    let mut alive: Vec<Holder<TextureHandle>> = Vec::new();
    for &count in &sizes {
        while (alive.len() as u64) < count {
            alive.push(texture(&ctx)?);
        }
        submit_empty(&ctx)?;
        let [created, destroyed] = create_and_destroy(&ctx, effort, || texture(&ctx))?;
        let named: Vec<_> = scattered(NAMED, alive.len()).into_iter().map(|index| *alive[index]).collect();
        let costs = [
            created,
            destroyed,
            empty_submission(effort, || Ok(submit_empty(&ctx)?))?,
            empty_submission(effort, || by_hand.submit_empty())?,
            effort.median(|| Ok(draw(&ctx, &scene)?))?,
            effort.median(|| Ok(dispatches(&ctx, &scene, &[])? / f64::from(DISPATCHES)))?,
            effort.median(|| Ok(dispatches(&ctx, &scene, &named)? / f64::from(DISPATCHES)))?,
        ];
        curves.iter_mut().zip(costs).for_each(|(curve, cost)| curve.push(count, cost));
    }
    let notes = vec![format!(
        "the device's limits of descriptors allow {} textures; textures are 4 x 4 texels",
        format_grouped(limit)
    )];
    Ok(Group { key: GroupKey::Textures, sizes, curves, notes })
}

fn curves() -> Vec<Curve> {
    let curves = [
        ("create one more", Expected::Constant),
        ("destroy one, with the submission that frees it", Expected::Constant),
        ("empty submission and wait", Expected::Constant),
        // Vulkan calls without the library, beside the same textures: what grows there is the driver's.
        ("the same by hand, with a fence", Expected::Grows("the driver")),
        ("pass with a draw that names none, until done", Expected::Constant),
        ("dispatch that names none, recorded", Expected::Constant),
        ("dispatch with 16 in `Dependencies`, recorded", Expected::Constant),
    ];
    curves.map(|(name, expected)| Curve::new(name, Unit::Milliseconds, expected)).into()
}

fn texture(ctx: &Context) -> lvk::Result<Holder<TextureHandle>> {
    ctx.create_texture(&TextureDesc {
        format: Format::Rgba8Unorm,
        extent: [4, 4],
        usage: TextureUsage::SAMPLED,
        ..TextureDesc::default()
    })
}

/// Returns the milliseconds of a pass with one draw until the GPU is done.
fn draw(ctx: &Context, scene: &DrawScene) -> lvk::Result<f64> {
    let start = Instant::now();
    let mut cmd = ctx.acquire_command_buffer()?;
    let mut pass = scene.pass(&mut cmd)?;
    pass.push_constants(&[1_u32; 16])?;
    pass.draw(0..3, 0..1)?;
    drop(pass);
    ctx.wait(ctx.submit(cmd)?)?;
    Ok(elapsed_ms(start))
}

/// Returns the milliseconds to record dispatches that sample `named`. The GPU runs them, too.
fn dispatches(ctx: &Context, scene: &DrawScene, named: &[TextureHandle]) -> lvk::Result<f64> {
    let mut cmd = ctx.acquire_command_buffer()?;
    let push: Push = [scene.image.index(); 16];
    let images = [*scene.image];
    let dependencies =
        Dependencies { sampled_images: named, storage_images: &images, ..Dependencies::default() };
    cmd.bind_compute_pipeline(*scene.compute)?;
    cmd.push_constants(&push)?;
    let start = Instant::now();
    for _ in 0..DISPATCHES {
        cmd.dispatch([1, 1, 1], &dependencies)?;
    }
    let recorded = elapsed_ms(start);
    ctx.wait(ctx.submit(cmd)?)?;
    Ok(recorded)
}
