//! A tool that reads the names of objects: the layer lists itself as one where a run is to tell all names. The library gives
//! names to Vulkan only for such tools.

use std::sync::LazyLock;

use ash::vk;

/// Environment variable that lists the layer as a tool that reads names.
pub const NAMES_VARIABLE: &str = "LVK_FAULT_NAMES";

static READS_NAMES: LazyLock<bool> = LazyLock::new(|| std::env::var_os(NAMES_VARIABLE).is_some());

/// Returns the function that takes the place of the driver's, if the layer reads names; else 0.
pub(super) fn own(name: &str) -> usize {
    let is_list_of_tools =
        matches!(name, "vkGetPhysicalDeviceToolProperties" | "vkGetPhysicalDeviceToolPropertiesEXT");
    if is_list_of_tools && *READS_NAMES { tools as *const () as usize } else { 0 }
}

/// `vkGetPhysicalDeviceToolProperties` with one tool, the layer.
unsafe extern "system" fn tools(
    _: vk::PhysicalDevice,
    count: *mut u32,
    properties: *mut vk::PhysicalDeviceToolProperties<'_>,
) -> vk::Result {
    // SAFETY: the list is null, or has room for the count.
    unsafe {
        if !properties.is_null() && *count > 0 {
            (*properties).purposes = vk::ToolPurposeFlags::DEBUG_MARKERS_EXT;
        }
        *count = 1;
    }
    vk::Result::SUCCESS
}
