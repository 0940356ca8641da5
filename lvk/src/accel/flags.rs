//! Parameters of a build: flags and mode, and the sizes it needs.

use ash::vk;
use bitflags::bitflags;

use crate::error::{Error, Result};
use crate::gpu::Gpu;

bitflags! {
    /// Build preferences, and the operations that an acceleration structure allows later.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
    pub struct BuildFlags: u32 {
        /// Prefers fast ray traversal over a fast build.
        const FAST_TRACE = 1;
        /// Prefers a fast build; for acceleration structures that are built every frame.
        const FAST_BUILD = 1 << 1;
        /// Allows refits after the inputs changed.
        const ALLOW_UPDATE = 1 << 2;
        /// Prefers little memory.
        const LOW_MEMORY = 1 << 3;
        /// Allows compaction by [`Context::compact`](crate::Context::compact) once the BLAS is built. Not for a TLAS.
        const ALLOW_COMPACTION = 1 << 4;
        /// Allows hit shaders and ray queries to fetch the vertices of the triangle hit
        /// (`VK_KHR_ray_tracing_position_fetch`). Not for a TLAS.
        const POSITION_FETCH = 1 << 5;
    }
}

impl Default for BuildFlags {
    fn default() -> Self {
        Self::FAST_TRACE
    }
}

impl BuildFlags {
    /// Flags that only a BLAS can have.
    const BLAS_ONLY: Self = Self::ALLOW_COMPACTION.union(Self::POSITION_FETCH);

    pub(crate) fn raw(self) -> vk::BuildAccelerationStructureFlagsKHR {
        use vk::BuildAccelerationStructureFlagsKHR as Raw;
        let pairs = [
            (Self::FAST_TRACE, Raw::PREFER_FAST_TRACE),
            (Self::FAST_BUILD, Raw::PREFER_FAST_BUILD),
            (Self::ALLOW_UPDATE, Raw::ALLOW_UPDATE),
            (Self::LOW_MEMORY, Raw::LOW_MEMORY),
            (Self::ALLOW_COMPACTION, Raw::ALLOW_COMPACTION),
            (Self::POSITION_FETCH, Raw::ALLOW_DATA_ACCESS),
        ];
        pairs.iter().filter(|(bit, _)| self.contains(*bit)).fold(Raw::empty(), |all, (_, raw)| all | *raw)
    }

    /// Fails if two flags contradict each other or the device lacks a required feature.
    pub(crate) fn check_blas(self, gpu: &Gpu, name: &str) -> Result<()> {
        self.check(name)?;
        if self.contains(Self::POSITION_FETCH) && !gpu.caps.position_fetch {
            return Err(gpu.unsupported(&format!("POSITION_FETCH, which '{name}' has in its flags")));
        }
        Ok(())
    }

    /// As [`check_blas`](Self::check_blas), for a TLAS.
    pub(crate) fn check_tlas(self, name: &str) -> Result<()> {
        if self.intersects(Self::BLAS_ONLY) {
            let message = "ALLOW_COMPACTION and POSITION_FETCH are for bottom-level structures";
            return Err(Error::usage(name, message));
        }
        self.check(name)
    }

    fn check(self, name: &str) -> Result<()> {
        if self.contains(Self::FAST_TRACE | Self::FAST_BUILD) {
            return Err(Error::usage(name, "choose either FAST_TRACE or FAST_BUILD"));
        }
        Ok(())
    }
}

/// Bytes that an acceleration structure and its builds need.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct AccelStructSizes {
    /// Bytes of the acceleration structure itself.
    pub structure_bytes: u64,
    /// Bytes of scratch memory of a build.
    pub build_scratch_bytes: u64,
    /// Bytes of scratch memory of a refit; 0 without [`BuildFlags::ALLOW_UPDATE`].
    pub update_scratch_bytes: u64,
}

impl AccelStructSizes {
    /// Scratch bytes of a build or a refit, whichever needs more.
    pub(crate) fn scratch_bytes(&self) -> u64 {
        self.build_scratch_bytes.max(self.update_scratch_bytes)
    }

    /// Combines the sizes of two acceleration structures: the sum of their bytes and the larger scratch sizes.
    pub(crate) fn max_with(self, other: Self) -> Self {
        Self {
            structure_bytes: self.structure_bytes.saturating_add(other.structure_bytes),
            build_scratch_bytes: self.build_scratch_bytes.max(other.build_scratch_bytes),
            update_scratch_bytes: self.update_scratch_bytes.max(other.update_scratch_bytes),
        }
    }
}

/// Rebuild or refit of an acceleration structure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum BuildMode {
    /// A new build: best quality; the number of instances may change.
    #[default]
    Rebuild,
    /// Updates the bounds of the present BVH. Needs [`BuildFlags::ALLOW_UPDATE`] and unchanged counts.
    Refit,
    /// Refits if allowed. Rebuilds without [`BuildFlags::ALLOW_UPDATE`], after a change of the number of instances,
    /// and after `max_refits` submitted refits in a row, which degrade the BVH. 16 to 64 suit most animations. A BLAS
    /// that was compacted and has no memory for a rebuild is always refitted.
    Auto {
        /// Maximum number of refits between two rebuilds.
        max_refits: u32,
    },
}

impl BuildMode {
    /// True if the build is a refit. `possible`: a refit is allowed. `refits`: the number since the last rebuild.
    pub(crate) fn refits(self, possible: bool, refits: u32) -> bool {
        match self {
            Self::Rebuild => false,
            Self::Refit => true,
            Self::Auto { max_refits } => possible && refits < max_refits,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn auto_rebuilds_where_a_refit_is_impossible_or_the_tree_worn_out() {
        let auto = BuildMode::Auto { max_refits: 2 };
        let mut refits = 0;
        let mut sequence = Vec::new();
        for _ in 0..7 {
            let refit = auto.refits(true, refits);
            refits = if refit { refits + 1 } else { 0 };
            sequence.push(refit);
        }
        assert_eq!(sequence, [true, true, false, true, true, false, true]);
        assert!(!auto.refits(false, 0));
        assert!(!BuildMode::Auto { max_refits: 0 }.refits(true, 0));
        assert!(BuildMode::Refit.refits(true, 99) && !BuildMode::Rebuild.refits(true, 0));
    }
}
