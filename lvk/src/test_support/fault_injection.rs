//! Fault injection: devices that can refuse a submission or an allocation, to test the library's error handling.

#![expect(clippy::disallowed_types, reason = "no lock is taken while another is held")]

use std::cell::{Cell, RefCell};
use std::collections::HashMap;
use std::ffi::{CStr, c_char};
use std::sync::{Mutex, PoisonError};

use ash::vk;

/// The driver's waits for semaphores, by device: any thread may wait.
static WAITS: Mutex<Vec<(vk::Device, vk::PFN_vkWaitSemaphores)>> = Mutex::new(Vec::new());

thread_local! {
    static INJECT_FAULTS: Cell<bool> = const { Cell::new(false) };
    static REAL: Cell<Option<vk::PFN_vkGetDeviceProcAddr>> = const { Cell::new(None) };
    static SUBMIT: Cell<Option<vk::PFN_vkQueueSubmit2>> = const { Cell::new(None) };
    /// Submissions of this thread before the one that fails.
    static SUBMITS_LEFT: Cell<Option<u32>> = const { Cell::new(None) };
    /// The result of that submission.
    static FAILURE: Cell<vk::Result> = const { Cell::new(vk::Result::ERROR_OUT_OF_DEVICE_MEMORY) };
    /// True if the device runs the submission that fails.
    static RUNS_REFUSED: Cell<bool> = const { Cell::new(false) };
    /// True if waits of this thread end by their timeout.
    static TIMES_OUT: Cell<bool> = const { Cell::new(false) };
    static ALLOCATE: Cell<Option<vk::PFN_vkAllocateMemory>> = const { Cell::new(None) };
    static IS_OUT_OF_MEMORY: Cell<bool> = const { Cell::new(false) };
    static FREE: Cell<Option<vk::PFN_vkFreeMemory>> = const { Cell::new(None) };
    /// Bytes that all devices of this thread may have allocated at a time.
    static HEAP_BYTES: Cell<u64> = const { Cell::new(u64::MAX) };
    /// Bytes of each live allocation.
    static ALLOCATED: RefCell<HashMap<(vk::Device, vk::DeviceMemory), u64>> = RefCell::default();
}

/// Runs `make`. Queues and allocations of the device that it creates can fail on this thread, until this function
/// creates another device.
pub(crate) fn with_failing_device<T>(make: impl FnOnce() -> T) -> T {
    INJECT_FAULTS.set(true);
    let made = make();
    INJECT_FAULTS.set(false);
    made
}

/// True while devices that this thread creates can fail.
pub(crate) fn injects_faults() -> bool {
    INJECT_FAULTS.get()
}

/// Makes one submission of this thread fail with `failure`, after `submissions` that succeed.
pub(crate) fn fail_after(submissions: u32, failure: vk::Result) {
    SUBMITS_LEFT.set(Some(submissions));
    FAILURE.set(failure);
    RUNS_REFUSED.set(false);
}

/// Lets the device run the submission that [`fail_after`] makes fail.
pub(crate) fn run_refused() {
    RUNS_REFUSED.set(true);
}

/// Makes all waits of this thread for semaphores end by their timeout, or succeed again.
pub(crate) fn set_times_out(times_out: bool) {
    TIMES_OUT.set(times_out);
}

/// Makes all allocations of device memory by this thread fail, or succeed again.
pub(crate) fn set_out_of_memory(is_out_of_memory: bool) {
    IS_OUT_OF_MEMORY.set(is_out_of_memory);
}

/// Emulates one heap of `heap_bytes` bytes, which all devices of this thread that can fail share. Allocations beyond it
/// fail; `u64::MAX` emulates none.
pub(crate) fn set_heap_bytes(heap_bytes: u64) {
    HEAP_BYTES.set(heap_bytes);
}

/// Returns the bytes that the devices of this thread that can fail have allocated.
pub(crate) fn allocated_bytes() -> u64 {
    ALLOCATED.with_borrow(|allocated| allocated.values().sum())
}

/// Returns the instance unchanged, or one whose devices can fail.
pub(crate) fn wrap_fault_injection(raw: ash::Instance) -> ash::Instance {
    if !INJECT_FAULTS.get() {
        return raw;
    }
    let mut functions = raw.fp_v1_0().clone();
    REAL.set(Some(functions.get_device_proc_addr));
    functions.get_device_proc_addr = look_up;
    ash::Instance::from_parts_1_3(raw.handle(), functions, raw.fp_v1_1().clone(), raw.fp_v1_3().clone())
}

