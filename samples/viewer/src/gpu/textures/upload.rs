//! Mip levels of an image, as a texture.

use std::sync::Arc;

use lvk::{Context, Error, Holder, TextureDesc, TextureHandle, TextureRegion};
use lvk_gltf::{ColorSpace, Image, ImageData, MipLevel, TexelFormat};
use lvk_samples::scene::{Encoding, blits_keep_the_mean, mip_levels};

use super::formats::format_of;

/// The number of mip levels that a texture of the image has: those of the file, or the whole chain where the file has one level.
pub(super) fn mip_count(image: &Image) -> u32 {
    let [width, height] = image.data.extent();
    if lacks_mips(image) { width.max(height).max(1).ilog2() + 1 } else { image.data.mips.len() as u32 }
}

/// Returns the image with the levels that its file lacks, where the device would not make them with its mean. Any other image is returned as
/// it is, and shares its texels.
pub(super) fn with_levels(image: &Image) -> Image {
    let extent = image.data.extent();
    if !lacks_mips(image) || blits_keep_the_mean(extent) {
        return image.clone();
    }
    let encoding = match image.color_space {
        ColorSpace::Srgb => Encoding::Srgb,
        ColorSpace::Linear => Encoding::Linear,
    };
    let mut data = ImageData::clone(&image.data);
    for (below, bytes) in mip_levels(&image.data.mips[0].bytes, extent, encoding).into_iter().enumerate() {
        let [width, height] = extent.map(|side| (side >> (below + 1)).max(1));
        data.mips.push(MipLevel { width, height, bytes });
    }
    Image { data: Arc::new(data), ..image.clone() }
}

/// Uploads all levels of an image. `None` if the device cannot read its format.
pub(super) fn whole(ctx: &Context, image: &Image) -> lvk::Result<Option<Holder<TextureHandle>>> {
    texture(ctx, &with_levels(image), 0)
}

/// Uploads the levels of an image from `first_mip` on. `None` if the device cannot read its format.
///
/// The device makes the levels that [`with_levels`] has left to it. They come from the largest one, in a texture that lives no longer than
/// this call, so they are the same whichever level is the first.
pub(super) fn texture(
    ctx: &Context,
    image: &Image,
    first_mip: u32,
) -> lvk::Result<Option<Holder<TextureHandle>>> {
    let Some(format) = format_of(image) else { return Ok(None) };
    let halved = lacks_mips(image);
    let is_uploaded = first_mip == 0 || !halved;
    let all_levels = image.data.mips.iter().map(|level| &level.bytes);
    let levels: Vec<_> = if is_uploaded { all_levels.skip(first_mip as usize).collect() } else { Vec::new() };
    let bytes: Vec<u8>;
    let data = match levels.as_slice() {
        [] => None,
        [only] => Some(only.as_slice()),
        levels => {
            bytes = levels.iter().copied().flatten().copied().collect();
            Some(bytes.as_slice())
        }
    };
    let extent = image.data.extent().map(|side| (side >> first_mip).max(1));
    let desc = TextureDesc {
        format,
        extent,
        mips: if halved { 0 } else { levels.len() as u32 },
        data_mips: levels.len().max(1) as u32,
        data,
        generate_mips: halved && data.is_some() && extent != [1, 1],
        debug_name: image.name.as_deref().unwrap_or("image"),
        ..TextureDesc::default()
    };
    match ctx.supports_texture(&desc) {
        Ok(()) => {}
        // The driver has not answered.
        Err(
            error @ (Error::OutOfHostMemory { .. } | Error::OutOfDeviceMemory { .. } | Error::Vulkan { .. }),
        ) => return Err(error),
        Err(_) => return Ok(None),
    }
    let texture = ctx.create_texture(&desc)?;
    if !is_uploaded {
        copy_halved(ctx, image, first_mip, *texture)?;
    }
    Ok(Some(texture))
}

/// Copies the levels from `first_mip` on of a texture with all levels.
fn copy_halved(ctx: &Context, image: &Image, first_mip: u32, target: TextureHandle) -> lvk::Result<()> {
    let Some(whole) = texture(ctx, image, 0)? else { return Ok(()) };
    let region = |mip| TextureRegion { mip, ..TextureRegion::default() };
    let mut cmd = ctx.acquire_command_buffer()?;
    for mip in first_mip..mip_count(image) {
        cmd.copy_texture(*whole, &region(mip), target, &region(mip - first_mip))?;
    }
    // The memory of the large texture is free before the next one is made.
    ctx.wait(ctx.submit(cmd)?)
}

fn lacks_mips(image: &Image) -> bool {
    image.data.mips.len() == 1 && image.data.format == TexelFormat::Rgba8
}
