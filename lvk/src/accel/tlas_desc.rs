//! Description of a TLAS.

use super::flags::BuildFlags;
use super::instance::TlasInstance;

/// Describes a top-level acceleration structure (TLAS).
#[derive(Debug, Clone, Copy)]
pub struct TlasDesc<'a> {
    /// The first instances; may be empty. Default: empty.
    pub instances: &'a [TlasInstance],
    /// Maximum number of instances in later updates. A smaller number than that of the first instances is raised to it.
    /// Default: 0.
    pub capacity: u32,
    /// Maximum average number of parts of the referenced meshes ([`AccelStructInfo::parts`](crate::AccelStructInfo))
    /// over all instances. 1 is enough unless the limits of phones or of [`DeviceProfile`](crate::DeviceProfile)s
    /// split meshes. The average of the first instances is used if it is larger. Default: 1.
    pub parts_per_instance: u32,
    /// Build preferences, and the operations allowed later. Default: [`BuildFlags::FAST_TRACE`].
    pub flags: BuildFlags,
    /// Name in error messages, validation messages and debuggers. Default: `"tlas"`.
    pub debug_name: &'a str,
}

impl Default for TlasDesc<'_> {
    fn default() -> Self {
        let flags = BuildFlags::default();
        Self { instances: &[], capacity: 0, parts_per_instance: 1, flags, debug_name: "tlas" }
    }
}
