//! Who walks the tree of a ray query: the device, or the library.

use crate::error::{Error, Result};

/// Who is to walk the trees of ray queries.
///
/// Software needs Vulkan 1.3 and nothing else, so it works on every device that a context can be made on. Either way
/// handles, shaders (`#include <lvk/ray_query.glsl>`) and answers are the same.
///
/// Software needs the feature `software-ray-query` of the crate, which is on by default.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum RayQueryRequest {
    /// Hardware where it is real; software where there is none, or where the device is a CPU, whose own queries are no
    /// hardware and slower. Without the feature `software-ray-query`, the same as
    /// [`HardwareIfPresent`](Self::HardwareIfPresent).
    #[default]
    Auto,
    /// Only devices with `VK_KHR_ray_query` are considered.
    Hardware,
    /// `VK_KHR_ray_query` where present; without it queries do not work. Spares devices that trace by pipelines alone the
    /// structures of software queries.
    HardwareIfPresent,
    /// The library itself, even where there is hardware. [`Context::new`](crate::Context::new) fails with
    /// [`Unsupported`](crate::Error::Unsupported) without the feature `software-ray-query`.
    Software,
    /// None, even where present.
    Off,
}

/// Who walks the trees of ray queries.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum RayQueryPath {
    /// Nobody: there are no ray queries.
    #[default]
    None,
    /// The device (`VK_KHR_ray_query`).
    Hardware,
    /// The library, in the shader, over trees of its own.
    Software,
}

/// A path with the reason it was taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct RayQueryChoice {
    pub(crate) path: RayQueryPath,
    pub(crate) reason: &'static str,
}

/// Whether the library has its own traversal.
const HAS_SOFTWARE: bool = cfg!(feature = "software-ray-query");

impl RayQueryRequest {
    /// Fails for the software path in a build without it.
    pub(crate) fn check(self) -> Result<()> {
        if self == Self::Software && !HAS_SOFTWARE {
            let why =
                "lvk was built without its feature `software-ray-query`; enable it, or ask for another path";
            return Err(Error::unsupported("RayQueryRequest::Software", why));
        }
        Ok(())
    }

    /// Whether only devices that have it will do.
    pub(crate) fn requires_hardware(self) -> bool {
        self == Self::Hardware
    }

    /// Whether a device that has it is better than one that has not.
    pub(crate) fn prefers_hardware(self) -> bool {
        matches!(self, Self::Auto | Self::Hardware | Self::HardwareIfPresent)
    }

    /// Who walks on a device that `has` hardware queries or not, and is a CPU or not.
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
