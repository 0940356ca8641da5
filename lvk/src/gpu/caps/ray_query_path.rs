//! Who walks the tree of a ray query: the device, or the library.

/// Who is to walk the trees of ray queries.
///
/// Software needs Vulkan 1.3 and nothing else, so it works on every device that a context can be made on. Either way
/// handles, shaders (`#include <lvk/ray_query.glsl>`) and answers are the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum RayQueryRequest {
    /// Hardware where it is real; software where there is none, or where the device is a CPU, whose own queries are no
    /// hardware and slower.
    #[default]
    Auto,
    /// Only devices with `VK_KHR_ray_query` are considered.
    Hardware,
    /// `VK_KHR_ray_query` where present; without it queries do not work. Spares devices that trace by pipelines alone the
    /// structures of software queries.
    HardwareIfPresent,
    /// The library itself, even where there is hardware.
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

impl RayQueryRequest {
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
            Self::Software => (Software, "software was asked for"),
            Self::Auto if !has => (Software, "the device has no ray queries of its own"),
            Self::Auto if is_cpu => {
                (Software, "the device is a CPU, on which the library's own traversal is faster")
            }
            Self::Auto => (Hardware, "the device has ray queries"),
            Self::Hardware | Self::HardwareIfPresent if has => (Hardware, "hardware was asked for"),
            Self::Hardware | Self::HardwareIfPresent => (None, "the device has no ray queries of its own"),
        };
        RayQueryChoice { path, reason }
    }
}

#[cfg(test)]
mod tests {
    use super::RayQueryPath::{Hardware, None, Software};
    use super::*;

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
