//! Builds that a command buffer has recorded, and what becomes of them when it is submitted or dropped.

use std::sync::Arc;

use crate::accel::AccelStruct;
use crate::accel::accel_struct::AccelKind;
use crate::accel::blas::BlasStructures;
use crate::error::{Error, Result};

/// A build that is recorded; until it is submitted the body must not be replaced by a compacted one.
pub(crate) struct OpenBuild {
    pub(super) target: Arc<AccelStruct>,
    pub(super) refit: bool,
    pub(super) bvh_update: CpuBvhUpdate,
    submitted: bool,
}

/// What a build does to the tree that the CPU made of a structure for software to trace.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum CpuBvhUpdate {
    /// Nothing: there is none, or it was moved before.
    None,
    /// Refits it where it lies.
    Refit,
    /// Puts one of the GPU in its place, elsewhere.
    Replace,
}

impl OpenBuild {
    /// Keeps what stands for a bottom-level structure in place, and answers it.
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

    /// A top-level structure stays what it is.
    pub(super) fn for_tlas(target: Arc<AccelStruct>) -> Self {
        Self { target, refit: false, bvh_update: CpuBvhUpdate::None, submitted: false }
    }

    /// Fails if a submission since it was recorded has moved the tree that it refits.
    pub(super) fn check_not_moved(&self) -> Result<()> {
        let software = self.target.blas().ok().and_then(|blas| blas.software.as_ref());
        if self.bvh_update == CpuBvhUpdate::Refit
            && software.is_some_and(|software| software.moved_storage().is_some())
        {
            let message =
                "a refit was recorded, but a submission since then has rebuilt the structure; record it anew";
            return Err(Error::usage(&self.target.name, message));
        }
        Ok(())
    }

    /// It went to the GPU with this timeline value.
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
