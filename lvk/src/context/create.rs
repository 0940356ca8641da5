//! Creation of buffers, samplers, shader modules, pipelines and query pools.

#[cfg(feature = "glsl")]
use std::path::Path;
use std::sync::Arc;

use super::Context;
use super::holder::Holder;
use crate::error::readable::readable_name;
use crate::error::{Error, Result};
use crate::gpu::caps::capabilities::Capabilities;
use crate::handle::{
    BufferHandle, ComputePipelineHandle, QueryPoolHandle, RenderPipelineHandle, SamplerHandle,
    ShaderModuleHandle,
};
use crate::pipeline::compute::ComputePipelineDesc;
use crate::pipeline::graphics_desc::RenderPipelineDesc;
use crate::pipeline::{ComputePipeline, RenderPipeline, ShaderModule};
use crate::resource::buffer::{BufferDesc, InternalUsage};
use crate::resource::query_pool::QueryPoolDesc;
use crate::resource::sampler::SamplerDesc;
use crate::resource::{Buffer, QueryPool, Sampler};
use crate::shader::{CompileFiles, ShaderCache, ShaderCacheStats, ShaderModuleDesc, find_raw_hit_builtin};

/// Slot of objects that take no bindless slot.
pub(super) const NO_SLOT: u32 = 0;

impl Context {
    /// Creates a buffer (`vkCreateBuffer`). Every command submitted afterwards sees its initial contents.
    pub fn create_buffer(&self, desc: &BufferDesc<'_>) -> Result<Holder<BufferHandle>> {
        let buffer = Buffer::new(&self.device_state().gpu, desc, InternalUsage::NONE)?;
        let staged = desc.data.filter(|data| !buffer.write_initial(data));
        let handle = self.device_state().store.buffers.insert(buffer);
        let holder = Holder::new(self, handle, NO_SLOT);
        if let Some(data) = staged {
            self.upload_buffer(handle, 0, data)?;
        }
        Ok(holder)
    }

    /// Creates a sampler (`vkCreateSampler`). [`Holder::index`] is its element of `kSamplers[]`.
    pub fn create_sampler(&self, desc: &SamplerDesc<'_>) -> Result<Holder<SamplerHandle>> {
        let shared = self.device_state();
        let slot = shared.reserve_slot(|| shared.bindless.reserve_sampler(desc.debug_name))?;
        let sampler =
            Sampler::new(&shared.gpu, desc, slot).inspect_err(|_| shared.bindless.free_sampler(slot))?;
        shared.bindless.set_sampler(slot, sampler.raw);
        Ok(Holder::new(self, shared.store.samplers.insert(sampler), slot))
    }

    /// Creates a shader module from GLSL or SPIR-V (`vkCreateShaderModule`).
    ///
    /// # Errors
    /// [`Shader`](Error::Shader) with the compiler's message and the caller's own line numbers;
    /// [`Unsupported`](Error::Unsupported) when the module uses a capability whose feature the device lacks, such as
    /// those of the task and mesh stages.
    pub fn create_shader_module(&self, desc: &ShaderModuleDesc<'_>) -> Result<Holder<ShaderModuleHandle>> {
        self.create_module(desc, CompileFiles::with_cache(self.device_state().shader_cache.as_ref()))
    }

    /// As [`create_shader_module`](Self::create_shader_module). Calls `on_search` with each path at which an include is
    /// searched.
    #[cfg(feature = "glsl")]
    pub(crate) fn create_module_from_files(
        &self,
        desc: &ShaderModuleDesc<'_>,
        on_search: &dyn Fn(&Path),
    ) -> Result<Holder<ShaderModuleHandle>> {
        let cache = self.device_state().shader_cache.as_ref();
        self.create_module(desc, CompileFiles { cache, on_search: Some(on_search) })
    }

    fn create_module(
        &self,
        desc: &ShaderModuleDesc<'_>,
        files: CompileFiles<'_>,
    ) -> Result<Holder<ShaderModuleHandle>> {
        let shared = self.device_state();
        let module = ShaderModule::new(
            &shared.gpu,
            desc,
            files,
            Some(&shared.bindless),
            shared.layout.push_constant_bytes,
        )?;
        warn_of_raw_hit_ids(&shared.gpu.caps, desc);
        Ok(Holder::new(self, shared.store.shader_modules.insert(module), NO_SLOT))
    }

