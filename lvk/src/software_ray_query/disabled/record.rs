//! The recording functions for a build without the feature `software-ray-query`: nothing is recorded.

use std::convert::Infallible;
use std::sync::Arc;

use crate::accel::AccelStruct;
use crate::accel::blas_refs::BlasRefSet;
use crate::accel::instance::{DeviceInstances, TlasInstance};
use crate::command::CommandBuffer;
use crate::error::Result;
use crate::software_ray_query::blas::SoftwareBlas;
use crate::software_ray_query::tlas::SoftwareTlas;

/// Builds to record: none.
pub(crate) struct SoftwareBuilds;

impl CommandBuffer {
    pub(crate) fn plan_first_software_builds(&self, _: &[Arc<AccelStruct>]) -> Result<SoftwareBuilds> {
        Ok(SoftwareBuilds)
    }

    pub(crate) fn plan_software_builds(&self, _: &[Arc<AccelStruct>], _: &[bool]) -> Result<SoftwareBuilds> {
        Ok(SoftwareBuilds)
    }

    pub(crate) fn record_software_builds(&mut self, _: SoftwareBuilds, _: bool) -> Result<()> {
        Ok(())
    }

    pub(crate) fn build_software_blas(&mut self, _: &Arc<AccelStruct>) -> Result<()> {
        Ok(())
    }

    pub(crate) fn moved_storage<'a>(
        &self,
        _: &AccelStruct,
        software: &'a SoftwareBlas,
    ) -> Option<&'a Infallible> {
        match *software {}
    }

    pub(crate) fn build_software_tlas(
        &mut self,
        _: &AccelStruct,
        software: &SoftwareTlas,
        _: &[TlasInstance],
    ) -> Result<()> {
        match *software {}
    }

    pub(crate) fn build_software_tlas_from_buffer(
        &mut self,
        _: &AccelStruct,
        software: &SoftwareTlas,
        _: &DeviceInstances<'_>,
        _: &BlasRefSet,
    ) -> Result<()> {
        match *software {}
    }
}

/// Succeeds, since no build moves a BVH.
pub(crate) fn check_unmoved(_: &AccelStruct) -> Result<()> {
    Ok(())
}
