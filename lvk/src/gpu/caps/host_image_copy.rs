//! Image copies by the host (`VK_EXT_host_image_copy`), without staging memory and queue.

use ash::vk;

use super::capabilities::Capabilities;
use crate::error::{Error, Result};
use crate::gpu::answers::image_support;

/// The layout in which images are written and remain: the layout for sampling.
const LAYOUT: vk::ImageLayout = vk::ImageLayout::READ_ONLY_OPTIMAL;

/// The functions of the extension, for writing the first contents of images.
pub(crate) struct HostImageCopy {
    device: ash::ext::host_image_copy::Device,
}

impl HostImageCopy {
    /// `None` if the device lacks the extension, if staging is faster, or if the device cannot write images
    /// in the layout for sampling.
    pub(crate) fn new(
        instance: &ash::Instance,
        device: &ash::Device,
        physical: vk::PhysicalDevice,
        caps: &Capabilities,
    ) -> Option<Self> {
        let is_wanted = caps.host_image_copy && host_copy_layouts(instance, physical).contains(&LAYOUT);
        is_wanted.then(|| Self { device: ash::ext::host_image_copy::Device::new(instance, device) })
    }

    /// Writes the first contents of the image `name`. Afterwards `range` is ready to be sampled.
    ///
    /// # Safety
    /// The image is new and was created with [`vk::ImageUsageFlags::HOST_TRANSFER_EXT`], and `range` covers
    /// all of it. The regions lie inside the image and do not overlap. Each region points to as many bytes as
    /// it copies.
    pub(crate) unsafe fn write_image(
        &self,
        image: vk::Image,
        name: &str,
        range: vk::ImageSubresourceRange,
        regions: &[vk::MemoryToImageCopyEXT<'_>],
    ) -> Result<()> {
        let transition = vk::HostImageLayoutTransitionInfoEXT::default()
            .image(image)
            .old_layout(vk::ImageLayout::UNDEFINED)
            .new_layout(LAYOUT)
            .subresource_range(range);
        // SAFETY: the image is new, so its layout is undefined and the GPU does not use it.
        unsafe { self.device.transition_image_layout(&[transition]) }
            .map_err(Error::vulkan("vkTransitionImageLayoutEXT", name))?;
        let copy = vk::CopyMemoryToImageInfoEXT::default()
            .dst_image(image)
            .dst_image_layout(LAYOUT)
            .regions(regions);
        // SAFETY: guaranteed by the caller; the device supports writes in this layout.
        unsafe { self.device.copy_memory_to_image(&copy) }
            .map_err(Error::vulkan("vkCopyMemoryToImageEXT", name))
    }
}

/// True if the host can write images of this description without making sampling on the device slower. `name` is the object in the
/// error.
pub(crate) fn host_copies_stay_optimal(
    instance: &ash::Instance,
    device: vk::PhysicalDevice,
    info: &vk::ImageCreateInfo<'_>,
    name: &str,
) -> Result<bool> {
    Ok(has_host_transfer(instance, device, info.format) && is_optimal(instance, device, info, name)?)
}

fn has_host_transfer(instance: &ash::Instance, device: vk::PhysicalDevice, format: vk::Format) -> bool {
    let mut more = vk::FormatProperties3::default();
    let mut all = vk::FormatProperties2::default().push_next(&mut more);
    // SAFETY: the physical device belongs to the instance, and the extension of the format is enabled.
    unsafe { instance.get_physical_device_format_properties2(device, format, &mut all) };
    more.optimal_tiling_features.contains(vk::FormatFeatureFlags2::HOST_IMAGE_TRANSFER_EXT)
}

fn is_optimal(
    instance: &ash::Instance,
    device: vk::PhysicalDevice,
    info: &vk::ImageCreateInfo<'_>,
    name: &str,
) -> Result<bool> {
    let asked = vk::PhysicalDeviceImageFormatInfo2::default()
        .format(info.format)
        .ty(info.image_type)
        .tiling(info.tiling)
        .usage(info.usage | vk::ImageUsageFlags::HOST_TRANSFER_EXT)
        .flags(info.flags);
    let mut access = vk::HostImageCopyDevicePerformanceQueryEXT::default();
    let mut all = vk::ImageFormatProperties2::default().push_next(&mut access);
    // SAFETY: as above; if the query fails, nothing was written.
    let answer = unsafe { instance.get_physical_device_image_format_properties2(device, &asked, &mut all) };
    let supported = image_support(answer, "vkGetPhysicalDeviceImageFormatProperties2", name)?;
    Ok(supported.is_some() && access.optimal_device_access == vk::TRUE)
}

/// Returns the layouts in which the host can write images.
fn host_copy_layouts(instance: &ash::Instance, physical: vk::PhysicalDevice) -> Vec<vk::ImageLayout> {
    let mut count = vk::PhysicalDeviceHostImageCopyPropertiesEXT::default();
    let mut all = vk::PhysicalDeviceProperties2::default().push_next(&mut count);
    // SAFETY: the physical device belongs to the instance and has the extension. Without arrays only the
    // counts are written.
    unsafe { instance.get_physical_device_properties2(physical, &mut all) };
    let (read, written) = (count.copy_src_layout_count, count.copy_dst_layout_count);
    let mut source = vec![vk::ImageLayout::UNDEFINED; read as usize];
    let mut target = vec![vk::ImageLayout::UNDEFINED; written as usize];
    let mut lists = vk::PhysicalDeviceHostImageCopyPropertiesEXT::default()
        .copy_src_layouts(&mut source)
        .copy_dst_layouts(&mut target);
    let mut all = vk::PhysicalDeviceProperties2::default().push_next(&mut lists);
    // SAFETY: as above, with arrays of the returned lengths.
    unsafe { instance.get_physical_device_properties2(physical, &mut all) };
    target
}
