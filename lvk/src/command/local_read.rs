//! Passes whose fragment shaders read what the pass has drawn.

use ash::vk;

use super::CommandBuffer;
use super::attachments::{PassTarget, PassTargets};
use super::render_pass::RenderPass;
use super::render_pass_desc::RenderPassDesc;
use crate::barrier::{Layout, Use};
use crate::bindless::input_attachments::{InputAttachment, InputAttachmentMask};
use crate::bindless::layout::INPUT_SET;
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::gpu::caps::optional_features::OptionalFeature;
use crate::pipeline::RenderPipeline;
use crate::pipeline::local_read::{InputIndices, READS_WRITTEN, default_indices};
use crate::resource::texture_desc::TextureUsage;
use crate::submit::emit_barriers::vulkan_layout as raw_layout;

/// The targets of a pass that its own fragment shaders can read.
#[derive(Default)]
pub(super) struct PassInputAttachments {
    /// Whether the pass was begun for it.
    pub(super) is_enabled: bool,
    views: Vec<(InputAttachment, vk::ImageView)>,
    mask: InputAttachmentMask,
}

impl PassInputAttachments {
    /// None of them yet.
    pub(super) fn new(gpu: &Gpu, desc: &RenderPassDesc<'_>) -> Result<Self> {
        if desc.local_read {
            let name = if desc.debug_name.is_empty() { "without a name" } else { desc.debug_name };
            gpu.require(OptionalFeature::LocalRead, &format!("local_read of the pass '{name}'"))?;
        }
        Ok(Self { is_enabled: desc.local_read, ..Self::default() })
    }

    /// How the pass uses a target, where it would use it as `plain` without anybody reading it.
    pub(super) fn target_use(&self, target: &PassTarget, plain: Use) -> Use {
        if !self.includes(target) {
            return plain;
        }
        let (target, read) = (plain.with_layout(Layout::LocalRead), Use::local_read());
        Use { stages: target.stages | read.stages, access: target.access | read.access, ..target }
    }

    /// Whether shaders can read the target.
    fn includes(&self, target: &PassTarget) -> bool {
        self.is_enabled && target.texture.usage.contains(TextureUsage::INPUT)
    }

    /// The pass draws to this colour target.
    pub(super) fn add_color(&mut self, place: u32, target: &PassTarget) -> Result<()> {
        if self.includes(target) {
            self.write_descriptor(InputAttachment::Color(place), target.view()?);
        }
        Ok(())
    }

    /// The pass draws to this depth target, or only tests it.
    pub(super) fn add_depth(&mut self, target: &PassTarget) -> Result<()> {
        if !self.includes(target) {
            return Ok(());
        }
        self.write_descriptor(InputAttachment::Depth, target.input_view(vk::ImageAspectFlags::DEPTH)?);
        if target.texture.format.has_stencil() {
            self.write_descriptor(
                InputAttachment::Stencil,
                target.input_view(vk::ImageAspectFlags::STENCIL)?,
            );
        }
        Ok(())
    }

    fn write_descriptor(&mut self, input: InputAttachment, view: vk::ImageView) {
        self.views.push((input, view));
        self.mask.insert(input);
    }

    /// Fails where the pass was begun for nothing.
    pub(super) fn check_desc(&self, desc: &RenderPassDesc<'_>) -> Result<()> {
        if !self.is_enabled || !self.mask.is_empty() {
            return Ok(());
        }
        let name = if desc.debug_name.is_empty() { "begin_rendering" } else { desc.debug_name };
        let message =
            "local_read is on, but no target has TextureUsage::INPUT: give it to those that shaders read";
        Err(Error::usage(name, message))
    }

    /// Fails unless the pass has what a pipeline reads.
    pub(super) fn check_reads(&self, pipeline: &RenderPipeline) -> Result<()> {
        let missing = pipeline.reads.without(self.mask);
        if missing.is_empty() { Ok(()) } else { self.missing_input_error(pipeline, missing) }
    }

    #[cold]
    fn missing_input_error(&self, pipeline: &RenderPipeline, missing: InputAttachmentMask) -> Result<()> {
        let Some(input) = missing.iter().next() else { return Ok(()) };
        let remedy = if self.is_enabled {
            "whose texture lacks TextureUsage::INPUT"
        } else {
            "but the pass was begun without local_read"
        };
        Err(Error::usage(&*pipeline.name, format!("its fragment shader reads {input}, {remedy}")))
    }
}

