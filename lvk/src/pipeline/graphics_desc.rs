//! Descriptions of graphics pipelines.

use super::blend::{Blend, ColorWriteMask};
use super::block_layout::BlockLayout;
use super::depth_stencil::{DepthTest, StencilTest};
use super::rasterization::{CullMode, DepthBias, FrontFace, PolygonMode, Topology};
use super::rendering_formats::RenderingFormats;
use super::stage::SpecializationConstant;
use crate::format::{Format, VertexFormat};
use crate::gpu::caps::shading_rate::ShadingRate;
use crate::handle::ShaderModuleHandle;

/// A vertex buffer slot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct VertexBinding {
    /// Distance between consecutive vertices or instances, in bytes: a multiple of
    /// [`Limits::vertex_stride_alignment`](crate::Limits::vertex_stride_alignment). Default: 0.
    pub stride: u32,
    /// True if the attributes advance once for each instance instead of each vertex. Default: false.
    pub per_instance: bool,
}

/// A vertex attribute.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct VertexAttribute {
    /// The shader's `location`. Default: 0.
    pub location: u32,
    /// Index into the bindings. Default: 0.
    pub binding: u32,
    /// Format of the attribute. Default: [`VertexFormat::F32x3`].
    pub format: VertexFormat,
    /// Offset in the vertex, in bytes. Default: 0.
    pub offset: u32,
}

/// A colour target of a pipeline.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct ColorTarget {
    /// Format of the target.
    pub format: Format,
    /// Blending of the output with the target; `None` replaces the target's value.
    pub blend: Option<Blend>,
    /// Channels that are written.
    pub write: ColorWriteMask,
}

impl ColorTarget {
    /// Returns a target whose channels are all replaced.
    pub const fn new(format: Format) -> Self {
        Self { format, blend: None, write: ColorWriteMask::all() }
    }

