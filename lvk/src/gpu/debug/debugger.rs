//! Detects debuggers and profilers that read the names of objects.

use ash::vk;

/// True if a debugger or profiler has registered itself with the loader (`vkGetPhysicalDeviceToolProperties`).
pub(crate) fn has_debugger(instance: &ash::Instance, device: vk::PhysicalDevice) -> bool {
    // SAFETY: the physical device belongs to the instance, whose version is 1.3.
    let count = unsafe { instance.get_physical_device_tool_properties_len(device) }.unwrap_or(0);
    let mut tools = vec![vk::PhysicalDeviceToolProperties::default(); count];
    // SAFETY: as above. Tools register once per process, so the count still holds.
    let found = unsafe { instance.get_physical_device_tool_properties(device, &mut tools) };
    found.is_ok() && tools.iter().any(|tool| reads_names(tool.purposes))
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
}
