//! A top-level structure of the library's own.

use std::sync::Arc;

use super::gpu_build::layout::GpuBuildPlan;
use super::storage::SoftwareAccelStorage;
use crate::accel::flags::AccelStructSizes;

/// What stands behind the handle of a top-level structure for software to trace. Every update is a build.
pub(crate) struct SoftwareTlas {
    pub(crate) storage: Arc<SoftwareAccelStorage>,
    pub(crate) plan: GpuBuildPlan,
    /// Records that the body has room for: more than instances, as some may be shown in parts.
    pub(crate) record_capacity: u32,
}

impl SoftwareTlas {
    /// The address that the table of top-level structures holds.
    pub(crate) fn address(&self) -> u64 {
        self.storage.address
    }

    /// Bytes of memory.
    pub(crate) fn memory_bytes(&self) -> u64 {
        self.storage.memory_bytes()
    }

    /// What it takes and its builds take.
    pub(crate) fn sizes(&self) -> AccelStructSizes {
        AccelStructSizes {
            structure_bytes: self.storage.memory_bytes(),
            build_scratch_bytes: self.plan.scratch_bytes,
            update_scratch_bytes: self.plan.scratch_bytes,
        }
    }
}
