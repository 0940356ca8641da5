//! Detects debuggers and profilers that read the names of objects.

use ash::vk;

use crate::error::{Error, Result};
use crate::gpu::answers::listed;

/// True if a debugger or profiler has registered itself with the loader (`vkGetPhysicalDeviceToolProperties`). `name` is the device in
/// the error.
pub(crate) fn has_debugger(instance: &ash::Instance, device: vk::PhysicalDevice, name: &str) -> Result<bool> {
    let ask = instance.fp_v1_3().get_physical_device_tool_properties;
    // SAFETY: the physical device belongs to the instance, whose version is 1.3. The list is null, or has room for the count.
    has_reader(|count, list| unsafe { ask(device, count, list) }, name)
}

/// True if a tool reads names, through `ask`, which works like `vkGetPhysicalDeviceToolProperties` of one device.
fn has_reader(
    ask: impl FnMut(&mut u32, *mut vk::PhysicalDeviceToolProperties<'static>) -> vk::Result,
    name: &str,
) -> Result<bool> {
    let tools = listed(ask).map_err(Error::vulkan("vkGetPhysicalDeviceToolProperties", name))?;
    Ok(tools.iter().any(|tool| reads_names(tool.purposes)))
}

fn reads_names(purposes: vk::ToolPurposeFlags) -> bool {
    use vk::ToolPurposeFlags as Purpose;
    let readers = Purpose::VALIDATION
        | Purpose::PROFILING
        | Purpose::TRACING
        | Purpose::DEBUG_REPORTING_EXT
        | Purpose::DEBUG_MARKERS_EXT;
    purposes.intersects(readers)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tools_that_only_change_features_read_no_names() {
        use vk::ToolPurposeFlags as Purpose;
        assert!(
            reads_names(Purpose::TRACING)
                && reads_names(Purpose::DEBUG_MARKERS_EXT | Purpose::MODIFYING_FEATURES)
        );
        assert!(!reads_names(Purpose::MODIFYING_FEATURES | Purpose::ADDITIONAL_FEATURES));
    }

    #[test]
    fn a_loader_without_memory_for_its_tools_is_no_loader_without_tools() {
        let one = |count: &mut u32, list: *mut vk::PhysicalDeviceToolProperties<'static>| {
            *count = 1;
            if !list.is_null() {
                // SAFETY: the list has room for one tool.
                unsafe { (*list).purposes = vk::ToolPurposeFlags::TRACING };
            }
            vk::Result::SUCCESS
        };
        assert!(has_reader(one, "gpu").unwrap());
        assert!(!has_reader(|_, _| vk::Result::SUCCESS, "gpu").unwrap());
        let second = |count: &mut u32, list: *mut vk::PhysicalDeviceToolProperties<'static>| {
            if list.is_null() { one(count, list) } else { vk::Result::ERROR_OUT_OF_HOST_MEMORY }
        };
        let expected = "out of host memory in vkGetPhysicalDeviceToolProperties for 'gpu'";
        assert_eq!(has_reader(second, "gpu").unwrap_err().to_string(), expected);
        let first = has_reader(|_, _| vk::Result::ERROR_OUT_OF_HOST_MEMORY, "gpu");
        assert_eq!(first.unwrap_err().to_string(), expected);
    }
}
