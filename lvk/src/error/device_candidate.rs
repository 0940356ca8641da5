//! One device as the selection sees it: its name, its driver, and the requirements that it does not meet.

use std::fmt;

use super::readable::readable_name;

/// Kind of a device, in order of preference.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum DeviceKind {
    /// Graphics card.
    Discrete,
    /// Integrated GPU, which shares memory with the CPU.
    Integrated,
    /// Virtual GPU: part of a device, inside a virtual machine.
    Virtual,
    /// Software driver.
    Cpu,
    /// Anything else.
    Other,
}

impl fmt::Display for DeviceKind {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(match self {
            Self::Discrete => "discrete",
            Self::Integrated => "integrated",
            Self::Virtual => "virtual",
            Self::Cpu => "CPU",
            Self::Other => "other",
        })
    }
}

/// A device that was considered, with the requirements that it does not meet.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DeviceCandidate {
    /// Position in the list of devices, as [`ContextDesc::device`](crate::ContextDesc::device) takes it.
    pub index: usize,
    /// Name reported by the driver.
    pub name: String,
    /// Kind of the device.
    pub kind: DeviceKind,
    /// Vulkan version of the device: major, minor, patch.
    pub api_version: (u32, u32, u32),
    /// Name and version of the driver. Empty below Vulkan 1.3.
    pub driver: String,
    /// Requirements that the device does not meet. Empty if the device is usable.
    pub missing: Vec<String>,
}

impl fmt::Display for DeviceCandidate {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { index, name, kind, api_version: (major, minor, patch), .. } = self;
        let name = readable_name(name);
        write!(out, "[{index}] {name} ({kind}, Vulkan {major}.{minor}.{patch}")?;
        if !self.driver.is_empty() {
            write!(out, ", {}", readable_name(&self.driver))?;
        }
        match self.missing.as_slice() {
            [] => out.write_str("): usable"),
            missing => write!(out, "): lacks {}", missing.join(", ")),
        }
    }
}
