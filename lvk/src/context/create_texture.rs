//! Creation of textures and texture views.

use super::Context;
use super::holder::Holder;
use crate::bindless::TextureViews;
use crate::error::{Error, Result};
use crate::handle::TextureHandle;
use crate::resource::Texture;
use crate::resource::host_copy;
use crate::resource::region::{Region, TextureRegion};
use crate::resource::texture_desc::{TextureDesc, TextureUsage};
use crate::resource::view::TextureViewDesc;

impl Context {
    /// Creates a texture (`vkCreateImage`). [`Holder::index`] is its element of `kTextures2D[]`, `kTextures3D[]`,
    /// `kTexturesCube[]` and the storage images. For a Y'CbCr texture it is the index for `textureBindlessYUV`. Every
    /// command submitted afterwards sees the initial contents.
    pub fn create_texture(&self, desc: &TextureDesc<'_>) -> Result<Holder<TextureHandle>> {
        let holder = if desc.format.is_yuv() { self.new_yuv(desc)? } else { self.new_texture(desc)? };
        self.fill_texture(holder.handle(), desc)?;
        Ok(holder)
    }

    fn new_texture(&self, desc: &TextureDesc<'_>) -> Result<Holder<TextureHandle>> {
        self.add_texture(desc, |slot| Texture::new(&self.device_state().gpu, desc, slot))
    }

    /// Adds the texture that `make` creates for a slot, with its default views.
    pub(super) fn add_texture(
        &self,
        desc: &TextureDesc<'_>,
        make: impl FnOnce(u32) -> Result<Texture>,
    ) -> Result<Holder<TextureHandle>> {
        let shared = self.device_state();
        let slot = shared.reserve_slot(|| shared.bindless.reserve_texture(desc.debug_name))?;
        let made = make(slot).and_then(|texture| {
            check_data_size(desc, texture.mips())?;
            let views = default_views(&texture)?;
            Ok((texture, views))
        });
        let (texture, views) = made.inspect_err(|_| shared.bindless.free_texture(slot))?;
        shared.bindless.set_texture(slot, views);
        Ok(Holder::new(self, shared.store.textures.insert(texture), slot))
    }

    fn new_yuv(&self, desc: &TextureDesc<'_>) -> Result<Holder<TextureHandle>> {
        let shared = self.device_state();
        let bindless = &shared.bindless;
        let reserve = || bindless.reserve_yuv(desc.format, desc.conversion, desc.debug_name);
        let place = reserve().or_else(|_| {
            shared.collect()?;
            reserve()
        })?;
        let made =
            Texture::with_conversion(&shared.gpu, desc, place.slot, place.conversion).and_then(|texture| {
                check_data_size(desc, texture.mips())?;
                let view = texture.sampled_view()?;
                Ok((texture, view))
            });
        let (texture, view) = made.inspect_err(|_| bindless.free_yuv(place.slot))?;
        bindless.set_yuv(place.slot, view);
        Ok(Holder::new(self, shared.store.textures.insert(texture), place.slot))
    }

    /// Creates a view of a texture (`vkCreateImageView`): a texture with some mips and layers of another texture. It
    /// may have another kind, another compatible format, or swizzled channels.
    ///
    /// The view has its own slot and handle and can be used like any texture: in shaders,
    /// [`Dependencies`](crate::Dependencies), render passes and copies. The image lives until the last handle that
    /// refers to it is destroyed and the GPU is done. Barriers are tracked for the image, whichever handle a command
    /// uses.
    ///
    /// # Errors
    /// [`InvalidUsage`](Error::InvalidUsage) for mips and layers that the texture does not have, for cubes of anything
    /// but six square layers, for a format that is not among the [`view_formats`](TextureDesc::view_formats), and for
    /// usages that the texture was not created with or that the format or the swizzle exclude;
    /// [`StaleHandle`](Error::StaleHandle); [`LimitExceeded`](Error::LimitExceeded) when all texture slots are taken.
    pub fn create_texture_view(&self, desc: &TextureViewDesc<'_>) -> Result<Holder<TextureHandle>> {
        let shared = self.device_state();
        let missing = || Error::usage(desc.debug_name, "give the view a texture");
        let shown = shared.store.textures.get(desc.texture.ok_or_else(missing)?)?;
        let slot = shared.reserve_slot(|| shared.bindless.reserve_texture(desc.debug_name))?;
        let made = shown.view(desc, slot).and_then(|texture| {
            let views = default_views(&texture)?;
            texture.image.add_texture()?;
            Ok((texture, views))
        });
        let (texture, views) = made.inspect_err(|_| shared.bindless.free_texture(slot))?;
        shared.bindless.set_texture(slot, views);
        Ok(Holder::new(self, shared.store.textures.insert(texture), slot))
    }

    /// Writes the initial contents with a host copy, so that no submission is needed.
    ///
    /// # Safety
    /// The texture is new, and its image has the usage for host copies. The regions are different mips of it, each with all
    /// of its bytes.
    unsafe fn fill_with_host_copy(&self, texture: &Texture, contents: &[(Region, &[u8])]) -> Result<()> {
        let (shared, image) = (self.device_state(), &texture.image);
        let range = image.barrier_image().range(image.shape.all_subresources());
        // SAFETY: guaranteed by the caller.
        unsafe { host_copy::fill_from_host(&shared.gpu, image.raw, &texture.name, range, contents) }?;
        shared.submitter.mark_host_written(image.id, image.shape);
        Ok(())
    }

