//! Whether objects get names for debuggers, and the calls that give them.

use ash::vk;

use super::messenger::c_name;
use crate::gpu::device::Gpu;
use crate::gpu::start::instance::Instance;

impl Gpu {
    /// Whether names and labels reach anybody.
    pub(crate) fn names_objects(&self) -> bool {
        self.debug_utils.is_some()
    }

    /// Names an object for the validation layer and debuggers, where there are any.
    pub(crate) fn name<H: vk::Handle>(&self, object: H, name: &str) {
        let Some(ext) = &self.debug_utils else { return };
        let name = c_name(name);
        let info = vk::DebugUtilsObjectNameInfoEXT::default().object_handle(object).object_name(&name);
        // SAFETY: the object is alive and belongs to this device. A failure loses a name only.
        let _ = unsafe { ext.set_debug_utils_object_name(&info) };
    }

    /// Opens a labelled range in a command buffer.
    pub(crate) fn begin_label(&self, commands: vk::CommandBuffer, name: &str) {
        let Some(ext) = &self.debug_utils else { return };
        let name = c_name(name);
        let label = vk::DebugUtilsLabelEXT::default().label_name(&name);
        // SAFETY: the command buffer is being recorded.
        unsafe { ext.cmd_begin_debug_utils_label(commands, &label) };
    }

    /// Marks a place in a command buffer.
    pub(crate) fn insert_label(&self, commands: vk::CommandBuffer, name: &str) {
        let Some(ext) = &self.debug_utils else { return };
        let name = c_name(name);
        let label = vk::DebugUtilsLabelEXT::default().label_name(&name);
        // SAFETY: the command buffer is being recorded.
        unsafe { ext.cmd_insert_debug_utils_label(commands, &label) };
    }

    /// Closes the innermost labelled range.
    pub(crate) fn end_label(&self, commands: vk::CommandBuffer) {
        if let Some(ext) = &self.debug_utils {
            // SAFETY: the command buffer is being recorded and the caller counts its labels.
            unsafe { ext.cmd_end_debug_utils_label(commands) };
        }
    }
}

/// Whether to name objects: as the caller says, or where somebody reads names.
pub(crate) fn should_name_objects(
    instance: &Instance,
    device: vk::PhysicalDevice,
    requested: Option<bool>,
) -> bool {
    instance.debug_utils && requested.unwrap_or_else(|| instance.validated || has_debugger(instance, device))
}

/// Whether a debugger or profiler has told the loader that it is there (`vkGetPhysicalDeviceToolProperties`).
fn has_debugger(instance: &Instance, device: vk::PhysicalDevice) -> bool {
    // SAFETY: the physical device belongs to the instance, whose version is 1.3.
    let count = unsafe { instance.raw.get_physical_device_tool_properties_len(device) }.unwrap_or(0);
    let mut tools = vec![vk::PhysicalDeviceToolProperties::default(); count];
    // SAFETY: as above; tools come and go with the process, so the count still holds.
    let found = unsafe { instance.raw.get_physical_device_tool_properties(device, &mut tools) };
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
