//! Selection of the implementation of ray tracing pipelines: the device, or compute shaders that the library makes of them.

use super::ray_query_path::{HAS_SOFTWARE, RayQueryPath};
use crate::error::{Error, Result};

/// Requested implementation of ray tracing pipelines.
///
/// A lowered pipeline is a compute shader that the library makes of all shaders of the pipeline. It needs no
/// `VK_KHR_ray_tracing_pipeline`. Descriptions, shaders, records and results are the same on every path.
///
/// The traversal in software needs the crate feature `software-ray-query`, which is enabled by default.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum RayTracingPipelineRequest {
    /// The device's own pipelines where it has them. Otherwise lowered: onto the library's traversal if ray queries use
    /// it too, else onto the device's ray queries, else onto the library's traversal. On CPUs, and
    /// on [GPUs where it was measured](crate::Capabilities::prefers_lowered_pipelines), pipelines are lowered onto the
    /// library's traversal, which is faster there, unless ray queries of shaders use the device's structures, or a
    /// required feature is one of the device's pipelines. Without the feature `software-ray-query` the library has no
    /// traversal.
    #[default]
    Auto,
    /// Only devices with `VK_KHR_ray_tracing_pipeline` are considered.
    Hardware,
    /// `VK_KHR_ray_tracing_pipeline` if the device has it; otherwise there are no ray tracing pipelines.
    HardwareIfPresent,
    /// Lowered onto the device's ray queries, even if it has pipelines of its own. Only devices with `VK_KHR_ray_query`
    /// are considered.
    Query,
    /// Lowered onto the library's own traversal, even if the device has pipelines or ray queries. Without the feature
    /// `software-ray-query`, [`Context::new`](crate::Context::new) fails with
    /// [`Unsupported`](crate::Error::Unsupported).
    Software,
    /// No ray tracing pipelines, even if the device has them.
    Off,
}

/// Implementation of ray tracing pipelines in use.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum RayTracingPipelinePath {
    /// No ray tracing pipelines.
    #[default]
    None,
    /// Pipelines of the device (`VK_KHR_ray_tracing_pipeline`).
    Hardware,
    /// Compute shaders with ray queries of the device (`VK_KHR_ray_query`).
    Query,
    /// Compute shaders with the library's own traversal, over the library's own BVHs.
    Software,
}

impl RayTracingPipelinePath {
    /// Returns true if pipelines are lowered to compute shaders.
    pub fn is_lowered(self) -> bool {
        matches!(self, Self::Query | Self::Software)
    }
}

/// A path of ray tracing pipelines, with the reason for its selection.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct RayTracingPipelineChoice {
    pub(crate) path: RayTracingPipelinePath,
    pub(crate) reason: &'static str,
}

/// Properties of a device that the selection depends on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct PathInputs {
    /// The device has ray tracing pipelines.
    pub(crate) has_pipelines: bool,
    /// The device has ray queries.
    pub(crate) has_queries: bool,
    /// The path that ray queries of shaders take.
    pub(crate) query_path: RayQueryPath,
    /// The library's traversal is known to be faster than the driver's: on CPUs, and on GPUs where that was measured.
    pub(crate) prefers_lowered: bool,
    /// The application requires features of ray tracing by the device, which lowered pipelines do not have.
    pub(crate) needs_device: bool,
}

impl RayTracingPipelineRequest {
    /// Returns an error for the software path in a build without it.
    pub(crate) fn check(self) -> Result<()> {
        if self == Self::Software && !HAS_SOFTWARE {
            let why =
                "lvk was built without its feature `software-ray-query`; enable it, or ask for another path";
            return Err(Error::unsupported("RayTracingPipelineRequest::Software", why));
        }
        Ok(())
    }

    /// Returns true if only devices with pipelines are considered.
    pub(crate) fn requires_pipelines(self) -> bool {
        self == Self::Hardware
    }

    /// Returns true if only devices with ray queries are considered.
    pub(crate) fn requires_queries(self) -> bool {
        self == Self::Query
    }

    /// Returns true if devices with pipelines are preferred.
    pub(crate) fn prefers_hardware(self) -> bool {
        matches!(self, Self::Auto | Self::Hardware | Self::HardwareIfPresent)
    }

