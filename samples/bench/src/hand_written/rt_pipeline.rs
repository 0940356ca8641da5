//! A ray tracing pipeline with its shader binding table and a descriptor set with one TLAS.

use std::rc::Rc;

use lvk::ash::vk;

use super::RawDevice;
use super::buffer::RawBuffer;
use crate::error::BenchError;
use crate::tracer::View;

/// Binding of acceleration structures in set 0 of the shaders.
const BINDING: u32 = 4;
/// Stages of the pipeline.
const STAGES: vk::ShaderStageFlags = vk::ShaderStageFlags::from_raw(
    vk::ShaderStageFlags::RAYGEN_KHR.as_raw()
        | vk::ShaderStageFlags::MISS_KHR.as_raw()
        | vk::ShaderStageFlags::CLOSEST_HIT_KHR.as_raw(),
);
/// The stages of [`stages`](crate::pipelines::stages), which are also the order of the groups.
const KINDS: [vk::ShaderStageFlags; 6] = [
    vk::ShaderStageFlags::RAYGEN_KHR,
    vk::ShaderStageFlags::RAYGEN_KHR,
    vk::ShaderStageFlags::RAYGEN_KHR,
    vk::ShaderStageFlags::MISS_KHR,
    vk::ShaderStageFlags::MISS_KHR,
    vk::ShaderStageFlags::CLOSEST_HIT_KHR,
];

/// A ray tracing pipeline with its shader binding table and a descriptor set with one TLAS.
pub(crate) struct RawTracing {
    set_layout: vk::DescriptorSetLayout,
    layout: vk::PipelineLayout,
    pipeline: vk::Pipeline,
    pool: vk::DescriptorPool,
    set: vk::DescriptorSet,
    /// The first ray generation shader, the miss shaders, the hit group, no callable shader.
    regions: [vk::StridedDeviceAddressRegionKHR; 4],
    sbt: Option<RawBuffer>,
    stack: StackSize,
    /// Size of the stack that each trace sets, in bytes.
    stack_bytes: u32,
    device: Rc<RawDevice>,
}

/// How the pipeline gets its stack.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum StackSize {
    /// The driver computes the size.
    Default,
    /// Each trace sets the size, as the library does.
    Set,
}

impl RawTracing {
    /// Creates all objects for a trace of `tlas`, which is `element` of the shaders' array. `words` are the SPIR-V of the
    /// stages.
    pub(crate) fn new(
        device: &Rc<RawDevice>,
        words: &[Vec<u32>],
        tlas: vk::AccelerationStructureKHR,
        element: u32,
        stack: StackSize,
    ) -> Result<Self, BenchError> {
        let mut made = Self {
            set_layout: vk::DescriptorSetLayout::null(),
            layout: vk::PipelineLayout::null(),
            pipeline: vk::Pipeline::null(),
            pool: vk::DescriptorPool::null(),
            set: vk::DescriptorSet::null(),
            regions: [vk::StridedDeviceAddressRegionKHR::default(); 4],
            sbt: None,
            stack,
            stack_bytes: 0,
            device: Rc::clone(device),
        };
        made.create_layouts(element + 1)?;
        made.create_set(element + 1)?;
        made.write_set(tlas, element);
        made.create_pipeline(words)?;
        made.create_sbt()?;
        made.stack_bytes = made.bytes_of_stack();
        Ok(made)
    }

    /// Records a trace of primary rays.
    pub(crate) fn trace(&self, commands: vk::CommandBuffer, view: &View, [width, height]: [u32; 2]) {
        let device = &self.device.device;
        let point = vk::PipelineBindPoint::RAY_TRACING_KHR;
        let [ray_gen, miss, hit, callable] = &self.regions;
        // SAFETY: everything is alive and made for each other; the push constants are those of the layout.
        unsafe {
            device.cmd_bind_pipeline(commands, point, self.pipeline);
            device.cmd_bind_descriptor_sets(commands, point, self.layout, 0, &[self.set], &[]);
            device.cmd_push_constants(commands, self.layout, STAGES, 0, bytemuck::bytes_of(view));
            if self.stack == StackSize::Set {
                self.device.tracing.cmd_set_ray_tracing_pipeline_stack_size(commands, self.stack_bytes);
            }
            self.device.tracing.cmd_trace_rays(commands, ray_gen, miss, hit, callable, width, height, 1);
        }
    }

