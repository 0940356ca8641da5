//! Dispatches that write one storage image, each behind the one before.

use std::rc::Rc;
use std::time::Instant;

use lvk::ash::vk;
use lvk::{Context, Dependencies};

use super::row::{Limit, Row};
use super::scene::{Push, Scene};
use super::{Amount, each_ns};
use crate::bench::error::BenchError;
use crate::bench::hand_written::{RawDevice, RawRecorder};
use crate::bench::measure::{median_of, since, take_turns};

pub(super) fn measure(ctx: &Context, silent: &Context, amount: Amount) -> Result<Vec<Row>, BenchError> {
    let (scene, silent_scene) = (Scene::new(ctx)?, Scene::new(silent)?);
    let raw = RawRecorder::new(&RawDevice::new(ctx))?;
    let count = (amount.draws / 10).max(1);
    let samples: [Vec<f64>; 3] = take_turns(amount.runs, |which| match which {
        0 => Ok(ours(ctx, &scene, count)?),
        1 => by_hand(ctx, &raw, &scene, count),
        _ => Ok(ours(silent, &silent_scene, count)?),
    })?;
    let [ours, by_hand, own] = samples.map(|samples| each_ns(median_of(&samples, |ms| *ms), count));
    let what = format!("dispatch behind a storage image's barrier, {count} recorded");
    Ok(vec![
        Row { what, ours, other: Some(by_hand), unit: "ns", limit: Limit::Ratio(1.25) },
        Row { what: "- own share".to_owned(), ours: own, other: None, unit: "ns", limit: Limit::Most(25.0) },
    ])
}

/// Milliseconds to record them.
fn ours(ctx: &Context, scene: &Scene, count: u32) -> lvk::Result<f64> {
    let mut cmd = ctx.acquire_command_buffer()?;
    let push: Push = [scene.image.index(); 16];
    let images = [*scene.image];
    cmd.bind_compute_pipeline(*scene.compute)?;
    cmd.push_constants(&push)?;
    let start = Instant::now();
    for _ in 0..count {
        cmd.dispatch([1, 1, 1], &Dependencies { storage_images: &images, ..Dependencies::default() })?;
    }
    Ok(since(start))
}

fn by_hand(ctx: &Context, raw: &Rc<RawRecorder>, scene: &Scene, count: u32) -> Result<f64, BenchError> {
    let pipeline = ctx.raw_compute_pipeline(*scene.compute)?;
    let (device, layout) = (ctx.raw_device(), ctx.raw_pipeline_layout());
    let commands = raw.begin()?;
    let push: Push = [scene.image.index(); 16];
    let access = vk::AccessFlags2::SHADER_READ | vk::AccessFlags2::SHADER_WRITE;
    // SAFETY: everything named is alive, and the command buffer is given up, never submitted.
    unsafe {
        let (compute, set) = (vk::PipelineBindPoint::COMPUTE, [ctx.raw_descriptor_set()]);
        device.cmd_bind_pipeline(commands, compute, pipeline);
        device.cmd_bind_descriptor_sets(commands, compute, layout, 0, &set, &[]);
        let bytes = bytemuck::bytes_of(&push);
        device.cmd_push_constants(commands, layout, vk::ShaderStageFlags::ALL, 0, bytes);
        let start = Instant::now();
        for _ in 0..count {
            let barrier = [vk::MemoryBarrier2::default()
                .src_stage_mask(vk::PipelineStageFlags2::COMPUTE_SHADER)
                .src_access_mask(vk::AccessFlags2::SHADER_WRITE)
                .dst_stage_mask(vk::PipelineStageFlags2::COMPUTE_SHADER)
                .dst_access_mask(access)];
            let barrier = vk::DependencyInfo::default().memory_barriers(&barrier);
            device.cmd_pipeline_barrier2(commands, &barrier);
            device.cmd_dispatch(commands, 1, 1, 1);
        }
        let taken = since(start);
        raw.give_up()?;
        Ok(taken)
    }
}
