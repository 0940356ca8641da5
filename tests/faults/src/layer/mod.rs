//! The Vulkan layer: what the loader calls, and the commands that create and destroy instances and devices.

mod command_buffers;
mod commands;
mod device_fault;
mod dispatch;
mod injector;
mod loader;
mod name_reader;
mod wrappers;

use std::ffi::{CStr, c_char};

use ash::vk;
use ash::vk::Handle;

use commands::LOST;
use dispatch::{Level, Table, insert, number_of, remove, table_of};
use injector::injector;
pub use injector::{FAULT_VARIABLE, LOG_VARIABLE};
use loader::{ExtensionsChain, LayersChain, VersionChain};
use lvk_layer::{DEVICE_LINK, INSTANCE_LINK, Negotiation, take_link};
pub use name_reader::NAMES_VARIABLE;

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

/// `vkEnumerateInstanceVersion`, before there is an instance; the layer's description names this function.
///
/// # Safety
/// The loader calls this function with a valid chain.
#[unsafe(export_name = "lvk_fault_instance_version")]
pub unsafe extern "system" fn instance_version(chain: *const VersionChain, version: *mut u32) -> vk::Result {
    match injector().called_by_name("vkEnumerateInstanceVersion", 0) {
        Some(fault) => fault.result(),
        // SAFETY: by contract.
        None => unsafe { ((*chain).next)((*chain).link, version) },
    }
}

/// `vkEnumerateInstanceExtensionProperties`, before there is an instance.
///
/// # Safety
/// The loader calls this function with a valid chain.
#[unsafe(export_name = "lvk_fault_instance_extensions")]
pub unsafe extern "system" fn instance_extensions(
    chain: *const ExtensionsChain,
    layer: *const c_char,
    count: *mut u32,
    properties: *mut vk::ExtensionProperties,
) -> vk::Result {
    match injector().called_by_name("vkEnumerateInstanceExtensionProperties", 0) {
        Some(fault) => fault.result(),
        // SAFETY: by contract.
        None => unsafe { ((*chain).next)((*chain).link, layer, count, properties) },
    }
}

/// `vkEnumerateInstanceLayerProperties`, before there is an instance.
///
/// # Safety
/// The loader calls this function with a valid chain.
#[unsafe(export_name = "lvk_fault_instance_layers")]
pub unsafe extern "system" fn instance_layers(
    chain: *const LayersChain,
    count: *mut u32,
    properties: *mut vk::LayerProperties,
) -> vk::Result {
    match injector().called_by_name("vkEnumerateInstanceLayerProperties", 0) {
        Some(fault) => fault.result(),
        // SAFETY: by contract.
        None => unsafe { ((*chain).next)((*chain).link, count, properties) },
    }
}

fn address(function: vk::PFN_vkVoidFunction) -> usize {
    function.map_or(0, |function| function as *const () as usize)
}

fn function(address: usize) -> vk::PFN_vkVoidFunction {
    // SAFETY: the address is 0 or that of a Vulkan function, and `Option` of a function has 0 for `None`.
    unsafe { std::mem::transmute::<usize, vk::PFN_vkVoidFunction>(address) }
}

fn c_name(name: &str) -> std::ffi::CString {
    std::ffi::CString::new(name).unwrap_or_default()
}

