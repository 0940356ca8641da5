//! Passes whose fragment shaders read the pass's own targets.

use ash::vk;

use super::attachments::PassTargets;
use super::pass::RenderPass;
use super::target_hazards::TargetHazards;
use crate::barrier::Layout;
use crate::bindless::input_attachments::{InputAttachment, InputAttachmentMask};
use crate::bindless::layout::INPUT_SET;
use crate::command::CommandBuffer;
use crate::error::{Error, Result};
use crate::pipeline::RenderPipeline;
use crate::pipeline::local_read::{InputIndices, READS_WRITTEN, default_indices};
use crate::submit::emit_barriers::vulkan_layout as raw_layout;

impl CommandBuffer {
    /// Binds the descriptor set of the targets that shaders read. No shader may read its other bindings.
    pub(super) fn bind_inputs(&mut self, targets: &PassTargets) -> Result<()> {
        let shared = &self.shared;
        let Some(layout) = shared.layout.inputs.as_ref().filter(|_| targets.inputs.is_enabled) else {
            return Ok(());
        };
        let set = self.recording.input_set(&shared.gpu, layout.raw, layout.count)?;
        let raw = raw_layout(Layout::LocalRead);
        let infos: Vec<_> =
            targets.inputs.views.iter().map(|(input, view)| (*input, image_info(*view, raw))).collect();
        let within = infos.iter().filter(|(input, _)| input.index() < layout.count);
        let writes: Vec<_> = within
            .map(|(input, info)| {
                vk::WriteDescriptorSet::default()
                    .dst_set(set)
                    .dst_binding(input.index())
                    .descriptor_type(vk::DescriptorType::INPUT_ATTACHMENT)
                    .image_info(info)
            })
            .collect();
        let point = vk::PipelineBindPoint::GRAPHICS;
        // SAFETY: the views are alive, the set is not in use yet, and it has the layout at `INPUT_SET` of the pipeline
        // layout.
        unsafe {
            shared.gpu.device.update_descriptor_sets(&writes, &[]);
            let commands = self.recording.commands;
            shared.gpu.device.cmd_bind_descriptor_sets(
                commands,
                point,
                shared.layout.raw,
                INPUT_SET,
                &[set],
                &[],
            );
        }
        Ok(())
    }
}

impl RenderPass<'_> {
    /// Makes earlier draws visible to the fragment shaders of later draws, which read the targets at their own pixel.
    /// Later draws do not change a target before earlier ones have read it (`vkCmdPipelineBarrier2` with
    /// `VK_DEPENDENCY_BY_REGION_BIT`).
    ///
    /// Binding a pipeline does the same if it reads targets that were drawn to, or draws to targets that were read. So
    /// this is only needed between draws with one pipeline that both reads and writes a target.
    ///
    /// # Errors
    /// [`InvalidUsage`](Error::InvalidUsage) in passes that were begun without
    /// [`RenderPassDesc::local_read`](crate::RenderPassDesc::local_read).
    pub fn read_targets(&mut self) -> Result<()> {
        if !self.targets.inputs.is_enabled {
            let message =
                "the pass was begun without RenderPassDesc::local_read, so no shader may read its targets";
            return Err(Error::usage("read_targets", message));
        }
        self.barrier_between_draws();
        Ok(())
    }

    /// Orders earlier draws before the draws with the pipeline `next`, which is bound in place of another one.
    pub(super) fn order_target_accesses(&mut self, next: &RenderPipeline) {
        if !self.targets.inputs.is_enabled {
            return;
        }
        self.hazards.record_draws(self.pipeline.as_deref(), self.dynamic.writes_depth());
        if self.hazards.needs_barrier(next.reads, next.writes) {
            self.barrier_between_draws();
        }
        self.set_input_indices(!next.reads.is_empty());
    }

    /// Declares that draws write depth from here on, unlike the state that the bound pipeline was created with.
    pub(super) fn write_depth(&mut self) -> Result<()> {
        let reader =
            self.pipeline.as_ref().filter(|pipeline| pipeline.reads.contains(InputAttachment::Depth));
        if let Some(pipeline) = reader {
            let message = format!("its fragment shader reads {}, {READS_WRITTEN}", InputAttachment::Depth);
            return Err(Error::usage(&*pipeline.name, message));
        }
        let depth = [InputAttachment::Depth].into_iter().collect();
        if self.hazards.needs_barrier(InputAttachmentMask::default(), depth) {
            self.barrier_between_draws();
        }
        self.hazards.written.insert(InputAttachment::Depth);
        Ok(())
    }

    fn barrier_between_draws(&mut self) {
        self.hazards = TargetHazards { finds_inputs: self.hazards.finds_inputs, ..TargetHazards::default() };
        let barrier = [draw_barrier(self.targets.inputs.mask)];
        let mut flags = vk::DependencyFlags::BY_REGION;
        if self.targets.layers.view_mask != 0 {
            flags |= vk::DependencyFlags::VIEW_LOCAL;
        }
        let info = vk::DependencyInfo::default().dependency_flags(flags).memory_barriers(&barrier);
        // SAFETY: a pass is open whose targets are in the layout for local reads, and all stages are framebuffer-space
        // stages.
        unsafe { self.cmd.shared.gpu.device.cmd_pipeline_barrier2(self.cmd.raw(), &info) };
    }

    /// Sets the indices by which shaders find targets in Vulkan: those of pipelines that read targets, or the defaults.
    fn set_input_indices(&mut self, wanted: bool) {
        let gpu = &self.cmd.shared.gpu;
        let Some(ext) = gpu.local_read.as_ref().filter(|_| wanted != self.hazards.finds_inputs) else {
            return;
        };
        self.hazards.finds_inputs = wanted;
        let colors = self.targets.colors.len() as u32;
        let indices = InputIndices::new(colors, gpu.caps.limits.max_input_attachments);
        let info = if wanted { indices.raw() } else { default_indices(colors) };
        // SAFETY: a pass with `colors` colour targets is open.
        unsafe { ext.cmd_set_rendering_input_attachment_indices(self.cmd.raw(), &info) };
    }
}

