//! Names of a device's objects, and labels in its command buffers, for debuggers.

use ash::vk;

use super::debug::messenger::c_name;
use super::device::Gpu;

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
