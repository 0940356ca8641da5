//! A Vulkan layer that measures how long the GPU works for a program, whichever library submits the work.
//!
//! Each submission gets a command buffer with a timestamp before its own, and one behind them. The program opens the library that the
//! loader has opened, and asks [`take_busy_time`] for the time of the submissions since its last question. Programs must ask for Vulkan 1.3.

mod device;
mod host_query_reset;
mod intervals;

use std::collections::HashMap;
use std::ffi::{CStr, c_char};
use std::sync::{Arc, LazyLock, PoisonError, RwLock};

use ash::vk;
use ash::vk::Handle;
use lvk_layer::{DEVICE_LINK, INSTANCE_LINK, Negotiation, find_set_loader_data, take_link};

use device::{BusyTime, TimedDevice};

/// Name of the function that programs ask for the time.
pub const TAKE_BUSY_TIME: &str = "lvk_gpu_timer_take_busy_time";
/// Answer of [`take_busy_time`]: nothing was submitted since the last question.
pub const NOTHING_SUBMITTED: f64 = -1.0;
/// Answer of [`take_busy_time`]: the time of a submission is not known, as where its queue has no timestamps.
pub const NOT_TIMED: f64 = -2.0;

/// Functions of the layer below, by the key of an instance or a device.
type Map<T> = LazyLock<RwLock<HashMap<usize, Arc<T>>>>;

static INSTANCES: Map<LowerInstance> = LazyLock::new(RwLock::default);
static DEVICES: Map<TimedDevice> = LazyLock::new(RwLock::default);

struct LowerInstance {
    functions: ash::Instance,
    get_proc_addr: vk::PFN_vkGetInstanceProcAddr,
}

fn insert<T>(map: &Map<T>, handle: u64, value: T) {
    // SAFETY: the layer below has just created the handle.
    let key = unsafe { lvk_layer::key_of(handle) };
    map.write().unwrap_or_else(PoisonError::into_inner).insert(key, Arc::new(value));
}

fn lookup<T>(map: &Map<T>, handle: u64) -> Option<Arc<T>> {
    // SAFETY: the caller of a Vulkan command passes a handle that is alive.
    let key = unsafe { lvk_layer::key_of(handle) };
    map.read().unwrap_or_else(PoisonError::into_inner).get(&key).cloned()
}

fn remove<T>(map: &Map<T>, handle: u64) -> Option<Arc<T>> {
    // SAFETY: the caller of a Vulkan command passes a handle that is alive.
    let key = unsafe { lvk_layer::key_of(handle) };
    map.write().unwrap_or_else(PoisonError::into_inner).remove(&key)
}

/// Returns the milliseconds in which a queue worked since the last call, as a sum over all devices; [`NOTHING_SUBMITTED`], or [`NOT_TIMED`].
///
/// Ask after the program has waited for its work: this call waits for submissions that have not ended, and new ones wait for this call.
#[unsafe(export_name = "lvk_gpu_timer_take_busy_time")] // as `TAKE_BUSY_TIME`
pub extern "C" fn take_busy_time() -> f64 {
    let devices: Vec<_> = DEVICES.read().unwrap_or_else(PoisonError::into_inner).values().cloned().collect();
    // Every device is asked, so that none keeps what it did for the next call.
    let times: Vec<_> = devices.iter().map(|device| device.take_busy_time()).collect();
    if times.contains(&BusyTime::NotTimed) {
        return NOT_TIMED;
    }
    let milliseconds = |time: &BusyTime| match time {
        BusyTime::Milliseconds(time) => Some(*time),
        BusyTime::NothingSubmitted | BusyTime::NotTimed => None,
    };
    let times: Vec<f64> = times.iter().filter_map(milliseconds).collect();
    if times.is_empty() { NOTHING_SUBMITTED } else { times.iter().sum() }
}

