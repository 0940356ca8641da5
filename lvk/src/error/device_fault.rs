//! Description of the fault that lost a device (`VK_EXT_device_fault`).

use std::fmt;
use std::ops::Range;

/// What a driver with `VK_EXT_device_fault` ([`OptionalFeature::DeviceFault`](crate::OptionalFeature)) says of the fault
/// that lost the device.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct DeviceFault {
    /// The driver's own words.
    pub description: String,
    /// Addresses that have to do with the fault.
    pub addresses: Vec<FaultAddress>,
    /// Codes that the vendor's tools understand.
    pub vendor: Vec<VendorFault>,
}

/// An address that has to do with a fault.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FaultAddress {
    /// What happened there.
    pub kind: FaultKind,
    /// The address, in the space of [`Context::buffer_address`](crate::Context::buffer_address), as the driver reported it.
    pub address: u64,
    /// The addresses among which the true one is.
    pub range: Range<u64>,
}

/// What happened at an address.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum FaultKind {
    /// A read of what nobody has.
    InvalidRead,
    /// A write to what nobody has.
    InvalidWrite,
    /// An instruction taken from where none is.
    InvalidExecute,
    /// Where an instruction stood that may have to do with the fault.
    Instruction,
    /// Where an instruction stood that was not valid.
    InvalidInstruction,
    /// Where the instruction stood that made the fault.
    FaultingInstruction,
    /// Something else, by Vulkan's number.
    Other(i32),
}

/// A code of the vendor's.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct VendorFault {
    /// The driver's own words.
    pub description: String,
    /// The code.
    pub code: u64,
    /// What belongs to the code.
    pub data: u64,
}

impl fmt::Display for DeviceFault {
    /// In one line, for messages.
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "{}", self.description)?;
        for FaultAddress { kind, range, .. } in &self.addresses {
            write!(out, "; {kind:?} at {:#x} to {:#x}", range.start, range.end - 1)?;
        }
        for VendorFault { description, code, data } in &self.vendor {
            write!(out, "; {description} (code {code:#x}, data {data:#x})")?;
        }
        Ok(())
    }
}
