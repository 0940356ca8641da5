//! Destruction of objects, once the GPU is done with them.

use super::Context;
use crate::device_state::{DeferredObject, DeviceState};
use crate::error::{Error, Result, stale_object};
use crate::handle::{
    AccelStructHandle, BufferHandle, ComputePipelineHandle, Handle, OpacityMicromapHandle, QueryPoolHandle,
    RayTracingLibraryHandle, RayTracingPipelineHandle, RenderPipelineHandle, SamplerHandle,
    ShaderModuleHandle, TextureHandle,
};

/// A handle whose object a context can destroy. All handles implement it.
pub trait Destroy: Handle {
    #[doc(hidden)]
    fn destroy_in(self, ctx: &Context) -> Result<()>;
}

impl Context {
    /// Destroys an object. The handle is stale from then on. Memory is freed when the last command buffer that may use
    /// the object is done.
    ///
    /// Destroys nothing for a stale handle, for a handle of another context and for an image of a swapchain. A warning
    /// of the `log` crate tells so.
    pub fn destroy<H: Destroy>(&self, handle: H) {
        match handle.destroy_in(self) {
            Ok(()) => {}
            Err(Error::StaleHandle { kind, name }) => {
                let object = stale_object(kind, &name);
                log::warn!("nothing is destroyed: {object} was destroyed before; destroy it once");
            }
            Err(error) => log::warn!("nothing is destroyed: {error}"),
        }
    }
}

macro_rules! destroy {
    ($($handle:ident: $pool:ident => $variant:ident;)*) => {
        $(impl Destroy for $handle {
            fn destroy_in(self, ctx: &Context) -> Result<()> {
                let shared: &DeviceState = ctx.device_state();
                shared.free_later(DeferredObject::$variant(shared.store.$pool.remove(self)?));
                Ok(())
            }
        })*
    };
}

destroy! {
    BufferHandle: buffers => Buffer;
    SamplerHandle: samplers => Sampler;
    RenderPipelineHandle: render_pipelines => RenderPipeline;
    ComputePipelineHandle: compute_pipelines => ComputePipeline;
    RayTracingPipelineHandle: ray_tracing_pipelines => RayTracingPipeline;
    QueryPoolHandle: query_pools => QueryPool;
    OpacityMicromapHandle: micromaps => Micromap;
    AccelStructHandle: accel_structs => AccelStruct;
}

impl Destroy for TextureHandle {
    /// Fails for images of a swapchain: they are destroyed with the swapchain.
    fn destroy_in(self, ctx: &Context) -> Result<()> {
        let shared: &DeviceState = ctx.device_state();
        let texture = shared.store.textures.get(self)?;
        if texture.lent {
            return Err(Error::usage(&*texture.name, "it is an image of a swapchain; destroy the swapchain"));
        }
        shared.free_later(DeferredObject::Texture(shared.store.textures.remove(self)?));
        Ok(())
    }
}

impl Destroy for ShaderModuleHandle {
    /// Destroys the module. Pipelines do not need their modules after creation.
    fn destroy_in(self, ctx: &Context) -> Result<()> {
        ctx.device_state().store.shader_modules.remove(self).map(drop)
    }
}

impl Destroy for RayTracingLibraryHandle {
    /// Removes the handle. Pipelines that are linked from the library keep the library.
    fn destroy_in(self, ctx: &Context) -> Result<()> {
        ctx.device_state().store.ray_tracing_libraries.remove(self).map(drop)
    }
}
