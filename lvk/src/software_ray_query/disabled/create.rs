//! The creation functions for a build without the feature `software-ray-query`: no BLAS or TLAS has a software BVH.

use std::convert::Infallible;
use std::sync::Arc;

use crate::accel::AccelStruct;
use crate::accel::blas::Blas;
use crate::accel::blas_file::BlasFile;
use crate::accel::desc::BlasDesc;
use crate::context::Context;
use crate::context::holder::Holder;
use crate::device_state::DeviceState;
use crate::error::Result;
use crate::handle::AccelStructHandle;
use crate::software_ray_query::blas::{SoftwareBlas, missing};
use crate::software_ray_query::tlas::SoftwareTlas;

impl Context {
    pub(crate) fn software_blobs(&self, descs: &[BlasDesc<'_>]) -> Result<Vec<Option<Infallible>>> {
        Ok(descs.iter().map(|_| None).collect())
    }

    pub(crate) fn software_blas(
        &self,
        _: &BlasDesc<'_>,
        _: Option<&Infallible>,
    ) -> Result<Option<SoftwareBlas>> {
        Ok(None)
    }

    pub(crate) fn upload_software_blob(&self, _: &Arc<AccelStruct>, blob: &Infallible) -> Result<()> {
        match *blob {}
    }

    pub(crate) fn read_software_bytes(&self, _: &Blas) -> Result<Vec<u8>> {
        Ok(Vec::new())
    }

    pub(crate) fn load_software_blas(
        &self,
        desc: &BlasDesc<'_>,
        _: &BlasFile,
    ) -> Result<Holder<AccelStructHandle>> {
        Err(missing(desc.debug_name))
    }
}

/// Returns no software TLAS.
pub(crate) fn software_tlas(_: &DeviceState, _: &str, _: u32) -> Result<Option<SoftwareTlas>> {
    Ok(None)
}
