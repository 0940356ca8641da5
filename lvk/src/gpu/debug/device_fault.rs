//! Reads the fault of a lost device (`vkGetDeviceFaultInfoEXT`).

use std::ffi::{CStr, c_char};

use ash::vk;

use crate::error::device_fault::{DeviceFault, FaultAddress, FaultKind, VendorFault};

/// Maximum length of a list. A driver that has just failed may report nonsense, and longer lists are cut.
const MAX_ENTRIES: u32 = 1 << 12;

/// Queries the fault of a lost device. `None` if the query fails.
pub(crate) fn query_fault(
    functions: &ash::ext::device_fault::Device,
    device: vk::Device,
) -> Option<DeviceFault> {
    let functions = functions.fp();
    // SAFETY: the device is lost, as its last result reported, and the lists have the lengths given by the
    // counts.
    read_fault(|counts, info| unsafe { (functions.get_device_fault_info_ext)(device, counts, info) })
}

/// Reads a fault through `ask`, which works like `vkGetDeviceFaultInfoEXT`: first the counts, then lists of
/// that length.
fn read_fault(
    ask: impl Fn(*mut vk::DeviceFaultCountsEXT<'_>, *mut vk::DeviceFaultInfoEXT<'_>) -> vk::Result,
) -> Option<DeviceFault> {
    let mut counts = vk::DeviceFaultCountsEXT::default();
    if ask(&mut counts, std::ptr::null_mut()) != vk::Result::SUCCESS {
        return None;
    }
    counts.vendor_binary_size = 0; // read only by the driver's own tools, and behind a separate feature
    counts.address_info_count = counts.address_info_count.min(MAX_ENTRIES);
    counts.vendor_info_count = counts.vendor_info_count.min(MAX_ENTRIES);
    let mut addresses: Vec<vk::DeviceFaultAddressInfoEXT> = empty_list(counts.address_info_count)?;
    let mut vendor: Vec<vk::DeviceFaultVendorInfoEXT> = empty_list(counts.vendor_info_count)?;
    let mut info = vk::DeviceFaultInfoEXT {
        p_address_infos: addresses.as_mut_ptr(),
        p_vendor_infos: vendor.as_mut_ptr(),
        ..Default::default()
    };
    // `INCOMPLETE` only means that more entries exist.
    let answer = ask(&mut counts, &mut info);
    if answer != vk::Result::SUCCESS && answer != vk::Result::INCOMPLETE {
        return None;
    }
    addresses.truncate(counts.address_info_count as usize);
    vendor.truncate(counts.vendor_info_count as usize);
    Some(decode(&info.description, &addresses, &vendor))
}

/// Returns a list of this length. `None` if the host has no memory for it, which must not hide the loss.
fn empty_list<T: Clone + Default>(count: u32) -> Option<Vec<T>> {
    let mut list = Vec::new();
    list.try_reserve_exact(count as usize).ok()?;
    list.resize(count as usize, T::default());
    Some(list)
}

fn decode(
    description: &[c_char],
    addresses: &[vk::DeviceFaultAddressInfoEXT],
    vendor: &[vk::DeviceFaultVendorInfoEXT],
) -> DeviceFault {
    let vendor_fault = |info: &vk::DeviceFaultVendorInfoEXT| VendorFault {
        description: decode_text(&info.description),
        code: info.vendor_fault_code,
        data: info.vendor_fault_data,
    };
    DeviceFault {
        description: decode_text(description),
        addresses: addresses.iter().map(decode_address).collect(),
        vendor: vendor.iter().map(vendor_fault).collect(),
    }
}

/// Decodes an address. The precision is a power of two, and the true address has the same multiple of it
/// below.
fn decode_address(info: &vk::DeviceFaultAddressInfoEXT) -> FaultAddress {
    let precision = info.address_precision.max(1);
    let start = info.reported_address / precision * precision;
    FaultAddress {
        kind: decode_kind(info.address_type),
        address: info.reported_address,
        range: start..start.saturating_add(precision),
    }
}

fn decode_kind(raw: vk::DeviceFaultAddressTypeEXT) -> FaultKind {
    use vk::DeviceFaultAddressTypeEXT as Raw;
    match raw {
        Raw::READ_INVALID => FaultKind::InvalidRead,
        Raw::WRITE_INVALID => FaultKind::InvalidWrite,
        Raw::EXECUTE_INVALID => FaultKind::InvalidExecute,
        Raw::INSTRUCTION_POINTER_UNKNOWN => FaultKind::Instruction,
        Raw::INSTRUCTION_POINTER_INVALID => FaultKind::InvalidInstruction,
        Raw::INSTRUCTION_POINTER_FAULT => FaultKind::FaultingInstruction,
        other => FaultKind::Other(other.as_raw()),
    }
}

