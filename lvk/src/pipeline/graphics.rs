//! Graphics pipelines, created in small steps.

use std::sync::Arc;

use ash::vk;

use super::blend::{Blend, ColorWriteMask, blend_state};
use super::depth_stencil::{DepthState, DepthTest, depth_stencil_state};
use super::graphics_check::{check_modules, check_stages};
use super::graphics_desc::{ColorTarget, RenderPipelineDesc, VertexAttribute};
use super::local_read::{InputIndices, inputs_read, inputs_written, writes_color};
use super::pipeline_layout::PipelineBase;
use super::rasterization::DepthBias;
use super::rasterization_state::{multisampling, rasterization};
use super::render_modules::RenderModules;
use super::rendering_formats::RenderingFormats;
use super::shader_module::ModuleLookup;
use super::stage::{Specialization, stage_info};
use crate::barrier::Stages;
use crate::bindless::input_attachments::InputAttachmentMask;
use crate::cpu_scope::cpu_scope;
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::gpu::caps::optional_features::OptionalFeature;
use crate::gpu::caps::shading_rate::ShadingRate;

/// The source of a pipeline's primitives. It decides which draw commands the pipeline takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum FrontEnd {
    /// A vertex shader: draws of vertices.
    Vertex,
    /// A mesh shader: draws of mesh workgroups.
    Mesh,
    /// A task shader and a mesh shader: draws of task workgroups.
    TaskAndMesh,
}

/// The state that is not part of the pipeline. The pass sets it when the pipeline is bound.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct PassState {
    /// Default depth state; `None` without a depth test.
    pub(crate) depth: Option<DepthState>,
    /// Default depth bias; `None` without a depth bias.
    pub(crate) bias: Option<DepthBias>,
    /// True if the pipeline tests stencil against the pass's reference.
    pub(crate) stencil: bool,
    /// True if the pipeline blends with the pass's constants.
    pub(crate) blend_constants: bool,
    /// Default shading rate; `None` for pipelines without a shading rate.
    pub(crate) shading_rate: Option<ShadingRate>,
}

impl PassState {
    fn from_desc(desc: &RenderPipelineDesc<'_>) -> Self {
        let blends = desc.color.iter().filter_map(|target| target.blend);
        Self {
            depth: desc.depth.map(|depth| depth.dynamic_state()),
            bias: desc.depth_bias,
            stencil: desc.stencil.is_some(),
            blend_constants: blends.into_iter().any(Blend::uses_constants),
            shading_rate: desc.shading_rate,
        }
    }

    fn dynamic_states(&self) -> Vec<vk::DynamicState> {
        use vk::DynamicState as Raw;
        let mut states = vec![Raw::VIEWPORT, Raw::SCISSOR];
        if self.depth.is_some() {
            states.extend([Raw::DEPTH_WRITE_ENABLE, Raw::DEPTH_COMPARE_OP]);
        }
        let rest = [
            (self.bias.is_some(), Raw::DEPTH_BIAS),
            (self.stencil, Raw::STENCIL_REFERENCE),
            (self.blend_constants, Raw::BLEND_CONSTANTS),
            (self.shading_rate.is_some(), Raw::FRAGMENT_SHADING_RATE_KHR),
        ];
        states.extend(rest.iter().filter(|(on, _)| *on).map(|(_, state)| *state));
        states
    }
}

/// A graphics pipeline, destroyed on drop.
pub(crate) struct RenderPipeline {
    pub(crate) raw: vk::Pipeline,
    pub(crate) push_constant_bytes: u32,
    /// Stages that run ray queries.
    pub(crate) query_stages: Stages,
    pub(crate) front_end: FrontEnd,
    pub(crate) shape: RenderingFormats,
    pub(crate) pass_state: PassState,
    /// True if draws may change stencil values.
    pub(crate) writes_stencil: bool,
    pub(crate) vertex_binding_count: u32,
    /// Targets that the fragment shader reads.
    pub(crate) reads: InputAttachmentMask,
    /// Targets that draws may change.
    pub(crate) writes: InputAttachmentMask,
    pub(crate) name: Arc<str>,
    gpu: Arc<Gpu>,
}

