//! Blits, and the generation of mips by blits.

use std::sync::Arc;

use ash::vk;

use super::{SOURCE_LAYOUT, TARGET_LAYOUT};
use crate::command::CommandBuffer;
use crate::command::pending_visibility::PendingVisibility;
use crate::error::{Error, Result};
use crate::format::Format;
use crate::handle::TextureHandle;
use crate::resource::Texture;
use crate::resource::region::{Region, TextureRegion};
use crate::resource::sampler::Filter;

impl CommandBuffer {
    /// Copies and scales a region, and converts its format (`vkCmdBlitImage`). Both regions have the same number of
    /// layers. A volume is scaled in depth too, and only to a volume or one layer. A view counts as of the format of
    /// its texture.
    ///
    /// # Errors
    /// [`Unsupported`](Error::Unsupported) for formats that the device cannot scale. Depth and stencil are scaled one
    /// at a time, to the nearest texel, and in the same format. [`InvalidUsage`](Error::InvalidUsage) for regions that
    /// do not exist or have different numbers of layers, and for multisampled textures;
    /// [`WrongQueue`](Error::WrongQueue) on queues other than the graphics queue.
    pub fn blit_texture(
        &mut self,
        source: TextureHandle,
        from: &TextureRegion,
        target: TextureHandle,
        to: &TextureRegion,
        filter: Filter,
    ) -> Result<()> {
        self.needs_graphics("a blit")?;
        let source = self.shared.store.textures.get(source)?;
        let target = self.shared.store.textures.get(target)?;
        let from = source.resolve_region(from)?;
        let to = target.resolve_region(to)?;
        self.check_blit(&source, &target, filter)?;
        if from.layers != to.layers || from.part.aspect != to.part.aspect {
            let message = format!(
                "a blit moves {} layers of {:?} to {} of {:?}; both must be alike",
                from.layers, from.part.aspect, to.layers, to.part.aspect
            );
            return Err(Error::usage(&target.name, message));
        }
        if (source.kind.is_3d() || target.kind.is_3d()) && from.layer + to.layer > 0 {
            let message = "volumes are scaled from and to the first layer only; copy slices to others";
            return Err(Error::usage(&target.name, message));
        }
        self.use_texture_pair(&source, &from, &target, &to)?;
        self.record_blit((&source, &from), (&target, &to), filter);
        self.make_pair_visible(source, target);
        Ok(())
    }

    /// Fills every mip but the first by scaling the previous mip to half its size, for all layers. Volumes are halved
    /// in depth too.
    ///
    /// Each texel is the mean of two texels of each side. An odd side has a texel left over, so a linear blit weighs
    /// its texels unevenly: of a side of three, the middle one alone remains. Where small mips must keep the mean of
    /// the texture, give it sides that are powers of two, or mips of your own ([`data_mips`](crate::TextureDesc::data_mips)).
    ///
    /// # Errors
    /// As [`blit_texture`](Self::blit_texture).
    pub fn generate_mipmaps(&mut self, texture: TextureHandle) -> Result<()> {
        self.needs_graphics("the generation of mips")?;
        let texture = self.shared.store.textures.get(texture)?;
        self.generate_mipmaps_object(&texture)
    }

    /// As [`generate_mipmaps`](Self::generate_mipmaps), by object.
    pub(crate) fn generate_mipmaps_object(&mut self, texture: &Arc<Texture>) -> Result<()> {
        self.check_blit(texture, texture, Filter::Linear)?;
        let all_layers =
            |mip| texture.resolve_region(&TextureRegion { mip, layers: 0, ..Default::default() });
        for mip in 1..texture.mips() {
            let (from, to) = (all_layers(mip - 1)?, all_layers(mip)?);
            self.use_texture_pair(texture, &from, texture, &to)?;
            self.record_blit((texture, &from), (texture, &to), Filter::Linear);
        }
        self.state.pending_visibility.push(PendingVisibility::Texture(Arc::clone(texture)));
        Ok(())
    }

    fn check_blit(&self, source: &Texture, target: &Texture, filter: Filter) -> Result<()> {
        source.check_one_sample("blits read")?;
        target.check_one_sample("blits write")?;
        let gpu = &self.shared.gpu;
        let [from, to] = [source, target].map(|texture| texture.image.format);
        let linear = match filter {
            Filter::Nearest => vk::FormatFeatureFlags::empty(),
            Filter::Linear => vk::FormatFeatureFlags::SAMPLED_IMAGE_FILTER_LINEAR,
        };
        let read = vk::FormatFeatureFlags::BLIT_SRC | linear;
        let scales = is_blit_supported(from, to, filter)
            && gpu.format_features(from).contains(read)
            && gpu.format_features(to).contains(vk::FormatFeatureFlags::BLIT_DST);
        if scales {
            return Ok(());
        }
        let what = format!("a {filter:?} blit from '{}' to '{}'", source.name, target.name);
        let formats = format!("{from:?} and {to:?}");
        Err(Error::unsupported(what, format!("the device cannot scale between {formats}; use a shader")))
    }

    fn record_blit(
        &self,
        (source, from): (&Texture, &Region),
        (target, to): (&Texture, &Region),
        filter: Filter,
    ) {
        let blit = vk::ImageBlit {
            src_subresource: from.raw_layers(),
            src_offsets: from.raw_corners(),
            dst_subresource: to.raw_layers(),
            dst_offsets: to.raw_corners(),
        };
        let (from, to, filter) = (source.image.raw, target.image.raw, filter.raw());
        // SAFETY: both regions lie inside their images, and the formats can be blitted.
        unsafe {
            self.shared.gpu.device.cmd_blit_image(
                self.raw(),
                from,
                SOURCE_LAYOUT,
                to,
                TARGET_LAYOUT,
                &[blit],
                filter,
            );
        }
    }
}

/// True if Vulkan supports blits between the formats at all.
fn is_blit_supported(from: Format, to: Format, filter: Filter) -> bool {
    if from.is_yuv() || to.is_yuv() {
        return false;
    }
    if from.is_color() && to.is_color() {
        return from.numeric_format() == to.numeric_format();
    }
    from == to && filter == Filter::Nearest
}
