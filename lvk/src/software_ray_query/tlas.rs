//! A TLAS for software traversal.

use std::sync::Arc;

use super::gpu_build::layout::GpuBuildPlan;
use super::storage::SoftwareAccelStorage;
use crate::accel::flags::AccelStructSizes;

/// The software half of a TLAS. Every update is a build.
pub(crate) struct SoftwareTlas {
    pub(crate) storage: Arc<SoftwareAccelStorage>,
    pub(crate) plan: GpuBuildPlan,
    /// Maximum records: more than instances, because re-braiding splits some of them.
    pub(crate) record_capacity: u32,
}

impl SoftwareTlas {
    /// Returns the address for the table of TLASes.
    pub(crate) fn address(&self) -> u64 {
        self.storage.address
    }

    /// Returns the bytes of memory.
    pub(crate) fn memory_bytes(&self) -> u64 {
        self.storage.memory_bytes()
    }

    /// Returns the sizes of the TLAS and of its builds.
    pub(crate) fn sizes(&self) -> AccelStructSizes {
        AccelStructSizes {
            structure_bytes: self.storage.memory_bytes(),
            build_scratch_bytes: self.plan.scratch_bytes,
            update_scratch_bytes: self.plan.scratch_bytes,
        }
    }
}
