//! Creation of a graphics pipeline, or of a part of one, by Vulkan.

use ash::vk;

use super::blend::blend_state;
use super::depth_stencil::{DepthTest, depth_stencil_state};
use super::graphics_desc::{RenderPipelineDesc, VertexAttribute};
use super::local_read::{InputIndices, inputs_read};
use super::pass_state::PassState;
use super::pipeline_layout::PipelineBase;
use super::rasterization_state::{multisampling, rasterization};
use super::render_modules::RenderModules;
use super::stage::{Specialization, stage_info};
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::gpu::caps::optional_features::OptionalFeature;

/// Creates a pipeline, or the part of one that `library` names. Each colour target has its final write mask.
pub(super) fn create_pipeline(
    gpu: &Gpu,
    base: PipelineBase,
    desc: &RenderPipelineDesc<'_>,
    modules: &RenderModules,
    library: Option<&mut vk::GraphicsPipelineLibraryCreateInfoEXT<'_>>,
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
    let blends: Vec<_> = desc.color.iter().map(|target| blend_state(target.blend, target.write)).collect();
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
    if let Some(library) = library {
        info = info.flags(info.flags | vk::PipelineCreateFlags::LIBRARY_KHR).push_next(library);
    }
    // SAFETY: the modules and the layout are alive; everything `info` points to lives until the call returns.
    let made = unsafe { gpu.device.create_graphics_pipelines(base.cache, &[info], None) };
    Ok(made.map_err(|(_, result)| Error::vulkan("vkCreateGraphicsPipelines", desc.debug_name)(result))?[0])
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
