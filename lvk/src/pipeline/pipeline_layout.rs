//! The one pipeline layout: the bindless set, the set of a pass's own targets, and push constants for every stage.
//!
//! All pipelines share this layout. Therefore the bindless set is bound once for each bind point of a command buffer,
//! and push constants survive a change of pipeline.

use std::sync::Arc;

use ash::vk;

use crate::bindless::input_attachments::InputAttachmentLayout;
use crate::error::{Error, Result};
use crate::gpu::Gpu;

/// Objects that the creation of every pipeline needs.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PipelineBase {
    pub(crate) layout: vk::PipelineLayout,
    /// Bytes of push constants of the layout.
    pub(crate) push_constant_bytes: u32,
    /// The pipeline cache; null if the context has none.
    pub(crate) cache: vk::PipelineCache,
    /// Most threads that one creation uses, the calling thread included.
    pub(crate) max_threads: usize,
}

/// The layout, destroyed on drop.
pub(crate) struct PipelineLayout {
    pub(crate) raw: vk::PipelineLayout,
    pub(crate) push_constant_bytes: u32,
    /// Layout of the second set; `None` on devices whose shaders cannot read the targets of their pass.
    pub(crate) inputs: Option<InputAttachmentLayout>,
    gpu: Arc<Gpu>,
}

impl PipelineLayout {
    /// Upper limit of push constants. Vulkan guarantees 128 bytes; the library uses at most this many.
    const MAX_PUSH_CONSTANT_BYTES: u32 = 256;

    pub(crate) fn new(gpu: &Arc<Gpu>, set: vk::DescriptorSetLayout) -> Result<Self> {
        let bytes = gpu.caps.limits.max_push_constant_bytes.min(Self::MAX_PUSH_CONSTANT_BYTES);
        let inputs = InputAttachmentLayout::new(gpu)?;
        let sets: Vec<_> = [set].into_iter().chain(inputs.as_ref().map(|inputs| inputs.raw)).collect();
        let ranges =
            [vk::PushConstantRange { stage_flags: vk::ShaderStageFlags::ALL, offset: 0, size: bytes }];
        let info = vk::PipelineLayoutCreateInfo::default().set_layouts(&sets).push_constant_ranges(&ranges);
        // SAFETY: the set layouts are alive and the range is within the limit.
        let raw = unsafe { gpu.device.create_pipeline_layout(&info, None) }
            .map_err(Error::vulkan("vkCreatePipelineLayout", "pipeline layout"))?;
        Ok(Self { raw, push_constant_bytes: bytes, inputs, gpu: Arc::clone(gpu) })
    }
}

impl Drop for PipelineLayout {
    fn drop(&mut self) {
        // SAFETY: the context has waited for the GPU before its parts are dropped.
        unsafe { self.gpu.device.destroy_pipeline_layout(self.raw, None) };
    }
}
