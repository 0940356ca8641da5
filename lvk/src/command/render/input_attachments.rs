//! The targets of a render pass that its own fragment shaders read.

use ash::vk;

use super::desc::RenderPassDesc;
use super::target::PassTarget;
use crate::barrier::{Layout, Use};
use crate::bindless::input_attachments::{InputAttachment, InputAttachmentMask};
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::gpu::caps::optional_features::OptionalFeature;
use crate::pipeline::RenderPipeline;
use crate::resource::texture_desc::TextureUsage;

/// The targets of a pass that its own fragment shaders can read.
#[derive(Default)]
pub(super) struct PassInputAttachments {
    /// True if the pass was begun with `local_read`.
    pub(super) is_enabled: bool,
    pub(super) views: Vec<(InputAttachment, vk::ImageView)>,
    pub(super) mask: InputAttachmentMask,
}

impl PassInputAttachments {
    /// Creates an empty list. Fails if the pass needs local reads and the device lacks them.
    pub(super) fn new(gpu: &Gpu, desc: &RenderPassDesc<'_>) -> Result<Self> {
        if desc.local_read {
            let name = if desc.debug_name.is_empty() { "without a name" } else { desc.debug_name };
            gpu.require(OptionalFeature::LocalRead, &format!("local_read of the pass '{name}'"))?;
        }
        Ok(Self { is_enabled: desc.local_read, ..Self::default() })
    }

    /// Returns the use of a target in the pass; `plain` is the use without local reads.
    pub(super) fn target_use(&self, target: &PassTarget, plain: Use) -> Use {
        if !self.includes(target) {
            return plain;
        }
        let (target, read) = (plain.with_layout(Layout::LocalRead), Use::local_read());
        Use { stages: target.stages | read.stages, access: target.access | read.access, ..target }
    }

    /// True if shaders can read the target.
    fn includes(&self, target: &PassTarget) -> bool {
        self.is_enabled && target.texture.usage.contains(TextureUsage::INPUT)
    }

    /// Adds a colour target of the pass.
    pub(super) fn add_color(&mut self, place: u32, target: &PassTarget) -> Result<()> {
        if self.includes(target) {
            self.write_descriptor(InputAttachment::Color(place), target.view()?);
        }
        Ok(())
    }

    /// Adds the depth target of the pass, which draws to it or only tests it.
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

    /// Fails if the pass was begun with `local_read` and shaders can read none of its targets.
    pub(super) fn check_desc(&self, desc: &RenderPassDesc<'_>) -> Result<()> {
        if !self.is_enabled || !self.mask.is_empty() {
            return Ok(());
        }
        let name = if desc.debug_name.is_empty() { "begin_rendering" } else { desc.debug_name };
        let message =
            "local_read is on, but no target has TextureUsage::INPUT: give it to those that shaders read";
        Err(Error::usage(name, message))
    }

    /// Fails unless the pass has the targets that a pipeline reads.
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
