//! Resolves of multisampled textures.

use ash::vk;

use super::{SOURCE_LAYOUT, TARGET_LAYOUT};
use crate::command::CommandBuffer;
use crate::error::{Error, Result};
use crate::handle::TextureHandle;
use crate::resource::Texture;
use crate::resource::region::TextureRegion;

impl CommandBuffer {
    /// Resolves a region of a multisampled colour texture to a texture of one sample (`vkCmdResolveImage`). Each texel
    /// becomes the mean of its samples, or one of them for integer formats. Both textures have the same format, and
    /// both regions have the extent and layers of `from`. Render passes resolve depth and stencil.
    ///
    /// # Errors
    /// [`InvalidUsage`](Error::InvalidUsage) for other numbers of samples, for different formats, for depth, and for
    /// regions that do not exist; [`Unsupported`](Error::Unsupported) if the device cannot resolve to the format;
    /// [`WrongQueue`](Error::WrongQueue) on queues other than the graphics queue.
    pub fn resolve_texture(
        &mut self,
        source: TextureHandle,
        from: &TextureRegion,
        target: TextureHandle,
        to: &TextureRegion,
    ) -> Result<()> {
        self.needs_graphics("a resolve")?;
        let source = self.shared.store.textures.get(source)?;
        let target = self.shared.store.textures.get(target)?;
        let from = source.resolve_region(from)?;
        let to = target.resolve_region(&from.sized_like(to))?;
        self.check_resolve(&source, &target)?;
        self.use_texture_pair(&source, &from, &target, &to)?;
        let resolve = vk::ImageResolve {
            src_subresource: from.raw_layers(),
            src_offset: from.raw_offset(),
            dst_subresource: to.raw_layers(),
            dst_offset: to.raw_offset(),
            extent: from.raw_extent(),
        };
        // SAFETY: both regions lie inside their images of one format, the first with several samples, the other with
        // one.
        unsafe {
            let device = &self.shared.gpu.device;
            device.cmd_resolve_image(
                self.raw(),
                source.image.raw,
                SOURCE_LAYOUT,
                target.image.raw,
                TARGET_LAYOUT,
                &[resolve],
            );
        }
        self.make_pair_visible(source, target);
        Ok(())
    }

    fn check_resolve(&self, source: &Texture, target: &Texture) -> Result<()> {
        target.check_one_sample("resolves write")?;
        let [from, to] = [source, target].map(|texture| texture.image.format);
        if source.image.samples == 1 {
            return Err(Error::usage(&source.name, "it has one sample a texel; copy or blit it"));
        }
        if from != to || !from.is_color() {
            let message = format!("{from:?} cannot be resolved to {to:?}; both must be one colour format");
            return Err(Error::usage(&target.name, message));
        }
        if self.shared.gpu.format_features(to).contains(vk::FormatFeatureFlags::COLOR_ATTACHMENT) {
            return Ok(());
        }
        let what = format!("a resolve from '{}' to '{}'", source.name, target.name);
        Err(Error::unsupported(what, format!("the device cannot resolve {to:?}; use a shader")))
    }
}
