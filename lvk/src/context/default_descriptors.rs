//! The default descriptors in unused bindless slots: a texture in striking colours, a sampler, an empty TLAS.

use std::sync::Arc;

use super::Context;
use super::create_accel::new_tlas;
use crate::accel::AccelStruct;
use crate::accel::flags::BuildMode;
use crate::accel::tlas_desc::TlasDesc;
use crate::bindless::DefaultDescriptors;
use crate::device_state::DefaultObjects;
use crate::error::Result;
use crate::resource::region::TextureRegion;
use crate::resource::sampler::SamplerDesc;
use crate::resource::texture_desc::{TextureDesc, TextureUsage};
use crate::resource::{Sampler, Texture};

/// The slot of the default descriptors.
const DEFAULT_SLOT: u32 = 0;
const MAGENTA: [u8; 4] = [255, 0, 255, 255];
const BLACK: [u8; 4] = [0, 0, 0, 255];

/// Creates the default objects and writes their descriptors into every slot. They live as long as the context.
pub(super) fn fill_default_descriptors(ctx: &Context) -> Result<()> {
    let shared = ctx.device_state();
    let sampled = checker_texture(ctx, TextureUsage::SAMPLED)?;
    let storage = checker_texture(ctx, TextureUsage::STORAGE)?;
    let sampler = SamplerDesc { debug_name: "default sampler", ..Default::default() };
    let sampler = Sampler::new(&shared.gpu, &sampler, DEFAULT_SLOT)?;
    ctx.record_in_prologue(|cmd| {
        cmd.clear_tlas_table();
        Ok(())
    })?;
    let tlas = if shared.gpu.has_acceleration_structures() { Some(new_empty_tlas(ctx)?) } else { None };
    let mut textures = default_yuv_textures(ctx)?;
    shared.bindless.write_defaults(DefaultDescriptors {
        sampled: sampled.sampled_view()?,
        storage: storage.storage_view()?,
        sampler: sampler.raw,
        tlas: tlas.as_ref().and_then(|tlas| Some(tlas.tlas().ok()?.structure.as_ref()?.raw)),
        tlas_table: shared.tlas_table.as_ref().map(|table| table.raw),
    });
    textures.extend([sampled, storage]);
    let objects = DefaultObjects { _textures: textures, _sampler: sampler, _tlas: tlas };
    // The cell is empty: this runs once, while the context is created.
    let _ = shared.default_objects.set(objects);
    Ok(())
}

/// Creates a default texture. Sampled and storage slots get one each, so that a store into an unused storage slot does
/// not change what shaders sample from an unused slot.
fn checker_texture(ctx: &Context, usage: TextureUsage) -> Result<Arc<Texture>> {
    let desc = TextureDesc { extent: [2, 2], usage, debug_name: "default texture", ..Default::default() };
    let texture = Arc::new(Texture::new(&ctx.device_state().gpu, &desc, DEFAULT_SLOT)?);
    let pixels = [MAGENTA, BLACK, BLACK, MAGENTA].concat();
    ctx.upload_texture_object(&texture, &TextureRegion::default(), &pixels)?;
    Ok(texture)
}

/// Creates a black texture for each Y'CbCr conversion.
fn default_yuv_textures(ctx: &Context) -> Result<Vec<Arc<Texture>>> {
    let shared = ctx.device_state();
    let mut defaults = Vec::new();
    for (number, conversion, raw) in shared.bindless.yuv_conversions() {
        let format = conversion.format;
        let desc =
            TextureDesc { format, extent: [2, 2], debug_name: "default texture", ..Default::default() };
        let texture = Arc::new(Texture::with_conversion(&shared.gpu, &desc, DEFAULT_SLOT, raw)?);
        for aspect in format.uploaded_aspects() {
            let region = TextureRegion { aspect, ..Default::default() };
            let bytes = vec![0; texture.resolve_region(&region)?.bytes() as usize];
            ctx.upload_texture_object(&texture, &region, &bytes)?;
        }
        shared.bindless.set_yuv_default(number, texture.sampled_view()?);
        defaults.push(texture);
    }
    Ok(defaults)
}

fn new_empty_tlas(ctx: &Context) -> Result<Arc<AccelStruct>> {
    let desc = TlasDesc { debug_name: "default tlas", ..Default::default() };
    let tlas = Arc::new(new_tlas(ctx.device_state(), &desc, DEFAULT_SLOT)?);
    ctx.record_in_prologue(|cmd| cmd.update_tlas_object(&tlas, &[], BuildMode::Rebuild))?;
    Ok(tlas)
}