/// What draws of the pass have done to its targets since the last barrier.
#[derive(Default)]
pub(super) struct TargetHazards {
    read: InputAttachmentMask,
    written: InputAttachmentMask,
    /// Whether there was a draw since the bound pipeline was bound, or since the last barrier.
    pub(super) drawn: bool,
    /// Vulkan knows the library's places of targets.
    finds_inputs: bool,
}

impl TargetHazards {
    /// Counts what `pipeline` has drawn, while depth was written or not.
    fn record_draws(&mut self, pipeline: Option<&RenderPipeline>, writes_depth: bool) {
        if let Some(pipeline) = pipeline.filter(|_| self.drawn) {
            self.read = self.read.union(pipeline.reads);
            self.written = self.written.union(pipeline.writes);
            if writes_depth {
                self.written.insert(InputAttachment::Depth);
            }
        }
        self.drawn = false;
    }

    /// Whether draws that read and write these have to wait for those before.
    fn needs_barrier(&self, reads: InputAttachmentMask, writes: InputAttachmentMask) -> bool {
        self.written.intersects(reads) || self.read.intersects(writes)
    }
}

impl CommandBuffer {
    /// Binds the set of the targets that shaders read, whose other places no shader may look at.
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
        // SAFETY: the views are alive, nobody uses the set yet, and it has the layout of this place in the pipelines' layout.
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
    /// What was drawn so far is there for the draws that follow, whose fragment shaders read it at their own pixel, and is
    /// not changed by them before it was read (`vkCmdPipelineBarrier2` with `VK_DEPENDENCY_BY_REGION_BIT`).
    ///
    /// Binding a pipeline does this where it reads what was drawn, or draws to what was read, so it is only needed between
    /// draws with one pipeline that both reads and writes a target.
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

    /// A pipeline that the pass has the targets for is bound in place of another.
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

    /// Depth is written from here on, other than the bound pipeline says.
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
        // SAFETY: a pass is open whose targets are in the layout for this, and all stages are those of fragments.
        unsafe { self.cmd.shared.gpu.device.cmd_pipeline_barrier2(self.cmd.raw(), &info) };
    }

    /// Tells Vulkan where shaders find targets, as their pipeline was told, or was not.
    fn set_input_indices(&mut self, wanted: bool) {
        let gpu = &self.cmd.shared.gpu;
        let Some(ext) = gpu.local_read.as_ref().filter(|_| wanted != self.hazards.finds_inputs) else {
            return;
        };
        self.hazards.finds_inputs = wanted;
        let colors = self.targets.colors.len() as u32;
        let indices = InputIndices::new(colors, gpu.caps.limits.max_input_attachments);
        let info = if wanted { indices.raw() } else { default_indices(colors) };
        // SAFETY: a pass with so many colour targets is open.
        unsafe { ext.cmd_set_rendering_input_attachment_indices(self.cmd.raw(), &info) };
    }
}

/// Orders draws before and behind, at each pixel, by what they read and write of these targets.
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
    fn draws_wait_where_one_reads_what_another_writes() {
        let (albedo, lit) = (
            input_mask(&[InputAttachment::Color(0), InputAttachment::Depth]),
            input_mask(&[InputAttachment::Color(1)]),
        );
        let drawn = TargetHazards { written: albedo, ..Default::default() };
        assert!(
            drawn.needs_barrier(albedo, lit)
                && drawn.needs_barrier(input_mask(&[InputAttachment::Depth]), lit)
        );
        assert!(
            !drawn.needs_barrier(InputAttachmentMask::default(), albedo),
            "the order of blending is Vulkan's"
        );
        let lights = TargetHazards { read: albedo, written: lit, ..Default::default() };
        assert!(!lights.needs_barrier(albedo, lit), "further lights need not wait");
        assert!(
            lights.needs_barrier(InputAttachmentMask::default(), albedo),
            "nor is changed what they still read"
        );
        assert!(
            !lights.needs_barrier(InputAttachmentMask::default(), input_mask(&[InputAttachment::Color(2)]))
        );
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
