//! Initial contents of textures that the host writes itself (`vkCopyMemoryToImageEXT`).

use ash::vk;

use super::region::Region;
use super::texture_desc::{TextureDesc, TextureMemory, TextureUsage};
use crate::error::Result;
use crate::gpu::Gpu;

/// Largest contents that the host writes. Up to this size, llvmpipe 25.0 needs an eighth to a half of the time of a
/// copy from staging memory. At four times this size it needs longer than the copy.
const MAX_BYTES: usize = 256 << 10;

/// True if the host should write the contents of an image of this description. Such an image is only sampled, and the
/// device samples it as fast as other images.
pub(super) fn can_fill_from_host(
    gpu: &Gpu,
    desc: &TextureDesc<'_>,
    info: &vk::ImageCreateInfo<'_>,
) -> Result<bool> {
    let is_possible = gpu.host_copies.is_some() && is_plain(desc);
    Ok(is_possible && gpu.host_copies_stay_optimal(info, desc.debug_name)?)
}

/// True if the texture has initial contents of at most [`MAX_BYTES`] and is only sampled, in its own format.
fn is_plain(desc: &TextureDesc<'_>) -> bool {
    let planes = desc.format.aspects().as_raw().count_ones();
    desc.data.is_some_and(|data| data.len() <= MAX_BYTES)
        && !desc.generate_mips
        && desc.usage == TextureUsage::SAMPLED
        && desc.memory == TextureMemory::Device
        && desc.samples == 1
        && desc.view_formats.is_empty()
        && !desc.format.is_yuv()
        && planes == 1
}

/// Writes the initial contents of the new image `name`, for which [`can_fill_from_host`] is true. `range` is the whole image.
///
/// # Safety
/// The image is new and has the usage for host copies. The regions are different mips of it, each with all of its bytes.
pub(crate) unsafe fn fill_from_host(
    gpu: &Gpu,
    image: vk::Image,
    name: &str,
    range: vk::ImageSubresourceRange,
    contents: &[(Region, &[u8])],
) -> Result<()> {
    let Some(copies) = &gpu.host_copies else { return Ok(()) };
    let copy = |(region, bytes): &(Region, &[u8])| {
        debug_assert_eq!(region.bytes(), bytes.len() as u64);
        let mut copy = vk::MemoryToImageCopyEXT::default()
            .image_subresource(region.raw_layers())
            .image_offset(region.raw_offset())
            .image_extent(region.raw_extent());
        copy.p_host_pointer = bytes.as_ptr().cast();
        copy
    };
    let copies_to_make: Vec<_> = contents.iter().map(copy).collect();
    // SAFETY: guaranteed by the caller.
    unsafe { copies.write_image(image, name, range, &copies_to_make) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::Format;

    #[test]
    fn only_sampled_pictures_with_contents_are_plain() {
        let plain = TextureDesc { data: Some(&[0; 4]), ..TextureDesc::default() };
        assert!(is_plain(&plain));
        assert!(is_plain(&TextureDesc { format: Format::D32Float, ..plain }));
        for other in [
            TextureDesc { data: None, ..plain },
            TextureDesc { data: Some(&[0; MAX_BYTES + 1]), ..plain },
            TextureDesc { generate_mips: true, ..plain },
            TextureDesc { usage: TextureUsage::SAMPLED | TextureUsage::STORAGE, ..plain },
            TextureDesc { usage: TextureUsage::TARGET, ..plain },
            TextureDesc { memory: TextureMemory::Transient, ..plain },
            TextureDesc { samples: 4, ..plain },
            TextureDesc { view_formats: &[Format::Rgba8Srgb], ..plain },
            TextureDesc { format: Format::Nv12, ..plain },
            TextureDesc { format: Format::D32FloatS8, ..plain },
        ] {
            assert!(!is_plain(&other), "{other:?}");
        }
    }
}
