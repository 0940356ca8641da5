//! Graphics pipelines, built of small steps.

use std::sync::Arc;

use ash::vk;

use super::graphics_check::{check, check_stages};
use super::graphics_desc::{
    Blend, CullMode, DepthTest, FrontFace, RenderPipelineDesc, Topology, VertexAttribute,
};
use super::layout::PipelineBase;
use super::shader_module::ShaderModule;
use super::stage::{Specialization, stage};
use crate::barrier::Stages;
use crate::error::{Error, Result};
use crate::format::Format;
use crate::gpu::Gpu;
use crate::handle::ShaderModuleHandle;
use crate::shader::ShaderStage;

/// The shader modules of a graphics pipeline.
pub(super) struct RenderModules {
    pub(super) vertex: Option<Arc<ShaderModule>>,
    pub(super) task: Option<Arc<ShaderModule>>,
    pub(super) mesh: Option<Arc<ShaderModule>>,
    pub(super) fragment: Option<Arc<ShaderModule>>,
}

impl RenderModules {
    fn find(desc: &RenderPipelineDesc<'_>, find: FindModule<'_>) -> Result<Self> {
        let find = |handle: Option<ShaderModuleHandle>| handle.map(find).transpose();
        Ok(Self {
            vertex: find(desc.vertex)?,
            task: find(desc.task)?,
            mesh: find(desc.mesh)?,
            fragment: find(desc.fragment)?,
        })
    }

    fn iter(&self) -> impl Iterator<Item = &ShaderModule> + Clone {
        [&self.vertex, &self.task, &self.mesh, &self.fragment].into_iter().filter_map(Option::as_deref)
    }

    /// Stages of the pipeline in which rays are queried.
    fn query_stages(&self) -> Stages {
        let stage = |module: &ShaderModule| match module.stage {
            ShaderStage::Fragment => Stages::FRAGMENT,
            _ => Stages::PRE_RASTER,
        };
        self.iter().filter(|module| module.reflection.ray_query).map(stage).collect()
    }
}

/// Looks a module up.
type FindModule<'a> = &'a dyn Fn(ShaderModuleHandle) -> Result<Arc<ShaderModule>>;

/// Where a pipeline gets its primitives from, which decides how it is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum FrontEnd {
    /// A vertex shader: draws of vertices.
    Vertex,
    /// A mesh shader: draws of mesh workgroups.
    Mesh,
    /// A task shader and a mesh shader: draws of task workgroups.
    TaskAndMesh,
}

/// A graphics pipeline, destroyed on drop.
pub(crate) struct RenderPipeline {
    pub(crate) raw: vk::Pipeline,
    pub(crate) push_constant_bytes: u32,
    /// Stages in which rays are queried.
    pub(crate) query_stages: Stages,
    pub(crate) front_end: FrontEnd,
    pub(crate) color_formats: Vec<Format>,
    pub(crate) depth_format: Option<Format>,
    pub(crate) vertex_binding_count: u32,
    pub(crate) name: Arc<str>,
    gpu: Arc<Gpu>,
}

impl RenderPipeline {
    pub(crate) fn new(
        gpu: &Arc<Gpu>,
        base: PipelineBase,
        desc: &RenderPipelineDesc<'_>,
        find: FindModule<'_>,
    ) -> Result<Self> {
        check_stages(gpu, desc)?;
        let modules = RenderModules::find(desc, find)?;
        check(gpu, desc, &modules)?;
        let raw = create(gpu, base, desc, &modules)?;
        gpu.name(raw, desc.debug_name);
        let push_constant_bytes = modules.iter().map(|m| m.reflection.push_constant_bytes).max();
        Ok(Self {
            raw,
            push_constant_bytes: push_constant_bytes.unwrap_or(0),
            query_stages: modules.query_stages(),
            front_end: match (&modules.mesh, &modules.task) {
                (None, _) => FrontEnd::Vertex,
                (Some(_), None) => FrontEnd::Mesh,
                (Some(_), Some(_)) => FrontEnd::TaskAndMesh,
            },
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

fn create(
    gpu: &Gpu,
    base: PipelineBase,
    desc: &RenderPipelineDesc<'_>,
    modules: &RenderModules,
) -> Result<vk::Pipeline> {
    let constants = Specialization::new(desc.debug_name, desc.specialization, modules.iter())?;
    let constants = constants.info();
    let stages: Vec<_> = modules.iter().map(|module| stage(module, &constants)).collect();
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
        .layout(base.layout)
        .push_next(&mut rendering);
    // SAFETY: the modules and the layout are alive; everything `info` points to lives until the call returns.
    let made = unsafe { gpu.device.create_graphics_pipelines(base.cache, &[info], None) };
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
