//! Textures of scenes on the device.

use std::sync::{Arc, Mutex, PoisonError};

use lvk::{Context, Format, Holder, TextureDesc, TextureHandle, TextureKind, TextureUsage};

use crate::hybrid::half_float::half_bits;
use crate::scene::{Encoding, Sky, Texture, blits_keep_the_mean, mip_levels};

/// Index of a texture that is not there (`kNoTexture` in `shaders/common/no_texture.glsl`).
pub(crate) const NO_TEXTURE: u32 = u32::MAX;

/// A picture of a scene, with all its mips.
pub(crate) fn picture(ctx: &Context, texture: &Texture) -> lvk::Result<Holder<TextureHandle>> {
    with_mips(ctx, texture, Encoding::Srgb)
}

/// A normal map of a scene, with all its mips.
pub(crate) fn normal_map(ctx: &Context, texture: &Texture) -> lvk::Result<Holder<TextureHandle>> {
    with_mips(ctx, texture, Encoding::Linear)
}

fn with_mips(ctx: &Context, texture: &Texture, encoding: Encoding) -> lvk::Result<Holder<TextureHandle>> {
    let extent = [texture.width, texture.height];
    let is_halved = blits_keep_the_mean(extent);
    let whole_chain = (!is_halved).then(|| {
        let levels = mip_levels(&texture.pixels, extent, encoding).concat();
        [texture.pixels.as_slice(), &levels].concat()
    });
    ctx.create_texture(&TextureDesc {
        format: match encoding {
            Encoding::Srgb => Format::Rgba8Srgb,
            Encoding::Linear => Format::Rgba8Unorm,
        },
        extent,
        mips: 0,
        data: Some(whole_chain.as_deref().unwrap_or(&texture.pixels)),
        data_mips: if is_halved { 1 } else { 0 },
        generate_mips: is_halved,
        debug_name: &texture.name,
        ..TextureDesc::default()
    })
}

/// A sky, the edge of its cube, and the cube's texels.
type BakedSky = (Sky, u32, Arc<[u16]>);

/// The sky that was baked last. A renderer that is made anew, as for another method, has the same.
static LAST_SKY: Mutex<Option<BakedSky>> = Mutex::new(None);

/// The texels of a sky as half floats, face by face.
fn baked_sky(sky: &Sky, size: u32) -> Arc<[u16]> {
    let last = || LAST_SKY.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((_, _, texels)) = last().as_ref().filter(|(of, edge, _)| of == sky && *edge == size) {
        return Arc::clone(texels);
    }
    // Without the lock: another renderer may bake another sky.
    let faces = sky.bake_cube(size);
    let texels: Arc<[u16]> = faces.iter().flatten().flatten().map(|&c| half_bits(c)).collect();
    *last() = Some((*sky, size, Arc::clone(&texels)));
    texels
}

/// A sky as a cube with edges of `size` texels.
pub(crate) fn sky(ctx: &Context, sky: &Sky, size: u32) -> lvk::Result<Holder<TextureHandle>> {
    let texels = baked_sky(sky, size);
    ctx.create_texture(&TextureDesc {
        kind: TextureKind::Cube,
        format: Format::Rgba16Float,
        extent: [size, size],
        usage: TextureUsage::SAMPLED,
        data: Some(bytemuck::cast_slice(&texels)),
        debug_name: "sky",
        ..TextureDesc::default()
    })
}
