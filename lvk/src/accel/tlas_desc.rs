//! The description of a TLAS.

use super::flags::BuildFlags;
use super::instance::TlasInstance;

/// Describes a top-level structure.
#[derive(Debug, Clone, Copy)]
pub struct TlasDesc<'a> {
    /// Its first instances; may be empty.
    pub instances: &'a [TlasInstance],
    /// Room for instances in later updates; at least the number of the first ones.
    pub capacity: u32,
    /// Most parts that a mesh shown may have been split into ([`AccelStructInfo::parts`](crate::AccelStructInfo)), on
    /// the average of all instances. 1 unless phones' limits or [`DeviceProfile`](crate::DeviceProfile)s split meshes; the
    /// average of the first instances where that is more.
    pub parts_per_instance: u32,
    /// What the build is optimised for.
    pub flags: BuildFlags,
    /// Name in error messages, validation messages and debuggers.
    pub debug_name: &'a str,
}

impl Default for TlasDesc<'_> {
    fn default() -> Self {
        let flags = BuildFlags::default();
        Self { instances: &[], capacity: 0, parts_per_instance: 1, flags, debug_name: "tlas" }
    }
}
