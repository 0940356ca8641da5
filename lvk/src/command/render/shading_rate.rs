//! Shading rates of a pass, from a texture, and of draws.

use ash::vk;

use super::area::PassArea;
use super::desc::RenderPassDesc;
use super::desc::ShadingRateAttachment;
use super::pass::RenderPass;
use crate::barrier::Use;
use crate::command::CommandBuffer;
use crate::error::{Error, Result};
use crate::gpu::caps::shading_rate::ShadingRate;
use crate::pipeline::RenderPipeline;
use crate::resource::texture_desc::TextureUsage;
use crate::submit::emit_barriers::vulkan_layout;

impl CommandBuffer {
    /// Checks the shading rate texture of a pass, and declares its use.
    pub(super) fn use_shading_rate_attachment(
        &mut self,
        desc: &RenderPassDesc<'_>,
        area: PassArea,
    ) -> Result<Option<vk::RenderingFragmentShadingRateAttachmentInfoKHR<'static>>> {
        let Some(ShadingRateAttachment { texture, mip, layer, texel }) = desc.shading_rate else {
            return Ok(None);
        };
        let texture = self.shared.store.textures.get(texture)?;
        texture.check_usage(TextureUsage::SHADING_RATE)?;
        texture.check_subresource(mip, layer)?;
        let wrong = |message| Error::usage(&texture.name, message);
        self.shared.gpu.caps.limits.shading_rate.check_texel(texel).map_err(wrong)?;
        check_covers_area(texture.mip_extent(mip), texel, area).map_err(wrong)?;
        let used = Use::shading_rate();
        self.use_texture(&texture, texture.subresource(mip, layer), used)?;
        let [width, height] = texel;
        Ok(Some(
            vk::RenderingFragmentShadingRateAttachmentInfoKHR::default()
                .image_view(texture.rate_view(mip, layer)?)
                .image_layout(vulkan_layout(used.layout))
                .shading_rate_attachment_texel_size(vk::Extent2D { width, height }),
        ))
    }
}

/// Fails unless there is a texel for each pixel of the area.
fn check_covers_area(texels: [u32; 2], texel: [u32; 2], area: PassArea) -> Result<(), String> {
    let needed = |axis: usize| area.offset[axis].saturating_add(area.extent[axis]).div_ceil(texel[axis]);
    let needed = [needed(0), needed(1)];
    if texels[0] >= needed[0] && texels[1] >= needed[1] {
        return Ok(());
    }
    Err(format!("it has {texels:?} texels, but the pass needs {needed:?}, each for {texel:?} pixels"))
}

impl RenderPass<'_> {
    /// Replaces the shading rate of the bound pipeline until a pipeline is bound (`vkCmdSetFragmentShadingRateKHR`).
    ///
    /// # Errors
    /// [`InvalidUsage`](Error::InvalidUsage) unless a pipeline with a
    /// [`shading_rate`](crate::RenderPipelineDesc::shading_rate) is bound; [`Unsupported`](Error::Unsupported) for
    /// fragment sizes and combinations that the device lacks.
    pub fn shading_rate(&mut self, rate: ShadingRate) -> Result<()> {
        let pipeline = self.bound_pipeline("shading_rate")?;
        if pipeline.pass_state.shading_rate.is_none() {
            let message = "it has no shading rate to replace; create it with one";
            return Err(Error::usage(&*pipeline.name, message));
        }
        self.cmd.shared.gpu.check_shading_rate(&pipeline.name, &rate, pipeline.shape.samples)?;
        self.set_shading_rate(rate);
        Ok(())
    }

    /// Fails if the pass has a shading rate texture and the pipeline was created without a shading rate.
    pub(super) fn check_shading_rates(&self, pipeline: &RenderPipeline) -> Result<()> {
        if self.targets.rates.is_none() || pipeline.pass_state.shading_rate.is_some() {
            return Ok(());
        }
        let message = "the pass takes shading rates from a texture; create the pipeline with a shading_rate, if only of single \
                       pixels";
        Err(Error::usage(&*pipeline.name, message))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pixel_has_a_texel() {
        let area = PassArea { offset: [16, 0], extent: [17, 32] };
        assert_eq!(check_covers_area([3, 2], [16, 16], area), Ok(()));
        assert_eq!(check_covers_area([9, 9], [16, 16], area), Ok(()));
        let message = check_covers_area([2, 2], [16, 16], area).map_err(|why| why.contains("needs [3, 2]"));
        assert_eq!(message, Err(true));
        assert!(check_covers_area([3, 1], [16, 16], area).is_err());
    }
}
