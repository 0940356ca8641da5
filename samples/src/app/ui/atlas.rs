//! The textures that egui owns: the atlas of its font, and pictures.

use std::collections::HashMap;

use egui::epaint::ImageDelta;
use egui::{ColorImage, ImageData, TextureFilter, TextureId, TextureOptions, TextureWrapMode};
use lvk::{
    AddressMode, Context, Filter, Format, Holder, SamplerDesc, SamplerHandle, TextureDesc, TextureHandle,
    TextureRegion,
};

/// All textures of an interface, and how each is sampled.
pub(super) struct Atlas {
    ctx: Context,
    owned: HashMap<TextureId, Owned>,
    samplers: HashMap<TextureOptions, Holder<SamplerHandle>>,
}

struct Owned {
    texture: Holder<TextureHandle>,
    sampler: u32,
}

impl Atlas {
    pub(super) fn new(ctx: &Context) -> Self {
        Self { ctx: ctx.clone(), owned: HashMap::new(), samplers: HashMap::new() }
    }

    /// Makes a texture, or changes a part of it. Changes take place after the frames that are under way.
    pub(super) fn set(&mut self, id: TextureId, delta: &ImageDelta) -> lvk::Result<()> {
        let ImageData::Color(image) = &delta.image;
        match delta.pos {
            None => {
                let texture = self.create(image)?;
                let sampler = self.sampler(delta.options)?;
                self.owned.insert(id, Owned { texture, sampler });
                Ok(())
            }
            Some(offset) => self.update(id, offset, image),
        }
    }

    /// Gives a texture up, once no frame shows it.
    pub(super) fn free(&mut self, id: TextureId) {
        self.owned.remove(&id);
    }

    /// Indices of a texture and its sampler for shaders; 0, which is white, for a texture that does not exist. The
    /// index of a texture that is not egui's own is its id.
    pub(super) fn numbers(&mut self, id: TextureId) -> lvk::Result<[u32; 2]> {
        match id {
            TextureId::Managed(_) => {
                Ok(self.owned.get(&id).map_or([0; 2], |owned| [owned.texture.index(), owned.sampler]))
            }
            TextureId::User(number) => {
                Ok([u32::try_from(number).unwrap_or(0), self.sampler(TextureOptions::LINEAR)?])
            }
        }
    }

    fn create(&self, image: &ColorImage) -> lvk::Result<Holder<TextureHandle>> {
        self.ctx.create_texture(&TextureDesc {
            format: Format::Rgba8Unorm,
            extent: image.size.map(|side| side as u32),
            data: Some(bytemuck::cast_slice(&image.pixels)),
            debug_name: "interface texture",
            ..TextureDesc::default()
        })
    }

    fn update(&self, id: TextureId, offset: [usize; 2], image: &ColorImage) -> lvk::Result<()> {
        let Some(owned) = self.owned.get(&id) else { return Ok(()) };
        let [offset, extent] = [offset, image.size].map(|pair| pair.map(|number| number as u32));
        let region = TextureRegion { offset, extent, ..TextureRegion::default() };
        self.ctx.upload_texture(*owned.texture, &region, bytemuck::cast_slice(&image.pixels))
    }

    fn sampler(&mut self, options: TextureOptions) -> lvk::Result<u32> {
        if let Some(known) = self.samplers.get(&options) {
            return Ok(known.index());
        }
        let filter = |filter| match filter {
            TextureFilter::Nearest => Filter::Nearest,
            TextureFilter::Linear => Filter::Linear,
        };
        let address = match options.wrap_mode {
            TextureWrapMode::ClampToEdge => AddressMode::ClampToEdge,
            TextureWrapMode::Repeat => AddressMode::Repeat,
            TextureWrapMode::MirroredRepeat => AddressMode::MirroredRepeat,
        };
        let sampler = self.ctx.create_sampler(&SamplerDesc {
            mag_filter: filter(options.magnification),
            min_filter: filter(options.minification),
            address: [address; 3],
            debug_name: "interface sampler",
            ..SamplerDesc::default()
        })?;
        Ok(self.samplers.entry(options).or_insert(sampler).index())
    }
}