    /// Uploads the initial contents. Without contents, makes the texture readable by shaders.
    pub(super) fn fill_texture(&self, handle: TextureHandle, desc: &TextureDesc<'_>) -> Result<()> {
        let texture = self.device_state().store.textures.get(handle)?;
        let Some(data) = desc.data else {
            return self.make_texture_visible(&texture);
        };
        let mips = mips_in_data(desc, texture.mips());
        let mut regions = Vec::with_capacity(mips as usize);
        let mut rest = data;
        for mip in 0..mips {
            for aspect in desc.format.uploaded_aspects() {
                let region = TextureRegion { mip, layers: 0, aspect, ..Default::default() };
                let region = texture.resolve_region(&region)?;
                let (bytes, behind) = rest.split_at(region.bytes() as usize);
                regions.push((region, bytes));
                rest = behind;
            }
        }
        if texture.image.host_filled {
            // SAFETY: the image was created to be filled so, and no command has used it. Each region is a mip with the bytes
            // that were split off for it.
            return unsafe { self.fill_with_host_copy(&texture, &regions) };
        }
        for (region, bytes) in regions {
            self.upload_region(&texture, region, bytes)?;
        }
        if desc.generate_mips {
            self.record_in_prologue(|cmd| cmd.generate_mipmaps_object(&texture))?;
        }
        Ok(())
    }
}

/// Fails unless the initial contents have the expected number of bytes. `mips` is the texture's number of mips.
pub(super) fn check_data_size(desc: &TextureDesc<'_>, mips: u32) -> Result<()> {
    let wrong = |message: String| Err(Error::usage(desc.debug_name, message));
    check_generated_mips(desc, mips)?;
    let Some(data) = desc.data else { return Ok(()) };
    let count = mips_in_data(desc, mips);
    if count > mips {
        return wrong(format!("the data has {count} mips, but the texture has {mips}"));
    }
    let sizes = (0..count).map(|mip| {
        let [width, height] = desc.extent.map(|side| (side >> mip).max(1));
        desc.format.bytes([width, height, (desc.kind.depth() >> mip).max(1)])
    });
    let expected = sizes.fold(0, u64::saturating_add).saturating_mul(desc.kind.layers().into());
    if data.len() as u64 == expected {
        return Ok(());
    }
    let given = data.len();
    wrong(format!("{count} mips have {expected} bytes in all layers and slices, but {given} were given"))
}

/// Fails if mips are to be generated without data, from several mips of data, or into a texture without further mips.
/// `mips` is the texture's number of mips.
fn check_generated_mips(desc: &TextureDesc<'_>, mips: u32) -> Result<()> {
    let wrong = |message: String| Err(Error::usage(desc.debug_name, message));
    if !desc.generate_mips {
        return Ok(());
    }
    if desc.data.is_none() {
        return wrong(
            "mips are generated from data; without it use CommandBuffer::generate_mipmaps".to_owned(),
        );
    }
    let count = mips_in_data(desc, mips);
    if count != 1 {
        return wrong(format!("the data has {count} mips, but mips are generated from a single one"));
    }
    let full = desc.full_mips();
    if mips == 1 && full > 1 {
        return wrong(format!(
            "generate_mips needs more than the one mip of the texture; give it mips: 0 for all {full}"
        ));
    }
    Ok(())
}

fn mips_in_data(desc: &TextureDesc<'_>, mips: u32) -> u32 {
    if desc.data_mips == 0 { mips } else { desc.data_mips }
}

/// Returns the views that the bindless slots of a texture hold.
pub(super) fn default_views(texture: &Texture) -> Result<TextureViews> {
    let sampled = texture.usage.contains(TextureUsage::SAMPLED);
    let storage = texture.usage.contains(TextureUsage::STORAGE);
    Ok(TextureViews {
        sampled: if sampled { Some(texture.sampled_view()?) } else { None },
        storage: if storage { Some(texture.storage_view()?) } else { None },
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::resource::texture_desc::TextureKind;

    fn error(desc: &TextureDesc<'_>, mips: u32) -> String {
        check_data_size(desc, mips).map_or_else(|error| error.to_string(), |()| String::new())
    }

    #[test]
    fn mips_are_generated_from_one_mip_of_data_into_further_mips() {
        let data = [0; 4 * 4 * 4];
        let desc = TextureDesc {
            extent: [4, 4],
            data: Some(&data),
            generate_mips: true,
            debug_name: "bark",
            ..TextureDesc::default()
        };
        assert_eq!(error(&desc, 3), "");
        assert_eq!(error(&desc, 2), "");
        let alone = error(&desc, 1);
        assert!(alone.starts_with("bark: ") && alone.ends_with("give it mips: 0 for all 3"), "{alone}");
        assert!(error(&TextureDesc { data: None, ..desc }, 3).contains("generated from data"));
        assert!(error(&TextureDesc { data_mips: 2, ..desc }, 3).contains("a single one"));
        assert!(error(&TextureDesc { data_mips: 0, ..desc }, 3).contains("a single one"));
    }

    #[test]
    fn a_texture_of_one_texel_has_all_its_mips() {
        let desc = TextureDesc { data: Some(&[0; 4]), generate_mips: true, ..TextureDesc::default() };
        assert_eq!(error(&desc, 1), "");
        assert!(error(&TextureDesc { data_mips: 2, generate_mips: false, ..desc }, 1).contains("has 1"));
        let volume = TextureDesc { kind: TextureKind::D3 { depth: 2 }, data: Some(&[0; 8]), ..desc };
        assert!(error(&volume, 1).ends_with("give it mips: 0 for all 2"));
        assert_eq!(error(&volume, 2), "");
    }
}
