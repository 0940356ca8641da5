//! Shader modules as objects of a context.

use std::sync::Arc;

use ::spirv::Capability;
use ash::vk;

use crate::bindless::Bindless;
use crate::bindless::index_checks::CheckPlan;
use crate::error::limit_origin::LimitOrigin;
use crate::error::readable::readable_name;
use crate::error::{Error, Result, check_limit};
use crate::gpu::Gpu;
use crate::gpu::caps::capabilities::Capabilities;
use crate::handle::ShaderModuleHandle;
use crate::shader::spirv::reflect::reflect;
use crate::shader::{CompileFiles, CompileOptions, Reflection, ShaderModuleDesc, ShaderStage};
use crate::shader::{check_capabilities, check_stage, compile, with_checked_indices};

/// Finds the module of a handle.
pub(crate) type ModuleLookup<'a> = &'a dyn Fn(ShaderModuleHandle) -> Result<Arc<ShaderModule>>;

/// A compiled module, destroyed on drop.
pub(crate) struct ShaderModule {
    /// Null if the module has `words`.
    pub(crate) raw: vk::ShaderModule,
    /// SPIR-V of a shader that is lowered with the others of its pipeline.
    pub(crate) words: Option<Arc<[u32]>>,
    pub(crate) stage: ShaderStage,
    pub(crate) reflection: Reflection,
    pub(crate) name: String,
    gpu: Arc<Gpu>,
}

impl ShaderModule {
    /// Creates a module. If `bindless` has index checks, modules other than the library's own are instrumented.
    pub(crate) fn new(
        gpu: &Arc<Gpu>,
        desc: &ShaderModuleDesc<'_>,
        files: CompileFiles<'_>,
        bindless: Option<&Bindless>,
        max_push_bytes: u32,
    ) -> Result<Self> {
        check_stage(desc.debug_name, desc.stage, &gpu.features)?;
        let words = compile(desc, &CompileOptions::from_capabilities(&gpu.caps), files)?;
        let reflection = reflect(desc.debug_name, desc.stage, &words)?;
        check_features(gpu, desc.debug_name, &reflection)?;
        let is_lowered = desc.stage.is_ray_tracing() && gpu.caps.lowered_pipelines();
        let stage = if is_lowered { ShaderStage::Compute } else { desc.stage };
        let mut extra = gpu.extra_capabilities.clone();
        if is_lowered {
            extra.extend(lowered_capabilities(&gpu.caps));
        }
        check_capabilities(desc.debug_name, stage, &reflection, &gpu.features, &extra)?;
        if let Some(last) = reflection.input_reads.last() {
            let (what, limit) = ("place of an input attachment", gpu.caps.limits.max_input_attachments);
            check_limit(desc.debug_name, what, u64::from(last.input.index()) + 1, limit.into())?;
        }
        if reflection.push_constant_bytes > max_push_bytes {
            let is_own = max_push_bytes < gpu.caps.limits.max_push_constant_bytes;
            return Err(Error::LimitExceeded {
                object: desc.debug_name.to_owned(),
                what: "push constants in bytes",
                requested: reflection.push_constant_bytes.into(),
                limit: max_push_bytes.into(),
                origin: if is_own { LimitOrigin::Library } else { LimitOrigin::Device },
            });
        }
        let words = match bindless.and_then(|bindless| bindless.check_plan(desc.debug_name)) {
            Some(plan) => with_index_checks(gpu, desc, words, &plan),
            None => words,
        };
        let (raw, words) = match is_lowered {
            true => (vk::ShaderModule::null(), Some(words.into())),
            false => (create_raw(gpu, desc.debug_name, &words)?, None),
        };
        let name = desc.debug_name.to_owned();
        Ok(Self { raw, words, stage: desc.stage, reflection, name, gpu: Arc::clone(gpu) })
    }

