//! The names of this folder in a build without the feature `software-ray-query`: nothing is recorded.

use std::convert::Infallible;
use std::sync::Arc;

use super::CommandBuffer;
use crate::accel::AccelStruct;
use crate::accel::blas_refs::ShownSet;
use crate::accel::instance::{DeviceInstances, TlasInstance};
use crate::error::Result;
use crate::software_ray_query::blas::SoftwareBlas;
use crate::software_ray_query::tlas::SoftwareTlas;

/// Builds to record: none.
pub(super) struct SoftwareWork;

impl CommandBuffer {
    pub(super) fn plan_software_first(&self, _: &[Arc<AccelStruct>]) -> Result<SoftwareWork> {
        Ok(SoftwareWork)
    }

    pub(super) fn plan_software(&self, _: &[Arc<AccelStruct>], _: &[bool]) -> Result<SoftwareWork> {
        Ok(SoftwareWork)
    }

    pub(super) fn record_software(&mut self, _: SoftwareWork) -> Result<()> {
        Ok(())
    }

    pub(crate) fn build_software_of(&mut self, _: &Arc<AccelStruct>) -> Result<()> {
        Ok(())
    }

    pub(super) fn moved_tree<'a>(
        &self,
        _: &AccelStruct,
        software: &'a SoftwareBlas,
    ) -> Option<&'a Infallible> {
        match *software {}
    }

    pub(super) fn build_software_tlas(
        &mut self,
        _: &AccelStruct,
        software: &SoftwareTlas,
        _: &[TlasInstance],
    ) -> Result<()> {
        match *software {}
    }

    pub(super) fn build_software_tlas_from(
        &mut self,
        _: &AccelStruct,
        software: &SoftwareTlas,
        _: &DeviceInstances<'_>,
        _: &ShownSet,
    ) -> Result<()> {
        match *software {}
    }
}

/// Succeeds: no build moves a tree.
pub(super) fn check_placed(_: &AccelStruct) -> Result<()> {
    Ok(())
}
