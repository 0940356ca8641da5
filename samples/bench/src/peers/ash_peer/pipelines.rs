//! Pipelines, their layouts, and descriptor sets.

use lvk::ash::vk;

use super::device::Device;
use crate::peers::glsl::{GlslStage, compile};
use crate::peers::peer::Failure;

/// A pipeline with its layout, and a descriptor set if its shaders have one.
pub(super) struct Pipeline {
    pub(super) raw: vk::Pipeline,
    pub(super) layout: vk::PipelineLayout,
    pub(super) set: Option<vk::DescriptorSet>,
}

/// A pipeline layout, and a descriptor set of it.
pub(super) struct Layout {
    pub(super) raw: vk::PipelineLayout,
    pub(super) set: Option<vk::DescriptorSet>,
}

impl Layout {
    /// Creates a layout with `push_bytes` push constants and one set of these descriptors: type and number at each binding.
    pub(super) fn new(
        device: &Device,
        push_bytes: u32,
        descriptors: &[(vk::DescriptorType, u32)],
    ) -> Result<Self, Failure> {
        let stages = vk::ShaderStageFlags::ALL;
        let binding = |(number, (ty, count)): (u32, &(vk::DescriptorType, u32))| {
            let binding = vk::DescriptorSetLayoutBinding::default().binding(number);
            binding.descriptor_type(*ty).descriptor_count(*count).stage_flags(stages)
        };
        let bindings: Vec<_> = (0..).zip(descriptors).map(binding).collect();
        let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
        let ranges = [vk::PushConstantRange { stage_flags: stages, offset: 0, size: push_bytes }];
        let ranges = if push_bytes == 0 { &ranges[..0] } else { &ranges[..] };
        // SAFETY: the descriptions are valid, and the pool has as many descriptors as the set.
        unsafe {
            let set_layouts = [device.raw.create_descriptor_set_layout(&info, None)?];
            let set_layouts = if bindings.is_empty() { &set_layouts[..0] } else { &set_layouts[..] };
            let info =
                vk::PipelineLayoutCreateInfo::default().set_layouts(set_layouts).push_constant_ranges(ranges);
            let raw = device.raw.create_pipeline_layout(&info, None)?;
            if bindings.is_empty() {
                return Ok(Self { raw, set: None });
            }
            let size = |(ty, count): &(vk::DescriptorType, u32)| {
                vk::DescriptorPoolSize::default().ty(*ty).descriptor_count(*count)
            };
            let sizes: Vec<_> = descriptors.iter().map(size).collect();
            let info = vk::DescriptorPoolCreateInfo::default().max_sets(1).pool_sizes(&sizes);
            let pool = device.raw.create_descriptor_pool(&info, None)?;
            let info =
                vk::DescriptorSetAllocateInfo::default().descriptor_pool(pool).set_layouts(set_layouts);
            Ok(Self { raw, set: device.raw.allocate_descriptor_sets(&info)?.first().copied() })
        }
    }
}

impl Pipeline {
    /// Creates a compute pipeline.
    pub(super) fn compute(device: &Device, layout: Layout, text: &str) -> Result<Self, Failure> {
        let stage = vk::PipelineShaderStageCreateInfo::default()
            .stage(vk::ShaderStageFlags::COMPUTE)
            .module(module(device, GlslStage::Compute, text)?)
            .name(c"main");
        let info = [vk::ComputePipelineCreateInfo::default().stage(stage).layout(layout.raw)];
        // SAFETY: the module and the layout fit each other.
        let made = unsafe { device.raw.create_compute_pipelines(vk::PipelineCache::null(), &info, None) };
        let raw = made.map_err(|(_, result)| result)?[0];
        Ok(Self { raw, layout: layout.raw, set: layout.set })
    }

    /// Creates a pipeline that draws to one colour target.
    pub(super) fn graphics(
        device: &Device,
        layout: Layout,
        [vertex, fragment]: [&str; 2],
        topology: vk::PrimitiveTopology,
    ) -> Result<Self, Failure> {
        let stage = |stage, module| {
            vk::PipelineShaderStageCreateInfo::default().stage(stage).module(module).name(c"main")
        };
        let stages = [
            stage(vk::ShaderStageFlags::VERTEX, module(device, GlslStage::Vertex, vertex)?),
            stage(vk::ShaderStageFlags::FRAGMENT, module(device, GlslStage::Fragment, fragment)?),
        ];
        let vertices = vk::PipelineVertexInputStateCreateInfo::default();
        let assembly = vk::PipelineInputAssemblyStateCreateInfo::default().topology(topology);
        let viewport = vk::PipelineViewportStateCreateInfo::default().viewport_count(1).scissor_count(1);
        let raster = vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0);
        let samples = vk::PipelineMultisampleStateCreateInfo::default()
            .rasterization_samples(vk::SampleCountFlags::TYPE_1);
        let blend =
            [vk::PipelineColorBlendAttachmentState::default()
                .color_write_mask(vk::ColorComponentFlags::RGBA)];
        let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&blend);
        let dynamic = [vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR];
        let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&dynamic);
        let mut formats = vk::PipelineRenderingCreateInfo::default()
            .color_attachment_formats(&[vk::Format::R8G8B8A8_UNORM]);
        let info = [vk::GraphicsPipelineCreateInfo::default()
            .stages(&stages)
            .vertex_input_state(&vertices)
            .input_assembly_state(&assembly)
            .viewport_state(&viewport)
            .rasterization_state(&raster)
            .multisample_state(&samples)
            .color_blend_state(&blend)
            .dynamic_state(&dynamic)
            .layout(layout.raw)
            .push_next(&mut formats)];
        // SAFETY: modules and layout fit each other, and all states are given.
        let made = unsafe { device.raw.create_graphics_pipelines(vk::PipelineCache::null(), &info, None) };
        let raw = made.map_err(|(_, result)| result)?[0];
        Ok(Self { raw, layout: layout.raw, set: layout.set })
    }

    /// Records the binding of pipeline and set, and the push constants.
    pub(super) fn bind(
        &self,
        device: &Device,
        list: vk::CommandBuffer,
        point: vk::PipelineBindPoint,
        push: &[u8],
    ) {
        // SAFETY: pipeline, set and push constants have one layout.
        unsafe {
            device.raw.cmd_bind_pipeline(list, point, self.raw);
            if let Some(set) = self.set {
                device.raw.cmd_bind_descriptor_sets(list, point, self.layout, 0, &[set], &[]);
            }
            if !push.is_empty() {
                device.raw.cmd_push_constants(list, self.layout, vk::ShaderStageFlags::ALL, 0, push);
            }
        }
    }
}

/// Compiles a shader module.
pub(super) fn module(device: &Device, stage: GlslStage, text: &str) -> Result<vk::ShaderModule, Failure> {
    let words = compile(stage, text)?;
    // SAFETY: the words come from the compiler.
    Ok(unsafe { device.raw.create_shader_module(&vk::ShaderModuleCreateInfo::default().code(&words), None) }?)
}

/// Writes a storage buffer into a descriptor set.
pub(super) fn write_buffer(device: &Device, set: vk::DescriptorSet, binding: u32, buffer: vk::Buffer) {
    let info = [vk::DescriptorBufferInfo::default().buffer(buffer).range(vk::WHOLE_SIZE)];
    let write = [vk::WriteDescriptorSet::default()
        .dst_set(set)
        .dst_binding(binding)
        .descriptor_type(vk::DescriptorType::STORAGE_BUFFER)
        .buffer_info(&info)];
    // SAFETY: the set has the binding, and no command uses it yet.
    unsafe { device.raw.update_descriptor_sets(&write, &[]) };
}
