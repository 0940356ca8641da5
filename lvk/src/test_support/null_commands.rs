//! Devices whose recorded commands do nothing, to measure the library's own recording time.

use std::cell::Cell;
use std::ffi::{CStr, c_char};
use std::sync::OnceLock;

use ash::vk;

thread_local! {
    static NULL_COMMANDS: Cell<bool> = const { Cell::new(false) };
}

static REAL: OnceLock<vk::PFN_vkGetDeviceProcAddr> = OnceLock::new();

/// Runs `make`. Devices that it creates on this thread record nothing.
pub(crate) fn with_null_commands<T>(make: impl FnOnce() -> T) -> T {
    NULL_COMMANDS.set(true);
    let made = make();
    NULL_COMMANDS.set(false);
    made
}

/// Returns the instance unchanged, or one whose devices load an empty function for every recorded command.
pub(crate) fn wrap_null_commands(raw: ash::Instance) -> ash::Instance {
    if !NULL_COMMANDS.get() {
        return raw;
    }
    let mut functions = raw.fp_v1_0().clone();
    REAL.get_or_init(|| functions.get_device_proc_addr);
    functions.get_device_proc_addr = look_up;
    ash::Instance::from_parts_1_3(raw.handle(), functions, raw.fp_v1_1().clone(), raw.fp_v1_3().clone())
}

/// # Safety
/// As `vkGetDeviceProcAddr`.
unsafe extern "system" fn look_up(device: vk::Device, name: *const c_char) -> vk::PFN_vkVoidFunction {
    let real = REAL.get()?;
    // SAFETY: the caller's device and name are passed to the real function; the name ends with a zero.
    let (found, name) = unsafe { (real(device, name), CStr::from_ptr(name)) };
    if name.to_bytes().starts_with(b"vkCmd") {
        found.map(|_| nothing as unsafe extern "system" fn())
    } else {
        found
    }
}

/// Replaces commands with any arguments: all of them return nothing, and in the C calling convention the caller removes
/// the arguments.
unsafe extern "system" fn nothing() {}
