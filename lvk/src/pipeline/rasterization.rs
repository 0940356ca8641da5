//! From primitives to fragments: topology, faces, polygon modes, depth bias, samples.

use ash::vk;

use crate::shader::Primitive;

/// What vertices make.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Topology {
    /// Points.
    Points,
    /// Every two vertices are a line.
    Lines,
    /// Each vertex continues the line.
    LineStrip,
    /// Every three vertices are a triangle.
    #[default]
    Triangles,
    /// Each vertex makes a triangle with the two before.
    TriangleStrip,
    /// Each vertex makes a triangle with the one before and the first.
    TriangleFan,
    /// So many vertices at a time are a patch, for the tessellation stages; 1 to
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

    /// What its vertices make; `None` for patches, whose shader decides.
    pub(super) fn primitive(self) -> Option<Primitive> {
        match self {
            Self::Points => Some(Primitive::Points),
            Self::Lines | Self::LineStrip => Some(Primitive::Lines),
            Self::Triangles | Self::TriangleStrip | Self::TriangleFan => Some(Primitive::Triangles),
            Self::Patches { .. } => None,
        }
    }

    /// Vertices of a patch; 0 for all else.
    pub(super) fn patch_points(self) -> u32 {
        if let Self::Patches { points } = self { points } else { 0 }
    }
}

/// Which faces are left out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum CullMode {
    /// Both faces are drawn.
    #[default]
    None,
    /// Front faces are left out.
    Front,
    /// Back faces are left out.
    Back,
}

/// Which winding is the front, as seen in Vulkan's clip space (y down).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum FrontFace {
    /// Counter-clockwise.
    #[default]
    CounterClockwise,
    /// Clockwise.
    Clockwise,
}

/// What is drawn of a triangle (`VkPolygonMode`); all but
/// [`Fill`](Self::Fill) need [`OptionalFeature::FillModeNonSolid`](crate::OptionalFeature::FillModeNonSolid).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum PolygonMode {
    /// Its inside.
    #[default]
    Fill,
    /// Its edges.
    Line,
    /// Its corners.
    Point,
}

/// An offset of the depths of triangles: `constant * r + slope * m`, with the least difference `r` that the depth target
/// resolves and the greatest slope `m` of the triangle's depth over a pixel.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DepthBias {
    /// Factor of the least difference.
    pub constant: f32,
    /// Factor of the slope.
    pub slope: f32,
    /// Greatest offset, or least where it is negative; 0 for no bound. Any other needs
    /// [`OptionalFeature::DepthBiasClamp`](crate::OptionalFeature::DepthBiasClamp).
    pub clamp: f32,
}

impl DepthBias {
    /// Whether each part is a number.
    pub(crate) fn is_finite(&self) -> bool {
        [self.constant, self.slope, self.clamp].iter().all(|part| part.is_finite())
    }
}
