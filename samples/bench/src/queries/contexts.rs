//! Three contexts of one device: driver and software together, and each alone.

use lvk::{Context, RayQueryPath, RayQueryRequest, RayTracingPipelineRequest};

use crate::error::BenchError;
use crate::setup::Setup;

/// Three contexts of one device.
pub(super) struct Contexts {
    /// The driver's ray tracing pipelines, if any, and software ray queries.
    pub(super) both: Context,
    /// Software ray queries alone: acceleration structures have no part of the driver.
    pub(super) software: Context,
    /// The driver's ray tracing alone.
    driver: Context,
}

impl Contexts {
    pub(super) fn open(setup: &Setup) -> Result<Self, BenchError> {
        use RayQueryRequest::{HardwareIfPresent, Software};
        use RayTracingPipelineRequest::{HardwareIfPresent as PipelineIfPresent, Off};
        Ok(Self {
            both: setup.open_tracing(PipelineIfPresent, Software, None)?,
            software: setup.open_tracing(Off, Software, None)?,
            driver: setup.open_tracing(PipelineIfPresent, HardwareIfPresent, None)?,
        })
    }

    /// Returns the driver's context if it supports ray tracing.
    pub(super) fn driver(&self) -> Option<&Context> {
        let caps = self.driver.capabilities();
        (caps.ray_tracing_pipeline || caps.ray_query).then_some(&self.driver)
    }

    /// Returns the driver's context if it has ray queries.
    pub(super) fn driver_with_queries(&self) -> Option<&Context> {
        (self.driver.capabilities().ray_query_path == RayQueryPath::Hardware).then_some(&self.driver)
    }

    /// Returns notes on what is not measured because the device lacks it.
    pub(super) fn unmeasured(&self) -> Vec<String> {
        let caps = self.driver.capabilities();
        let device = &caps.device_name;
        let lacks = [("ray tracing pipelines", caps.ray_tracing_pipeline), ("ray queries", caps.ray_query)];
        let lacks = lacks.into_iter().filter(|(_, has)| !has);
        lacks.map(|(what, _)| format!("the driver's {what} not measured: {device} has none")).collect()
    }
}
