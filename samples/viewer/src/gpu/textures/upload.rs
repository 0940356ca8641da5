//! Mip levels of an image, as a texture.

use lvk::{Context, Error, Holder, TextureDesc, TextureHandle, TextureRegion};
use lvk_gltf::{ColorSpace, Image, TexelFormat};
use lvk_samples::scene::{Encoding, blits_keep_the_mean, mip_levels};

use super::formats::format_of;

/// The number of mip levels that a texture of the image has: those of the file, or the whole chain where the file has one level.
pub(super) fn mip_count(image: &Image) -> u32 {
    let [width, height] = image.data.extent();
    if lacks_mips(image) { width.max(height).max(1).ilog2() + 1 } else { image.data.mips.len() as u32 }
}

/// Uploads the levels of an image from `first_mip` on. `None` if the device cannot read its format.
///
/// Levels that the file lacks are made from the largest one, so they are the same whichever level is the first: on the device, in a texture
/// that lives no longer than this call, or here where the device would not keep the mean.
pub(super) fn texture(
    ctx: &Context,
    image: &Image,
    first_mip: u32,
) -> lvk::Result<Option<Holder<TextureHandle>>> {
    let Some(format) = format_of(image) else { return Ok(None) };
    let halved = is_to_be_halved(image);
    let is_given = first_mip == 0 || !halved;
    let made = made_mips(image);
    let all_levels = image.data.mips.iter().map(|level| &level.bytes).chain(&made);
    let levels: Vec<_> = if is_given { all_levels.skip(first_mip as usize).collect() } else { Vec::new() };
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
    if !is_given {
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

/// True if the device makes the levels that the file lacks.
fn is_to_be_halved(image: &Image) -> bool {
    lacks_mips(image) && blits_keep_the_mean(image.data.extent())
}

/// The levels that the file lacks and the device does not make.
fn made_mips(image: &Image) -> Vec<Vec<u8>> {
    if !lacks_mips(image) || is_to_be_halved(image) {
        return Vec::new();
    }
    let encoding = match image.color_space {
        ColorSpace::Srgb => Encoding::Srgb,
        ColorSpace::Linear => Encoding::Linear,
    };
    mip_levels(&image.data.mips[0].bytes, image.data.extent(), encoding)
}
