//! A render pass being recorded: its pipeline, viewport and scissor.

use std::sync::Arc;

use ash::vk;

use super::area::PassArea;
use super::attachments::PassTargets;
use super::dynamic_state::{DynamicState, READ_ONLY_DEPTH_ERROR};
use super::target_hazards::TargetHazards;
use crate::barrier::Use;
use crate::command::CommandBuffer;
use crate::command::push_constants::word_mask;
use crate::command::recording_state::RecordingState;
use crate::error::{Error, Result};
use crate::gpu::caps::limits::Limits;
use crate::handle::RenderPipelineHandle;
use crate::pipeline::{FrontEnd, RenderPipeline};
use crate::resource::Buffer;
use crate::submit::Recording;

/// A render pass being recorded. It borrows the command buffer, so only draws can be recorded until it is dropped.
/// Dropping it ends the pass (`vkCmdEndRendering`).
///
/// ```compile_fail,E0499
/// fn no_dispatch_inside(cmd: &mut lvk::CommandBuffer, pass: &lvk::RenderPassDesc<'_>) -> lvk::Result<()> {
///     let mut pass = cmd.begin_rendering(pass)?;
///     cmd.dispatch([1, 1, 1], &lvk::Dependencies::default())?;
///     pass.draw(0..3, 0..1)
/// }
/// ```
pub struct RenderPass<'a> {
    pub(in crate::command) cmd: &'a mut CommandBuffer,
    pub(super) targets: PassTargets,
    pub(super) dynamic: DynamicState,
    pub(in crate::command) labelled: bool,
    /// Number of labels that are open outside of the pass.
    pub(in crate::command) labels_outside: u32,
    pub(super) hazards: TargetHazards,
    pub(super) pipeline: Option<Arc<RenderPipeline>>,
    pub(super) draws: Option<DrawRequirements>,
    pub(super) indices: Option<BoundIndexBuffer>,
    pub(super) vertex_slots: u32,
}

/// Requirements of draws with the bound pipeline. Collected when it is bound, so that a draw checks no more than this.
pub(super) struct DrawRequirements {
    pub(super) vertex_slots: u32,
    /// A bit for each 4-byte word of push constants.
    pub(super) push_constants: u64,
}

impl DrawRequirements {
    /// Returns `None` for a pipeline without a vertex shader.
    fn for_pipeline(pipeline: &RenderPipeline) -> Option<Self> {
        (pipeline.front_end == FrontEnd::Vertex).then(|| Self {
            vertex_slots: (1 << pipeline.vertex_binding_count) - 1,
            push_constants: word_mask(0, pipeline.push_constant_bytes),
        })
    }
}

/// The index buffer bound last.
pub(super) struct BoundIndexBuffer {
    pub(super) buffer: Arc<Buffer>,
    pub(super) count: u64,
}

impl<'a> RenderPass<'a> {
    pub(super) fn new(cmd: &'a mut CommandBuffer, targets: PassTargets, labelled: bool) -> Self {
        let [width, height] = targets.extent;
        let labels_outside = cmd.open_labels - u32::from(labelled);
        let pass = Self {
            cmd,
            targets,
            dynamic: DynamicState::default(),
            labelled,
            labels_outside,
            hazards: TargetHazards::default(),
            pipeline: None,
            draws: None,
            indices: None,
            vertex_slots: 0,
        };
        pass.set_viewport([0.0, 0.0, width as f32, height as f32], [0.0, 1.0]);
        pass.set_scissor(pass.targets.area);
        pass
    }

    /// Returns the width and height of the targets in pixels.
    pub fn extent(&self) -> [u32; 2] {
        self.targets.extent
    }

    /// Binds a graphics pipeline for the draws that follow. Its formats and views must be those of the pass, and it may
    /// not write to a read-only depth target.
    pub fn bind_render_pipeline(&mut self, pipeline: RenderPipelineHandle) -> Result<()> {
        let pipeline = self.cmd.shared.store.render_pipelines.get(pipeline)?;
        let targets = &self.targets;
        if pipeline.shape != targets.shape {
            let message = format!("it draws to {}, but the pass has {}", pipeline.shape, targets.shape);
            return Err(Error::usage(&*pipeline.name, message));
        }
        let writes = pipeline.writes_stencil || pipeline.pass_state.depth.is_some_and(|depth| depth.write);
        if targets.read_only_depth && writes {
            return Err(Error::usage(&*pipeline.name, READ_ONLY_DEPTH_ERROR));
        }
        targets.inputs.check_reads(&pipeline)?;
        self.check_shading_rates(&pipeline)?;
        if !pipeline.query_stages.is_empty() {
            self.cmd.use_accel_structs(pipeline.query_stages);
            let remedy = "create the pipeline before the pass begins, or list one in the pass's dependencies";
            self.track_in_pass("an acceleration structure", &pipeline.name, remedy)?;
        }
        self.order_target_accesses(&pipeline);
        let point = vk::PipelineBindPoint::GRAPHICS;
        self.cmd.bind_pipeline(point, pipeline.raw, &pipeline.name, pipeline.push_constant_bytes);
        self.draws = DrawRequirements::for_pipeline(&pipeline);
        self.set_pipeline_state(&pipeline.pass_state);
        self.pipeline = Some(pipeline);
        Ok(())
    }

