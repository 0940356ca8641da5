//! Names of a device's objects, and labels in its command buffers, for debuggers.

use ash::vk;

use super::debug::messenger::c_name;
use super::device::Gpu;

impl Gpu {
    /// True if a tool reads names and labels.
    pub(crate) fn names_objects(&self) -> bool {
        self.debug_utils.is_some()
    }

    /// Names an object for the validation layer and debuggers, if a tool reads names.
    pub(crate) fn name<H: vk::Handle>(&self, object: H, name: &str) {
        let Some(ext) = &self.debug_utils else { return };
        let name = c_name(name);
        let info = vk::DebugUtilsObjectNameInfoEXT::default().object_handle(object).object_name(&name);
        // SAFETY: the object is alive and belongs to this device. A failure only loses a name.
        let _ = unsafe { ext.set_debug_utils_object_name(&info) };
    }

    /// Begins a labelled range in a command buffer.
    pub(crate) fn begin_label(&self, commands: vk::CommandBuffer, name: &str) {
        let Some(ext) = &self.debug_utils else { return };
        let name = c_name(name);
        let label = vk::DebugUtilsLabelEXT::default().label_name(&name);
        // SAFETY: the command buffer is being recorded.
        unsafe { ext.cmd_begin_debug_utils_label(commands, &label) };
    }

    /// Inserts a label in a command buffer.
    pub(crate) fn insert_label(&self, commands: vk::CommandBuffer, name: &str) {
        let Some(ext) = &self.debug_utils else { return };
        let name = c_name(name);
        let label = vk::DebugUtilsLabelEXT::default().label_name(&name);
        // SAFETY: the command buffer is being recorded.
        unsafe { ext.cmd_insert_debug_utils_label(commands, &label) };
    }

    /// Ends the innermost labelled range.
    pub(crate) fn end_label(&self, commands: vk::CommandBuffer) {
        if let Some(ext) = &self.debug_utils {
            // SAFETY: the command buffer is being recorded, and the caller balances its labels.
            unsafe { ext.cmd_end_debug_utils_label(commands) };
        }
    }
}
