//! Graphics pipelines, built of small steps.

use std::sync::Arc;

use ash::vk;

use super::shader_module::ShaderModule;
use super::stage::{Specialization, SpecializationConstant, stage};
use crate::error::{Error, Result, check_limit};
use crate::format::{Format, VertexFormat};
use crate::gpu::Gpu;
use crate::handle::ShaderModuleHandle;
use crate::resource::sampler::CompareOp;
use crate::shader::ShaderStage;

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
    /// The vertex shader.
    pub vertex: Option<ShaderModuleHandle>,
    /// The fragment shader; without one only depth is written.
    pub fragment: Option<ShaderModuleHandle>,
    /// What vertices make.
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

/// A graphics pipeline, destroyed on drop.
pub(crate) struct RenderPipeline {
    pub(crate) raw: vk::Pipeline,
    pub(crate) push_constant_bytes: u32,
    pub(crate) ray_query: bool,
    pub(crate) color_formats: Vec<Format>,
    pub(crate) depth_format: Option<Format>,
    pub(crate) vertex_binding_count: u32,
    pub(crate) name: Arc<str>,
    gpu: Arc<Gpu>,
}

impl RenderPipeline {
    pub(crate) fn new(
        gpu: &Arc<Gpu>,
        layout: vk::PipelineLayout,
        desc: &RenderPipelineDesc<'_>,
        vertex: &ShaderModule,
        fragment: Option<&ShaderModule>,
    ) -> Result<Self> {
        check(gpu, desc, vertex, fragment)?;
        let modules = || std::iter::once(vertex).chain(fragment);
        let raw = create(gpu, layout, desc, vertex, fragment)?;
        gpu.name(raw, desc.debug_name);
        Ok(Self {
            raw,
            push_constant_bytes: modules().map(|m| m.reflection.push_constant_bytes).max().unwrap_or(0),
            ray_query: modules().any(|module| module.reflection.ray_query),
            color_formats: desc.color.iter().map(|target| target.format).collect(),
            depth_format: desc.depth.map(|depth| depth.format),
            vertex_binding_count: desc.vertex_bindings.len() as u32,
            name: desc.debug_name.into(),
            gpu: Arc::clone(gpu),
        })
    }
}

impl Drop for RenderPipeline {
    fn drop(&mut self) {
        // SAFETY: the owner has waited until the GPU is done with the pipeline.
        unsafe { self.gpu.device.destroy_pipeline(self.raw, None) };
    }
}

fn check(
    gpu: &Gpu,
    desc: &RenderPipelineDesc<'_>,
    vertex: &ShaderModule,
    fragment: Option<&ShaderModule>,
) -> Result<()> {
    let name = desc.debug_name;
    vertex.check_stage(ShaderStage::Vertex)?;
    fragment.map_or(Ok(()), |module| module.check_stage(ShaderStage::Fragment))?;
    let targets = desc.color.len() as u64;
    check_limit(name, "colour target count", targets, gpu.caps.limits.max_color_targets.into())?;
    for target in desc.color {
        let features = gpu.image_features(target.format.raw());
        if target.format.is_depth() || !features.contains(vk::FormatFeatureFlags::COLOR_ATTACHMENT) {
            let what = format!("{:?} as a colour target of '{name}'", target.format);
            return Err(Error::unsupported(what, "the device cannot draw to it; choose another format"));
        }
        if target.blend.is_some() && !features.contains(vk::FormatFeatureFlags::COLOR_ATTACHMENT_BLEND) {
            let what = format!("blending into {:?} in '{name}'", target.format);
            return Err(Error::unsupported(what, "the device cannot blend this format"));
        }
    }
    if let Some(depth) = desc.depth {
        let features = gpu.image_features(depth.format.raw());
        if !features.contains(vk::FormatFeatureFlags::DEPTH_STENCIL_ATTACHMENT) {
            let what = format!("{:?} as the depth target of '{name}'", depth.format);
            return Err(Error::unsupported(what, "choose D32Float or D16Unorm"));
        }
    }
    check_vertex_input(name, desc)?;
    check_locations(name, desc, &vertex.reflection.inputs)
}

