//! What a build is asked for: flags, mode, and the sizes that follow.

use ash::vk;
use bitflags::bitflags;

use crate::error::{Error, Result};
use crate::gpu::Gpu;

bitflags! {
    /// What a build is optimised for, and what may be done with the structure later.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
    pub struct BuildFlags: u32 {
        /// Rays are traced as fast as possible; the build may take longer.
        const FAST_TRACE = 1;
        /// The build is as fast as possible; for structures built every frame.
        const FAST_BUILD = 1 << 1;
        /// The structure may be refitted after its inputs moved.
        const ALLOW_UPDATE = 1 << 2;
        /// The structure takes little memory.
        const LOW_MEMORY = 1 << 3;
        /// The structure may be compacted by [`Context::compact`](crate::Context::compact) once it is built. Bottom
        /// level only.
        const ALLOW_COMPACTION = 1 << 4;
        /// Hit shaders and queries may fetch the corners of the triangle that was hit
        /// (`VK_KHR_ray_tracing_position_fetch`). Bottom level only.
        const POSITION_FETCH = 1 << 5;
    }
}

impl Default for BuildFlags {
    fn default() -> Self {
        Self::FAST_TRACE
    }
}

impl BuildFlags {
    /// Those that only a bottom-level structure can have.
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

    /// Fails where two flags contradict each other, or the device lacks one.
    pub(crate) fn check_blas(self, gpu: &Gpu, name: &str) -> Result<()> {
        self.check(name)?;
        if self.contains(Self::POSITION_FETCH) && !gpu.caps.position_fetch {
            return Err(gpu.unsupported(&format!("'{name}' with POSITION_FETCH: the fetch of positions")));
        }
        Ok(())
    }

    /// As [`check_blas`](Self::check_blas), for a top-level structure.
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

/// Bytes an acceleration structure takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct AccelStructSizes {
    /// Bytes of the structure itself.
    pub structure_bytes: u64,
    /// Bytes of scratch memory of a build.
    pub build_scratch_bytes: u64,
    /// Bytes of scratch memory of a refit; 0 without [`BuildFlags::ALLOW_UPDATE`].
    pub update_scratch_bytes: u64,
}

impl AccelStructSizes {
    /// Scratch bytes of the build that needs more.
    pub(crate) fn scratch_bytes(&self) -> u64 {
        self.build_scratch_bytes.max(self.update_scratch_bytes)
    }

    /// Of several structures that stand for one: their bytes together, and the scratch of the largest.
    pub(crate) fn max_with(self, other: Self) -> Self {
        Self {
            structure_bytes: self.structure_bytes.saturating_add(other.structure_bytes),
            build_scratch_bytes: self.build_scratch_bytes.max(other.build_scratch_bytes),
            update_scratch_bytes: self.update_scratch_bytes.max(other.update_scratch_bytes),
        }
    }
}

/// Whether a build starts anew or moves what is there.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum BuildMode {
    /// A whole new build: best quality, and the number of instances may change.
    #[default]
    Rebuild,
    /// Moves the boxes of the present tree. Needs [`BuildFlags::ALLOW_UPDATE`] and unchanged counts.
    Refit,
    /// Refits where that is allowed, and rebuilds where it is not (no [`BuildFlags::ALLOW_UPDATE`], another number of
    /// instances) or when this many submitted refits in a row have worn the tree out. 16 to 64 suit most animations. A
    /// bottom-level structure without room for a rebuild, since it was compacted, is refitted on.
    Auto {
        /// Most refits between two rebuilds.
        max_refits: u32,
    },
}

impl BuildMode {
    /// Whether to refit, where a refit is `possible` and so many were made since the last rebuild.
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
