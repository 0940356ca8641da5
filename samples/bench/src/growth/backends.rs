//! The implementations of ray tracing that are measured: the driver's and the library's.

use lvk::{Context, RayQueryRequest, RayTracingPipelineRequest};

use crate::error::BenchError;
use crate::measure::Stopwatch;
use crate::setup::{Setup, ray_paths};
use crate::tracer::MeshTracer;

/// One implementation with a context of its own.
pub(super) struct Backend {
    /// `driver` or `lvk`.
    pub(super) name: &'static str,
    pub(super) ctx: Context,
    pub(super) tracer: MeshTracer,
    pub(super) stopwatch: Stopwatch,
}

/// Returns the library's implementation and, if the device has one, the driver's.
pub(super) fn open(setup: &Setup) -> Result<Vec<Backend>, BenchError> {
    use RayTracingPipelineRequest::{HardwareIfPresent, Off};
    let driver = setup.open_tracing(HardwareIfPresent, RayQueryRequest::HardwareIfPresent, None)?;
    let own = setup.open_tracing(Off, RayQueryRequest::Software, None)?;
    let caps = driver.capabilities();
    let has_driver = caps.ray_tracing_pipeline || caps.ray_query;
    let contexts = [Some(("driver", driver)).filter(|_| has_driver), Some(("lvk", own))];
    contexts.into_iter().flatten().map(|(name, ctx)| Backend::new(name, ctx)).collect()
}

impl Backend {
    fn new(name: &'static str, ctx: Context) -> Result<Self, BenchError> {
        let paths = ray_paths(&ctx)?.0;
        // Ray queries where there are some: all implementations have them but those of some GPUs.
        let path = paths[paths.len() - 1];
        Ok(Self { name, tracer: MeshTracer::new(&ctx, path)?, stopwatch: Stopwatch::new(&ctx)?, ctx })
    }
}
