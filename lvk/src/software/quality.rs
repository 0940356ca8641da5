//! How much work a build on the CPU puts into a tree.

use obvhs::BvhBuildParams;

use crate::accel::flags::BuildFlags;

/// What the flags of a build ask of the CPU.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Quality {
    /// The build is as fast as possible.
    pub(crate) fast_build: bool,
    /// Leaves name shared vertices.
    pub(crate) low_memory: bool,
    /// The structure may be refitted.
    pub(crate) refit: bool,
}

impl Quality {
    pub(crate) fn of(flags: BuildFlags) -> Self {
        Self {
            fast_build: flags.contains(BuildFlags::FAST_BUILD),
            low_memory: flags.contains(BuildFlags::LOW_MEMORY),
            refit: flags.contains(BuildFlags::ALLOW_UPDATE),
        }
    }

    /// Never with split primitives: each is in one leaf, so that it is a candidate once.
    pub(super) fn params(self) -> BvhBuildParams {
        let params =
            if self.fast_build { BvhBuildParams::very_fast_build() } else { BvhBuildParams::medium_build() };
        BvhBuildParams { pre_split: false, max_prims_per_leaf: 3, ..params }
    }
}