    /// Returns a target whose channels are all blended.
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
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RenderPipelineDesc<'a> {
    /// The vertex shader; `None` in pipelines with a mesh shader. Default: none.
    pub vertex: Option<ShaderModuleHandle>,
    /// Task shader: decides how many mesh workgroups run. Optional, and only valid with a mesh shader. Default: none.
    pub task: Option<ShaderModuleHandle>,
    /// Mesh shader: outputs vertices and primitives, in place of a vertex shader
    /// ([`Capabilities::mesh_shader`](crate::Capabilities::mesh_shader)). Default: none.
    pub mesh: Option<ShaderModuleHandle>,
    /// Tessellation control shader (hull): decides how finely each patch is divided. It needs an evaluation shader,
    /// [`Topology::Patches`] and [`OptionalFeature::TessellationShader`](crate::OptionalFeature::TessellationShader).
    /// Default: none.
    pub tess_control: Option<ShaderModuleHandle>,
    /// Tessellation evaluation shader (domain): computes the vertices of a divided patch. Default: none.
    pub tess_eval: Option<ShaderModuleHandle>,
    /// Geometry shader: outputs primitives for each input primitive. Needs
    /// [`OptionalFeature::GeometryShader`](crate::OptionalFeature::GeometryShader). Default: none.
    pub geometry: Option<ShaderModuleHandle>,
    /// The fragment shader; `None` writes only depth and stencil. Default: none.
    pub fragment: Option<ShaderModuleHandle>,
    /// Primitives that the vertices form; ignored with a mesh shader, which declares its own.
    /// Default: [`Topology::Triangles`].
    pub topology: Topology,
    /// Faces that are culled. Default: [`CullMode::None`].
    pub cull: CullMode,
    /// Winding of front faces. Default: [`FrontFace::CounterClockwise`].
    pub front_face: FrontFace,
    /// Rendered part of a triangle: its inside, its edges or its vertices. Default: [`PolygonMode::Fill`].
    pub polygon: PolygonMode,
    /// Width of lines in pixels, within [`Limits::line_width`](crate::Limits::line_width). Any other width than 1 needs
    /// [`OptionalFeature::WideLines`](crate::OptionalFeature::WideLines). Default: 1.
    pub line_width: f32,
    /// Offset of the depths of triangles; `None` for no offset.
    /// [`RenderPass::depth_bias`](crate::RenderPass::depth_bias) may replace it. Default: none.
    pub depth_bias: Option<DepthBias>,
    /// True if depths beyond the viewport's range are clamped to it instead of clipped. Needs
    /// [`OptionalFeature::DepthClamp`](crate::OptionalFeature::DepthClamp). Default: false.
    pub depth_clamp: bool,
    /// Vertex buffers; empty if the shader reads its vertices by address. Default: empty.
    pub vertex_bindings: &'a [VertexBinding],
    /// Attributes read from the vertex buffers. Default: empty.
    pub vertex_attributes: &'a [VertexAttribute],
    /// Colour targets, in the order of the shader's outputs. Targets without an output are not changed. Default: empty.
    pub color: &'a [ColorTarget],
    /// Depth test; `None` draws without depth. Default: none.
    pub depth: Option<DepthTest>,
    /// Stencil test; `None` draws without stencil. The format of [`depth`](Self::depth) must contain stencil.
    /// Default: none.
    pub stencil: Option<StencilTest>,
    /// Number of samples per pixel; equals that of the targets ([`TextureDesc::samples`](crate::TextureDesc::samples)).
    /// Default: 1.
    pub samples: u32,
    /// True if the alpha of the first output decides how many of a pixel's samples are covered. Default: false.
    pub alpha_to_coverage: bool,
    /// Minimum fraction of a pixel's samples for which the fragment shader runs, 0 to 1. A shader that reads
    /// `gl_SampleID` runs for each sample. Any other value than 0 needs
    /// [`OptionalFeature::SampleRateShading`](crate::OptionalFeature::SampleRateShading). Default: 0.
    pub sample_shading: f32,
    /// Bit mask of the views that each draw renders; 0 without multiview. Must equal
    /// [`RenderPassDesc::view_mask`](crate::RenderPassDesc::view_mask). Default: 0.
    pub view_mask: u32,
    /// Pixels that a fragment covers; `None` for one pixel.
    /// [`RenderPass::shading_rate`](crate::RenderPass::shading_rate) may replace it. Passes with
    /// [`RenderPassDesc::shading_rate`](crate::RenderPassDesc::shading_rate) do not take pipelines with `None`. Needs
    /// [`OptionalFeature::PipelineShadingRate`](crate::OptionalFeature::PipelineShadingRate). Default: none.
    pub shading_rate: Option<ShadingRate>,
    /// True to link the pipeline from parts that the context shares among pipelines (`VK_EXT_graphics_pipeline_library`):
    /// vertex input, shaders before rasterisation, fragment shader, output. Only parts that no live pipeline has are
    /// compiled. Draws give the same pixels, but may be slower than with a pipeline that is compiled as a whole.
    ///
    /// The whole pipeline is compiled without
    /// [`OptionalFeature::GraphicsPipelineLibrary`](crate::OptionalFeature::GraphicsPipelineLibrary), without a fragment
    /// shader, with a shading rate, and with a fragment shader that reads targets of its pass. Default: false.
    pub fast_link: bool,
    /// Values of specialization constants. Default: empty.
    pub specialization: &'a [SpecializationConstant],
    /// Rust structs for the blocks of the shaders, compared with them at creation. Default: empty.
    pub layouts: &'a [BlockLayout],
    /// Name in error messages, validation messages and debuggers. Default: `"render pipeline"`.
    pub debug_name: &'a str,
}

impl RenderPipelineDesc<'_> {
    /// Returns the formats, samples and views that a pass must have to use the pipeline.
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
            fast_link: false,
            specialization: &[],
            layouts: &[],
            debug_name: "render pipeline",
        }
    }
}
