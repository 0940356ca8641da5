//! An acceleration structure of either level, with its name, flags, sizes and build state.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use super::blas::Blas;
use super::blas_refs::BlasRef;
use super::flags::{AccelStructSizes, BuildFlags};
use super::tlas::Tlas;
use crate::barrier::ResourceId;
use crate::error::{Error, Result};
use crate::handle::AccelStructHandle;

/// An acceleration structure of either level.
pub(crate) struct AccelStruct {
    /// The resource that barriers track: one, even if a BLAS has several parts.
    pub(crate) id: ResourceId,
    pub(crate) name: String,
    pub(crate) flags: BuildFlags,
    /// Sizes that the first build needs.
    pub(crate) sizes: AccelStructSizes,
    pub(crate) kind: AccelKind,
    /// Timeline value of the submission with the first build; 0 before it is submitted.
    built_by: AtomicU64,
}

/// Data of a BLAS or of a TLAS.
#[expect(clippy::large_enum_variant, reason = "an update of a TLAS reads it without one more pointer")]
pub(crate) enum AccelKind {
    /// A bottom-level acceleration structure.
    Blas(Arc<Blas>),
    /// A top-level acceleration structure.
    Tlas(Tlas),
}

impl AccelStruct {
    pub(crate) fn new(name: &str, flags: BuildFlags, sizes: AccelStructSizes, kind: AccelKind) -> Self {
        let built_by = AtomicU64::new(0);
        Self { id: ResourceId::next(), name: name.to_owned(), flags, sizes, kind, built_by }
    }

    /// Returns the BLAS. Fails if the handle names a TLAS.
    pub(crate) fn blas(&self) -> Result<&Arc<Blas>> {
        match &self.kind {
            AccelKind::Blas(blas) => Ok(blas),
            AccelKind::Tlas(_) => {
                Err(Error::usage(&self.name, "a bottom-level structure is needed, this is a top-level one"))
            }
        }
    }

    /// Returns a reference to the BLAS that `handle` names. Fails if it names a TLAS.
    pub(crate) fn blas_ref(&self, handle: AccelStructHandle) -> Result<BlasRef> {
        Ok(BlasRef::new(handle, self.id, self.flags, Arc::clone(self.blas()?)))
    }

    /// Returns the TLAS. Fails if the handle names a BLAS.
    #[inline]
    pub(crate) fn tlas(&self) -> Result<&Tlas> {
        match &self.kind {
            AccelKind::Tlas(tlas) => Ok(tlas),
            AccelKind::Blas(_) => {
                Err(Error::usage(&self.name, "a top-level structure is needed, this is a bottom-level one"))
            }
        }
    }

    /// True if the acceleration structure may be refitted.
    #[inline]
    pub(crate) fn allows_refit(&self) -> bool {
        self.flags.contains(BuildFlags::ALLOW_UPDATE)
    }

    /// Fails unless the acceleration structure may be refitted.
    #[inline]
    pub(crate) fn check_refit(&self) -> Result<()> {
        if self.allows_refit() {
            return Ok(());
        }
        let message = "a refit needs BuildFlags::ALLOW_UPDATE when the structure is created";
        Err(Error::usage(&self.name, message))
    }

    /// Records the timeline value of the first submission with a build. Later calls change nothing.
    #[inline]
    pub(crate) fn mark_used_by_submission(&self, value: u64) {
        if self.built_by.load(Ordering::Relaxed) == 0 {
            let _ = self.built_by.compare_exchange(0, value, Ordering::Relaxed, Ordering::Relaxed);
        }
    }

    /// Timeline value of the first submission with a build; `None` before that submission.
    pub(crate) fn last_build_value(&self) -> Option<u64> {
        Some(self.built_by.load(Ordering::Relaxed)).filter(|value| *value > 0)
    }
}
