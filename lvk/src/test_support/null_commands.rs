//! Devices whose recorded commands do nothing, to measure what the library itself takes to record.

use std::cell::Cell;
use std::ffi::{CStr, c_char};
use std::sync::OnceLock;

use ash::vk;

thread_local! {
    static NULL_COMMANDS: Cell<bool> = const { Cell::new(false) };
}

static REAL: OnceLock<vk::PFN_vkGetDeviceProcAddr> = OnceLock::new();

/// Devices made by `make` on this thread record nothing.
pub(crate) fn with_null_commands<T>(make: impl FnOnce() -> T) -> T {
    NULL_COMMANDS.set(true);
    let made = make();
    NULL_COMMANDS.set(false);
    made
}

/// The instance as it is, or one whose devices find empty functions for all commands that are recorded.
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
    // SAFETY: the caller's device and name go on to the real function; the name ends with a zero.
    let (found, name) = unsafe { (real(device, name), CStr::from_ptr(name)) };
    if name.to_bytes().starts_with(b"vkCmd") {
        found.map(|_| nothing as unsafe extern "system" fn())
    } else {
        found
    }
}

/// Stands for commands of any arguments: all answer nothing, and their callers clear the arguments up.
unsafe extern "system" fn nothing() {}
