//! Destruction of objects, once the GPU is done with them.

use super::Context;
use crate::device_state::{DeferredObject, DeviceState};
use crate::error::{Error, Result};
use crate::handle::{
    AccelStructHandle, BufferHandle, ComputePipelineHandle, Handle, OpacityMicromapHandle, QueryPoolHandle,
    RayTracingLibraryHandle, RayTracingPipelineHandle, RenderPipelineHandle, SamplerHandle,
    ShaderModuleHandle, TextureHandle,
};

/// A handle whose object a context can destroy. All handles implement it.
pub trait Destroy: Handle {
    #[doc(hidden)]
    fn destroy_in(self, ctx: &Context);
}

impl Context {
    /// Destroys an object. The handle is stale from then on. Memory is freed when the last command buffer that may use
    /// the object is done. Does nothing for a stale handle or for an image of a swapchain. Warns of the handle of
    /// another context, whose object stays.
    pub fn destroy<H: Destroy>(&self, handle: H) {
        handle.destroy_in(self);
    }
}

/// Returns what was removed from a pool, and warns of the handle of another context.
pub(super) fn removed<T>(found: Result<T>) -> Option<T> {
    if let Err(error @ Error::ForeignHandle { .. }) = &found {
        log::warn!("nothing is destroyed: {error}");
    }
    found.ok()
}

macro_rules! destroy {
    ($($handle:ident: $pool:ident => $variant:ident;)*) => {
        $(impl Destroy for $handle {
            fn destroy_in(self, ctx: &Context) {
                let shared: &DeviceState = ctx.device_state();
                if let Some(object) = removed(shared.store.$pool.remove(self)) {
                    shared.free_later(DeferredObject::$variant(object));
                }
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
    /// Does nothing for images of a swapchain: they are destroyed with the swapchain.
    fn destroy_in(self, ctx: &Context) {
        let shared: &DeviceState = ctx.device_state();
        let textures = &shared.store.textures;
        if textures.get(self).is_ok_and(|texture| texture.lent) {
            return;
        }
        if let Some(texture) = removed(textures.remove(self)) {
            shared.free_later(DeferredObject::Texture(texture));
        }
    }
}

impl Destroy for ShaderModuleHandle {
    /// Destroys the module. Pipelines do not need their modules after creation.
    fn destroy_in(self, ctx: &Context) {
        drop(removed(ctx.device_state().store.shader_modules.remove(self)));
    }
}

impl Destroy for RayTracingLibraryHandle {
    /// Removes the handle. Pipelines that are linked from the library keep the library.
    fn destroy_in(self, ctx: &Context) {
        drop(removed(ctx.device_state().store.ray_tracing_libraries.remove(self)));
    }
}
