//! Begin and end of a render pass, with the barriers before it.

use std::sync::Arc;

use ash::vk;

use super::attachments::PassTargets;
use super::desc::RenderPassDesc;
use super::pass::RenderPass;
use crate::barrier::{Stages, Use};
use crate::command::CommandBuffer;
use crate::command::dependencies::Dependencies;
use crate::error::{Error, Result};
use crate::gpu::debug::label::Label;
use crate::resource::buffer::BufferUsage;

/// Uses of buffers by draws, with the usage that allows each.
const DRAW_INPUTS: [(BufferUsage, fn() -> Use); 3] = [
    (BufferUsage::INDEX, Use::index),
    (BufferUsage::VERTEX, Use::vertex),
    (BufferUsage::INDIRECT, Use::indirect),
];

impl CommandBuffer {
    /// Begins a render pass (`vkCmdBeginRendering`), which ends when the value is dropped. The viewport covers the
    /// targets, and the scissor covers the area.
    ///
    /// # Errors
    /// [`InvalidUsage`](Error::InvalidUsage) for targets that do not match, do not exist, or are named twice;
    /// [`LimitExceeded`](Error::LimitExceeded) for too many colour targets, layers or views;
    /// [`Unsupported`](Error::Unsupported) for views without
    /// [`OptionalFeature::Multiview`](crate::OptionalFeature::Multiview), and for local reads without
    /// [`OptionalFeature::LocalRead`](crate::OptionalFeature::LocalRead), and for resolves to volumes without
    /// [`Capabilities::resolves_to_volumes`](crate::Capabilities::resolves_to_volumes); [`WrongQueue`](Error::WrongQueue) on queues
    /// other than the graphics queue.
    pub fn begin_rendering(&mut self, desc: &RenderPassDesc<'_>) -> Result<RenderPass<'_>> {
        self.needs_graphics("a render pass")?;
        let mut targets = None;
        self.flush_barriers_after(|cmd| {
            targets = Some(cmd.use_targets(desc)?);
            cmd.use_built_accel_structs();
            cmd.use_dependencies(&desc.dependencies, Stages::PRE_RASTER | Stages::FRAGMENT)?;
            cmd.use_draw_inputs(&desc.dependencies)
        })?;
        let Some(targets) = targets else {
            return Err(Error::usage("begin_rendering", "the pass has no targets"));
        };
        self.bind_inputs(&targets)?;
        if !desc.debug_name.is_empty() {
            self.push_label(Label { name: desc.debug_name, color: desc.debug_color });
        }
        self.record_begin(&targets);
        Ok(RenderPass::new(self, targets, !desc.debug_name.is_empty()))
    }

    fn record_begin(&mut self, targets: &PassTargets) {
        let layers = targets.layers;
        let mut info = vk::RenderingInfo::default()
            .render_area(targets.area.raw())
            .layer_count(layers.layer_count())
            .view_mask(layers.view_mask)
            .color_attachments(&targets.colors);
        if let Some(depth) = &targets.depth {
            info = info.depth_attachment(depth);
        }
        if let Some(stencil) = &targets.stencil {
            info = info.stencil_attachment(stencil);
        }
        let mut rates = targets.rates.unwrap_or_default();
        if targets.rates.is_some() {
            info = info.push_next(&mut rates);
        }
        // SAFETY: the views are alive and in the layouts named; no other pass is open, as passes borrow `self`.
        unsafe { self.shared.gpu.device.cmd_begin_rendering(self.raw(), &info) };
        self.rendering = true;
        self.views = layers.query_count();
        self.had_pass = true;
    }

    /// Ends the open pass, if any: only draws are recorded inside of passes.
    #[inline]
    pub(in crate::command) fn end_rendering(&mut self) {
        if self.rendering {
            self.end_pass();
        }
    }

    fn end_pass(&mut self) {
        self.end_pass_queries();
        self.rendering = false;
        self.views = 1;
        // SAFETY: a pass was begun and has not been ended.
        unsafe { self.shared.gpu.device.cmd_end_rendering(self.raw()) };
    }

    /// Declares that draws may read the buffers of `deps` as indices, vertices and indirect arguments.
    fn use_draw_inputs(&mut self, deps: &Dependencies<'_>) -> Result<()> {
        let shared = Arc::clone(&self.shared);
        for handle in deps.buffers.iter().chain(deps.read_buffers) {
            let buffer = shared.store.buffers.get(*handle)?;
            for (usage, next) in DRAW_INPUTS {
                if buffer.usage.contains(usage) {
                    self.use_buffer(&buffer, next());
                }
            }
        }
        Ok(())
    }
}