/// Returns the text of a character array, with or without a terminating zero.
fn decode_text(chars: &[c_char]) -> String {
    // `char` of C is signed on x86 and unsigned on ARM.
    let mut bytes: Vec<u8> = chars.iter().flat_map(|c| c.to_ne_bytes()).collect();
    bytes.push(0);
    CStr::from_bytes_until_nul(&bytes).map(|text| text.to_string_lossy().into_owned()).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::error::Error;
    use crate::error::device_loss::DeviceLossReport;

    fn chars<const N: usize>(text: &str) -> [c_char; N] {
        let mut all = [0; N];
        all.iter_mut().zip(text.bytes()).for_each(|(place, byte)| *place = c_char::from_ne_bytes([byte]));
        all
    }

    fn address_info(kind: i32, address: u64, precision: u64) -> vk::DeviceFaultAddressInfoEXT {
        let address_type = vk::DeviceFaultAddressTypeEXT::from_raw(kind);
        vk::DeviceFaultAddressInfoEXT {
            address_type,
            reported_address: address,
            address_precision: precision,
        }
    }

    /// A driver that reports two addresses and one code.
    fn driver(
        counts: *mut vk::DeviceFaultCountsEXT<'_>,
        info: *mut vk::DeviceFaultInfoEXT<'_>,
    ) -> vk::Result {
        // SAFETY: the contract of `vkGetDeviceFaultInfoEXT`; only this test calls the function.
        unsafe {
            if info.is_null() {
                *counts = vk::DeviceFaultCountsEXT {
                    address_info_count: 2,
                    vendor_info_count: 1,
                    vendor_binary_size: 512,
                    ..Default::default()
                };
                return vk::Result::SUCCESS;
            }
            assert_eq!(((*counts).address_info_count, (*counts).vendor_info_count), (2, 1));
            assert!((*counts).vendor_binary_size == 0 && (*info).p_vendor_binary_data.is_null());
            (*info).description = chars("page fault");
            *(*info).p_address_infos = address_info(1, 0x1_2345, 0x1000);
            *(*info).p_address_infos.add(1) = address_info(6, 0x77, 1);
            let code = vk::DeviceFaultVendorInfoEXT {
                description: chars("unit 7"),
                vendor_fault_code: 0xab,
                vendor_fault_data: 3,
            };
            *(*info).p_vendor_infos = code;
        }
        vk::Result::SUCCESS
    }

    #[test]
    fn a_fault_is_read_as_the_driver_says_it() {
        let fault = read_fault(driver).unwrap();
        let read =
            FaultAddress { kind: FaultKind::InvalidRead, address: 0x1_2345, range: 0x1_2000..0x1_3000 };
        let at = FaultAddress { kind: FaultKind::FaultingInstruction, address: 0x77, range: 0x77..0x78 };
        assert_eq!(fault.addresses, [read, at]);
        assert_eq!(fault.vendor, [VendorFault { description: "unit 7".to_owned(), code: 0xab, data: 3 }]);
        let (call, object) = ("vkQueueSubmit2", "graphics queue".to_owned());
        let report = DeviceLossReport { call, object, fault: Some(fault), queues: Vec::new() };
        let error = Error::DeviceLost { report: Arc::new(report) }.to_string();
        assert_eq!(
            error,
            "the device was lost in vkQueueSubmit2 for 'graphics queue' (page fault; InvalidRead at 0x12000 to 0x12fff; FaultingInstruction \
             at 0x77 to 0x77; unit 7 (code 0xab, data 0x3)); create a new context"
        );
        let error = Error::device_lost("vkQueueSubmit2", "graphics queue").to_string();
        assert_eq!(error, "the device was lost in vkQueueSubmit2 for 'graphics queue'; create a new context");
    }

    #[test]
    fn drivers_that_cannot_say_are_no_second_error() {
        assert_eq!(read_fault(|_, _| vk::Result::ERROR_UNKNOWN), None);
        let second_fails = |_: *mut vk::DeviceFaultCountsEXT<'_>, info: *mut vk::DeviceFaultInfoEXT<'_>| {
            if info.is_null() { vk::Result::SUCCESS } else { vk::Result::ERROR_OUT_OF_HOST_MEMORY }
        };
        assert_eq!(read_fault(second_fails), None);
        assert_eq!(read_fault(|_, _| vk::Result::SUCCESS), Some(DeviceFault::default()));
        // Announces more entries than any list holds, and then writes fewer entries than announced.
        let boasts = |counts: *mut vk::DeviceFaultCountsEXT<'_>, info: *mut vk::DeviceFaultInfoEXT<'_>| {
            // SAFETY: as in `driver`.
            unsafe { (*counts).address_info_count = if info.is_null() { u32::MAX } else { 1 } };
            vk::Result::INCOMPLETE
        };
        assert_eq!(read_fault(boasts), None, "asked for counts alone, nothing is incomplete");
        let fewer = |counts: *mut vk::DeviceFaultCountsEXT<'_>, info: *mut vk::DeviceFaultInfoEXT<'_>| {
            // SAFETY: as in `driver`.
            unsafe { (*counts).address_info_count = if info.is_null() { u32::MAX } else { 1 } };
            if info.is_null() { vk::Result::SUCCESS } else { vk::Result::INCOMPLETE }
        };
        let fault = read_fault(fewer).unwrap();
        assert_eq!((fault.addresses.len(), fault.addresses[0].kind), (1, FaultKind::Other(0)));
    }

    #[test]
    fn odd_precisions_and_texts_do_no_harm() {
        assert_eq!(decode_address(&address_info(2, 9, 0)).range, 9..10);
        let last = decode_address(&address_info(2, u64::MAX, 1 << 20)).range;
        assert!(last.start < last.end);
        assert_eq!(decode_text(&chars::<4>("four")), "four");
        assert_eq!(decode_text(&[]), "");
    }
}
