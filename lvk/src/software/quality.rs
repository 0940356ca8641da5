//! What the flags of a build ask of the CPU.

use crate::accel::flags::BuildFlags;

/// What the flags of a build ask of the CPU. Fast builds are the GPU's.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Quality {
    /// Leaves name shared vertices.
    pub(crate) low_memory: bool,
    /// The structure may be refitted.
    pub(crate) refit: bool,
}

impl Quality {
    pub(crate) fn of(flags: BuildFlags) -> Self {
        Self {
            low_memory: flags.contains(BuildFlags::LOW_MEMORY),
            refit: flags.contains(BuildFlags::ALLOW_UPDATE),
        }
    }
}