    /// Returns how many GLSL modules were found in the folder of
    /// [`ContextDesc::shader_cache`](crate::ContextDesc::shader_cache), and how many were not. Zeros without a folder.
    pub fn shader_cache_stats(&self) -> ShaderCacheStats {
        self.device_state().shader_cache.as_ref().map(ShaderCache::counts).unwrap_or_default()
    }

    /// Creates a graphics pipeline (`vkCreateGraphicsPipelines`) from a vertex shader, or from a mesh shader with or
    /// without a task shader.
    ///
    /// # Errors
    /// [`InvalidUsage`](Error::InvalidUsage) when the stages do not match, or the shaders and the description disagree;
    /// [`Unsupported`](Error::Unsupported) for mesh shaders and for formats that the device lacks;
    /// [`LimitExceeded`](Error::LimitExceeded) for workgroups and outputs of mesh shaders, and for targets.
    pub fn create_render_pipeline(
        &self,
        desc: &RenderPipelineDesc<'_>,
    ) -> Result<Holder<RenderPipelineHandle>> {
        let shared = self.device_state();
        let find = |handle| shared.store.shader_modules.get(handle);
        self.add_render_pipeline(RenderPipeline::new(
            &shared.gpu,
            shared.pipeline_base(),
            desc,
            &find,
            &shared.graphics_parts,
        )?)
    }

    pub(super) fn add_render_pipeline(
        &self,
        pipeline: RenderPipeline,
    ) -> Result<Holder<RenderPipelineHandle>> {
        let shared = self.device_state();
        shared.graphics_queries.insert(pipeline.query_stages);
        Ok(Holder::new(self, shared.store.render_pipelines.insert(pipeline), NO_SLOT))
    }

    /// Creates a compute pipeline (`vkCreateComputePipelines`).
    pub fn create_compute_pipeline(
        &self,
        desc: &ComputePipelineDesc<'_>,
    ) -> Result<Holder<ComputePipelineHandle>> {
        let shared = self.device_state();
        let module = self.required_module(desc.module, desc.debug_name, "compute")?;
        self.add_compute_pipeline(ComputePipeline::new(&shared.gpu, shared.pipeline_base(), desc, &module)?)
    }

    pub(super) fn add_compute_pipeline(
        &self,
        pipeline: ComputePipeline,
    ) -> Result<Holder<ComputePipelineHandle>> {
        Ok(Holder::new(self, self.device_state().store.compute_pipelines.insert(pipeline), NO_SLOT))
    }

    /// Creates a query pool (`vkCreateQueryPool`). All of its queries are reset and ready to be written.
    ///
    /// # Errors
    /// [`Unsupported`](Error::Unsupported) where the device lacks the kind of query,
    /// [`LimitExceeded`](Error::LimitExceeded) for more than 65,536 queries, and [`InvalidUsage`](Error::InvalidUsage)
    /// for a count of 0.
    pub fn create_query_pool(&self, desc: &QueryPoolDesc<'_>) -> Result<Holder<QueryPoolHandle>> {
        let pool = QueryPool::new(&self.device_state().gpu, desc)?;
        Ok(Holder::new(self, self.device_state().store.query_pools.insert(pool), NO_SLOT))
    }

    pub(super) fn required_module(
        &self,
        handle: Option<ShaderModuleHandle>,
        pipeline: &str,
        stage: &str,
    ) -> Result<Arc<ShaderModule>> {
        let missing = || Error::usage(pipeline, format!("give the pipeline a {stage} shader"));
        self.device_state().store.shader_modules.get(handle.ok_or_else(missing)?)
    }
}

/// Warns about shaders that use raw hit ids, on drivers and profiles whose meshes are split or reordered. Raw ids there
/// differ from the caller's ids.
fn warn_of_raw_hit_ids(caps: &Capabilities, desc: &ShaderModuleDesc<'_>) {
    if !(caps.prefers_spatial_order || caps.profile.is_some()) {
        return;
    }
    if let Some((number, helper)) = find_raw_hit_builtin(desc) {
        let name = readable_name(desc.debug_name);
        log::warn!("shader '{name}': {number} counts parts of split and reordered meshes here; use {helper}");
    }
}
