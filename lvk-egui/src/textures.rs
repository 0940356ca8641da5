//! The textures of an interface: those that egui owns, and those of the application.

use std::collections::HashMap;

use egui::epaint::ImageDelta;
use egui::{ColorImage, ImageData, TextureFilter, TextureId, TextureOptions, TextureWrapMode};
use lvk::{
    AddressMode, Context, Filter, Format, Holder, SamplerDesc, SamplerHandle, TextureDesc, TextureHandle,
    TextureRegion, TextureUsage, TextureViewDesc,
};

use crate::error::{Error, Result};

/// The encoding of colours in the texels of a texture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum TexelEncoding {
    /// Shaders read encoded sRGB, as from `Rgba8Unorm` textures that hold a picture.
    #[default]
    Srgb,
    /// Shaders read linear light, as from `Rgba8Srgb` and float textures.
    Linear,
}

/// Describes how a texture of the application is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct UserTexture {
    /// Encoding of the texels. Colours are multiplied with their alpha.
    pub encoding: TexelEncoding,
    /// Filters and addressing.
    pub options: TextureOptions,
}

impl Default for UserTexture {
    /// Encoded sRGB with linear filters.
    fn default() -> Self {
        Self { encoding: TexelEncoding::default(), options: TextureOptions::LINEAR }
    }
}

/// A texture as the shaders take it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct ShownTexture {
    pub(crate) texture: u32,
    pub(crate) sampler: u32,
    pub(crate) encoding: TexelEncoding,
    /// The handle, of a texture of the application.
    pub(crate) handle: Option<TextureHandle>,
}

/// All textures of an interface.
pub(crate) struct Textures {
    ctx: Context,
    known: HashMap<TextureId, Known>,
    samplers: HashMap<TextureOptions, Holder<SamplerHandle>>,
    /// The next id of a texture of the application.
    next: u64,
}

struct Known {
    /// The texture of egui, or a view of the application's.
    texture: Holder<TextureHandle>,
    shown: ShownTexture,
}

impl Textures {
    pub(crate) fn new(ctx: &Context) -> Self {
        Self { ctx: ctx.clone(), known: HashMap::new(), samplers: HashMap::new(), next: 0 }
    }

    /// Creates a texture of egui, or changes a part of it before the next submission.
    pub(crate) fn set(&mut self, id: TextureId, delta: &ImageDelta) -> Result<()> {
        let ImageData::Color(image) = &delta.image;
        if let Some(offset) = delta.pos {
            return self.update(id, offset, image);
        }
        let texture = self.ctx.create_texture(&TextureDesc {
            format: Format::Rgba8Unorm,
            extent: pixels(image.size),
            data: Some(bytemuck::cast_slice(&image.pixels)),
            debug_name: "egui texture",
            ..TextureDesc::default()
        })?;
        self.insert(id, texture, delta.options, TexelEncoding::Srgb, None)
    }

    fn update(&self, id: TextureId, offset: [usize; 2], image: &ColorImage) -> Result<()> {
        let known = self.known.get(&id).ok_or(Error::UnknownTexture { id })?;
        let (offset, extent) = (pixels(offset), pixels(image.size));
        let region = TextureRegion { offset, extent, ..TextureRegion::default() };
        Ok(self.ctx.upload_texture(*known.texture, &region, bytemuck::cast_slice(&image.pixels))?)
    }

    /// Adds a texture of the application.
    pub(crate) fn register(&mut self, handle: TextureHandle, user: &UserTexture) -> Result<TextureId> {
        let view = self.ctx.create_texture_view(&TextureViewDesc {
            texture: Some(handle),
            usage: Some(TextureUsage::SAMPLED),
            debug_name: "texture shown by egui",
            ..TextureViewDesc::default()
        })?;
        let id = TextureId::User(self.next);
        self.insert(id, view, user.options, user.encoding, Some(handle))?;
        self.next += 1;
        Ok(id)
    }

    /// Removes a texture. Command buffers that show it keep it until they are done.
    pub(crate) fn remove(&mut self, id: TextureId) -> Result<()> {
        self.known.remove(&id).map(drop).ok_or(Error::UnknownTexture { id })
    }

    pub(crate) fn shown(&self, id: TextureId) -> Result<ShownTexture> {
        self.known.get(&id).map(|known| known.shown).ok_or(Error::UnknownTexture { id })
    }

    fn insert(
        &mut self,
        id: TextureId,
        texture: Holder<TextureHandle>,
        options: TextureOptions,
        encoding: TexelEncoding,
        handle: Option<TextureHandle>,
    ) -> Result<()> {
        let sampler = self.sampler(options)?;
        let shown = ShownTexture { texture: texture.index(), sampler, encoding, handle };
        self.known.insert(id, Known { texture, shown });
        Ok(())
    }

    fn sampler(&mut self, options: TextureOptions) -> Result<u32> {
        if let Some(known) = self.samplers.get(&options) {
            return Ok(known.index());
        }
        let sampler = self.ctx.create_sampler(&sampler_desc(options))?;
        Ok(self.samplers.entry(options).or_insert(sampler).index())
    }
}

fn sampler_desc(options: TextureOptions) -> SamplerDesc<'static> {
    let filter = |filter| match filter {
        TextureFilter::Nearest => Filter::Nearest,
        TextureFilter::Linear => Filter::Linear,
    };
    let address = match options.wrap_mode {
        TextureWrapMode::ClampToEdge => AddressMode::ClampToEdge,
        TextureWrapMode::Repeat => AddressMode::Repeat,
        TextureWrapMode::MirroredRepeat => AddressMode::MirroredRepeat,
    };
    SamplerDesc {
        mag_filter: filter(options.magnification),
        min_filter: filter(options.minification),
        mip_filter: filter(options.mipmap_mode.unwrap_or(TextureFilter::Nearest)),
        address: [address; 3],
        debug_name: "egui sampler",
        ..SamplerDesc::default()
    }
}

/// Sizes that 32 bits do not hold are as wrong as the largest that they do.
fn pixels(pair: [usize; 2]) -> [u32; 2] {
    pair.map(|side| u32::try_from(side).unwrap_or(u32::MAX))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_of_egui_are_those_of_the_sampler() {
        let desc = sampler_desc(TextureOptions {
            magnification: TextureFilter::Nearest,
            minification: TextureFilter::Linear,
            wrap_mode: TextureWrapMode::MirroredRepeat,
            mipmap_mode: Some(TextureFilter::Linear),
        });
        let filters = (desc.mag_filter, desc.min_filter, desc.mip_filter);
        assert_eq!(filters, (Filter::Nearest, Filter::Linear, Filter::Linear));
        assert_eq!(desc.address, [AddressMode::MirroredRepeat; 3]);
        assert_eq!(pixels([7, usize::MAX]), [7, u32::MAX]);
    }
}
