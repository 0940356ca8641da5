//! Ray tracing paths in the report.

use lvk::{Capabilities, RayQueryPath};

use lvk_samples::hybrid::RayPath;

/// A ray tracing path: the Vulkan feature, and the implementation of ray queries.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TracePath {
    /// A ray tracing pipeline.
    Pipeline,
    /// The driver's ray queries in a compute shader.
    Query,
    /// The library's software ray queries in a compute shader.
    SoftwareQuery,
}

impl TracePath {
    /// Returns the path that `path` selects on a device with `capabilities`.
    #[must_use]
    pub fn new(path: RayPath, capabilities: &Capabilities) -> Self {
        match (path, capabilities.ray_query_path) {
            (RayPath::Pipeline, _) => Self::Pipeline,
            (RayPath::Query, RayQueryPath::Software) => Self::SoftwareQuery,
            (RayPath::Query, RayQueryPath::Hardware | RayQueryPath::None) => Self::Query,
        }
    }

    /// Returns the Vulkan feature of the path.
    #[must_use]
    pub fn ray_path(self) -> RayPath {
        match self {
            Self::Pipeline => RayPath::Pipeline,
            Self::Query | Self::SoftwareQuery => RayPath::Query,
        }
    }

    /// Returns the name for tables and plots.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Pipeline => "pipeline",
            Self::Query => "query",
            Self::SoftwareQuery => "software query",
        }
    }

    /// Returns the name for file names.
    #[must_use]
    pub fn file_name(self) -> &'static str {
        match self {
            Self::SoftwareQuery => "software_query",
            Self::Pipeline | Self::Query => self.name(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn queries_are_named_by_their_implementation() {
        use RayQueryPath::{Hardware, None, Software};
        let found = |path, ray_query_path| {
            TracePath::new(path, &Capabilities { ray_query_path, ..Capabilities::default() })
        };
        assert_eq!(found(RayPath::Query, Software).name(), "software query");
        assert_eq!([Hardware, None].map(|path| found(RayPath::Query, path).name()), ["query"; 2]);
        assert_eq!(
            [Hardware, Software, None].map(|path| found(RayPath::Pipeline, path).name()),
            ["pipeline"; 3]
        );
        for path in [TracePath::Pipeline, TracePath::Query, TracePath::SoftwareQuery] {
            assert_eq!(path.file_name(), path.name().replace(' ', "_"));
        }
    }
}
