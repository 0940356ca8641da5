//! The report of a lost device that the layer gives (`VK_EXT_device_fault`).

use std::ffi::CStr;

/// Environment variable with the [`FaultReport`]; without it the layer does not offer the extension.
pub const REPORT_VARIABLE: &str = "LVK_FAULT_REPORT";
/// Description of the fault.
pub const DESCRIPTION: &CStr = c"injected page fault";
/// Description of the vendor's code.
pub const VENDOR_DESCRIPTION: &CStr = c"injected unit";
/// The vendor's code.
pub const VENDOR_CODE: u64 = 0x1d;
/// Data of the vendor's code.
pub const VENDOR_DATA: u64 = 0xfa;
/// Precision of the address, in bytes. The address itself is the one that the program has asked for last.
pub const ADDRESS_PRECISION: u64 = 16;

/// Number of addresses of [`FaultReport::Many`].
pub const MANY_ADDRESSES: u32 = 5000;

/// Kinds of answers of `vkGetDeviceFaultInfoEXT`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FaultReport {
    /// A description, an address and a vendor's code.
    Complete,
    /// The same, and one more address than the first call has counted: `VK_INCOMPLETE`.
    Incomplete,
    /// The same, but the first call counts more addresses than any memory holds.
    Overstated,
    /// Thousands of addresses.
    Many,
    /// The first call fails for lack of host memory.
    NoCounts,
    /// The second call fails for lack of device memory.
    NoLists,
}

impl FaultReport {
    /// Every kind.
    pub const ALL: [Self; 6] =
        [Self::Complete, Self::Incomplete, Self::Overstated, Self::Many, Self::NoCounts, Self::NoLists];

    /// Returns the name in the environment variable.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Complete => "complete",
            Self::Incomplete => "incomplete",
            Self::Overstated => "overstated",
            Self::Many => "many",
            Self::NoCounts => "no-counts",
            Self::NoLists => "no-lists",
        }
    }

    /// Returns the kind of this name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|report| report.name() == name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kinds_come_back_from_their_names() {
        assert!(FaultReport::ALL.iter().all(|report| FaultReport::named(report.name()) == Some(*report)));
        assert_eq!(FaultReport::named("rain"), None);
    }
}