/// Returns the barrier that orders earlier and later draws at each pixel, by their accesses to these targets.
fn draw_barrier(inputs: InputAttachmentMask) -> vk::MemoryBarrier2<'static> {
    use vk::{AccessFlags2 as Access, PipelineStageFlags2 as Stage};
    let mut stages = Stage::FRAGMENT_SHADER;
    let (mut writes, mut reads) = (Access::NONE, Access::INPUT_ATTACHMENT_READ);
    if inputs.has_depth() {
        stages |= Stage::EARLY_FRAGMENT_TESTS | Stage::LATE_FRAGMENT_TESTS;
        writes |= Access::DEPTH_STENCIL_ATTACHMENT_WRITE;
        reads |= Access::DEPTH_STENCIL_ATTACHMENT_READ;
    }
    if inputs.iter().any(|input| matches!(input, InputAttachment::Color(_))) {
        stages |= Stage::COLOR_ATTACHMENT_OUTPUT;
        writes |= Access::COLOR_ATTACHMENT_WRITE;
        reads |= Access::COLOR_ATTACHMENT_READ;
    }
    vk::MemoryBarrier2::default()
        .src_stage_mask(stages)
        .src_access_mask(writes)
        .dst_stage_mask(stages)
        .dst_access_mask(reads | writes)
}

fn image_info(view: vk::ImageView, layout: vk::ImageLayout) -> [vk::DescriptorImageInfo; 1] {
    [vk::DescriptorImageInfo::default().image_view(view).image_layout(layout)]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn input_mask(inputs: &[InputAttachment]) -> InputAttachmentMask {
        inputs.iter().copied().collect()
    }

    #[test]
    fn barriers_name_the_stages_of_what_can_be_read() {
        use vk::PipelineStageFlags2 as Stage;
        let color = draw_barrier(input_mask(&[InputAttachment::Color(3)]));
        assert_eq!(color.src_stage_mask, Stage::FRAGMENT_SHADER | Stage::COLOR_ATTACHMENT_OUTPUT);
        assert_eq!(color.src_access_mask, vk::AccessFlags2::COLOR_ATTACHMENT_WRITE);
        let depth = draw_barrier(input_mask(&[InputAttachment::Stencil]));
        assert!(depth.src_stage_mask.contains(Stage::LATE_FRAGMENT_TESTS));
        assert!(depth.dst_access_mask.contains(vk::AccessFlags2::INPUT_ATTACHMENT_READ));
        assert!(!depth.dst_access_mask.contains(vk::AccessFlags2::COLOR_ATTACHMENT_READ));
    }
}
