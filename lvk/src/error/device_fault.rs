//! Description of the fault that lost a device (`VK_EXT_device_fault`).

use std::fmt;
use std::ops::Range;

use super::readable::readable_line;

/// Fault report of a lost device, from a driver with `VK_EXT_device_fault`
/// ([`OptionalFeature::DeviceFault`](crate::OptionalFeature)).
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct DeviceFault {
    /// Description by the driver.
    pub description: String,
    /// Addresses related to the fault.
    pub addresses: Vec<FaultAddress>,
    /// Codes for the vendor's tools.
    pub vendor: Vec<VendorFault>,
}

/// An address related to a fault.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FaultAddress {
    /// Kind of the address.
    pub kind: FaultKind,
    /// The address as the driver reported it, in the address space of
    /// [`Context::buffer_address`](crate::Context::buffer_address).
    pub address: u64,
    /// Range of addresses that contains the true address.
    pub range: Range<u64>,
}

/// Kind of a fault address.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum FaultKind {
    /// Read of unallocated memory.
    InvalidRead,
    /// Write to unallocated memory.
    InvalidWrite,
    /// Instruction fetch from an address without instructions.
    InvalidExecute,
    /// Address of an instruction that may be related to the fault.
    Instruction,
    /// Address of an invalid instruction.
    InvalidInstruction,
    /// Address of the instruction that caused the fault.
    FaultingInstruction,
    /// Another kind, with Vulkan's number.
    Other(i32),
}

/// A vendor-specific fault code.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct VendorFault {
    /// Description by the driver.
    pub description: String,
    /// The code.
    pub code: u64,
    /// Data of the code.
    pub data: u64,
}

/// Most addresses, and most codes, that the text lists.
const MAX_LISTED: usize = 8;

impl fmt::Display for DeviceFault {
    /// Formats the report in one line, for messages. Long lists are cut.
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(&readable_line(&self.description))?;
        for FaultAddress { kind, range, .. } in self.addresses.iter().take(MAX_LISTED) {
            write!(out, "; {kind:?} at {:#x} to {:#x}", range.start, range.end.saturating_sub(1))?;
        }
        write_rest(out, self.addresses.len(), "addresses")?;
        for VendorFault { description, code, data } in self.vendor.iter().take(MAX_LISTED) {
            let description = readable_line(description);
            write!(out, "; {description} (code {code:#x}, data {data:#x})")?;
        }
        write_rest(out, self.vendor.len(), "codes")
    }
}

fn write_rest(out: &mut fmt::Formatter<'_>, count: usize, what: &str) -> fmt::Result {
    match count.saturating_sub(MAX_LISTED) {
        0 => Ok(()),
        rest => write!(out, "; {rest} more {what}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_lists_the_first_addresses_and_codes() {
        let address =
            |address| FaultAddress { kind: FaultKind::InvalidRead, address, range: address..address + 1 };
        let code = |code| VendorFault { description: "unit".to_owned(), code, data: 0 };
        let fault = |count| DeviceFault {
            description: "fault".to_owned(),
            addresses: (0..count).map(address).collect(),
            vendor: (0..count).map(code).collect(),
        };
        let text = fault(40).to_string();
        assert_eq!((text.matches("InvalidRead").count(), text.matches("unit").count()), (8, 8), "{text}");
        assert!(text.contains("; 32 more addresses; unit") && text.ends_with("; 32 more codes"), "{text}");
        assert!(!fault(8).to_string().contains("more"));
    }
}
