//! Compilation of shader groups to a ray tracing pipeline or to a library.

use std::sync::Arc;

use ash::vk;

use super::deferred_operation::compile;
use super::pipeline_layout::PipelineBase;
use super::ray_tracing_desc::RayTracingPipelineDesc;
use super::shader_groups::ShaderGroups;
use super::shader_module::ShaderModule;
use super::stage::{Specialization, stage_info};
use crate::error::limit_origin::LimitOrigin;
use crate::error::{Error, Result, check_limit, check_limit_of};
use crate::gpu::Gpu;
use crate::gpu::caps::limits::lowered;

/// The libraries that a pipeline is linked with; the default is none.
#[derive(Default)]
pub(super) struct LinkedLibraries {
    pub(super) raw: Vec<vk::Pipeline>,
    /// A ray generation shader of one of the libraries.
    pub(super) ray_gen: Option<Arc<ShaderModule>>,
}

/// Fails unless the device supports the recursion depth and the interface that libraries must agree on.
pub(super) fn check_interface(gpu: &Gpu, desc: &RayTracingPipelineDesc<'_>) -> Result<()> {
    let (name, limits) = (desc.debug_name, &gpu.caps.limits);
    if desc.max_recursion == 0 {
        return Err(Error::usage(name, "a recursion depth of 0 traces no ray; 1 is the least"));
    }
    check_limit(name, "recursion depth", desc.max_recursion.into(), limits.max_ray_recursion.into())?;
    if gpu.caps.ray_tracing_pipeline_path.is_lowered() {
        let (what, most) = ("depth of callable shaders", lowered::MAX_CALLABLE_DEPTH);
        check_limit_of(LimitOrigin::Library, name, what, desc.max_callable_depth.into(), most.into())?;
    }
    let attributes = desc.max_hit_attribute_bytes.into();
    check_limit(name, "hit attributes in bytes", attributes, limits.max_hit_attribute_bytes.into())
}

/// Compiles groups as a pipeline that is linked with `libraries`, or as a library, depending on `flags`.
pub(super) fn compile_groups(
    gpu: &Gpu,
    base: PipelineBase,
    desc: &RayTracingPipelineDesc<'_>,
    groups: &ShaderGroups,
    libraries: &LinkedLibraries,
    flags: vk::PipelineCreateFlags,
) -> Result<vk::Pipeline> {
    let modules = groups.modules.iter().map(|module| &**module);
    let constants = Specialization::new(desc.debug_name, desc.specialization, modules.clone())?;
    let constants = constants.info();
    let stand_in = placeholder_stage(gpu, groups, libraries);
    let modules = modules.chain(stand_in.as_deref());
    let stages: Vec<_> = modules.map(|module| stage_info(module, &constants)).collect();
    let dynamic = [vk::DynamicState::RAY_TRACING_PIPELINE_STACK_SIZE_KHR];
    let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&dynamic);
    let linked = vk::PipelineLibraryCreateInfoKHR::default().libraries(&libraries.raw);
    let interface = vk::RayTracingPipelineInterfaceCreateInfoKHR::default()
        .max_pipeline_ray_payload_size(desc.max_payload_bytes)
        .max_pipeline_ray_hit_attribute_size(desc.max_hit_attribute_bytes);
    let mut info = vk::RayTracingPipelineCreateInfoKHR::default()
        .flags(flags | micromap_flag(gpu))
        .stages(&stages)
        .groups(&groups.infos)
        .max_pipeline_ray_recursion_depth(desc.max_recursion)
        .dynamic_state(&dynamic)
        .layout(base.layout);
    if flags.contains(vk::PipelineCreateFlags::LIBRARY_KHR) || !libraries.raw.is_empty() {
        groups.check_sizes(desc)?;
        info = info.library_info(&linked).library_interface(&interface);
    }
    // SAFETY: modules, layout and libraries are alive, the recursion depth is within the limit, and the libraries were
    // created with the same layout and agree on the interface.
    unsafe { compile(gpu, base, desc.debug_name, &info) }
}

/// Returns the flag without which rays of a pipeline may not meet triangles with opacity micromaps.
fn micromap_flag(gpu: &Gpu) -> vk::PipelineCreateFlags {
    match gpu.micromaps {
        Some(_) => vk::PipelineCreateFlags::RAY_TRACING_OPACITY_MICROMAP_EXT,
        None => vk::PipelineCreateFlags::empty(),
    }
}

/// Returns a stage that is part of no group, for lavapipe. It passes push constants only to pipelines that have a ray
/// generation shader outside of their libraries.
fn placeholder_stage(
    gpu: &Gpu,
    groups: &ShaderGroups,
    libraries: &LinkedLibraries,
) -> Option<Arc<ShaderModule>> {
    if gpu.caps.driver_name != "llvmpipe" || groups.list.counts().ray_gen > 0 {
        return None;
    }
    libraries.ray_gen.clone()
}