    /// Selects the implementation for a device.
    pub(crate) fn choose(self, device: PathInputs) -> RayTracingPipelineChoice {
        use RayTracingPipelinePath::{Hardware, None, Query, Software};
        const LACKS_BOTH: &str = "the device has neither ray tracing pipelines nor ray queries of its own";
        let PathInputs { has_pipelines, has_queries, .. } = device;
        let (path, reason) = match self {
            Self::Off => (None, "ray tracing pipelines are turned off"),
            Self::Software if HAS_SOFTWARE => (Software, "software was asked for"),
            Self::Query if has_queries => (Query, "ray queries were asked for"),
            Self::Query => (None, "the device has no ray queries of its own"),
            Self::Hardware | Self::HardwareIfPresent if has_pipelines => (Hardware, "hardware was asked for"),
            Self::Hardware | Self::HardwareIfPresent => {
                (None, "the device has no ray tracing pipelines of its own")
            }
            Self::Auto if has_pipelines && device.needs_device => {
                (Hardware, "a required feature is that of ray tracing by the device")
            }
            Self::Auto if has_pipelines && is_faster_lowered(device) => {
                (Software, "on this device the library's own traversal is faster than its pipelines")
            }
            Self::Auto if has_pipelines => (Hardware, "the device has ray tracing pipelines"),
            Self::Auto if HAS_SOFTWARE && device.query_path == RayQueryPath::Software => (
                Software,
                "the device has no ray tracing pipelines of its own, and ray queries are in software as well",
            ),
            Self::Auto if has_queries && is_faster_lowered(device) => {
                (Software, "on this device the library's own traversal is faster than its ray queries")
            }
            Self::Auto if has_queries => {
                (Query, "the device has no ray tracing pipelines of its own, but ray queries")
            }
            Self::Auto if HAS_SOFTWARE => (Software, LACKS_BOTH),
            Self::Auto | Self::Software => (
                None,
                "the device has neither ray tracing pipelines nor ray queries of its own, and lvk lacks its feature `software-ray-query`",
            ),
        };
        RayTracingPipelineChoice { path, reason }
    }
}

/// Returns true if pipelines in software are known to be faster than the device's own, and need no structures beside
/// those of ray queries.
fn is_faster_lowered(device: PathInputs) -> bool {
    HAS_SOFTWARE && device.prefers_lowered && device.query_path != RayQueryPath::Hardware
}

#[cfg(test)]
mod tests {
    use super::RayTracingPipelinePath::*;
    use super::*;

    /// Returns the paths of GPUs without ray tracing, with queries only, and with pipelines and queries.
    fn paths(request: RayTracingPipelineRequest, query_path: RayQueryPath) -> [RayTracingPipelinePath; 3] {
        paths_of(request, query_path, false)
    }

    fn paths_of(
        request: RayTracingPipelineRequest,
        query_path: RayQueryPath,
        prefers_lowered: bool,
    ) -> [RayTracingPipelinePath; 3] {
        [(false, false), (false, true), (true, true)].map(|(has_pipelines, has_queries)| {
            let device =
                PathInputs { has_pipelines, has_queries, query_path, prefers_lowered, needs_device: false };
            request.choose(device).path
        })
    }

    #[cfg(not(feature = "software-ray-query"))]
    #[test]
    fn without_the_feature_nothing_is_lowered_onto_software() {
        let Err(Error::Unsupported { why, .. }) = RayTracingPipelineRequest::Software.check() else {
            panic!()
        };
        assert!(why.contains("feature `software-ray-query`"));
        assert_eq!(paths(RayTracingPipelineRequest::Auto, RayQueryPath::None), [None, Query, Hardware]);
    }

    #[cfg(feature = "software-ray-query")]
    #[test]
    fn every_request_has_its_path() {
        for (request, expected) in [
            (RayTracingPipelineRequest::Auto, [Software, Query, Hardware]),
            (RayTracingPipelineRequest::Hardware, [None, None, Hardware]),
            (RayTracingPipelineRequest::HardwareIfPresent, [None, None, Hardware]),
            (RayTracingPipelineRequest::Query, [None, Query, Query]),
            (RayTracingPipelineRequest::Software, [Software; 3]),
            (RayTracingPipelineRequest::Off, [None; 3]),
        ] {
            assert_eq!(paths(request, RayQueryPath::Hardware), expected, "{request:?}");
        }
    }

    #[cfg(feature = "software-ray-query")]
    #[test]
    fn automatic_pipelines_share_the_structures_of_software_queries() {
        let found = paths(RayTracingPipelineRequest::Auto, RayQueryPath::Software);
        assert_eq!(found, [Software, Software, Hardware]);
    }

    #[cfg(feature = "software-ray-query")]
    #[test]
    fn devices_that_prefer_it_lower_unless_queries_use_their_structures() {
        use RayQueryPath as Queries;
        let of = |request, queries| paths_of(request, queries, true);
        for queries in [Queries::None, Queries::Software] {
            assert_eq!(of(RayTracingPipelineRequest::Auto, queries), [Software; 3]);
        }
        assert_eq!(of(RayTracingPipelineRequest::Auto, Queries::Hardware), [Software, Query, Hardware]);
        assert_eq!(of(RayTracingPipelineRequest::Hardware, Queries::Software), [None, None, Hardware]);
    }

    #[test]
    fn features_of_the_device_keep_its_pipelines() {
        let device = PathInputs {
            has_pipelines: true,
            has_queries: false,
            query_path: RayQueryPath::None,
            prefers_lowered: true,
            needs_device: true,
        };
        assert_eq!(RayTracingPipelineRequest::Auto.choose(device).path, Hardware);
        assert_eq!(RayTracingPipelineRequest::Off.choose(device).path, None);
    }

    #[test]
    fn only_two_paths_are_lowered() {
        let lowered = [None, Hardware, Query, Software].map(RayTracingPipelinePath::is_lowered);
        assert_eq!(lowered, [false, false, true, true]);
    }
}