    /// Creates the compute shader that a ray tracing pipeline was lowered to. Its words may use ray queries of the
    /// device where shaders of the caller may not.
    pub(crate) fn from_lowered(gpu: &Arc<Gpu>, name: &str, words: &[u32]) -> Result<Self> {
        let stage = ShaderStage::Compute;
        let reflection = reflect(name, stage, words)?;
        let raw = create_raw(gpu, name, words)?;
        Ok(Self { raw, words: None, stage, reflection, name: name.to_owned(), gpu: Arc::clone(gpu) })
    }

    /// Fails unless the module has the stage `stage`.
    pub(crate) fn check_stage(&self, stage: ShaderStage) -> Result<()> {
        if self.stage == stage {
            return Ok(());
        }
        let message = format!("a {stage:?} module is needed here, this is a {:?} module", self.stage);
        Err(Error::usage(&self.name, message))
    }
}

impl Drop for ShaderModule {
    fn drop(&mut self) {
        // SAFETY: pipelines do not need their modules after creation; null is ignored.
        unsafe { self.gpu.device.destroy_shader_module(self.raw, None) };
    }
}

fn create_raw(gpu: &Gpu, name: &str, words: &[u32]) -> Result<vk::ShaderModule> {
    let info = vk::ShaderModuleCreateInfo::default().code(words);
    // SAFETY: the words are a complete module for a stage and features of this device.
    let raw = unsafe { gpu.device.create_shader_module(&info, None) }
        .map_err(Error::vulkan("vkCreateShaderModule", name))?;
    gpu.name(raw, name);
    Ok(raw)
}

/// Returns the capabilities of ray tracing stages that need no feature of the device if pipelines are lowered.
fn lowered_capabilities(device: &Capabilities) -> impl Iterator<Item = u32> {
    let fetch = device.position_fetch.then_some(Capability::RayTracingPositionFetchKHR);
    let always =
        [Capability::RayTracingKHR, Capability::RayTraversalPrimitiveCullingKHR, Capability::RayCullMaskKHR];
    always.into_iter().chain(fetch).map(|capability| capability as u32)
}

/// Returns the module with index checks. If the checks cannot be added, logs a warning and returns the module
/// unchanged.
fn with_index_checks(gpu: &Gpu, desc: &ShaderModuleDesc<'_>, words: Vec<u32>, plan: &CheckPlan) -> Vec<u32> {
    use ShaderStage::{Geometry, TessControl, TessEval, Vertex};
    let writes = match desc.stage {
        Vertex | TessControl | TessEval | Geometry => gpu.features.core.vertex_pipeline_stores_and_atomics,
        _ => vk::TRUE,
    };
    let stores =
        if writes == vk::TRUE { Ok(()) } else { Err("its stage cannot write on this device".to_owned()) };
    match stores.and_then(|()| with_checked_indices(&words, plan)) {
        Ok(checked) => checked,
        Err(why) => {
            let name = readable_name(desc.debug_name);
            log::warn!("the indices of shader '{name}' are not checked: {why}");
            words
        }
    }
}

fn check_features(gpu: &Gpu, name: &str, reflection: &Reflection) -> Result<()> {
    if reflection.ray_query && !gpu.caps.ray_query {
        return Err(gpu.unsupported(&format!("ray queries, which shader '{name}' uses")));
    }
    if reflection.ray_query && reflection.hardware_ray_query != gpu.caps.hardware_ray_query() {
        let traversal_by = if reflection.hardware_ray_query { "the device" } else { "the library itself" };
        let message = format!(
            "its ray queries were compiled for traversal by {traversal_by}; this context uses {:?}",
            gpu.caps.ray_query_path
        );
        return Err(Error::usage(name, message));
    }
    if reflection.ray_tracing && !gpu.caps.ray_tracing_pipeline {
        return Err(gpu.unsupported(&format!("ray tracing pipelines, which shader '{name}' is for")));
    }
    Ok(())
}
