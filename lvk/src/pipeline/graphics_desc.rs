//! What a caller says about a graphics pipeline.

use super::stage::SpecializationConstant;
use crate::format::{Format, VertexFormat};
use crate::handle::ShaderModuleHandle;
use crate::resource::sampler::CompareOp;

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

/// A buffer slot of vertex attributes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct VertexBinding {
    /// From one vertex (or instance) to the next, in bytes.
    pub stride: u32,
    /// Advances once for each instance instead of each vertex.
    pub per_instance: bool,
}

/// A vertex attribute.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct VertexAttribute {
    /// The shader's `location`.
    pub location: u32,
    /// Index into the bindings.
    pub binding: u32,
    /// Format of the attribute.
    pub format: VertexFormat,
    /// Offset in the vertex, in bytes.
    pub offset: u32,
}

/// How a colour is combined with what is in the target.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Blend {
    /// `source * alpha + target * (1 - alpha)`.
    Alpha,
    /// `source + target * (1 - alpha)`.
    PremultipliedAlpha,
    /// `source + target`.
    Additive,
}

/// A colour target of a pipeline.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct ColorTarget {
    /// Format of the target.
    pub format: Format,
    /// How colours are combined; `None` replaces.
    pub blend: Option<Blend>,
}

impl From<Format> for ColorTarget {
    fn from(format: Format) -> Self {
        Self { format, blend: None }
    }
}

/// Depth test of a pipeline.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct DepthTest {
    /// Format of the depth target.
    pub format: Format,
    /// A fragment passes if its depth compares so with the target's.
    pub compare: CompareOp,
    /// Whether passing fragments write their depth.
    pub write: bool,
}

/// Describes a graphics pipeline.
#[derive(Debug, Clone, Copy)]
pub struct RenderPipelineDesc<'a> {
    /// The vertex shader; none where there is a mesh shader.
    pub vertex: Option<ShaderModuleHandle>,
    /// Decides how many mesh workgroups run; only in front of a mesh shader, and optional there.
    pub task: Option<ShaderModuleHandle>,
    /// Makes vertices and primitives itself, in place of a vertex shader
    /// ([`Capabilities::mesh_shader`](crate::Capabilities::mesh_shader)).
    pub mesh: Option<ShaderModuleHandle>,
    /// The fragment shader; without one only depth is written.
    pub fragment: Option<ShaderModuleHandle>,
    /// What vertices make; a mesh shader says so itself.
    pub topology: Topology,
    /// Which faces are left out.
    pub cull: CullMode,
    /// Which winding is the front.
    pub front_face: FrontFace,
    /// Vertex buffers; empty when the shader pulls its vertices by address.
    pub vertex_bindings: &'a [VertexBinding],
    /// Attributes read from the vertex buffers.
    pub vertex_attributes: &'a [VertexAttribute],
    /// Colour targets, in the order of the shader's outputs.
    pub color: &'a [ColorTarget],
    /// Depth test; `None` draws without depth.
    pub depth: Option<DepthTest>,
    /// Values of specialization constants.
    pub specialization: &'a [SpecializationConstant],
    /// Name in error messages, validation messages and debuggers.
    pub debug_name: &'a str,
}

impl Default for RenderPipelineDesc<'_> {
    fn default() -> Self {
        Self {
            vertex: None,
            task: None,
            mesh: None,
            fragment: None,
            topology: Topology::default(),
            cull: CullMode::default(),
            front_face: FrontFace::default(),
            vertex_bindings: &[],
            vertex_attributes: &[],
            color: &[],
            depth: None,
            specialization: &[],
            debug_name: "render pipeline",
        }
    }
}