/// Fails unless each location the vertex shader reads has an attribute, and no location has two.
fn check_locations(name: &str, desc: &RenderPipelineDesc<'_>, inputs: &[u32]) -> Result<()> {
    let mut given: Vec<u32> = desc.vertex_attributes.iter().map(|attribute| attribute.location).collect();
    given.sort_unstable();
    if let Some(pair) = given.windows(2).find(|pair| pair[0] == pair[1]) {
        return Err(Error::usage(name, format!("two vertex attributes have the location {}", pair[0])));
    }
    match inputs.iter().find(|location| !given.contains(location)) {
        None => Ok(()),
        Some(location) => {
            let message =
                format!("the vertex shader reads location {location}, which no vertex attribute has");
            Err(Error::usage(name, message))
        }
    }
}

fn check_vertex_input(name: &str, desc: &RenderPipelineDesc<'_>) -> Result<()> {
    const MAX: u64 = 16;
    check_limit(name, "vertex binding count", desc.vertex_bindings.len() as u64, MAX)?;
    check_limit(name, "vertex attribute count", desc.vertex_attributes.len() as u64, MAX)?;
    for attribute in desc.vertex_attributes {
        let Some(binding) = desc.vertex_bindings.get(attribute.binding as usize) else {
            let message =
                format!("vertex attribute {} names binding {}", attribute.location, attribute.binding);
            return Err(Error::usage(name, format!("{message}, which does not exist")));
        };
        let end = u64::from(attribute.offset) + u64::from(attribute.format.size_bytes());
        if end > u64::from(binding.stride) {
            let message = format!("vertex attribute {} ends beyond the stride", attribute.location);
            return Err(Error::usage(name, message));
        }
        check_limit(name, "vertex attribute location", attribute.location.into(), MAX - 1)?;
    }
    desc.vertex_bindings
        .iter()
        .try_for_each(|binding| check_limit(name, "vertex stride in bytes", binding.stride.into(), 2048))
}

fn create(
    gpu: &Gpu,
    layout: vk::PipelineLayout,
    desc: &RenderPipelineDesc<'_>,
    vertex: &ShaderModule,
    fragment: Option<&ShaderModule>,
) -> Result<vk::Pipeline> {
    let modules = std::iter::once(vertex).chain(fragment);
    let constants = Specialization::new(desc.debug_name, desc.specialization, modules.clone())?;
    let constants = constants.info();
    let stages: Vec<_> = modules.map(|module| stage(module, &constants)).collect();
    let (bindings, attributes) = (vertex_bindings(desc), vertex_attributes(desc));
    let input = vk::PipelineVertexInputStateCreateInfo::default()
        .vertex_binding_descriptions(&bindings)
        .vertex_attribute_descriptions(&attributes);
    let assembly = vk::PipelineInputAssemblyStateCreateInfo::default().topology(topology(desc.topology));
    let viewport = vk::PipelineViewportStateCreateInfo::default().viewport_count(1).scissor_count(1);
    let raster = rasterization(desc);
    let samples =
        vk::PipelineMultisampleStateCreateInfo::default().rasterization_samples(vk::SampleCountFlags::TYPE_1);
    let depth = depth_state(desc.depth);
    let blends: Vec<_> = desc.color.iter().map(|target| blend_state(target.blend)).collect();
    let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&blends);
    let dynamic = [vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR];
    let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&dynamic);
    let colors: Vec<_> = desc.color.iter().map(|target| target.format.raw()).collect();
    let mut rendering = rendering_formats(&colors, desc.depth.map(|depth| depth.format));
    let info = vk::GraphicsPipelineCreateInfo::default()
        .stages(&stages)
        .vertex_input_state(&input)
        .input_assembly_state(&assembly)
        .viewport_state(&viewport)
        .rasterization_state(&raster)
        .multisample_state(&samples)
        .depth_stencil_state(&depth)
        .color_blend_state(&blend)
        .dynamic_state(&dynamic)
        .layout(layout)
        .push_next(&mut rendering);
    // SAFETY: the modules and the layout are alive; everything `info` points to lives until the call returns.
    let made = unsafe { gpu.device.create_graphics_pipelines(vk::PipelineCache::null(), &[info], None) };
    Ok(made.map_err(|(_, result)| Error::vulkan("vkCreateGraphicsPipelines")(result))?[0])
}

