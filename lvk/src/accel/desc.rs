//! Descriptions of acceleration structures.

use super::geometry::BlasGeometry;
use super::instance::TlasInstance;
use super::structure::BuildFlags;

/// Describes a bottom-level structure.
#[derive(Debug, Clone, Copy)]
pub struct BlasDesc<'a> {
    /// Its geometries, all triangles or all boxes. Shaders read a hit's place in the list as `gl_GeometryIndexEXT`.
    pub geometries: &'a [BlasGeometry],
    /// What the build is optimised for.
    pub flags: BuildFlags,
    /// Name in error messages, validation messages and debuggers.
    pub debug_name: &'a str,
}

impl Default for BlasDesc<'_> {
    fn default() -> Self {
        Self { geometries: &[], flags: BuildFlags::default(), debug_name: "blas" }
    }
}

/// Describes a top-level structure.
#[derive(Debug, Clone, Copy)]
pub struct TlasDesc<'a> {
    /// Its first instances; may be empty.
    pub instances: &'a [TlasInstance],
    /// Room for instances in later updates; at least the number of the first ones.
    pub capacity: u32,
    /// What the build is optimised for.
    pub flags: BuildFlags,
    /// Name in error messages, validation messages and debuggers.
    pub debug_name: &'a str,
}

impl Default for TlasDesc<'_> {
    fn default() -> Self {
        Self { instances: &[], capacity: 0, flags: BuildFlags::default(), debug_name: "tlas" }
    }
}
