//! `VK_EXT_device_fault`, offered by the layer in place of the driver: software drivers do not have it, and others report
//! nothing after an injected loss.

use std::ffi::{CStr, c_char};
use std::sync::LazyLock;
use std::sync::atomic::{AtomicU64, Ordering};

use ash::vk;
use ash::vk::Handle;

use super::dispatch::{next, number_of, table_of};
use super::injector::injector;
use crate::fault_report::{
    ADDRESS_PRECISION, DESCRIPTION, FaultReport, MANY_ADDRESSES, REPORT_VARIABLE, VENDOR_CODE, VENDOR_DATA,
    VENDOR_DESCRIPTION,
};

/// Bytes of the vendor's binary.
const BINARY_BYTES: u64 = 64;

static REPORT: LazyLock<Option<FaultReport>> =
    LazyLock::new(|| FaultReport::named(&std::env::var(REPORT_VARIABLE).ok()?));
/// The last answer of `vkGetBufferDeviceAddress` in this process.
static LAST_ADDRESS: AtomicU64 = AtomicU64::new(0);

/// True if the layer offers the extension.
pub(super) fn is_offered() -> bool {
    REPORT.is_some()
}

/// Returns the function that takes the place of the driver's, if the layer offers the extension; else 0.
pub(super) fn own(name: &str) -> usize {
    if !is_offered() {
        return 0;
    }
    match name {
        "vkEnumerateDeviceExtensionProperties" => extensions as *const () as usize,
        "vkGetPhysicalDeviceFeatures2" | "vkGetPhysicalDeviceFeatures2KHR" => features as *const () as usize,
        "vkGetBufferDeviceAddress" | "vkGetBufferDeviceAddressKHR" => buffer_address as *const () as usize,
        "vkGetDeviceFaultInfoEXT" => fault_info as *const () as usize,
        _ => 0,
    }
}

/// `vkEnumerateDeviceExtensionProperties`, with the extension.
unsafe extern "system" fn extensions(
    physical: vk::PhysicalDevice,
    layer: *const c_char,
    count: *mut u32,
    properties: *mut vk::ExtensionProperties,
) -> vk::Result {
    let Some(number) = number_of("vkEnumerateDeviceExtensionProperties") else {
        return vk::Result::ERROR_UNKNOWN;
    };
    if let Some(fault) = injector().called(number, physical.as_raw()) {
        return fault.result();
    }
    let Some(below) = next(number, physical.as_raw()) else { return vk::Result::ERROR_UNKNOWN };
    // SAFETY: the address is that of the command in the next layer, and the arguments are the caller's or have the
    // length that the command has said.
    unsafe {
        let below = std::mem::transmute::<usize, vk::PFN_vkEnumerateDeviceExtensionProperties>(below);
        if !layer.is_null() {
            return below(physical, layer, count, properties);
        }
        let mut length = 0;
        let mut result = below(physical, layer, &mut length, std::ptr::null_mut());
        let mut all = vec![vk::ExtensionProperties::default(); length as usize];
        if result == vk::Result::SUCCESS {
            result = below(physical, layer, &mut length, all.as_mut_ptr());
        }
        if result != vk::Result::SUCCESS {
            return result;
        }
        all.truncate(length as usize);
        add_extension(&mut all);
        copy_out(&all, &mut *count, properties)
    }
}

/// Adds the extension, unless the driver has it.
fn add_extension(all: &mut Vec<vk::ExtensionProperties>) {
    let name = ash::ext::device_fault::NAME;
    if all.iter().any(|found| found.extension_name_as_c_str() == Ok(name)) {
        return;
    }
    let mut added = vk::ExtensionProperties { spec_version: 2, ..Default::default() };
    write_text(&mut added.extension_name, name);
    all.push(added);
}

/// Answers as a Vulkan command that returns a list: with its length where there is no place, else with as much of it as
/// there is place for.
///
/// # Safety
/// `place` is null, or has room for `count` elements.
unsafe fn copy_out<T: Copy>(all: &[T], count: &mut u32, place: *mut T) -> vk::Result {
    let length = all.len() as u32;
    if place.is_null() {
        *count = length;
        return vk::Result::SUCCESS;
    }
    *count = length.min(*count);
    // SAFETY: by contract, and the list has as many elements.
    unsafe { place.copy_from_nonoverlapping(all.as_ptr(), *count as usize) };
    if *count < length { vk::Result::INCOMPLETE } else { vk::Result::SUCCESS }
}

