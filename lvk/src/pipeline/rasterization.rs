//! Topology, faces, polygon modes and depth bias of graphics pipelines.

use ash::vk;

use crate::shader::Primitive;

/// Primitives that vertices form (`VkPrimitiveTopology`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Topology {
    /// Points.
    Points,
    /// Every two vertices form a line.
    Lines,
    /// Each vertex continues the line.
    LineStrip,
    /// Every three vertices form a triangle.
    #[default]
    Triangles,
    /// Each vertex forms a triangle with the previous two.
    TriangleStrip,
    /// Each vertex forms a triangle with the previous one and the first
    /// ([`OptionalFeature::TriangleFans`](crate::OptionalFeature)).
    TriangleFan,
    /// Every `points` vertices form a patch, for the tessellation stages; 1 to
    /// [`Limits::max_patch_points`](crate::Limits::max_patch_points).
    Patches {
        /// Vertices of a patch.
        points: u32,
    },
}

impl Topology {
    pub(super) fn raw(self) -> vk::PrimitiveTopology {
        match self {
            Self::Points => vk::PrimitiveTopology::POINT_LIST,
            Self::Lines => vk::PrimitiveTopology::LINE_LIST,
            Self::LineStrip => vk::PrimitiveTopology::LINE_STRIP,
            Self::Triangles => vk::PrimitiveTopology::TRIANGLE_LIST,
            Self::TriangleStrip => vk::PrimitiveTopology::TRIANGLE_STRIP,
            Self::TriangleFan => vk::PrimitiveTopology::TRIANGLE_FAN,
            Self::Patches { .. } => vk::PrimitiveTopology::PATCH_LIST,
        }
    }

    /// Returns the primitive that the vertices form; `None` for patches, whose shader decides.
    pub(super) fn primitive(self) -> Option<Primitive> {
        match self {
            Self::Points => Some(Primitive::Points),
            Self::Lines | Self::LineStrip => Some(Primitive::Lines),
            Self::Triangles | Self::TriangleStrip | Self::TriangleFan => Some(Primitive::Triangles),
            Self::Patches { .. } => None,
        }
    }

    /// Returns the number of vertices of a patch; 0 for all other topologies.
    pub(super) fn patch_points(self) -> u32 {
        if let Self::Patches { points } = self { points } else { 0 }
    }
}

/// Faces that are culled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum CullMode {
    /// Both faces are drawn.
    #[default]
    None,
    /// Front faces are culled.
    Front,
    /// Back faces are culled.
    Back,
}

/// Winding of front faces, as seen in Vulkan's clip space (y down).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum FrontFace {
    /// Counter-clockwise.
    #[default]
    CounterClockwise,
    /// Clockwise.
    Clockwise,
}

/// Rendered part of a triangle (`VkPolygonMode`). All but [`Fill`](Self::Fill) need
/// [`OptionalFeature::FillModeNonSolid`](crate::OptionalFeature::FillModeNonSolid).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum PolygonMode {
    /// The inside.
    #[default]
    Fill,
    /// The edges.
    Line,
    /// The vertices.
    Point,
}

/// An offset of the depths of triangles: `constant * r + slope * m`. `r` is the least difference that the depth target
/// resolves. `m` is the greatest slope of the triangle's depth over a pixel.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DepthBias {
    /// Factor of the least difference `r`. Default: 0.
    pub constant: f32,
    /// Factor of the slope `m`. Default: 0.
    pub slope: f32,
    /// Greatest offset, or the least offset if negative; 0 for no limit. Any other value than 0 needs
    /// [`OptionalFeature::DepthBiasClamp`](crate::OptionalFeature::DepthBiasClamp). Default: 0.
    pub clamp: f32,
}

impl DepthBias {
    /// True if all values are finite.
    pub(crate) fn is_finite(&self) -> bool {
        [self.constant, self.slope, self.clamp].iter().all(|part| part.is_finite())
    }
}
