//! Begins a render pass, with the barriers in front.

use std::sync::Arc;

use ash::vk;

use super::CommandBuffer;
use super::attachment_desc::{ColorAttachment, DepthAttachment, ShadingRateAttachment};
use super::attachments::PassTargets;
use super::dependencies::Dependencies;
use super::render_pass::RenderPass;
use crate::barrier::{Stages, Use};
use crate::error::{Error, Result};
use crate::resource::buffer::BufferUsage;

/// How draws read buffers, by the usage that allows it.
const DRAW_INPUTS: [(BufferUsage, fn() -> Use); 3] = [
    (BufferUsage::INDEX, Use::index),
    (BufferUsage::VERTEX, Use::vertex),
    (BufferUsage::INDIRECT, Use::indirect),
];

/// Describes a render pass.
#[derive(Debug, Clone, Copy, Default)]
pub struct RenderPassDesc<'a> {
    /// Colour targets, in the order of the shaders' outputs.
    pub color: &'a [ColorAttachment],
    /// Depth and stencil target.
    pub depth: Option<DepthAttachment>,
    /// How many layers each target has, from its own first on; 0 and 1 are one. Draws choose theirs by `gl_Layer`, in the
    /// geometry and mesh stages, and with
    /// [`OptionalFeature::ShaderOutputLayer`](crate::OptionalFeature::ShaderOutputLayer) in the vertex stage.
    pub layers: u32,
    /// Views that each draw makes at once, a bit for each: bit `i` draws to the layer `i` of each target, counted from the
    /// target's own first, and shaders know it by `gl_ViewIndex` (`#extension GL_EXT_multiview`). 0 for one picture.
    /// Needs [`OptionalFeature::Multiview`](crate::OptionalFeature::Multiview); at most
    /// [`Limits::max_views`](crate::Limits::max_views).
    pub view_mask: u32,
    /// The pixels that are loaded, cleared, drawn and stored: x, y, width and height. `None` for all.
    pub area: Option<[u32; 4]>,
    /// Fragment shaders read those targets that have [`TextureUsage::INPUT`](crate::TextureUsage::INPUT), each at its own
    /// pixel: what earlier draws of the pass have put there (`LVK_INPUT`, `LVK_DEPTH_INPUT`, `LVK_STENCIL_INPUT` and
    /// `subpassLoad`). Needs [`OptionalFeature::LocalRead`](crate::OptionalFeature::LocalRead).
    pub local_read: bool,
    /// Where pipelines take the sizes of fragments from that combine their
    /// [`shading_rate`](crate::RenderPipelineDesc::shading_rate) with it.
    pub shading_rate: Option<ShadingRateAttachment>,
    /// What the pass's shaders reach bindlessly, and what its draws read that was written earlier in the same command
    /// buffer: no barrier can be placed inside a pass. Acceleration structures need not be listed.
    pub dependencies: Dependencies<'a>,
    /// Name of the pass in debuggers; empty for none.
    pub debug_name: &'a str,
}

impl CommandBuffer {
    /// Begins a render pass (`vkCmdBeginRendering`), which ends when the value is dropped. The viewport covers the targets,
    /// the scissor the area.
    ///
    /// # Errors
    /// [`InvalidUsage`](Error::InvalidUsage) for targets that do not go together, do not exist, or are named twice;
    /// [`LimitExceeded`](Error::LimitExceeded) for too many colours, layers or views; [`Unsupported`](Error::Unsupported)
    /// for views without [`OptionalFeature::Multiview`](crate::OptionalFeature::Multiview), and for local reads without
    /// [`OptionalFeature::LocalRead`](crate::OptionalFeature::LocalRead); [`WrongQueue`](Error::WrongQueue) on another queue than
    /// the graphics queue.
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
            self.push_label(desc.debug_name);
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

    /// Ends the pass that is open, if any: everything but draws happens outside of passes.
    #[inline]
    pub(super) fn end_rendering(&mut self) {
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

    /// Buffers the pass depends on may also be its indices, vertices and indirect arguments.
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