fn vertex_bindings(desc: &RenderPipelineDesc<'_>) -> Vec<vk::VertexInputBindingDescription> {
    let rate = |per_instance| match per_instance {
        true => vk::VertexInputRate::INSTANCE,
        false => vk::VertexInputRate::VERTEX,
    };
    let bindings = (0..).zip(desc.vertex_bindings);
    bindings
        .map(|(binding, desc)| vk::VertexInputBindingDescription {
            binding,
            stride: desc.stride,
            input_rate: rate(desc.per_instance),
        })
        .collect()
}

fn vertex_attributes(desc: &RenderPipelineDesc<'_>) -> Vec<vk::VertexInputAttributeDescription> {
    let raw = |attribute: &VertexAttribute| vk::VertexInputAttributeDescription {
        location: attribute.location,
        binding: attribute.binding,
        format: attribute.format.raw(),
        offset: attribute.offset,
    };
    desc.vertex_attributes.iter().map(raw).collect()
}

fn topology(topology: Topology) -> vk::PrimitiveTopology {
    match topology {
        Topology::Points => vk::PrimitiveTopology::POINT_LIST,
        Topology::Lines => vk::PrimitiveTopology::LINE_LIST,
        Topology::LineStrip => vk::PrimitiveTopology::LINE_STRIP,
        Topology::Triangles => vk::PrimitiveTopology::TRIANGLE_LIST,
        Topology::TriangleStrip => vk::PrimitiveTopology::TRIANGLE_STRIP,
    }
}

fn rasterization(desc: &RenderPipelineDesc<'_>) -> vk::PipelineRasterizationStateCreateInfo<'static> {
    let cull = match desc.cull {
        CullMode::None => vk::CullModeFlags::NONE,
        CullMode::Front => vk::CullModeFlags::FRONT,
        CullMode::Back => vk::CullModeFlags::BACK,
    };
    let front = match desc.front_face {
        FrontFace::CounterClockwise => vk::FrontFace::COUNTER_CLOCKWISE,
        FrontFace::Clockwise => vk::FrontFace::CLOCKWISE,
    };
    vk::PipelineRasterizationStateCreateInfo::default().cull_mode(cull).front_face(front).line_width(1.0)
}

fn depth_state(depth: Option<DepthTest>) -> vk::PipelineDepthStencilStateCreateInfo<'static> {
    let Some(depth) = depth else { return vk::PipelineDepthStencilStateCreateInfo::default() };
    vk::PipelineDepthStencilStateCreateInfo::default()
        .depth_test_enable(true)
        .depth_write_enable(depth.write)
        .depth_compare_op(depth.compare.raw())
}

fn blend_state(blend: Option<Blend>) -> vk::PipelineColorBlendAttachmentState {
    let state =
        vk::PipelineColorBlendAttachmentState::default().color_write_mask(vk::ColorComponentFlags::RGBA);
    let Some(blend) = blend else { return state };
    let (source, target) = match blend {
        Blend::Alpha => (vk::BlendFactor::SRC_ALPHA, vk::BlendFactor::ONE_MINUS_SRC_ALPHA),
        Blend::PremultipliedAlpha => (vk::BlendFactor::ONE, vk::BlendFactor::ONE_MINUS_SRC_ALPHA),
        Blend::Additive => (vk::BlendFactor::ONE, vk::BlendFactor::ONE),
    };
    state
        .blend_enable(true)
        .src_color_blend_factor(source)
        .dst_color_blend_factor(target)
        .src_alpha_blend_factor(vk::BlendFactor::ONE)
        .dst_alpha_blend_factor(target)
}

fn rendering_formats(colors: &[vk::Format], depth: Option<Format>) -> vk::PipelineRenderingCreateInfo<'_> {
    let info = vk::PipelineRenderingCreateInfo::default().color_attachment_formats(colors);
    let Some(depth) = depth else { return info };
    let info = info.depth_attachment_format(depth.raw());
    if depth.has_stencil() { info.stencil_attachment_format(depth.raw()) } else { info }
}
