//! Mip levels of an image, as a texture.

use lvk::{Context, Error, Holder, TextureDesc, TextureHandle, TextureRegion};
use lvk_gltf::{Image, TexelFormat};

use super::formats::format_of;

/// The number of mip levels that a texture of the image has: those of the file, or the whole chain where the file has one level that a
/// device can halve.
pub(super) fn mip_count(image: &Image) -> u32 {
    let [width, height] = image.data.extent();
    if is_to_be_halved(image) { width.max(height).max(1).ilog2() + 1 } else { image.data.mips.len() as u32 }
}

/// Uploads the levels of an image from `first_mip` on. `None` if the device cannot read its format.
///
/// Levels that the file lacks are made from the largest one on the device, in a texture that lives no longer than this call. They are
/// therefore the same whichever level is the first.
pub(super) fn texture(
    ctx: &Context,
    image: &Image,
    first_mip: u32,
) -> lvk::Result<Option<Holder<TextureHandle>>> {
    let Some(format) = format_of(image) else { return Ok(None) };
    let halved = is_to_be_halved(image);
    let is_from_file = first_mip == 0 || !halved;
    let levels = if is_from_file { image.data.mips.get(first_mip as usize..).unwrap_or(&[]) } else { &[] };
    let [width, height] = image.data.extent();
    let extent = levels.first().map_or_else(
        || [width, height].map(|side| (side >> first_mip).max(1)),
        |level| [level.width, level.height],
    );
    let bytes: Vec<u8>;
    let data = match levels {
        [] => None,
        [only] => Some(only.bytes.as_slice()),
        levels => {
            bytes = levels.iter().flat_map(|level| &level.bytes).copied().collect();
            Some(bytes.as_slice())
        }
    };
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
    if !is_from_file {
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

fn is_to_be_halved(image: &Image) -> bool {
    image.data.mips.len() == 1 && image.data.format == TexelFormat::Rgba8
}
