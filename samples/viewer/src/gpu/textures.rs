//! Images and samplers of a model on the GPU.

use lvk::{AddressMode, Context, Format, Holder, SamplerDesc, SamplerHandle, TextureDesc, TextureHandle};
use lvk_gltf::{ColorSpace, Filter, Image, Model, Sampler, TexelFormat, TextureRef, Wrap};

/// Images and samplers on the GPU.
pub(crate) struct GpuTextures {
    /// `None` for an image whose format the device lacks.
    images: Vec<Option<Holder<TextureHandle>>>,
    samplers: Vec<Holder<SamplerHandle>>,
    /// What is left out, for the user to read.
    pub(crate) warnings: Vec<String>,
}

impl GpuTextures {
    /// Uploads the images of a model.
    pub(crate) fn new(ctx: &Context, model: &Model) -> lvk::Result<Self> {
        let mut all = Self { images: Vec::new(), samplers: Vec::new(), warnings: Vec::new() };
        for image in &model.images {
            let texture = all.upload(ctx, image)?;
            all.images.push(texture);
        }
        for sampler in &model.samplers {
            all.samplers.push(ctx.create_sampler(&sampler_desc(sampler))?);
        }
        all.samplers.push(ctx.create_sampler(&SamplerDesc::default())?);
        Ok(all)
    }

    /// Bindless indices of the texture and of its sampler; `None` where there is no such texture.
    pub(crate) fn indices(&self, texture: &TextureRef) -> Option<(u32, u32)> {
        let image = self.images.get(texture.image)?.as_ref()?;
        let sampler = self.samplers.get(texture.sampler).or(self.samplers.last())?;
        Some((image.index(), sampler.index()))
    }

    fn upload(&mut self, ctx: &Context, image: &Image) -> lvk::Result<Option<Holder<TextureHandle>>> {
        let name = image.name.as_deref().unwrap_or("image");
        let bytes: Vec<u8>;
        let data = match image.data.mips.as_slice() {
            [only] => only.bytes.as_slice(),
            mips => {
                bytes = mips.iter().flat_map(|mip| &mip.bytes).copied().collect();
                &bytes
            }
        };
        let mips = image.data.mips.len() as u32;
        let is_to_be_halved =
            mips == 1 && image.data.format == TexelFormat::Rgba8 && image.data.extent() != [1, 1];
        let desc = format_of(image).map(|format| TextureDesc {
            format,
            extent: image.data.extent(),
            mips: if is_to_be_halved { 0 } else { mips },
            data_mips: mips,
            data: Some(data),
            generate_mips: is_to_be_halved,
            debug_name: name,
            ..TextureDesc::default()
        });
        match desc.filter(|desc| ctx.supports_texture(desc).is_ok()) {
            Some(desc) => ctx.create_texture(&desc).map(Some),
            None => {
                let format = image.data.format;
                self.warnings.push(format!(
                    "image {} '{name}': the device cannot read {format:?}; it is left out",
                    image.source
                ));
                Ok(None)
            }
        }
    }
}

fn format_of(image: &Image) -> Option<Format> {
    let is_srgb = image.color_space == ColorSpace::Srgb;
    let [linear, srgb] = match image.data.format {
        TexelFormat::Rgba8 => [Format::Rgba8Unorm, Format::Rgba8Srgb],
        TexelFormat::Bc1Rgb => [Format::Bc1RgbUnorm, Format::Bc1RgbSrgb],
        TexelFormat::Bc1Rgba => [Format::Bc1RgbaUnorm, Format::Bc1RgbaSrgb],
        TexelFormat::Bc2 => [Format::Bc2Unorm, Format::Bc2Srgb],
        TexelFormat::Bc3 => [Format::Bc3Unorm, Format::Bc3Srgb],
        TexelFormat::Bc4 => [Format::Bc4Unorm; 2],
        TexelFormat::Bc5 => [Format::Bc5Unorm; 2],
        TexelFormat::Bc7 => [Format::Bc7Unorm, Format::Bc7Srgb],
        TexelFormat::Etc2Rgb => [Format::Etc2Rgb8Unorm, Format::Etc2Rgb8Srgb],
        TexelFormat::Etc2Rgba => [Format::Etc2Rgba8Unorm, Format::Etc2Rgba8Srgb],
        TexelFormat::Astc([4, 4]) => [Format::Astc4x4Unorm, Format::Astc4x4Srgb],
        TexelFormat::Astc([6, 6]) => [Format::Astc6x6Unorm, Format::Astc6x6Srgb],
        TexelFormat::Astc([8, 8]) => [Format::Astc8x8Unorm, Format::Astc8x8Srgb],
        TexelFormat::Astc(_) => return None,
    };
    Some(if is_srgb { srgb } else { linear })
}

fn sampler_desc(sampler: &Sampler) -> SamplerDesc<'static> {
    let filter = |filter| match filter {
        Filter::Nearest => lvk::Filter::Nearest,
        Filter::Linear => lvk::Filter::Linear,
    };
    let wrap = |wrap| match wrap {
        Wrap::Repeat => AddressMode::Repeat,
        Wrap::MirroredRepeat => AddressMode::MirroredRepeat,
        Wrap::ClampToEdge => AddressMode::ClampToEdge,
    };
    let whole = SamplerDesc::default().lod_range;
    SamplerDesc {
        mag_filter: filter(sampler.mag_filter),
        min_filter: filter(sampler.min_filter),
        mip_filter: sampler.mip_filter.map_or(lvk::Filter::Nearest, filter),
        address: [wrap(sampler.wrap_u), wrap(sampler.wrap_v), AddressMode::Repeat],
        lod_range: if sampler.mip_filter.is_some() { whole } else { [0.0, 0.0] },
        debug_name: "texture sampler",
        ..SamplerDesc::default()
    }
}
