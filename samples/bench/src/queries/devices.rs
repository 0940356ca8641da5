//! One device opened three times: for the driver and software together, and for each alone.

use lvk::{Context, FeatureRequest, RayQueryPath, RayQueryRequest};

use super::super::error::BenchError;
use super::super::setup::Setup;

/// One device opened three times.
pub(super) struct Devices {
    /// Pipelines by the driver, if it has them, and queries in software.
    pub(super) both: Context,
    /// Software alone, so that structures are its own and nothing else.
    pub(super) software: Context,
    /// The driver alone.
    driver: Context,
}

impl Devices {
    pub(super) fn open(setup: &Setup) -> Result<Self, BenchError> {
        use FeatureRequest::{Off, Optional};
        use RayQueryRequest::{HardwareIfPresent, Software};
        Ok(Self {
            both: setup.open_tracing(Optional, Software, None)?,
            software: setup.open_tracing(Off, Software, None)?,
            driver: setup.open_tracing(Optional, HardwareIfPresent, None)?,
        })
    }

    /// The driver alone, if it traces anything.
    pub(super) fn driver(&self) -> Option<&Context> {
        let caps = self.driver.capabilities();
        (caps.ray_tracing_pipeline || caps.ray_query).then_some(&self.driver)
    }

    /// The driver alone, if it has ray queries.
    pub(super) fn driver_with_queries(&self) -> Option<&Context> {
        (self.driver.capabilities().ray_query_path == RayQueryPath::Hardware).then_some(&self.driver)
    }

    /// What is not measured, as the device lacks it.
    pub(super) fn missing(&self) -> Vec<String> {
        let caps = self.driver.capabilities();
        let device = &caps.device_name;
        let lacks = [("ray tracing pipelines", caps.ray_tracing_pipeline), ("ray queries", caps.ray_query)];
        let lacks = lacks.into_iter().filter(|(_, has)| !has);
        lacks.map(|(what, _)| format!("the driver's {what} not measured: {device} has none")).collect()
    }
}
