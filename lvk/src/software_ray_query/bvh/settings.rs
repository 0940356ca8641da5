//! Settings of a build on the CPU.

use crate::accel::flags::BuildFlags;

/// Settings of a build on the CPU, from the build flags. The GPU makes fast builds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct BvhSettings {
    /// Leaves have indices of shared vertices, if that is smaller than copies.
    pub(crate) low_memory: bool,
    /// The BLAS may be refitted.
    pub(crate) refit: bool,
}

impl BvhSettings {
    pub(crate) fn from_flags(flags: BuildFlags) -> Self {
        Self {
            low_memory: flags.contains(BuildFlags::LOW_MEMORY),
            refit: flags.contains(BuildFlags::ALLOW_UPDATE),
        }
    }

    /// True if leaves may share a vertex only if the caller does: a refit may move each vertex independently.
    pub(crate) fn keeps_given_vertices(self) -> bool {
        self.low_memory && self.refit
    }
}
