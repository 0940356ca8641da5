//! Selection of the ray query implementation: the device, or the library in software.

use crate::error::{Error, Result};

/// Requested implementation of ray queries.
///
/// Software traversal only needs Vulkan 1.3, so it works on every device that can have a context. Handles,
/// shaders (`#include <lvk/ray_query.glsl>`) and results are the same with both implementations.
///
/// Software traversal needs the crate feature `software-ray-query`, which is enabled by default.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum RayQueryRequest {
    /// Hardware queries on GPUs that have them. Software on GPUs without them, and on CPU devices, whose own
    /// queries are slower. Without the feature `software-ray-query`, the same as
    /// [`HardwareIfPresent`](Self::HardwareIfPresent).
    #[default]
    Auto,
    /// Only devices with `VK_KHR_ray_query` are considered.
    Hardware,
    /// `VK_KHR_ray_query` if the device has it; otherwise ray queries do not work. No acceleration structures are
    /// built for software queries.
    HardwareIfPresent,
    /// Software, even if the device has hardware queries. Without the feature `software-ray-query`,
    /// [`Context::new`](crate::Context::new) fails with [`Unsupported`](crate::Error::Unsupported).
    Software,
    /// No ray queries, even if the device has them.
    Off,
}

/// Implementation of ray queries in use.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum RayQueryPath {
    /// No ray queries.
    #[default]
    None,
    /// Traversal by the device (`VK_KHR_ray_query`).
    Hardware,
    /// Traversal by the library, in the shader, over the library's own BVHs.
    Software,
}

/// A ray query path, with the reason for its selection.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct RayQueryChoice {
    pub(crate) path: RayQueryPath,
    pub(crate) reason: &'static str,
}

/// True if the library is built with its own traversal.
pub(super) const HAS_SOFTWARE: bool = cfg!(feature = "software-ray-query");

impl RayQueryRequest {
    /// Returns an error for the software path in a build without it.
    pub(crate) fn check(self) -> Result<()> {
        if self == Self::Software && !HAS_SOFTWARE {
            let why =
                "lvk was built without its feature `software-ray-query`; enable it, or ask for another path";
            return Err(Error::unsupported("RayQueryRequest::Software", why));
        }
        Ok(())
    }

    /// True if only devices with hardware queries are considered.
    pub(crate) fn requires_hardware(self) -> bool {
        self == Self::Hardware
    }

    /// True if devices with hardware queries are preferred.
    pub(crate) fn prefers_hardware(self) -> bool {
        matches!(self, Self::Auto | Self::Hardware | Self::HardwareIfPresent)
    }

    /// Selects the implementation for a device. `has`: it has hardware queries; `is_cpu`: it is a CPU.
    pub(crate) fn choose(self, has: bool, is_cpu: bool) -> RayQueryChoice {
        use RayQueryPath::{Hardware, None, Software};
        let (path, reason) = match self {
            Self::Off => (None, "ray queries are turned off"),
            Self::Software if HAS_SOFTWARE => (Software, "software was asked for"),
            Self::Auto if HAS_SOFTWARE && !has => (Software, "the device has no ray queries of its own"),
            Self::Auto if HAS_SOFTWARE && is_cpu => {
                (Software, "the device is a CPU, on which the library's own traversal is faster")
            }
            Self::Auto if has => (Hardware, "the device has ray queries"),
            Self::Auto | Self::Software => (
                None,
                "the device has no ray queries of its own, and lvk lacks its feature `software-ray-query`",
            ),
            Self::Hardware | Self::HardwareIfPresent if has => (Hardware, "hardware was asked for"),
            Self::Hardware | Self::HardwareIfPresent => (None, "the device has no ray queries of its own"),
        };
        RayQueryChoice { path, reason }
    }
}

#[cfg(test)]
mod tests {
    use super::RayQueryPath::*;
    use super::*;

    #[cfg(not(feature = "software-ray-query"))]
    #[test]
    fn without_the_feature_only_hardware_is_chosen() {
        let Err(Error::Unsupported { why, .. }) = RayQueryRequest::Software.check() else { panic!() };
        assert!(why.contains("feature `software-ray-query`"));
        let devices = [(false, false), (false, true), (true, false), (true, true)];
        let found = devices.map(|(has, is_cpu)| RayQueryRequest::Auto.choose(has, is_cpu).path);
        assert_eq!(found, [None, None, Hardware, Hardware]);
    }

    #[cfg(feature = "software-ray-query")]
    #[test]
    fn every_request_has_its_path() {
        for (request, paths) in [
            (RayQueryRequest::Auto, [Software, Software, Hardware, Software]),
            (RayQueryRequest::Hardware, [None, None, Hardware, Hardware]),
            (RayQueryRequest::HardwareIfPresent, [None, None, Hardware, Hardware]),
            (RayQueryRequest::Software, [Software; 4]),
            (RayQueryRequest::Off, [None; 4]),
        ] {
            let devices = [(false, false), (false, true), (true, false), (true, true)];
            let found = devices.map(|(has, is_cpu)| request.choose(has, is_cpu).path);
            assert_eq!(found, paths, "{request:?}");
        }
    }
}