/// Exchanges versions and functions with the loader.
///
/// # Safety
/// The loader calls this function with a valid structure.
#[unsafe(export_name = "vkNegotiateLoaderLayerInterfaceVersion")]
pub unsafe extern "system" fn negotiate(negotiation: *mut Negotiation) -> vk::Result {
    // SAFETY: by contract.
    unsafe { (*negotiation).answer(get_instance_proc_addr, get_device_proc_addr) };
    vk::Result::SUCCESS
}

unsafe extern "system" fn create_instance(
    info: *const vk::InstanceCreateInfo<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    instance: *mut vk::Instance,
) -> vk::Result {
    // SAFETY: the loader passes a description with its link, and a valid pointer for the handle.
    unsafe {
        let Some(link) = take_link((*info).p_next, INSTANCE_LINK) else {
            return vk::Result::ERROR_INITIALIZATION_FAILED;
        };
        let get_proc_addr = (*link).get_instance_proc_addr;
        let entry =
            ash::EntryFnV1_0::load(|name| pointer(get_proc_addr(vk::Instance::null(), name.as_ptr())));
        let result = (entry.create_instance)(info, allocator, instance);
        if result == vk::Result::SUCCESS {
            let find = |name: &CStr| pointer(get_proc_addr(*instance, name.as_ptr()));
            let functions = ash::Instance::load_with(find, *instance);
            insert(&INSTANCES, (*instance).as_raw(), LowerInstance { functions, get_proc_addr });
        }
        result
    }
}

unsafe extern "system" fn destroy_instance(
    instance: vk::Instance,
    allocator: *const vk::AllocationCallbacks<'_>,
) {
    if instance == vk::Instance::null() {
        return;
    }
    if let Some(lower) = remove(&INSTANCES, instance.as_raw()) {
        // SAFETY: the arguments are the caller's.
        unsafe { lower.functions.destroy_instance(allocator.as_ref()) };
    }
}

unsafe extern "system" fn create_device(
    physical: vk::PhysicalDevice,
    info: *const vk::DeviceCreateInfo<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    device: *mut vk::Device,
) -> vk::Result {
    let Some(instance) = lookup(&INSTANCES, physical.as_raw()) else {
        return vk::Result::ERROR_INITIALIZATION_FAILED;
    };
    // SAFETY: the loader passes a description with its link, and a valid pointer for the handle.
    unsafe {
        let Some(link) = take_link((*info).p_next, DEVICE_LINK) else {
            return vk::Result::ERROR_INITIALIZATION_FAILED;
        };
        let set_loader_data = find_set_loader_data((*info).p_next);
        let Some(get_proc_addr) = (*link).get_device_proc_addr else {
            return vk::Result::ERROR_INITIALIZATION_FAILED;
        };
        let create = |info: *const vk::DeviceCreateInfo<'_>| {
            (instance.functions.fp_v1_0().create_device)(physical, info, allocator, device)
        };
        let result = host_query_reset::create_with_host_query_reset(info, create);
        if result == vk::Result::SUCCESS {
            let find = |name: &CStr| pointer(get_proc_addr(*device, name.as_ptr()));
            let functions = ash::Device::load_with(find, *device);
            let timed =
                TimedDevice::new(&instance.functions, physical, functions, get_proc_addr, set_loader_data);
            insert(&DEVICES, (*device).as_raw(), timed);
        }
        result
    }
}

unsafe extern "system" fn destroy_device(device: vk::Device, allocator: *const vk::AllocationCallbacks<'_>) {
    if device == vk::Device::null() {
        return;
    }
    if let Some(timed) = remove(&DEVICES, device.as_raw()) {
        timed.destroy_timestamps();
        // SAFETY: the arguments are the caller's.
        unsafe { timed.functions.destroy_device(allocator.as_ref()) };
    }
}

unsafe extern "system" fn get_device_queue(
    device: vk::Device,
    family: u32,
    index: u32,
    queue: *mut vk::Queue,
) {
    let Some(timed) = lookup(&DEVICES, device.as_raw()) else { return };
    // SAFETY: the arguments are the caller's.
    unsafe {
        *queue = timed.functions.get_device_queue(family, index);
        timed.add_queue(*queue, family);
    }
}

