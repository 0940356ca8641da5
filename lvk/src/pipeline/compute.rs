//! Compute pipelines.

use std::sync::Arc;

use ash::vk;

use super::block_layout::{BlockLayout, check_layouts};
use super::pipeline_layout::PipelineBase;
use super::shader_module::ShaderModule;
use super::stage::{Specialization, SpecializationConstant, stage_info};
use super::subgroup_size::SubgroupRequest;
use super::workgroup_memory::{WorkgroupMemoryLimits, check_workgroup_memory};
use super::workgroup_size::{WorkgroupLimits, check_workgroup_size};
use crate::cpu_scope::cpu_scope;
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::handle::ShaderModuleHandle;
use crate::shader::ShaderStage;

/// Describes a compute pipeline.
#[derive(Debug, Clone, Copy)]
pub struct ComputePipelineDesc<'a> {
    /// The compute shader. Default: none.
    pub module: Option<ShaderModuleHandle>,
    /// Values of specialization constants. Default: empty.
    pub specialization: &'a [SpecializationConstant],
    /// Invocations of each subgroup (`VkPipelineShaderStageRequiredSubgroupSizeCreateInfo`): a power of two within
    /// [`Limits::subgroup`](crate::Limits::subgroup). `None` leaves the size to the device. Needs
    /// [`OptionalFeature::SubgroupSizeControl`](crate::OptionalFeature::SubgroupSizeControl). Default: none.
    pub required_subgroup_size: Option<u32>,
    /// True if all invocations of every subgroup are active when it starts
    /// (`VK_PIPELINE_SHADER_STAGE_CREATE_REQUIRE_FULL_SUBGROUPS_BIT`). The size of the workgroup along x is then a
    /// multiple of `required_subgroup_size`, or of the largest subgroup size without it. Needs
    /// [`OptionalFeature::ComputeFullSubgroups`](crate::OptionalFeature::ComputeFullSubgroups). Default: false.
    pub full_subgroups: bool,
    /// Rust structs for the blocks of the shaders, compared with them at creation. Default: empty.
    pub layouts: &'a [BlockLayout],
    /// Name in error messages, validation messages and debuggers. Default: `"compute pipeline"`.
    pub debug_name: &'a str,
}

impl Default for ComputePipelineDesc<'_> {
    fn default() -> Self {
        Self {
            module: None,
            specialization: &[],
            required_subgroup_size: None,
            full_subgroups: false,
            layouts: &[],
            debug_name: "compute pipeline",
        }
    }
}

/// A compute pipeline, destroyed on drop.
pub(crate) struct ComputePipeline {
    pub(crate) raw: vk::Pipeline,
    pub(crate) push_constant_bytes: u32,
    pub(crate) ray_query: bool,
    pub(crate) name: Arc<str>,
    gpu: Arc<Gpu>,
}

impl ComputePipeline {
    pub(crate) fn new(
        gpu: &Arc<Gpu>,
        base: PipelineBase,
        desc: &ComputePipelineDesc<'_>,
        module: &ShaderModule,
    ) -> Result<Self> {
        cpu_scope!("create compute pipeline");
        module.check_stage(ShaderStage::Compute)?;
        let name = desc.debug_name;
        check_layouts(name, desc.layouts, std::iter::once(module))?;
        let limits = &gpu.caps.limits;
        let largest = WorkgroupLimits {
            size: limits.max_workgroup_size,
            invocations: limits.max_workgroup_invocations,
        };
        let workgroup = check_workgroup_size(name, module, desc.specialization, &largest)?;
        let subgroups = SubgroupRequest { size: desc.required_subgroup_size, full: desc.full_subgroups };
        subgroups.check(gpu, name, workgroup)?;
        let shared = limits.max_shared_bytes;
        let most = WorkgroupMemoryLimits { shared, payload: 0, together: shared };
        check_workgroup_memory(name, module, desc.specialization, &most)?;
        let constants = Specialization::new(name, desc.specialization, std::iter::once(module))?;
        let constants = constants.info();
        let mut required = vk::PipelineShaderStageRequiredSubgroupSizeCreateInfo::default()
            .required_subgroup_size(desc.required_subgroup_size.unwrap_or_default());
        let mut stage = stage_info(module, &constants).flags(subgroups.flags());
        if desc.required_subgroup_size.is_some() {
            stage = stage.push_next(&mut required);
        }
        let info = vk::ComputePipelineCreateInfo::default().layout(base.layout).stage(stage);
        // SAFETY: the module and the layout are alive and fit each other, and the device takes the subgroups.
        let made = unsafe { gpu.device.create_compute_pipelines(base.cache, &[info], None) };
        let raw = made.map_err(|(_, result)| Error::vulkan("vkCreateComputePipelines", name)(result))?[0];
        gpu.name(raw, name);
        Ok(Self {
            raw,
            push_constant_bytes: module.reflection.push_constant_bytes,
            ray_query: module.reflection.ray_query,
            name: name.into(),
            gpu: Arc::clone(gpu),
        })
    }
}

impl Drop for ComputePipeline {
    fn drop(&mut self) {
        // SAFETY: the owner has waited until the GPU is done with the pipeline.
        unsafe { self.gpu.device.destroy_pipeline(self.raw, None) };
    }
}
