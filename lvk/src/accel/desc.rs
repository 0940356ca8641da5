//! Description of a BLAS.

use super::flags::BuildFlags;
use super::geometry::BlasGeometry;
use crate::handle::OpacityMicromapHandle;

/// Order in which the driver's builder gets the primitives of a mesh.
///
/// Shaders get primitive indices in the caller's order from `lvkPrimitiveIndex` and `lvkRayQueryPrimitiveIndex`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum PrimitiveOrder {
    /// The caller's order, except [`Spatial`](Self::Spatial) for builds with [`BuildFlags::FAST_TRACE`] on drivers
    /// that keep the order and trace unordered meshes slowly
    /// ([`Capabilities::prefers_spatial_order`](crate::Capabilities)).
    #[default]
    Auto,
    /// The caller's order.
    Given,
    /// Neighbours in the list are neighbours in space: the leaf order of a BVH of small surface area. A given order
    /// that is about as good is kept. The inputs are read back, so creation waits for the GPU.
    Spatial,
}

/// Describes a bottom-level acceleration structure (BLAS).
#[derive(Debug, Clone, Copy)]
pub struct BlasDesc<'a> {
    /// The geometries, all triangles or all AABBs. Shaders read a hit's index in the list as `gl_GeometryIndexEXT`.
    /// Default: empty.
    pub geometries: &'a [BlasGeometry],
    /// Build preferences, and the operations allowed later. Default: [`BuildFlags::FAST_TRACE`].
    pub flags: BuildFlags,
    /// Order in which the primitives are built. It is derived from the contents of the buffers at creation.
    /// Default: [`PrimitiveOrder::Auto`].
    pub order: PrimitiveOrder,
    /// The opacity of the triangles of each geometry, in the order of `geometries`; a shorter list leaves the rest
    /// without. The micromap has as many triangles as the geometry. The structure is built in the given order, and it
    /// is not split. Needs [`OptionalFeature::OpacityMicromaps`](crate::OptionalFeature::OpacityMicromaps).
    /// Default: empty.
    pub opacity: &'a [Option<OpacityMicromapHandle>],
    /// Name in error messages, validation messages and debuggers. Default: `"blas"`.
    pub debug_name: &'a str,
}

impl Default for BlasDesc<'_> {
    fn default() -> Self {
        let (flags, order) = (BuildFlags::default(), PrimitiveOrder::default());
        Self { geometries: &[], flags, order, opacity: &[], debug_name: "blas" }
    }
}