unsafe extern "system" fn get_device_queue2(
    device: vk::Device,
    info: *const vk::DeviceQueueInfo2<'_>,
    queue: *mut vk::Queue,
) {
    let Some(timed) = lookup(&DEVICES, device.as_raw()) else { return };
    // SAFETY: the arguments are the caller's.
    unsafe {
        *queue = timed.functions.get_device_queue2(&*info);
        timed.add_queue(*queue, (*info).queue_family_index);
    }
}

unsafe extern "system" fn queue_submit(
    queue: vk::Queue,
    count: u32,
    batches: *const vk::SubmitInfo<'_>,
    fence: vk::Fence,
) -> vk::Result {
    let Some(timed) = lookup(&DEVICES, queue.as_raw()) else { return vk::Result::ERROR_DEVICE_LOST };
    // SAFETY: the arguments are the caller's.
    unsafe { timed.submit(queue, device::slice_of(batches, count), fence) }
}

unsafe extern "system" fn queue_submit2(
    queue: vk::Queue,
    count: u32,
    batches: *const vk::SubmitInfo2<'_>,
    fence: vk::Fence,
) -> vk::Result {
    let Some(timed) = lookup(&DEVICES, queue.as_raw()) else { return vk::Result::ERROR_DEVICE_LOST };
    // SAFETY: the arguments are the caller's.
    unsafe { timed.submit2(queue, device::slice_of(batches, count), fence) }
}

fn pointer(function: vk::PFN_vkVoidFunction) -> *const std::ffi::c_void {
    function.map_or(std::ptr::null(), |function| function as *const std::ffi::c_void)
}

/// The layer's own function of this name.
fn own(name: &CStr) -> vk::PFN_vkVoidFunction {
    let address = match name.to_bytes() {
        b"vkGetInstanceProcAddr" => get_instance_proc_addr as *const (),
        b"vkCreateInstance" => create_instance as *const (),
        b"vkDestroyInstance" => destroy_instance as *const (),
        b"vkCreateDevice" => create_device as *const (),
        _ => return own_of_device(name),
    };
    // SAFETY: the address is that of a function with the type of the command.
    unsafe { std::mem::transmute::<*const (), vk::PFN_vkVoidFunction>(address) }
}

/// The layer's own function of this name, for commands of a device and its queues.
fn own_of_device(name: &CStr) -> vk::PFN_vkVoidFunction {
    let address = match name.to_bytes() {
        b"vkGetDeviceProcAddr" => get_device_proc_addr as *const (),
        b"vkDestroyDevice" => destroy_device as *const (),
        b"vkGetDeviceQueue" => get_device_queue as *const (),
        b"vkGetDeviceQueue2" => get_device_queue2 as *const (),
        b"vkQueueSubmit" => queue_submit as *const (),
        b"vkQueueSubmit2" | b"vkQueueSubmit2KHR" => queue_submit2 as *const (),
        _ => return None,
    };
    // SAFETY: the address is that of a function with the type of the command.
    unsafe { std::mem::transmute::<*const (), vk::PFN_vkVoidFunction>(address) }
}

unsafe extern "system" fn get_instance_proc_addr(
    instance: vk::Instance,
    name: *const c_char,
) -> vk::PFN_vkVoidFunction {
    // SAFETY: the caller passes a name.
    let ours = own(unsafe { CStr::from_ptr(name) });
    if ours.is_some() || instance == vk::Instance::null() {
        return ours;
    }
    let lower = lookup(&INSTANCES, instance.as_raw())?;
    // SAFETY: the arguments are the caller's.
    unsafe { (lower.get_proc_addr)(instance, name) }
}

unsafe extern "system" fn get_device_proc_addr(
    device: vk::Device,
    name: *const c_char,
) -> vk::PFN_vkVoidFunction {
    let timed = lookup(&DEVICES, device.as_raw())?;
    // SAFETY: the arguments are the caller's.
    let below = unsafe { (timed.get_proc_addr)(device, name) };
    // SAFETY: the caller passes a name.
    below.and(own_of_device(unsafe { CStr::from_ptr(name) })).or(below)
}
