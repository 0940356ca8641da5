//! Dispatches that write one storage image, each after a barrier.

use std::rc::Rc;
use std::time::Instant;

use lvk::ash::vk;
use lvk::{Context, Dependencies};

use super::Workload;
use super::recording::{Limits, measure_recording};
use super::row::OverheadRow;
use super::scene::{Push, Scene};
use crate::error::BenchError;
use crate::hand_written::RawRecorder;
use crate::measure::elapsed_ms;

pub(super) fn measure(
    ctx: &Context,
    silent: &Context,
    workload: Workload,
) -> Result<Vec<OverheadRow>, BenchError> {
    let count = (workload.draws / 10).max(1);
    let name = format!("dispatch after a storage image barrier, {count} recorded");
    let limits = Limits { ratio: 1.25, library_ns: 25.0 };
    measure_recording(ctx, silent, (workload.runs, count), (ours, by_hand), (name, limits))
}

/// Returns the milliseconds of the recording.
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
    Ok(elapsed_ms(start))
}

fn by_hand(ctx: &Context, raw: &Rc<RawRecorder>, scene: &Scene, count: u32) -> Result<f64, BenchError> {
    let pipeline = ctx.raw_compute_pipeline(*scene.compute)?;
    let (device, layout) = (ctx.raw_device(), ctx.raw_pipeline_layout());
    let commands = raw.begin()?;
    let push: Push = [scene.image.index(); 16];
    let access = vk::AccessFlags2::SHADER_READ | vk::AccessFlags2::SHADER_WRITE;
    // SAFETY: everything named is alive, and the command buffer is discarded, never submitted.
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
        let taken = elapsed_ms(start);
        raw.discard()?;
        Ok(taken)
    }
}