    fn create_layouts(&mut self, elements: u32) -> Result<(), BenchError> {
        let device = &self.device.device;
        let bindings = [vk::DescriptorSetLayoutBinding::default()
            .binding(BINDING)
            .descriptor_type(vk::DescriptorType::ACCELERATION_STRUCTURE_KHR)
            .descriptor_count(elements)
            .stage_flags(STAGES)];
        let partial = [vk::DescriptorBindingFlags::PARTIALLY_BOUND];
        let mut flags = vk::DescriptorSetLayoutBindingFlagsCreateInfo::default().binding_flags(&partial);
        let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings).push_next(&mut flags);
        // SAFETY: the description is valid; the context has turned partially bound descriptors on.
        self.set_layout = unsafe { device.create_descriptor_set_layout(&info, None) }
            .map_err(BenchError::hand_written("vkCreateDescriptorSetLayout"))?;
        let sets = [self.set_layout];
        let ranges =
            [vk::PushConstantRange { stage_flags: STAGES, offset: 0, size: size_of::<View>() as u32 }];
        let info = vk::PipelineLayoutCreateInfo::default().set_layouts(&sets).push_constant_ranges(&ranges);
        // SAFETY: the set layout is alive, and every device has room for so few push constants.
        self.layout = unsafe { device.create_pipeline_layout(&info, None) }
            .map_err(BenchError::hand_written("vkCreatePipelineLayout"))?;
        Ok(())
    }

    fn create_set(&mut self, elements: u32) -> Result<(), BenchError> {
        let device = &self.device.device;
        let sizes = [vk::DescriptorPoolSize::default()
            .ty(vk::DescriptorType::ACCELERATION_STRUCTURE_KHR)
            .descriptor_count(elements)];
        let info = vk::DescriptorPoolCreateInfo::default().max_sets(1).pool_sizes(&sizes);
        // SAFETY: the description is valid.
        self.pool = unsafe { device.create_descriptor_pool(&info, None) }
            .map_err(BenchError::hand_written("vkCreateDescriptorPool"))?;
        let layouts = [self.set_layout];
        let info = vk::DescriptorSetAllocateInfo::default().descriptor_pool(self.pool).set_layouts(&layouts);
        // SAFETY: pool and layout are alive, and the pool has room for the set.
        let sets = unsafe { device.allocate_descriptor_sets(&info) };
        self.set = sets.map_err(BenchError::hand_written("vkAllocateDescriptorSets"))?[0];
        Ok(())
    }

    fn write_set(&self, tlas: vk::AccelerationStructureKHR, element: u32) {
        let structures = [tlas];
        let mut written =
            vk::WriteDescriptorSetAccelerationStructureKHR::default().acceleration_structures(&structures);
        let mut write = vk::WriteDescriptorSet::default()
            .dst_set(self.set)
            .dst_binding(BINDING)
            .dst_array_element(element)
            .descriptor_type(vk::DescriptorType::ACCELERATION_STRUCTURE_KHR)
            .push_next(&mut written);
        write.descriptor_count = 1;
        // SAFETY: the set has the element, and no command uses it yet.
        unsafe { self.device.device.update_descriptor_sets(&[write], &[]) };
    }

    fn create_pipeline(&mut self, words: &[Vec<u32>]) -> Result<(), BenchError> {
        let mut modules = Vec::with_capacity(words.len());
        let made = words.iter().try_for_each(|words| {
            let info = vk::ShaderModuleCreateInfo::default().code(words);
            // SAFETY: the words come from the compiler.
            let module = unsafe { self.device.device.create_shader_module(&info, None) };
            modules.push(module.map_err(BenchError::hand_written("vkCreateShaderModule"))?);
            Ok(())
        });
        let linked = made.and_then(|()| self.create_pipeline_from(&modules));
        for module in modules {
            // SAFETY: no pipeline is being made of it.
            unsafe { self.device.device.destroy_shader_module(module, None) };
        }
        self.pipeline = linked?;
        Ok(())
    }

    fn create_pipeline_from(&self, modules: &[vk::ShaderModule]) -> Result<vk::Pipeline, BenchError> {
        let stage = |(module, kind): (&vk::ShaderModule, &vk::ShaderStageFlags)| {
            vk::PipelineShaderStageCreateInfo::default().stage(*kind).module(*module).name(c"main")
        };
        let stages: Vec<_> = modules.iter().zip(&KINDS).map(stage).collect();
        let groups: Vec<_> = (0..).zip(&KINDS).map(|(index, kind)| group(index, *kind)).collect();
        let dynamic = match self.stack {
            StackSize::Default => &[][..],
            StackSize::Set => &[vk::DynamicState::RAY_TRACING_PIPELINE_STACK_SIZE_KHR],
        };
        let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(dynamic);
        let info = vk::RayTracingPipelineCreateInfoKHR::default()
            .dynamic_state(&dynamic)
            .stages(&stages)
            .groups(&groups)
            .max_pipeline_ray_recursion_depth(1)
            .layout(self.layout);
        let (none, cache) = (vk::DeferredOperationKHR::null(), vk::PipelineCache::null());
        // SAFETY: modules and layout are alive and fit each other.
        let made = unsafe { self.device.tracing.create_ray_tracing_pipelines(none, cache, &[info], None) };
        made.map(|pipelines| pipelines[0])
            .map_err(|(_, result)| BenchError::hand_written("vkCreateRayTracingPipelinesKHR")(result))
    }

    /// Returns the bytes of a ray generation shader and of the largest shader that it calls.
    fn bytes_of_stack(&self) -> u32 {
        let of_kind = |hit: bool| {
            let groups =
                (0..).zip(&KINDS).filter(|(_, kind)| (**kind == vk::ShaderStageFlags::RAYGEN_KHR) != hit);
            let bytes = groups.map(|(group, kind)| {
                let shader = match *kind {
                    vk::ShaderStageFlags::CLOSEST_HIT_KHR => vk::ShaderGroupShaderKHR::CLOSEST_HIT,
                    _ => vk::ShaderGroupShaderKHR::GENERAL,
                };
                let tracing = &self.device.tracing;
                // SAFETY: the pipeline has the group, and the group the shader.
                unsafe { tracing.get_ray_tracing_shader_group_stack_size(self.pipeline, group, shader) }
            });
            bytes.max().unwrap_or(0)
        };
        (of_kind(false) + of_kind(true)) as u32
    }

    /// Creates the SBT: handles of the first ray generation shader, both miss shaders and the hit group, each at the base alignment.
    fn create_sbt(&mut self) -> Result<(), BenchError> {
        let limits = &self.device.ctx.capabilities().limits;
        let handle = limits.sbt_handle_bytes as usize;
        let stride = limits.sbt_handle_bytes.next_multiple_of(limits.sbt_handle_alignment.max(1)) as usize;
        let base = limits.sbt_base_alignment.max(1) as usize;
        let groups = KINDS.len();
        // SAFETY: the pipeline has so many groups.
        let handles = unsafe {
            let tracing = &self.device.tracing;
            tracing.get_ray_tracing_shader_group_handles(self.pipeline, 0, groups as u32, handle * groups)
        };
        let handles = handles.map_err(BenchError::hand_written("vkGetRayTracingShaderGroupHandlesKHR"))?;
        let miss_at = stride.next_multiple_of(base);
        let hit_at = (miss_at + 2 * stride).next_multiple_of(base);
        let usage = vk::BufferUsageFlags::SHADER_BINDING_TABLE_KHR;
        let sbt = RawBuffer::writable(&self.device, (hit_at + stride + base) as u64, usage)?;
        let first = sbt.address.next_multiple_of(base as u64);
        for (group, place) in [(0, 0), (3, miss_at), (4, miss_at + stride), (5, hit_at)] {
            let offset = first - sbt.address + place as u64;
            sbt.write(offset, &handles[group * handle..(group + 1) * handle])?;
        }
        let region = |offset: usize, count: usize| vk::StridedDeviceAddressRegionKHR {
            device_address: first + offset as u64,
            stride: stride as u64,
            size: (stride * count) as u64,
        };
        self.regions = [region(0, 1), region(miss_at, 2), region(hit_at, 1), Default::default()];
        self.sbt = Some(sbt);
        Ok(())
    }
}