/// `vkGetPhysicalDeviceFeatures2`, with the feature.
unsafe extern "system" fn features(
    physical: vk::PhysicalDevice,
    features: *mut vk::PhysicalDeviceFeatures2<'_>,
) {
    let Some(table) = table_of(physical.as_raw()).filter(|table| table.features != 0) else { return };
    // SAFETY: the address is that of the command in the next layer, and the arguments are the caller's.
    unsafe {
        std::mem::transmute::<usize, vk::PFN_vkGetPhysicalDeviceFeatures2>(table.features)(
            physical, features,
        );
        let mut link = &raw mut (*features).p_next;
        if let Some(found) = find_features(&mut link) {
            (*found).device_fault = vk::TRUE;
            (*found).device_fault_vendor_binary = vk::TRUE;
        }
    }
}

/// Finds the structure of the extension's features in a chain. `link` is the place of the pointer to the chain, and then
/// that of the pointer to the structure.
///
/// # Safety
/// `link` points to a chain of Vulkan structures.
unsafe fn find_features(
    link: &mut *mut *mut std::ffi::c_void,
) -> Option<*mut vk::PhysicalDeviceFaultFeaturesEXT<'static>> {
    loop {
        // SAFETY: every structure of a chain starts with its type and the next one.
        unsafe {
            let found = (**link).cast::<vk::BaseOutStructure<'_>>();
            if found.is_null() {
                return None;
            }
            if (*found).s_type == vk::StructureType::PHYSICAL_DEVICE_FAULT_FEATURES_EXT {
                return Some(found.cast());
            }
            *link = (&raw mut (*found).p_next).cast();
        }
    }
}

