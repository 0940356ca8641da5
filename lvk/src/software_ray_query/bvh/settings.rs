//! What the flags of a build ask of the CPU.

use crate::accel::flags::BuildFlags;

/// What the flags of a build ask of the CPU. Fast builds are the GPU's.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct BvhSettings {
    /// Leaves name shared vertices, where that takes less than copies.
    pub(crate) low_memory: bool,
    /// The structure may be refitted.
    pub(crate) refit: bool,
}

impl BvhSettings {
    pub(crate) fn from_flags(flags: BuildFlags) -> Self {
        Self {
            low_memory: flags.contains(BuildFlags::LOW_MEMORY),
            refit: flags.contains(BuildFlags::ALLOW_UPDATE),
        }
    }

    /// Whether leaves may only share what the caller does: a refit may move each of its vertices elsewhere.
    pub(crate) fn keeps_given_vertices(self) -> bool {
        self.low_memory && self.refit
    }
}
