//! Creation of ray tracing pipelines and of the libraries they are linked from.

use std::sync::Arc;

use super::Context;
use super::create::NO_SLOT;
use super::holder::Holder;
use crate::error::{Error, Result};
use crate::handle::{RayTracingLibraryHandle, RayTracingPipelineHandle};
use crate::pipeline::ray_tracing::SbtContents;
use crate::pipeline::ray_tracing_desc::RayTracingPipelineDesc;
use crate::pipeline::ray_tracing_library::RayTracingLibraryDesc;
use crate::pipeline::{RayTracingLibrary, RayTracingPipeline};

impl Context {
    /// Creates a ray tracing pipeline with its shader binding table (`vkCreateRayTracingPipelinesKHR`). It is compiled
    /// on as many cores as the driver uses. A pipeline that is lowered
    /// ([`ray_tracing_pipeline_path`](crate::Capabilities::ray_tracing_pipeline_path)) becomes a compute pipeline for each
    /// ray generation shader (`vkCreateComputePipelines`).
    ///
    /// # Errors
    /// [`Unsupported`](Error::Unsupported) without [`ray_tracing_pipeline`](crate::Capabilities::ray_tracing_pipeline);
    /// [`LimitExceeded`](Error::LimitExceeded) for a recursion depth or a shader record beyond the device's limit;
    /// [`Lowering`](Error::Lowering) for a shader that cannot be lowered;
    /// [`InvalidUsage`](Error::InvalidUsage) for a module of another stage, more records than shaders, or a library
    /// that does not match the pipeline.
    pub fn create_ray_tracing_pipeline(
        &self,
        desc: &RayTracingPipelineDesc<'_>,
    ) -> Result<Holder<RayTracingPipelineHandle>> {
        let shared = self.device_state();
        let find = |handle| shared.store.shader_modules.get(handle);
        let libraries = self.ray_tracing_libraries(desc.libraries)?;
        let base = shared.pipeline_base();
        self.add_ray_tracing_pipeline(RayTracingPipeline::new(&shared.gpu, base, desc, &find, &libraries)?)
    }

    pub(super) fn ray_tracing_libraries(
        &self,
        handles: &[RayTracingLibraryHandle],
    ) -> Result<Vec<Arc<RayTracingLibrary>>> {
        handles.iter().map(|handle| self.device_state().store.ray_tracing_libraries.get(*handle)).collect()
    }

    /// Adds a pipeline, and uploads its shader binding table.
    pub(super) fn add_ray_tracing_pipeline(
        &self,
        (pipeline, table): (RayTracingPipeline, SbtContents),
    ) -> Result<Holder<RayTracingPipelineHandle>> {
        let target = Arc::clone(&pipeline.table);
        let handle = self.device_state().store.ray_tracing_pipelines.insert(pipeline);
        let holder = Holder::new(self, handle, NO_SLOT);
        self.upload_to_buffer(&target, table.offset, &table.bytes)?;
        Ok(holder)
    }

    /// Compiles shaders that several ray tracing pipelines share (`vkCreateRayTracingPipelinesKHR` with
    /// `VK_PIPELINE_CREATE_LIBRARY_BIT_KHR`). Where pipelines are lowered, the library keeps its shaders, and each pipeline
    /// compiles them.
    ///
    /// # Errors
    /// [`Unsupported`](Error::Unsupported) without [`pipeline_libraries`](crate::Capabilities::pipeline_libraries);
    /// [`InvalidUsage`](Error::InvalidUsage) without any shader, and where a shader's payload or hit attributes are
    /// larger than the description allows; otherwise as
    /// [`create_ray_tracing_pipeline`](Self::create_ray_tracing_pipeline).
    pub fn create_ray_tracing_library(
        &self,
        desc: &RayTracingLibraryDesc<'_>,
    ) -> Result<Holder<RayTracingLibraryHandle>> {
        let shared = self.device_state();
        let find = |handle| shared.store.shader_modules.get(handle);
        let library = RayTracingLibrary::new(&shared.gpu, shared.pipeline_base(), desc, &find)?;
        Ok(Holder::new(self, shared.store.ray_tracing_libraries.insert(library), NO_SLOT))
    }

    /// Returns the bytes of stack that each ray of a pipeline needs. They are set when the pipeline is bound
    /// (`vkCmdSetRayTracingPipelineStackSizeKHR`). Code that binds the raw pipeline must set them as well. Lowered
    /// pipelines need 0 bytes.
    pub fn ray_tracing_stack_bytes(&self, pipeline: RayTracingPipelineHandle) -> Result<u32> {
        Ok(self.device_state().store.ray_tracing_pipelines.get(pipeline)?.stack_bytes())
    }

    /// Writes all pipelines compiled so far to the file of
    /// [`ContextDesc::pipeline_cache`](crate::ContextDesc::pipeline_cache). The file is replaced in one step. The end
    /// of the context writes it as well.
    ///
    /// # Errors
    /// [`InvalidUsage`](Error::InvalidUsage) for a context without such a file; [`File`](Error::File) when it cannot be
    /// written, for instance because its folder does not exist.
    pub fn save_pipeline_cache(&self) -> Result<()> {
        let message = "name a file in ContextDesc::pipeline_cache to keep compiled pipelines";
        let cache = self.device_state().pipeline_cache.as_ref();
        cache.ok_or_else(|| Error::usage("save_pipeline_cache", message))?.save()
    }

    /// Returns the bytes of compiled pipelines that the context loaded from its file. 0 without a file, or if the file
    /// was ignored because it is damaged or of another device or driver.
    pub fn pipeline_cache_loaded_bytes(&self) -> u64 {
        self.device_state().pipeline_cache.as_ref().map_or(0, |cache| cache.loaded_bytes)
    }
}
