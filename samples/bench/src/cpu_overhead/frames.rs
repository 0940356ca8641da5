//! Parts of the CPU time of a frame with one dispatch: the command buffer, the commands, the submission.

use std::time::Instant;

use lvk::ash::vk;
use lvk::{Context, Dependencies};

use super::Workload;
use super::row::{Limit, OverheadRow};
use super::scene::{Push, Scene};
use crate::error::BenchError;
use crate::hand_written::{RawCommands, RawDevice, RawFrameRing};
use crate::measure::{FrameParts, elapsed_ms, interleave, median_of};

pub(super) fn measure(ctx: &Context, workload: Workload) -> Result<Vec<OverheadRow>, BenchError> {
    let scene = Scene::new(ctx)?;
    let device = RawDevice::new(ctx);
    let (raw, ring) = (RawCommands::new(&device)?, RawFrameRing::new(&device)?);
    let frames = (workload.many / 20).max(1);
    let samples: [Vec<FrameParts>; 3] = interleave(workload.runs, |which| {
        let mut parts = Vec::new();
        for _ in 0..frames {
            parts.push(match which {
                0 => ours(ctx, &scene)?,
                1 => raw.frame(dispatch(ctx, &scene)?)?,
                _ => ring.frame(dispatch(ctx, &scene)?)?,
            });
        }
        Ok(median_of_each(&parts))
    })?;
    let [ours, by_hand, same_calls] = samples.map(|samples| median_of_each(&samples));
    let row = |name, ours, by_hand| {
        OverheadRow::new(name, 1e3 * ours, "us", Limit::None).compared_with(1e3 * by_hand)
    };
    Ok(vec![
        row("frame of one dispatch: command buffer", ours.begin, by_hand.begin),
        row("- the same: commands", ours.record, by_hand.record),
        row("- the same: submission", ours.submit, by_hand.submit),
        row("- the same, by hand with the library's calls", ours.submit, same_calls.submit),
    ])
}

fn median_of_each(parts: &[FrameParts]) -> FrameParts {
    FrameParts {
        begin: median_of(parts, |parts| parts.begin),
        record: median_of(parts, |parts| parts.record),
        submit: median_of(parts, |parts| parts.submit),
    }
}

fn ours(ctx: &Context, scene: &Scene) -> lvk::Result<FrameParts> {
    let start = Instant::now();
    let mut cmd = ctx.acquire_command_buffer()?;
    let begin = elapsed_ms(start);
    let push: Push = [scene.image.index(); 16];
    let images = [*scene.image];
    cmd.bind_compute_pipeline(*scene.compute)?;
    cmd.push_constants(&push)?;
    cmd.dispatch([1, 1, 1], &Dependencies { storage_images: &images, ..Dependencies::default() })?;
    let recorded = elapsed_ms(start);
    let submission = ctx.submit(cmd)?;
    let submitted = elapsed_ms(start);
    ctx.wait(submission)?;
    Ok(FrameParts { begin, record: recorded - begin, submit: submitted - recorded })
}

/// Returns the commands of a frame by hand.
fn dispatch(ctx: &Context, scene: &Scene) -> lvk::Result<impl FnOnce(vk::CommandBuffer)> {
    let pipeline = ctx.raw_compute_pipeline(*scene.compute)?;
    let (device, layout, set) = (ctx.raw_device(), ctx.raw_pipeline_layout(), [ctx.raw_descriptor_set()]);
    let push: Push = [scene.image.index(); 16];
    Ok(move |commands| {
        // SAFETY: everything named is alive, and the command buffer is being recorded. The last frame was waited for.
        unsafe {
            let compute = vk::PipelineBindPoint::COMPUTE;
            device.cmd_bind_pipeline(commands, compute, pipeline);
            device.cmd_bind_descriptor_sets(commands, compute, layout, 0, &set, &[]);
            let bytes = bytemuck::bytes_of(&push);
            device.cmd_push_constants(commands, layout, vk::ShaderStageFlags::ALL, 0, bytes);
            device.cmd_dispatch(commands, 1, 1, 1);
        }
    })
}