/// Calls `create` with the description of a device without the extension and its features, of which the layers below do
/// not know. The caller's chain is whole again afterwards.
///
/// # Safety
/// The description is valid, and nothing else uses it meanwhile.
pub(super) unsafe fn without_extension(
    info: *const vk::DeviceCreateInfo<'_>,
    create: impl FnOnce(*const vk::DeviceCreateInfo<'_>) -> vk::Result,
) -> vk::Result {
    // SAFETY: by contract.
    if !is_offered() || unsafe { (*info).enabled_extension_count } == 0 {
        return create(info);
    }
    // SAFETY: by contract. The loader and the library keep their structures in memory that can be written.
    unsafe {
        let mut stripped = *info;
        let names = std::slice::from_raw_parts(
            stripped.pp_enabled_extension_names,
            stripped.enabled_extension_count as usize,
        );
        let is_other = |name: &*const c_char| CStr::from_ptr(*name) != ash::ext::device_fault::NAME;
        let names: Vec<*const c_char> = names.iter().copied().filter(is_other).collect();
        stripped.pp_enabled_extension_names = names.as_ptr();
        stripped.enabled_extension_count = names.len() as u32;
        let mut link = (&raw mut stripped.p_next).cast();
        let Some(found) = find_features(&mut link) else { return create(&stripped) };
        *link = (*found).p_next;
        let result = create(&stripped);
        *link = found.cast();
        result
    }
}

/// `vkGetBufferDeviceAddress`, whose answer is kept.
unsafe extern "system" fn buffer_address(
    device: vk::Device,
    info: *const vk::BufferDeviceAddressInfo<'_>,
) -> vk::DeviceAddress {
    let Some(table) = table_of(device.as_raw()).filter(|table| table.buffer_address != 0) else { return 0 };
    // SAFETY: the address is that of the command in the next layer, and the arguments are the caller's.
    let address = unsafe {
        let below = std::mem::transmute::<usize, vk::PFN_vkGetBufferDeviceAddress>(table.buffer_address);
        below(device, info)
    };
    LAST_ADDRESS.store(address, Ordering::Relaxed);
    address
}

/// `vkGetDeviceFaultInfoEXT`: the report that the environment asks for, of a device that is lost.
unsafe extern "system" fn fault_info(
    device: vk::Device,
    counts: *mut vk::DeviceFaultCountsEXT<'_>,
    info: *mut vk::DeviceFaultInfoEXT<'_>,
) -> vk::Result {
    let Some(number) = number_of("vkGetDeviceFaultInfoEXT") else { return vk::Result::ERROR_UNKNOWN };
    if let Some(fault) = injector().called(number, device.as_raw()) {
        return fault.result();
    }
    let is_lost = table_of(device.as_raw()).is_some_and(|table| table.lost.load(Ordering::Relaxed));
    let Some(report) = REPORT.filter(|_| is_lost) else { return vk::Result::ERROR_UNKNOWN };
    // SAFETY: the caller passes counts, and null or a structure with lists of these lengths.
    unsafe { answer(report, LAST_ADDRESS.load(Ordering::Relaxed), &mut *counts, info.as_mut()) }
}

/// Returns the number of addresses that the first call counts, and that the second one finds: a driver may have found
/// more meanwhile, or less.
fn address_counts(report: FaultReport) -> (u32, u32) {
    match report {
        FaultReport::Overstated => (u32::MAX, 1),
        FaultReport::Incomplete => (1, 2),
        FaultReport::Many => (MANY_ADDRESSES, MANY_ADDRESSES),
        FaultReport::Complete | FaultReport::NoCounts | FaultReport::NoLists => (1, 1),
    }
}

/// Answers a call of `vkGetDeviceFaultInfoEXT`: without `info` the lengths of the lists, with it the lists.
///
/// # Safety
/// The lists of `info` have the lengths that `counts` says.
unsafe fn answer(
    report: FaultReport,
    address: u64,
    counts: &mut vk::DeviceFaultCountsEXT<'_>,
    info: Option<&mut vk::DeviceFaultInfoEXT<'_>>,
) -> vk::Result {
    let (counted, found) = address_counts(report);
    match (report, info) {
        (FaultReport::NoCounts, None) => vk::Result::ERROR_OUT_OF_HOST_MEMORY,
        (FaultReport::NoLists, Some(_)) => vk::Result::ERROR_OUT_OF_DEVICE_MEMORY,
        (_, None) => {
            counts.address_info_count = counted;
            counts.vendor_info_count = 1;
            counts.vendor_binary_size = BINARY_BYTES;
            vk::Result::SUCCESS
        }
        // SAFETY: by contract.
        (_, Some(info)) => unsafe { write_report(address, found as usize, counts, info) },
    }
}

/// Writes the lists, as far as there is place for them.
///
/// # Safety
/// The lists of `info` have the lengths that `counts` says.
unsafe fn write_report(
    address: u64,
    found: usize,
    counts: &mut vk::DeviceFaultCountsEXT<'_>,
    info: &mut vk::DeviceFaultInfoEXT<'_>,
) -> vk::Result {
    write_text(&mut info.description, DESCRIPTION);
    let mut vendor = vk::DeviceFaultVendorInfoEXT {
        vendor_fault_code: VENDOR_CODE,
        vendor_fault_data: VENDOR_DATA,
        ..Default::default()
    };
    write_text(&mut vendor.description, VENDOR_DESCRIPTION);
    let fault = vk::DeviceFaultAddressInfoEXT {
        address_type: vk::DeviceFaultAddressTypeEXT::WRITE_INVALID,
        reported_address: address,
        address_precision: ADDRESS_PRECISION,
    };
    // SAFETY: by contract.
    let results = unsafe {
        if !info.p_vendor_binary_data.is_null() {
            counts.vendor_binary_size = counts.vendor_binary_size.min(BINARY_BYTES);
            let binary = info.p_vendor_binary_data.cast::<u8>();
            binary.write_bytes(0xfa, counts.vendor_binary_size as usize);
        }
        [
            copy_out(&vec![fault; found], &mut counts.address_info_count, info.p_address_infos),
            copy_out(&[vendor], &mut counts.vendor_info_count, info.p_vendor_infos),
        ]
    };
    if results.contains(&vk::Result::INCOMPLETE) { vk::Result::INCOMPLETE } else { vk::Result::SUCCESS }
}

/// Writes a text and its terminating zero, or as much of it as there is place for.
fn write_text(place: &mut [c_char], text: &CStr) {
    let bytes = text.to_bytes_with_nul();
    place.iter_mut().zip(bytes).for_each(|(to, byte)| *to = c_char::from_ne_bytes([*byte]));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_extension_is_listed_once_and_lists_obey_their_length() {
        let mut all = Vec::new();
        add_extension(&mut all);
        add_extension(&mut all);
        assert_eq!(all.len(), 1);
        let (list, mut place, mut count) = ([7, 8, 9], [0; 4], 0);
        // SAFETY: the place has room for as many elements as the count says.
        unsafe {
            assert_eq!(copy_out(&list, &mut count, std::ptr::null_mut()), vk::Result::SUCCESS);
            assert_eq!(count, 3);
            count = 2;
            assert_eq!(copy_out(&list, &mut count, place.as_mut_ptr()), vk::Result::INCOMPLETE);
            assert_eq!((place, count), ([7, 8, 0, 0], 2));
            count = 4;
            assert_eq!(copy_out(&list, &mut count, place.as_mut_ptr()), vk::Result::SUCCESS);
            assert_eq!((place, count), ([7, 8, 9, 0], 3));
        }
    }

    #[test]
    fn features_are_found_and_taken_out_of_a_chain() {
        let mut fault = vk::PhysicalDeviceFaultFeaturesEXT::default();
        let mut other = vk::PhysicalDeviceVulkan12Features::default();
        let mut last = vk::PhysicalDeviceVulkan13Features::default();
        fault.p_next = (&raw mut last).cast();
        other.p_next = (&raw mut fault).cast();
        let mut chain: *mut std::ffi::c_void = (&raw mut other).cast();
        // SAFETY: the chain ends at its last structure.
        unsafe {
            let mut link = &raw mut chain;
            let found = find_features(&mut link).map(<*mut _>::cast::<std::ffi::c_void>);
            assert_eq!(found, Some((&raw mut fault).cast()));
            *link = fault.p_next;
            assert_eq!(other.p_next, (&raw mut last).cast());
            link = &raw mut chain;
            assert!(find_features(&mut link).is_none());
        }
    }

    #[test]
    fn reports_are_counted_first_and_written_then() {
        let call = |report, room: u32| {
            let mut counts = vk::DeviceFaultCountsEXT::default();
            let mut addresses = [vk::DeviceFaultAddressInfoEXT::default(); 2];
            let mut vendor = vk::DeviceFaultVendorInfoEXT::default();
            let mut info = vk::DeviceFaultInfoEXT {
                p_address_infos: addresses.as_mut_ptr(),
                p_vendor_infos: &mut vendor,
                ..Default::default()
            };
            // SAFETY: the lists have at least the lengths of the counts.
            unsafe {
                let first = answer(report, 0x120, &mut counts, None);
                let counted = counts.address_info_count;
                counts.address_info_count = room;
                let second = answer(report, 0x120, &mut counts, Some(&mut info));
                (first, counted, second, counts.address_info_count, addresses[0].reported_address)
            }
        };
        use vk::Result as R;
        assert_eq!(call(FaultReport::Complete, 1), (R::SUCCESS, 1, R::SUCCESS, 1, 0x120));
        assert_eq!(call(FaultReport::Incomplete, 1), (R::SUCCESS, 1, R::INCOMPLETE, 1, 0x120));
        assert_eq!(call(FaultReport::Overstated, 2), (R::SUCCESS, u32::MAX, R::SUCCESS, 1, 0x120));
        assert_eq!(call(FaultReport::Many, 2), (R::SUCCESS, MANY_ADDRESSES, R::INCOMPLETE, 2, 0x120));
        assert_eq!(call(FaultReport::NoCounts, 1).0, R::ERROR_OUT_OF_HOST_MEMORY);
        assert_eq!(call(FaultReport::NoLists, 1).2, R::ERROR_OUT_OF_DEVICE_MEMORY);
    }
}