/// # Safety
/// As `vkGetDeviceProcAddr`.
unsafe extern "system" fn look_up(device: vk::Device, name: *const c_char) -> vk::PFN_vkVoidFunction {
    let real = REAL.get()?;
    // SAFETY: the caller's device and name are passed to the real function; the name ends with a zero.
    let (found, name) = unsafe { (real(device, name), CStr::from_ptr(name)) };
    // SAFETY: the functions of these names have these types, and all have the size of a pointer.
    unsafe {
        if name == c"vkQueueSubmit2" {
            SUBMIT.set(std::mem::transmute::<vk::PFN_vkVoidFunction, Option<vk::PFN_vkQueueSubmit2>>(found));
            return Some(std::mem::transmute::<vk::PFN_vkQueueSubmit2, unsafe extern "system" fn()>(submit));
        }
        if name == c"vkWaitSemaphores" {
            let found =
                std::mem::transmute::<vk::PFN_vkVoidFunction, Option<vk::PFN_vkWaitSemaphores>>(found)?;
            let mut waits = WAITS.lock().unwrap_or_else(PoisonError::into_inner);
            waits.retain(|(other, _)| *other != device);
            waits.push((device, found));
            return Some(std::mem::transmute::<vk::PFN_vkWaitSemaphores, unsafe extern "system" fn()>(wait));
        }
        if name == c"vkGetDeviceFaultInfoEXT" && found.is_some() {
            return Some(
                std::mem::transmute::<vk::PFN_vkGetDeviceFaultInfoEXT, unsafe extern "system" fn()>(
                    find_no_fault,
                ),
            );
        }
        if name == c"vkFreeMemory" {
            FREE.set(std::mem::transmute::<vk::PFN_vkVoidFunction, Option<vk::PFN_vkFreeMemory>>(found));
            return Some(std::mem::transmute::<vk::PFN_vkFreeMemory, unsafe extern "system" fn()>(free));
        }
        if name == c"vkAllocateMemory" {
            ALLOCATE
                .set(std::mem::transmute::<vk::PFN_vkVoidFunction, Option<vk::PFN_vkAllocateMemory>>(found));
            return Some(std::mem::transmute::<vk::PFN_vkAllocateMemory, unsafe extern "system" fn()>(
                allocate,
            ));
        }
    }
    found
}

/// # Safety
/// As `vkAllocateMemory`, on the thread that created the device.
unsafe extern "system" fn allocate(
    device: vk::Device,
    info: *const vk::MemoryAllocateInfo<'_>,
    callbacks: *const vk::AllocationCallbacks<'_>,
    memory: *mut vk::DeviceMemory,
) -> vk::Result {
    // SAFETY: the caller passes a valid description.
    let bytes = unsafe { (*info).allocation_size };
    let fits = allocated_bytes().checked_add(bytes).is_some_and(|all| all <= HEAP_BYTES.get());
    let Some(real) = ALLOCATE.get().filter(|_| fits && !IS_OUT_OF_MEMORY.get()) else {
        return vk::Result::ERROR_OUT_OF_DEVICE_MEMORY;
    };
    // SAFETY: the caller upholds the contract of `vkAllocateMemory`.
    let result = unsafe { real(device, info, callbacks, memory) };
    if result == vk::Result::SUCCESS {
        // SAFETY: the call has succeeded, so it has written the handle.
        let memory = unsafe { *memory };
        ALLOCATED.with_borrow_mut(|allocated| allocated.insert((device, memory), bytes));
    }
    result
}

/// # Safety
/// As `vkFreeMemory`, on the thread that created the device.
unsafe extern "system" fn free(
    device: vk::Device,
    memory: vk::DeviceMemory,
    callbacks: *const vk::AllocationCallbacks<'_>,
) {
    ALLOCATED.with_borrow_mut(|allocated| allocated.remove(&(device, memory)));
    if let Some(real) = FREE.get() {
        // SAFETY: the caller upholds the contract of `vkFreeMemory`.
        unsafe { real(device, memory, callbacks) }
    }
}

/// # Safety
/// As `vkQueueSubmit2`, on the thread that created the device.
unsafe extern "system" fn submit(
    queue: vk::Queue,
    count: u32,
    infos: *const vk::SubmitInfo2<'_>,
    fence: vk::Fence,
) -> vk::Result {
    let submits_left = SUBMITS_LEFT.get();
    SUBMITS_LEFT.set(submits_left.and_then(|submits_left| submits_left.checked_sub(1)));
    let is_refused = submits_left == Some(0);
    let result = match SUBMIT.get() {
        // SAFETY: the caller upholds the contract of `vkQueueSubmit2`.
        Some(real) if !is_refused || RUNS_REFUSED.get() => unsafe { real(queue, count, infos, fence) },
        _ => FAILURE.get(),
    };
    if is_refused { FAILURE.get() } else { result }
}

/// # Safety
/// As `vkWaitSemaphores`, of a device that this thread or another has created by [`with_failing_device`].
unsafe extern "system" fn wait(
    device: vk::Device,
    info: *const vk::SemaphoreWaitInfo<'_>,
    timeout_ns: u64,
) -> vk::Result {
    let waits = WAITS.lock().unwrap_or_else(PoisonError::into_inner);
    let real = waits.iter().find(|(other, _)| *other == device).map(|(_, real)| *real);
    drop(waits);
    match real {
        // SAFETY: the caller upholds the contract of `vkWaitSemaphores`.
        Some(real) if !TIMES_OUT.get() => unsafe { real(device, info, timeout_ns) },
        _ => vk::Result::TIMEOUT,
    }
}

/// A device that only seems lost has no fault, and must not be asked for one.
///
/// # Safety
/// As `vkGetDeviceFaultInfoEXT`.
unsafe extern "system" fn find_no_fault(
    _: vk::Device,
    _: *mut vk::DeviceFaultCountsEXT<'_>,
    _: *mut vk::DeviceFaultInfoEXT<'_>,
) -> vk::Result {
    vk::Result::ERROR_OUT_OF_HOST_MEMORY
}
