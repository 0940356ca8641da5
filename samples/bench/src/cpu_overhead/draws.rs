//! Many pairs of push constants and a draw in one render pass.

use std::rc::Rc;
use std::time::Instant;

use lvk::ash::vk;
use lvk::{Context, RenderPass};

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
    let count = workload.draws;
    let name = format!("push constants + draw, {count} pairs recorded");
    let limits = Limits { ratio: 1.10, library_ns: 7.0 };
    measure_recording(
        ctx,
        silent,
        (workload.runs, count),
        (record_draws, record_draws_by_hand),
        (name, limits),
    )
}

/// Returns the milliseconds to record `count` draws by the library. They are never submitted.
pub(crate) fn record_draws(ctx: &Context, scene: &Scene, count: u32) -> lvk::Result<f64> {
    let mut cmd = ctx.acquire_command_buffer()?;
    let mut pass = scene.pass(&mut cmd)?;
    let start = Instant::now();
    draw_many(&mut pass, count)?;
    Ok(elapsed_ms(start))
}

/// Records `count` draws, each with push constants of its own.
pub(crate) fn draw_many(pass: &mut RenderPass<'_>, count: u32) -> lvk::Result<()> {
    let mut push: Push = [1; 16];
    for number in 0..count {
        push[0] = number;
        pass.push_constants(&push)?;
        pass.draw(0..3, 0..1)?;
    }
    Ok(())
}

/// Returns the milliseconds of the same draws by hand.
pub(crate) fn record_draws_by_hand(
    ctx: &Context,
    raw: &Rc<RawRecorder>,
    scene: &Scene,
    count: u32,
) -> Result<f64, BenchError> {
    let (view, pipeline) = (ctx.raw_target_view(*scene.target, 0, 0)?, ctx.raw_render_pipeline(*scene.draw)?);
    let (device, layout) = (ctx.raw_device(), ctx.raw_pipeline_layout());
    let commands = raw.begin()?;
    let extent = vk::Extent2D { width: Scene::SIDE, height: Scene::SIDE };
    let area = vk::Rect2D { extent, ..vk::Rect2D::default() };
    let [width, height] = [Scene::SIDE as f32; 2];
    let viewport = vk::Viewport { width, height, max_depth: 1.0, ..vk::Viewport::default() };
    let color = [vk::RenderingAttachmentInfo::default()
        .image_view(view)
        .image_layout(vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL)
        .load_op(vk::AttachmentLoadOp::CLEAR)
        .store_op(vk::AttachmentStoreOp::STORE)];
    let pass = vk::RenderingInfo::default().render_area(area).layer_count(1).color_attachments(&color);
    let mut push: Push = [1; 16];
    // SAFETY: everything named is alive, and the command buffer is discarded, never submitted.
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
        let taken = elapsed_ms(start);
        device.cmd_end_rendering(commands);
        raw.discard()?;
        Ok(taken)
    }
}