impl Drop for RawTracing {
    fn drop(&mut self) {
        let device = &self.device.device;
        // SAFETY: the last submission was waited for; objects that were never created are null, which is allowed.
        unsafe {
            device.destroy_pipeline(self.pipeline, None);
            device.destroy_pipeline_layout(self.layout, None);
            device.destroy_descriptor_pool(self.pool, None);
            device.destroy_descriptor_set_layout(self.set_layout, None);
        }
    }
}

fn group(index: u32, kind: vk::ShaderStageFlags) -> vk::RayTracingShaderGroupCreateInfoKHR<'static> {
    let none = vk::RayTracingShaderGroupCreateInfoKHR::default()
        .general_shader(vk::SHADER_UNUSED_KHR)
        .closest_hit_shader(vk::SHADER_UNUSED_KHR)
        .any_hit_shader(vk::SHADER_UNUSED_KHR)
        .intersection_shader(vk::SHADER_UNUSED_KHR);
    match kind {
        vk::ShaderStageFlags::CLOSEST_HIT_KHR => {
            none.ty(vk::RayTracingShaderGroupTypeKHR::TRIANGLES_HIT_GROUP).closest_hit_shader(index)
        }
        _ => none.ty(vk::RayTracingShaderGroupTypeKHR::GENERAL).general_shader(index),
    }
}