unsafe extern "system" fn create_instance(
    info: *const vk::InstanceCreateInfo<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    instance: *mut vk::Instance,
) -> vk::Result {
    if let Some(fault) = injector().called_by_name("vkCreateInstance", 0) {
        return fault.result();
    }
    // SAFETY: the loader passes a description with its link, and a valid pointer for the handle.
    unsafe {
        let Some(link) = take_link((*info).p_next, INSTANCE_LINK) else {
            return vk::Result::ERROR_INITIALIZATION_FAILED;
        };
        let proc_addr = (*link).get_instance_proc_addr;
        let create = address(proc_addr(vk::Instance::null(), c"vkCreateInstance".as_ptr()));
        let create = std::mem::transmute::<usize, vk::PFN_vkCreateInstance>(create);
        let result = create(info, allocator, instance);
        if result == vk::Result::SUCCESS {
            let find = |name: &str| address(proc_addr(*instance, c_name(name).as_ptr()));
            let table =
                Table::new(Level::Instance, find, proc_addr as *const () as usize, "vkDestroyInstance");
            insert((*instance).as_raw(), table);
            injector().count(0, "VkInstance", (*instance).as_raw());
            injector().log_live();
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
    let Some(table) = remove(instance.as_raw()) else { return };
    injector().count_orphans(instance.as_raw());
    injector().uncount(0, "VkInstance", instance.as_raw());
    // SAFETY: the address is that of the command in the next layer.
    let destroy = unsafe { std::mem::transmute::<usize, vk::PFN_vkDestroyInstance>(table.destroy) };
    // SAFETY: the arguments are the caller's.
    unsafe { destroy(instance, allocator) };
    injector().log_live();
}

unsafe extern "system" fn create_device(
    physical: vk::PhysicalDevice,
    info: *const vk::DeviceCreateInfo<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    device: *mut vk::Device,
) -> vk::Result {
    if let Some(fault) = injector().called_by_name("vkCreateDevice", LOST) {
        return fault.result();
    }
    // SAFETY: the loader passes a description with its link, and a valid pointer for the handle.
    unsafe {
        let Some(link) = take_link((*info).p_next, DEVICE_LINK) else {
            return vk::Result::ERROR_INITIALIZATION_FAILED;
        };
        let get_instance = (*link).get_instance_proc_addr;
        let Some(get_device) = (*link).get_device_proc_addr else {
            return vk::Result::ERROR_INITIALIZATION_FAILED;
        };
        let create = address(get_instance(vk::Instance::null(), c"vkCreateDevice".as_ptr()));
        let create = std::mem::transmute::<usize, vk::PFN_vkCreateDevice>(create);
        let create = |info: *const vk::DeviceCreateInfo<'_>| create(physical, info, allocator, device);
        let result = device_fault::without_extension(info, create);
        if result == vk::Result::SUCCESS {
            let find = |name: &str| address(get_device(*device, c_name(name).as_ptr()));
            let mut table =
                Table::new(Level::Device, find, get_device as *const () as usize, "vkDestroyDevice");
            let wait = find("vkDeviceWaitIdle");
            table.finish = Some((std::mem::transmute::<usize, vk::PFN_vkDeviceWaitIdle>(wait), *device));
            insert((*device).as_raw(), table);
            injector().count(0, "VkDevice", (*device).as_raw());
        }
        result
    }
}

unsafe extern "system" fn destroy_device(device: vk::Device, allocator: *const vk::AllocationCallbacks<'_>) {
    if device == vk::Device::null() {
        return;
    }
    let Some(table) = remove(device.as_raw()) else { return };
    injector().count_orphans(device.as_raw());
    injector().uncount(0, "VkDevice", device.as_raw());
    // SAFETY: the address is that of the command in the next layer.
    let destroy = unsafe { std::mem::transmute::<usize, vk::PFN_vkDestroyDevice>(table.destroy) };
    // SAFETY: the arguments are the caller's.
    unsafe { destroy(device, allocator) };
}

/// Returns the layer's own functions that no table has.
fn own(name: &str) -> usize {
    match name {
        "vkGetInstanceProcAddr" => get_instance_proc_addr as *const () as usize,
        "vkGetDeviceProcAddr" => get_device_proc_addr as *const () as usize,
        "vkCreateInstance" => create_instance as *const () as usize,
        "vkDestroyInstance" => destroy_instance as *const () as usize,
        "vkCreateDevice" => create_device as *const () as usize,
        "vkDestroyDevice" => destroy_device as *const () as usize,
        _ => replaced(name),
    }
}

/// Returns the function that takes the place of the driver's for an extension or a tool that the layer offers; else 0.
fn replaced(name: &str) -> usize {
    match device_fault::own(name) {
        0 => name_reader::own(name),
        own => own,
    }
}

/// Returns the wrapper of a command that the layer below has; else its own function.
fn wrapped(name: &str, below: usize) -> vk::PFN_vkVoidFunction {
    match number_of(name) {
        Some(number) if below != 0 => function(dispatch::COMMANDS[number].wrapper),
        _ => function(below),
    }
}

unsafe extern "system" fn get_instance_proc_addr(
    instance: vk::Instance,
    name: *const c_char,
) -> vk::PFN_vkVoidFunction {
    // SAFETY: the caller passes a name.
    let text = unsafe { CStr::from_ptr(name) }.to_str().unwrap_or_default();
    let ours = own(text);
    if ours != 0 {
        return function(ours);
    }
    if instance == vk::Instance::null() {
        return None;
    }
    let table = table_of(instance.as_raw())?;
    // SAFETY: the address is that of the next layer's function, and the arguments are the caller's.
    let below = unsafe {
        let find = std::mem::transmute::<usize, vk::PFN_vkGetInstanceProcAddr>(table.proc_addr);
        find(instance, name)
    };
    wrapped(text, address(below))
}

unsafe extern "system" fn get_device_proc_addr(
    device: vk::Device,
    name: *const c_char,
) -> vk::PFN_vkVoidFunction {
    // SAFETY: the caller passes a name.
    let text = unsafe { CStr::from_ptr(name) }.to_str().unwrap_or_default();
    let table = table_of(device.as_raw())?;
    // SAFETY: the address is that of the next layer's function, and the arguments are the caller's.
    let below = unsafe {
        let find = std::mem::transmute::<usize, vk::PFN_vkGetDeviceProcAddr>(table.proc_addr);
        find(device, name)
    };
    let ours = match text {
        "vkGetDeviceProcAddr" | "vkDestroyDevice" => own(text),
        _ => replaced(text),
    };
    if ours != 0 {
        return function(ours);
    }
    wrapped(text, address(below))
}
