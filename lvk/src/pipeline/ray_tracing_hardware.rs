//! Ray tracing pipelines of the device (`VK_KHR_ray_tracing_pipeline`).

use std::sync::Arc;

use ash::vk;

use super::pipeline_layout::PipelineBase;
use super::ray_tracing_compile::{LinkedLibraries, compile_groups};
use super::ray_tracing_desc::RayTracingPipelineDesc;
use super::ray_tracing_library::RayTracingLibrary;
use super::ray_tracing_stack::StackSizes;
use super::shader_groups::{CompiledGroups, ShaderGroups};
use crate::error::limit_origin::LimitOrigin;
use crate::error::{Error, Result, check_limit_of};
use crate::gpu::Gpu;
use crate::gpu::start::driver_workarounds::with_shared_device_lock;
use crate::shader::ShaderStage;

/// A pipeline of the device, destroyed on drop.
pub(crate) struct HardwarePipeline {
    pub(crate) raw: vk::Pipeline,
    /// Stack size of one ray, in bytes.
    pub(crate) stack_bytes: u32,
    _libraries: Vec<Arc<RayTracingLibrary>>,
    gpu: Arc<Gpu>,
}

impl HardwarePipeline {
    /// Compiles `groups`, and links them with `libraries`.
    pub(super) fn new(
        gpu: &Arc<Gpu>,
        base: PipelineBase,
        desc: &RayTracingPipelineDesc<'_>,
        groups: &ShaderGroups,
        libraries: &[Arc<RayTracingLibrary>],
    ) -> Result<Self> {
        let ext = gpu.ray_tracing_functions()?;
        let linked = linked_libraries(libraries);
        let raw = compile_groups(gpu, base, desc, groups, &linked, vk::PipelineCreateFlags::empty())?;
        gpu.name(raw, desc.debug_name);
        let mut pipeline = Self { raw, stack_bytes: 0, _libraries: libraries.to_vec(), gpu: Arc::clone(gpu) };
        let parts = std::iter::once(&groups.list).chain(libraries.iter().map(|library| &library.groups));
        let bytes = stack_sizes(ext, raw, parts).pipeline_bytes(desc.max_recursion, desc.max_callable_depth);
        let what = "stack of one ray in bytes (max_recursion, max_callable_depth)";
        check_limit_of(LimitOrigin::Vulkan, desc.debug_name, what, bytes, u32::MAX.into())?;
        pipeline.stack_bytes = bytes as u32;
        Ok(pipeline)
    }

    /// Returns the handles of the first `group_count` groups, in Vulkan's order. `name` is that of the pipeline.
    pub(super) fn handles(&self, name: &str, group_count: u32, handle_bytes: u32) -> Result<Vec<u8>> {
        let bytes = group_count as usize * handle_bytes as usize;
        // SAFETY: the pipeline has these groups, and the size is that of their handles.
        unsafe {
            self.gpu.ray_tracing_functions()?.get_ray_tracing_shader_group_handles(
                self.raw,
                0,
                group_count,
                bytes,
            )
        }
        .map_err(Error::vulkan("vkGetRayTracingShaderGroupHandlesKHR", name))
    }
}

impl Drop for HardwarePipeline {
    fn drop(&mut self) {
        // SAFETY: the owner has waited until the GPU is done with the pipeline.
        let destroy = || unsafe { self.gpu.device.destroy_pipeline(self.raw, None) };
        with_shared_device_lock(self.gpu.caps.driver_id, destroy);
    }
}

fn linked_libraries(libraries: &[Arc<RayTracingLibrary>]) -> LinkedLibraries {
    let compiled = || libraries.iter().filter_map(|library| library.compiled());
    LinkedLibraries {
        raw: compiled().map(|library| library.raw).collect(),
        ray_gen: compiled().find_map(|library| library.ray_gen.clone()),
    }
}

/// Returns the largest stack size of each kind of shader. Only shaders that a group contains are queried.
fn stack_sizes<'a>(
    ext: &ash::khr::ray_tracing_pipeline::Device,
    pipeline: vk::Pipeline,
    parts: impl Iterator<Item = &'a CompiledGroups>,
) -> StackSizes {
    let mut sizes = StackSizes::default();
    let mut first = 0;
    for part in parts {
        for (group, stage) in &part.shaders {
            let shader = match stage {
                ShaderStage::ClosestHit => vk::ShaderGroupShaderKHR::CLOSEST_HIT,
                ShaderStage::AnyHit => vk::ShaderGroupShaderKHR::ANY_HIT,
                ShaderStage::Intersection => vk::ShaderGroupShaderKHR::INTERSECTION,
                _ => vk::ShaderGroupShaderKHR::GENERAL,
            };
            // SAFETY: the pipeline has the group, and the group has the shader.
            let bytes =
                unsafe { ext.get_ray_tracing_shader_group_stack_size(pipeline, first + group, shader) };
            sizes.add(*stage, bytes);
        }
        first += part.len() as u32;
    }
    sizes
}