    /// Sets the push constants; see [`CommandBuffer::push_constants`].
    #[inline]
    pub fn push_constants<T: bytemuck::NoUninit>(&mut self, constants: &T) -> Result<()> {
        self.cmd.push_constants(constants)
    }

    /// Sets the rectangle that clip space maps to: x, y, width and height in pixels, and the depth range. The height
    /// may be negative to flip y.
    pub fn viewport(&mut self, rectangle: [f32; 4], depth: [f32; 2]) -> Result<()> {
        let limits = &self.cmd.shared.gpu.caps.limits;
        let depths = depth.iter().all(|end| (0.0..=1.0).contains(end));
        if !depths || !viewport_fits(rectangle, limits) {
            let message = format!(
                "a viewport needs a width over 0, sides up to {:?}, corners between {:?}, and depths from 0 to 1, not \
                 {rectangle:?} and {depth:?}",
                limits.max_viewport, limits.viewport_bounds
            );
            return Err(Error::usage("viewport", message));
        }
        self.set_viewport(rectangle, depth);
        Ok(())
    }

    /// Limits draws to a rectangle: offset and extent in pixels, inside the pass's area.
    pub fn scissor(&mut self, offset: [u32; 2], extent: [u32; 2]) -> Result<()> {
        let area = self.targets.area;
        let wanted = PassArea { offset, extent };
        if !area.contains(wanted) {
            let message =
                format!("{offset:?} + {extent:?} is outside of {:?} + {:?}", area.offset, area.extent);
            return Err(Error::usage("scissor", message));
        }
        self.set_scissor(wanted);
        Ok(())
    }

    pub(super) fn bound_pipeline(&self, call: &str) -> Result<&RenderPipeline> {
        self.pipeline.as_deref().ok_or_else(|| Error::usage(call, "bind a render pipeline first"))
    }

    /// Declares that the pass reads a buffer. Fails if the read needs a barrier, which cannot be recorded inside the
    /// pass.
    pub(super) fn read_in_pass(&mut self, buffer: &Buffer, next: Use) -> Result<()> {
        self.cmd.use_buffer(buffer, next);
        self.track_in_pass("the buffer", &buffer.name, "list it in the pass's dependencies")
    }

    fn track_in_pass(&mut self, what: &str, name: &str, remedy: &str) -> Result<()> {
        let Recording { tracker, images, .. } = &mut **self.cmd.recording;
        let RecordingState { accesses: uses, texture_cache: found_textures, barriers, .. } =
            &mut **self.cmd.state;
        if uses.needs_barriers(tracker) {
            uses.clear();
            let message = format!("{what} was written earlier in this command buffer; {remedy}");
            return Err(Error::usage(name, message));
        }
        barriers.clear();
        uses.track(found_textures, tracker, images, barriers);
        Ok(())
    }

    fn set_viewport(&self, [x, y, width, height]: [f32; 4], [min_depth, max_depth]: [f32; 2]) {
        let viewport = vk::Viewport { x, y, width, height, min_depth, max_depth };
        // SAFETY: the numbers are checked and a pass is open.
        unsafe { self.cmd.shared.gpu.device.cmd_set_viewport(self.cmd.raw(), 0, &[viewport]) };
    }

    fn set_scissor(&self, area: PassArea) {
        // SAFETY: the rectangle lies inside the targets and a pass is open.
        unsafe { self.cmd.shared.gpu.device.cmd_set_scissor(self.cmd.raw(), 0, &[area.raw()]) };
    }
}

impl Drop for RenderPass<'_> {
    fn drop(&mut self) {
        self.cmd.end_rendering();
        self.cmd.pop_labels(self.labels_outside);
    }
}

impl std::fmt::Debug for RenderPass<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("RenderPass").field("extent", &self.targets.extent).finish()
    }
}

fn viewport_fits([x, y, width, height]: [f32; 4], limits: &Limits) -> bool {
    let [low, high] = limits.viewport_bounds;
    let sides = width > 0.0
        && width <= limits.max_viewport[0] as f32
        && height.abs() <= limits.max_viewport[1] as f32;
    // Comparisons with NaN are false.
    sides && [x, x + width, y, y + height].iter().all(|at| (low..=high).contains(at))
}
