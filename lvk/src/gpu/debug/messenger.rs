//! Messages of the validation layer, and object names.

use std::ffi::{CStr, CString, c_void};
use std::fmt;
use std::sync::Arc;

use ash::vk;

use crate::error::readable::{char_start, readable_text};
use crate::lock_order::{Guard, Mutex, Rank};

/// Checks of the validation layer, which must be installed for all modes but [`Off`](ValidationMode::Off): from the
/// Vulkan SDK, or from the package of the distribution. The environment variable `VK_ADD_LAYER_PATH` names the folder
/// of a layer that is installed elsewhere.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum ValidationMode {
    /// No layer is loaded.
    #[default]
    Off,
    /// Core checks, and synchronization validation with the shader-access heuristic.
    Standard,
    /// As [`Standard`](ValidationMode::Standard), with shaders instrumented to check their accesses on the
    /// GPU. About half as slow again; meant for a separate test run.
    GpuAssisted,
}

/// One message of the validation layer.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ValidationMessage {
    /// `true` for errors, `false` for warnings.
    pub error: bool,
    /// Name of the violated rule, for instance `VUID-vkCmdDraw-None-02699`.
    pub id: String,
    /// Text of the message.
    pub text: String,
}

impl fmt::Display for ValidationMessage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let severity = if self.error { "error" } else { "warning" };
        write!(f, "validation {severity} {}: {}", self.id, readable_text(&self.text))
    }
}

/// Collects the messages of the validation layer. Clones are cheap and share the same messages. A test can
/// therefore keep a clone and read it after the context is destroyed. A logger may read the sink while it
/// handles a message. It must not use a context then, whose locks the thread may hold, and a panic in it ends the
/// process: the driver has called it.
#[derive(Debug, Clone)]
pub struct ValidationSink {
    messages: Arc<Mutex<Vec<ValidationMessage>>>,
}

impl Default for ValidationSink {
    fn default() -> Self {
        Self { messages: Arc::new(Mutex::new(Rank::ValidationMessages, Vec::new())) }
    }
}

impl ValidationSink {
    /// Maximum number of messages kept. Later messages are only logged.
    const CAPACITY: usize = 1024;

    /// Returns the messages so far, oldest first.
    pub fn messages(&self) -> Vec<ValidationMessage> {
        self.lock().clone()
    }

    /// Removes and returns the messages so far.
    pub fn take(&self) -> Vec<ValidationMessage> {
        std::mem::take(&mut *self.lock())
    }

    /// True if the layer has reported no messages.
    pub fn is_empty(&self) -> bool {
        self.lock().is_empty()
    }

    fn push(&self, message: ValidationMessage) {
        let mut messages = self.lock();
        if messages.len() < Self::CAPACITY {
            messages.push(message);
        }
    }

    fn lock(&self) -> Guard<'_, Vec<ValidationMessage>> {
        self.messages.lock()
    }
}

/// The messenger of an instance. `sink` is shared so that its address stays valid while Vulkan holds it.
pub(crate) struct Messenger {
    sink: Arc<ValidationSink>,
    installed: Option<(ash::ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT)>,
}

impl Messenger {
    pub(crate) fn new(sink: ValidationSink) -> Self {
        Self { sink: Arc::new(sink), installed: None }
    }

    pub(crate) fn sink(&self) -> &ValidationSink {
        &self.sink
    }

    /// Returns the create info for both instance creation and [`install`](Self::install).
    pub(crate) fn create_info(&self) -> vk::DebugUtilsMessengerCreateInfoEXT<'static> {
        let sink: *const ValidationSink = Arc::as_ptr(&self.sink);
        vk::DebugUtilsMessengerCreateInfoEXT::default()
            .message_severity(
                vk::DebugUtilsMessageSeverityFlagsEXT::WARNING | vk::DebugUtilsMessageSeverityFlagsEXT::ERROR,
            )
            .message_type(vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION)
            .pfn_user_callback(Some(on_message))
            .user_data(sink.cast_mut().cast())
    }

    pub(crate) fn install(&mut self, entry: &ash::Entry, instance: &ash::Instance) -> Result<(), vk::Result> {
        let ext = ash::ext::debug_utils::Instance::new(entry, instance);
        // SAFETY: the sink outlives the messenger: both are fields of `self`, and `remove` runs first.
        let raw = unsafe { ext.create_debug_utils_messenger(&self.create_info(), None)? };
        self.installed = Some((ext, raw));
        Ok(())
    }

    /// Destroys the messenger. Must be called before the instance is destroyed.
    pub(crate) fn remove(&mut self) {
        if let Some((ext, raw)) = self.installed.take() {
            // SAFETY: created by `install` and removed once.
            unsafe { ext.destroy_debug_utils_messenger(raw, None) };
        }
    }
}

/// Warnings that do not concern the program. They are about the layer's own settings, and about names that
/// the loader itself requests while it creates a device.
const REMARKS: [&str; 3] =
    ["VALIDATION-SETTINGS", "WARNING-Setting-Limit-Adjusted", "WARNING-vkGetDeviceProcAddr-device"];

unsafe extern "system" fn on_message(
    severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    _: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    user: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: Vulkan passes a valid structure, and `user` is the sink of the `Messenger` that outlives the callback.
    let (data, sink) = unsafe { (&*data, &*user.cast::<ValidationSink>()) };
    let message = ValidationMessage {
        error: severity.contains(vk::DebugUtilsMessageSeverityFlagsEXT::ERROR),
        // SAFETY: both strings are null or NUL-terminated and live during the callback.
        id: unsafe { text(data.p_message_id_name) },
        // SAFETY: as above.
        text: unsafe { text(data.p_message) },
    };
    if message.error {
        log::error!("{message}");
    } else if REMARKS.contains(&message.id.as_str()) {
        log::debug!("{message}");
        return vk::FALSE;
    } else {
        log::warn!("{message}");
    }
    sink.push(message);
    vk::FALSE
}

/// # Safety
/// `ptr` is null or points to a NUL-terminated string.
unsafe fn text(ptr: *const std::ffi::c_char) -> String {
    if ptr.is_null() {
        return String::new();
    }
    // SAFETY: the caller guarantees it.
    unsafe { CStr::from_ptr(ptr) }.to_string_lossy().into_owned()
}

/// Most bytes of a name that driver and layers get, which print it whole.
const MAX_NAME_BYTES: usize = 1_000;

/// Returns a C string for a debug name. Interior NUL bytes are dropped, and bytes of a long name.
pub(crate) fn c_name(name: &str) -> CString {
    let most = char_start(name.as_bytes(), MAX_NAME_BYTES.min(name.len()));
    let name = name.get(..most).unwrap_or_default();
    CString::new(name.replace('\0', "")).unwrap_or_default()
}
