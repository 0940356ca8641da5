//! What a caller says about a graphics pipeline.

use super::blend::{Blend, ColorWriteMask};
use super::depth_stencil::{DepthTest, StencilTest};
use super::rasterization::{CullMode, DepthBias, FrontFace, PolygonMode, Topology};
use super::rendering_formats::RenderingFormats;
use super::stage::SpecializationConstant;
use crate::format::{Format, VertexFormat};
use crate::gpu::caps::shading_rate::ShadingRate;
use crate::handle::ShaderModuleHandle;

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

/// A colour target of a pipeline.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct ColorTarget {
    /// Format of the target.
    pub format: Format,
    /// How colours are combined; `None` replaces.
    pub blend: Option<Blend>,
    /// Channels that are written.
    pub write: ColorWriteMask,
}

impl ColorTarget {
    /// Replaced in all channels.
    pub const fn new(format: Format) -> Self {
        Self { format, blend: None, write: ColorWriteMask::all() }
    }

    /// Combined with what is there, in all channels.
    pub const fn blended(format: Format, blend: Blend) -> Self {
        Self { format, blend: Some(blend), write: ColorWriteMask::all() }
    }
}

impl From<Format> for ColorTarget {
    fn from(format: Format) -> Self {
        Self::new(format)
    }
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
    /// Tessellation control shader (hull): how finely each patch is divided. With an evaluation shader behind it, and
    /// [`Topology::Patches`] ([`OptionalFeature::TessellationShader`](crate::OptionalFeature::TessellationShader)).
    pub tess_control: Option<ShaderModuleHandle>,
    /// Tessellation evaluation shader (domain): where the vertices of a divided patch are.
    pub tess_eval: Option<ShaderModuleHandle>,
    /// Geometry shader: primitives out of primitives
    /// ([`OptionalFeature::GeometryShader`](crate::OptionalFeature::GeometryShader)).
    pub geometry: Option<ShaderModuleHandle>,
    /// The fragment shader; without one only depth and stencil are written.
    pub fragment: Option<ShaderModuleHandle>,
    /// What vertices make; a mesh shader says so itself.
    pub topology: Topology,
    /// Which faces are left out.
    pub cull: CullMode,
    /// Which winding is the front.
    pub front_face: FrontFace,
    /// What is drawn of triangles.
    pub polygon: PolygonMode,
    /// Width of lines in pixels, within [`Limits::line_width`](crate::Limits::line_width); all but 1 need
    /// [`OptionalFeature::WideLines`](crate::OptionalFeature::WideLines).
    pub line_width: f32,
    /// Offset of the depths of triangles, which [`RenderPass::depth_bias`](crate::RenderPass::depth_bias) may replace;
    /// `None` for none.
    pub depth_bias: Option<DepthBias>,
    /// Depths beyond the viewport's range are clamped to it in place of clipped
    /// ([`OptionalFeature::DepthClamp`](crate::OptionalFeature::DepthClamp)).
    pub depth_clamp: bool,
    /// Vertex buffers; empty when the shader pulls its vertices by address.
    pub vertex_bindings: &'a [VertexBinding],
    /// Attributes read from the vertex buffers.
    pub vertex_attributes: &'a [VertexAttribute],
    /// Colour targets, in the order of the shader's outputs. Those it has no output for are left as they are.
    pub color: &'a [ColorTarget],
    /// Depth test; `None` draws without depth.
    pub depth: Option<DepthTest>,
    /// Stencil test; `None` draws without stencil. The format of [`depth`](Self::depth) has to hold stencil.
    pub stencil: Option<StencilTest>,
    /// Samples a pixel, as the targets have them ([`TextureDesc::samples`](crate::TextureDesc::samples)).
    pub samples: u32,
    /// The alpha of the first output decides how many of a pixel's samples are covered.
    pub alpha_to_coverage: bool,
    /// The fragment shader runs for at least this part of a pixel's samples, 0 to 1; for each sample where it reads
    /// `gl_SampleID`. All but 0 need [`OptionalFeature::SampleRateShading`](crate::OptionalFeature::SampleRateShading).
    pub sample_shading: f32,
    /// Views that each draw makes at once, a bit for each, as the pass has them
    /// ([`RenderPassDesc::view_mask`](crate::RenderPassDesc::view_mask)); 0 for one picture.
    pub view_mask: u32,
    /// How many pixels a fragment covers, which [`RenderPass::shading_rate`](crate::RenderPass::shading_rate) may replace;
    /// `None` for one, and for passes without [`RenderPassDesc::shading_rate`](crate::RenderPassDesc::shading_rate). Needs
    /// [`OptionalFeature::PipelineShadingRate`](crate::OptionalFeature::PipelineShadingRate).
    pub shading_rate: Option<ShadingRate>,
    /// Values of specialization constants.
    pub specialization: &'a [SpecializationConstant],
    /// Name in error messages, validation messages and debuggers.
    pub debug_name: &'a str,
}

impl RenderPipelineDesc<'_> {
    /// What its passes have to be like.
    pub(super) fn rendering_formats(&self) -> RenderingFormats {
        let colors = self.color.iter().map(|target| target.format);
        RenderingFormats::new(colors, self.depth.map(|depth| depth.format), self.samples, self.view_mask)
    }
}

impl Default for RenderPipelineDesc<'_> {
    fn default() -> Self {
        Self {
            vertex: None,
            task: None,
            mesh: None,
            tess_control: None,
            tess_eval: None,
            geometry: None,
            fragment: None,
            topology: Topology::default(),
            cull: CullMode::default(),
            front_face: FrontFace::default(),
            polygon: PolygonMode::default(),
            line_width: 1.0,
            depth_bias: None,
            depth_clamp: false,
            vertex_bindings: &[],
            vertex_attributes: &[],
            color: &[],
            depth: None,
            stencil: None,
            samples: 1,
            alpha_to_coverage: false,
            sample_shading: 0.0,
            view_mask: 0,
            shading_rate: None,
            specialization: &[],
            debug_name: "render pipeline",
        }
    }
}