impl RenderPipeline {
    pub(crate) fn new(
        gpu: &Arc<Gpu>,
        base: PipelineBase,
        desc: &RenderPipelineDesc<'_>,
        find: ModuleLookup<'_>,
    ) -> Result<Self> {
        cpu_scope!("create graphics pipeline");
        check_stages(gpu, desc)?;
        let modules = RenderModules::resolve(desc, find)?;
        check_modules(gpu, desc, &modules)?;
        let raw = create_pipeline(gpu, base, desc, &modules)?;
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
            shape: desc.rendering_formats(),
            pass_state: PassState::from_desc(desc),
            writes_stencil: desc.stencil.is_some_and(|test| test.writes()),
            vertex_binding_count: desc.vertex_bindings.len() as u32,
            reads: inputs_read(&modules),
            writes: inputs_written(desc, &modules),
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

fn create_pipeline(
    gpu: &Gpu,
    base: PipelineBase,
    desc: &RenderPipelineDesc<'_>,
    modules: &RenderModules,
) -> Result<vk::Pipeline> {
    let constants = Specialization::new(desc.debug_name, desc.specialization, modules.iter())?;
    let constants = constants.info();
    let stages: Vec<_> = modules.iter().map(|module| stage_info(module, &constants)).collect();
    let (bindings, attributes) = (vertex_bindings(desc), vertex_attributes(desc));
    let input = vk::PipelineVertexInputStateCreateInfo::default()
        .vertex_binding_descriptions(&bindings)
        .vertex_attribute_descriptions(&attributes);
    let assembly = vk::PipelineInputAssemblyStateCreateInfo::default().topology(desc.topology.raw());
    let patches =
        vk::PipelineTessellationStateCreateInfo::default().patch_control_points(desc.topology.patch_points());
    let viewport = vk::PipelineViewportStateCreateInfo::default().viewport_count(1).scissor_count(1);
    let raster = rasterization(desc);
    let samples = multisampling(desc);
    let depth = depth_stencil_state(desc.depth, desc.stencil);
    let blends = blend_states(desc, modules);
    let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&blends);
    let dynamic = PassState::from_desc(desc).dynamic_states();
    let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&dynamic);
    let colors: Vec<_> = desc.color.iter().map(|target| target.format.raw()).collect();
    let mut rendering = rendering_info(&colors, desc);
    let indices = InputIndices::new(colors.len() as u32, gpu.caps.limits.max_input_attachments);
    let mut indices = indices.raw();
    let mut info = vk::GraphicsPipelineCreateInfo::default()
        .stages(&stages)
        .vertex_input_state(&input)
        .input_assembly_state(&assembly)
        .tessellation_state(&patches)
        .viewport_state(&viewport)
        .rasterization_state(&raster)
        .multisample_state(&samples)
        .depth_stencil_state(&depth)
        .color_blend_state(&blend)
        .dynamic_state(&dynamic)
        .layout(base.layout)
        .flags(create_flags(gpu, desc))
        .push_next(&mut rendering);
    if !inputs_read(modules).is_empty() {
        info = info.push_next(&mut indices);
    }
    // SAFETY: the modules and the layout are alive; everything `info` points to lives until the call returns.
    let made = unsafe { gpu.device.create_graphics_pipelines(base.cache, &[info], None) };
    Ok(made.map_err(|(_, result)| Error::vulkan("vkCreateGraphicsPipelines")(result))?[0])
}

/// Returns the creation flags. Pipelines with a shading rate may be used in passes with a shading rate attachment.
fn create_flags(gpu: &Gpu, desc: &RenderPipelineDesc<'_>) -> vk::PipelineCreateFlags {
    let rates = desc.shading_rate.is_some() && gpu.caps.has(OptionalFeature::AttachmentShadingRate);
    match rates {
        true => vk::PipelineCreateFlags::RENDERING_FRAGMENT_SHADING_RATE_ATTACHMENT_KHR,
        false => vk::PipelineCreateFlags::empty(),
    }
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

/// Returns the blend state of each target. A target without an output of the fragment shader is not written.
fn blend_states(
    desc: &RenderPipelineDesc<'_>,
    modules: &RenderModules,
) -> Vec<vk::PipelineColorBlendAttachmentState> {
    let write = |place, target: &ColorTarget| {
        if writes_color(modules, place, target) { target.write } else { ColorWriteMask::empty() }
    };
    let targets = (0..).zip(desc.color);
    targets.map(|(place, target)| blend_state(target.blend, write(place, target))).collect()
}

fn rendering_info<'a>(
    colors: &'a [vk::Format],
    desc: &RenderPipelineDesc<'_>,
) -> vk::PipelineRenderingCreateInfo<'a> {
    let info =
        vk::PipelineRenderingCreateInfo::default().color_attachment_formats(colors).view_mask(desc.view_mask);
    let Some(DepthTest { format: depth, .. }) = desc.depth else { return info };
    let info = info.depth_attachment_format(depth.raw());
    if depth.has_stencil() { info.stencil_attachment_format(depth.raw()) } else { info }
}
