//! Recorded builds of a command buffer, and their effects when it is submitted or dropped.

use std::sync::Arc;

use crate::accel::AccelStruct;
use crate::accel::accel_struct::AccelKind;
use crate::accel::blas::BlasStructures;
use crate::error::{Error, Result};

/// A recorded build. Until it is submitted, compaction must not replace the acceleration structures.
pub(crate) struct OpenBuild {
    pub(super) target: Arc<AccelStruct>,
    pub(super) refit: bool,
    pub(super) bvh_update: CpuBvhUpdate,
    submitted: bool,
}

/// Effect of a build on the BVH that the CPU built for software traversal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum CpuBvhUpdate {
    /// No effect: there is no such BVH, or a BVH of the GPU has replaced it.
    None,
    /// Refits it in place.
    Refit,
    /// Replaces it with a BVH that the GPU builds, which may lie elsewhere.
    Replace,
}

impl OpenBuild {
    /// Opens a build of a BLAS, and returns it with the acceleration structures that it keeps from being replaced.
    pub(super) fn for_blas(target: &Arc<AccelStruct>) -> Result<(Self, Arc<BlasStructures>)> {
        let body = target.blas()?.open_build();
        Ok((
            Self {
                target: Arc::clone(target),
                refit: false,
                bvh_update: CpuBvhUpdate::None,
                submitted: false,
            },
            body,
        ))
    }

    /// Opens a build of a TLAS, which compaction never replaces.
    pub(super) fn for_tlas(target: Arc<AccelStruct>) -> Self {
        Self { target, refit: false, bvh_update: CpuBvhUpdate::None, submitted: false }
    }

    /// Fails if a submission since the recording has moved the BVH that the build refits.
    pub(super) fn check_not_moved(&self) -> Result<()> {
        let software = self.target.blas().ok().and_then(|blas| blas.software.as_ref());
        if self.bvh_update == CpuBvhUpdate::Refit
            && software.is_some_and(|software| software.moved_storage().is_some())
        {
            let message =
                "a refit was recorded, but a submission since then has rebuilt the BLAS; record it anew";
            return Err(Error::usage(&self.target.name, message));
        }
        Ok(())
    }

    /// Marks the build as submitted with this timeline value.
    pub(crate) fn mark_submitted(mut self, value: u64) {
        self.target.mark_used_by_submission(value);
        self.submitted = true;
        if self.bvh_update == CpuBvhUpdate::Replace
            && let Some(software) = self.target.blas().ok().and_then(|blas| blas.software.as_ref())
        {
            software.set_moved_storage();
        }
    }
}

impl Drop for OpenBuild {
    fn drop(&mut self) {
        if let AccelKind::Blas(blas) = &self.target.kind {
            blas.close_build(self.submitted, self.refit);
        }
    }
}
