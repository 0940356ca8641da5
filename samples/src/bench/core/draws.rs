//! Push constants and a draw, many times in one pass.

use std::rc::Rc;
use std::time::Instant;

use lvk::Context;
use lvk::ash::vk;

use super::row::{Limit, Row};
use super::scene::{Push, Scene};
use super::{Amount, each_ns};
use crate::bench::error::BenchError;
use crate::bench::hand_written::{RawDevice, RawRecorder};
use crate::bench::measure::{median_of, since, take_turns};

pub(super) fn measure(ctx: &Context, silent: &Context, amount: Amount) -> Result<Vec<Row>, BenchError> {
    let (scene, silent_scene) = (Scene::new(ctx)?, Scene::new(silent)?);
    let raw = RawRecorder::new(&RawDevice::new(ctx))?;
    let count = amount.draws;
    let samples: [Vec<f64>; 3] = take_turns(amount.runs, |which| match which {
        0 => Ok(ours(ctx, &scene, count)?),
        1 => by_hand(ctx, &raw, &scene, count),
        _ => Ok(ours(silent, &silent_scene, count)?),
    })?;
    let [ours, by_hand, own] = samples.map(|samples| each_ns(median_of(&samples, |ms| *ms), count));
    let what = format!("push constants + draw, {count} pairs recorded");
    Ok(vec![
        Row { what, ours, other: Some(by_hand), unit: "ns", limit: Limit::Ratio(1.10) },
        Row { what: "- own share".to_owned(), ours: own, other: None, unit: "ns", limit: Limit::Most(7.0) },
    ])
}

/// Milliseconds to record them.
fn ours(ctx: &Context, scene: &Scene, count: u32) -> lvk::Result<f64> {
    let mut cmd = ctx.acquire_command_buffer()?;
    let mut pass = scene.pass(&mut cmd)?;
    let mut push: Push = [1; 16];
    let start = Instant::now();
    for number in 0..count {
        push[0] = number;
        pass.push_constants(&push)?;
        pass.draw(0..3, 0..1)?;
    }
    Ok(since(start))
}

fn by_hand(ctx: &Context, raw: &Rc<RawRecorder>, scene: &Scene, count: u32) -> Result<f64, BenchError> {
    let (view, pipeline) = (ctx.raw_target_view(*scene.target, 0, 0)?, ctx.raw_render_pipeline(*scene.draw)?);
    let (device, layout) = (ctx.raw_device(), ctx.raw_pipeline_layout());
    let commands = raw.begin()?;
    let extent = vk::Extent2D { width: Scene::SIDE, height: Scene::SIDE };
    let area = vk::Rect2D { extent, ..vk::Rect2D::default() };
    let viewport = vk::Viewport { width: 16.0, height: 16.0, max_depth: 1.0, ..vk::Viewport::default() };
    let color = [vk::RenderingAttachmentInfo::default()
        .image_view(view)
        .image_layout(vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL)
        .load_op(vk::AttachmentLoadOp::CLEAR)
        .store_op(vk::AttachmentStoreOp::STORE)];
    let pass = vk::RenderingInfo::default().render_area(area).layer_count(1).color_attachments(&color);
    let mut push: Push = [1; 16];
    // SAFETY: everything named is alive, and the command buffer is given up, never submitted.
    unsafe {
        let (graphics, set) = (vk::PipelineBindPoint::GRAPHICS, [ctx.raw_descriptor_set()]);
        device.cmd_begin_rendering(commands, &pass);
        device.cmd_set_viewport(commands, 0, &[viewport]);
        device.cmd_set_scissor(commands, 0, &[area]);
        device.cmd_bind_pipeline(commands, graphics, pipeline);
        device.cmd_bind_descriptor_sets(commands, graphics, layout, 0, &set, &[]);
        let start = Instant::now();
        for number in 0..count {
            push[0] = number;
            let bytes = bytemuck::bytes_of(&push);
            device.cmd_push_constants(commands, layout, vk::ShaderStageFlags::ALL, 0, bytes);
            device.cmd_draw(commands, 3, 1, 0, 0);
        }
        let taken = since(start);
        device.cmd_end_rendering(commands);
        raw.give_up()?;
        Ok(taken)
    }
}
