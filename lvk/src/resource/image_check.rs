//! Checks of an image description: shape, samples and formats against each other and the device.

use ash::vk;

use super::image_usage::{raw_usage, usage_from_features};
use super::portability::texture_needs;
use super::swizzle::Swizzle;
use super::texture_desc::{TextureDesc, TextureKind, TextureMemory, TextureUsage};
use crate::error::{Error, Result, check_limit};
use crate::format::Format;
use crate::gpu::Gpu;
use crate::gpu::caps::limits::Limits;
use crate::gpu::caps::optional_features::OptionalFeature;

/// Properties derived from a valid image description.
pub(crate) struct ImagePlan {
    pub(crate) mips: u32,
    pub(crate) flags: vk::ImageCreateFlags,
}

/// Checks an image description against the device.
pub(crate) fn check_image(gpu: &Gpu, desc: &TextureDesc<'_>) -> Result<ImagePlan> {
    let mips = check_shape(gpu, desc)?;
    check_view_formats(desc)?;
    gpu.require_portable(&format!("texture '{}'", desc.debug_name), texture_needs(desc))?;
    let plan = ImagePlan { mips, flags: flags(gpu, desc, mips)? };
    check_format(gpu, desc, &plan.info(desc))?;
    Ok(plan)
}

impl ImagePlan {
    /// Returns the description in Vulkan's form.
    pub(crate) fn info(&self, desc: &TextureDesc<'_>) -> vk::ImageCreateInfo<'static> {
        image_info(desc, self.mips).flags(self.flags)
    }
}

/// Checks the shape and returns the number of mips.
fn check_shape(gpu: &Gpu, desc: &TextureDesc<'_>) -> Result<u32> {
    let name = desc.debug_name;
    let [width, height] = desc.extent;
    let (layers, depth) = (desc.kind.layers(), desc.kind.depth());
    if width == 0 || height == 0 || layers == 0 || depth == 0 {
        let count = layers.min(depth);
        return Err(Error::usage(name, format!("a texture needs texels, not {width} x {height} x {count}")));
    }
    if desc.usage.is_empty() {
        return Err(Error::usage(name, "give the texture at least one usage"));
    }
    check_sides(gpu, desc)?;
    check_target_size(desc, &gpu.caps.limits)?;
    check_limit(name, "layer count", layers.into(), gpu.caps.limits.max_texture_layers.into())?;
    check_samples(desc)?;
    check_yuv(desc)?;
    check_transient(desc)?;
    check_input(gpu, desc)?;
    check_rates(gpu, desc)?;
    let full = desc.full_mips();
    if desc.mips > full {
        let message =
            format!("{} mips, but {width} x {height} x {depth} texels have at most {full}", desc.mips);
        return Err(Error::usage(name, message));
    }
    Ok(if desc.mips == 0 { full } else { desc.mips })
}

/// Fails unless the texture may have its number of samples per texel. Limits of the device are not checked here.
fn check_samples(desc: &TextureDesc<'_>) -> Result<()> {
    let wrong =
        |message: &str| Err(Error::usage(desc.debug_name, format!("{} samples: {message}", desc.samples)));
    if !desc.samples.is_power_of_two() || desc.samples > 64 {
        return wrong("a texel has 1, 2, 4, 8, 16, 32 or 64");
    }
    if desc.samples == 1 {
        return Ok(());
    }
    if !matches!(desc.kind, TextureKind::D2 | TextureKind::D2Array { .. }) || desc.mips != 1 {
        return wrong("multisampled textures are D2 or D2Array, with one mip");
    }
    if desc.usage.contains(TextureUsage::STORAGE) {
        return wrong("storage images have one; resolve to another texture");
    }
    if desc.data.is_some() {
        return wrong("data cannot be uploaded; draw to the texture, or clear it");
    }
    Ok(())
}

/// Fails if a transient texture is not a plain target.
fn check_transient(desc: &TextureDesc<'_>) -> Result<()> {
    let target = desc.usage - TextureUsage::INPUT == TextureUsage::TARGET && desc.data.is_none();
    if desc.memory == TextureMemory::Device || target {
        return Ok(());
    }
    let message =
        "a transient texture has the usage TARGET, or TARGET and INPUT, and no other, and takes no data";
    Err(Error::usage(desc.debug_name, message))
}

/// Fails unless fragment shaders can read the target in its own pass.
fn check_input(gpu: &Gpu, desc: &TextureDesc<'_>) -> Result<()> {
    let name = desc.debug_name;
    if !desc.usage.contains(TextureUsage::INPUT) {
        return Ok(());
    }
    gpu.require(OptionalFeature::LocalRead, &format!("the usage INPUT of texture '{name}'"))?;
    if !desc.usage.contains(TextureUsage::TARGET) {
        return Err(Error::usage(
            name,
            "INPUT is for what a pass draws to; give the texture the usage TARGET too",
        ));
    }
    if desc.kind.is_3d() {
        return Err(Error::usage(
            name,
            "slices of a volume cannot be read in their own pass; take a D2Array",
        ));
    }
    Ok(())
}

/// Fails unless the texture can hold shading rates.
fn check_rates(gpu: &Gpu, desc: &TextureDesc<'_>) -> Result<()> {
    let name = desc.debug_name;
    if !desc.usage.contains(TextureUsage::SHADING_RATE) {
        return Ok(());
    }
    let feature = OptionalFeature::AttachmentShadingRate;
    gpu.require(feature, &format!("the usage SHADING_RATE of texture '{name}'"))?;
    let flat = matches!(desc.kind, TextureKind::D2 | TextureKind::D2Array { .. });
    if desc.format == Format::R8Uint && desc.samples == 1 && flat {
        return Ok(());
    }
    Err(Error::usage(
        name,
        "textures of shading rates are D2 or D2Array, of the format R8Uint and one sample",
    ))
}

/// Fails if a Y'CbCr texture is not a plain 2D texture.
fn check_yuv(desc: &TextureDesc<'_>) -> Result<()> {
    if !desc.format.is_yuv() {
        return Ok(());
    }
    let wrong = |message: &str| Err(Error::usage(desc.debug_name, format!("{:?}: {message}", desc.format)));
    if desc.kind != TextureKind::D2 || desc.mips != 1 || desc.samples != 1 {
        return wrong("textures in Y'CbCr are D2, with one mip and one sample");
    }
    if desc.extent.iter().any(|side| !side.is_multiple_of(2)) {
        return wrong("two columns and two rows share a colour, so width and height are even");
    }
    if desc.usage != TextureUsage::SAMPLED || !desc.view_formats.is_empty() {
        return wrong("textures in Y'CbCr can only be sampled; view their planes in formats of their own");
    }
    if desc.swizzle != Swizzle::IDENTITY || desc.generate_mips {
        return wrong("textures in Y'CbCr have neither a swizzle nor mips");
    }
    Ok(())
}

fn check_sides(gpu: &Gpu, desc: &TextureDesc<'_>) -> Result<()> {
    let (name, limits) = (desc.debug_name, &gpu.caps.limits);
    let [width, height] = desc.extent;
    let side = u64::from(width.max(height));
    if let TextureKind::D3 { depth } = desc.kind {
        let side = side.max(depth.into());
        return check_limit(name, "volume side in texels", side, limits.max_texture_3d.into());
    }
    if desc.kind == TextureKind::D1 {
        if height != 1 || desc.usage.contains(TextureUsage::TARGET) {
            return Err(Error::usage(name, "a row of texels has the height 1, and no passes draw to it"));
        }
        return check_limit(name, "row length in texels", side, limits.max_texture_1d.into());
    }
    if desc.kind.is_cube() {
        if width != height {
            return Err(Error::usage(name, format!("faces of a cube are square, not {width} x {height}")));
        }
        check_limit(name, "cube side in texels", side, limits.max_texture_cube.into())?;
    }
    check_limit(name, "texture side in texels", side, limits.max_texture_2d.into())?;
    if matches!(desc.kind, TextureKind::CubeArray { .. }) { check_cube_arrays(gpu) } else { Ok(()) }
}

/// Fails if the texture is larger than the largest target of passes.
fn check_target_size(desc: &TextureDesc<'_>, limits: &Limits) -> Result<()> {
    if !desc.usage.contains(TextureUsage::TARGET) {
        return Ok(());
    }
    let [width, height] = limits.max_target_size;
    check_limit(desc.debug_name, "width of a target in pixels", desc.extent[0].into(), width.into())?;
    check_limit(desc.debug_name, "height of a target in pixels", desc.extent[1].into(), height.into())
}

/// Fails unless the device supports arrays of cubes.
pub(crate) fn check_cube_arrays(gpu: &Gpu) -> Result<()> {
    if gpu.caps.cube_arrays { Ok(()) } else { Err(gpu.unsupported("arrays of cubes (imageCubeArray)")) }
}

/// Fails unless all formats are colour formats of the same texel size, or of the same compression.
fn check_view_formats(desc: &TextureDesc<'_>) -> Result<()> {
    let alike = |other: &Format| desc.format.is_color() && other.is_viewable_as(desc.format);
    match desc.view_formats.iter().find(|other| !alike(other)) {
        None => Ok(()),
        Some(other) => {
            let message = format!(
                "texels of {:?} cannot be seen as {other:?}: both must be colours of the same number of bytes, or of one \
                 compression",
                desc.format
            );
            Err(Error::usage(desc.debug_name, message))
        }
    }
}

/// Returns the creation flags. Views of other formats and kinds must be allowed when the image is created.
fn flags(gpu: &Gpu, desc: &TextureDesc<'_>, mips: u32) -> Result<vk::ImageCreateFlags> {
    use vk::ImageCreateFlags as Flags;
    let formats = match desc.view_formats {
        // Views can be created of its planes.
        [] if desc.format.is_yuv() => Flags::MUTABLE_FORMAT,
        [] => Flags::empty(),
        _ => Flags::MUTABLE_FORMAT | Flags::EXTENDED_USAGE,
    };
    let cube = formats | Flags::CUBE_COMPATIBLE;
    Ok(match desc.kind {
        TextureKind::Cube | TextureKind::CubeArray { .. } => cube,
        // Passes draw to slices through 2D views.
        TextureKind::D3 { .. } if desc.usage.contains(TextureUsage::TARGET) => {
            formats | Flags::TYPE_2D_ARRAY_COMPATIBLE
        }
        TextureKind::D2Array { layers }
            if layers >= 6 && desc.extent[0] == desc.extent[1] && desc.samples == 1 =>
        {
            let small = desc.extent[0] <= gpu.caps.limits.max_texture_cube;
            let limits = gpu.image_limits(&image_info(desc, mips).flags(cube), desc.debug_name)?;
            let allowed = limits.is_some_and(|limits| limits.max_array_layers >= layers);
            if small && allowed { cube } else { formats }
        }
        TextureKind::D1 | TextureKind::D2 | TextureKind::D2Array { .. } | TextureKind::D3 { .. } => formats,
    })
}

fn image_info(desc: &TextureDesc<'_>, mips: u32) -> vk::ImageCreateInfo<'static> {
    let beside = match desc.memory {
        TextureMemory::Device => vk::ImageUsageFlags::TRANSFER_SRC | vk::ImageUsageFlags::TRANSFER_DST,
        TextureMemory::Transient => vk::ImageUsageFlags::TRANSIENT_ATTACHMENT,
    };
    vk::ImageCreateInfo::default()
        .image_type(match desc.kind {
            TextureKind::D1 => vk::ImageType::TYPE_1D,
            TextureKind::D3 { .. } => vk::ImageType::TYPE_3D,
            _ => vk::ImageType::TYPE_2D,
        })
        .format(desc.format.raw())
        .extent(vk::Extent3D { width: desc.extent[0], height: desc.extent[1], depth: desc.kind.depth() })
        .mip_levels(mips)
        .array_layers(desc.kind.layers())
        .samples(vk::SampleCountFlags::from_raw(desc.samples))
        .tiling(vk::ImageTiling::OPTIMAL)
        .usage(raw_usage(desc.usage, desc.format) | beside)
        .initial_layout(vk::ImageLayout::UNDEFINED)
}

/// Fails unless the device supports the format with this usage and size.
fn check_format(gpu: &Gpu, desc: &TextureDesc<'_>, info: &vk::ImageCreateInfo<'_>) -> Result<()> {
    let name = desc.debug_name;
    let refused = || {
        let also = match desc.view_formats {
            [] => String::new(),
            formats => format!(", views of {formats:?}"),
        };
        let what = format!("texture '{name}' with format {:?}{also} and usage {:?}", desc.format, desc.usage);
        Error::unsupported(
            what,
            "the device's driver refuses the combination; choose another format or usage",
        )
    };
    if gpu.format_features(desc.format).is_empty() {
        return Err(refused());
    }
    let limits = gpu.image_limits(info, name)?.ok_or_else(refused)?;
    let formats = [desc.format].into_iter().chain(desc.view_formats.iter().copied());
    let usages: TextureUsage =
        formats.map(|format| usage_from_features(gpu.format_features(format))).collect();
    if !desc.view_formats.is_empty() && !usages.contains(desc.usage) {
        return Err(refused());
    }
    if !limits.sample_counts.contains(info.samples) {
        let what =
            format!("texture '{name}' of {} samples a texel with format {:?}", desc.samples, desc.format);
        let counts = limits.sample_counts.as_raw();
        let counts: Vec<_> = (0..7).map(|bit| 1_u32 << bit).filter(|count| counts & count != 0).collect();
        return Err(Error::unsupported(what, format!("with this usage the device takes {counts:?}")));
    }
    let sides = [(desc.extent[0], limits.max_extent.width), (desc.extent[1], limits.max_extent.height)];
    for (side, limit) in sides {
        check_limit(name, "texture side in texels for its format", side.into(), limit.into())?;
    }
    let depth = u64::from(desc.kind.depth());
    check_limit(name, "texture depth in texels for its format", depth, limits.max_extent.depth.into())?;
    check_limit(name, "mip count for its format", info.mip_levels.into(), limits.max_mip_levels.into())?;
    let layers = u64::from(info.array_layers);
    check_limit(name, "layer count for its format", layers, limits.max_array_layers.into())?;
    let [width, height] = desc.extent;
    let copies = layers.saturating_mul(desc.samples.into());
    let bytes = desc.format.bytes([width, height, desc.kind.depth()]).saturating_mul(copies);
    check_limit(name, "texture size in bytes", bytes, limits.max_resource_size)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test")]
    use super::*;

    #[test]
    fn targets_are_no_larger_than_passes() {
        let limits = Limits { max_target_size: [64, 32], ..Limits::default() };
        let check =
            |usage, extent| check_target_size(&TextureDesc { usage, extent, ..Default::default() }, &limits);
        let drawn = TextureUsage::TARGET | TextureUsage::SAMPLED;
        check(drawn, [64, 32]).unwrap();
        assert!(check(drawn, [65, 1]).unwrap_err().to_string().contains("width of a target"));
        assert!(check(drawn, [1, 33]).unwrap_err().to_string().contains("height of a target"));
        check(TextureUsage::SAMPLED, [65, 33]).unwrap();
    }
}
