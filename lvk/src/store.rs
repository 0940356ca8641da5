//! The pools of a context, one for each kind of object.

use std::sync::Arc;

use crate::accel::AccelStruct;
use crate::handle::{
    AccelStructHandle, BufferHandle, ComputePipelineHandle, Handle, QueryPoolHandle, RayTracingLibraryHandle,
    RayTracingPipelineHandle, RenderPipelineHandle, SamplerHandle, ShaderModuleHandle, SwapchainHandle,
    TextureHandle,
};
use crate::pipeline::{ComputePipeline, RayTracingLibrary, RayTracingPipeline, RenderPipeline, ShaderModule};
use crate::pool::{HandlePool, next_context_mask};
use crate::resource::{Buffer, QueryPool, Sampler, Texture};
use crate::swapchain::state::Swapchain;

/// Every object of a context, by handle.
pub(crate) struct Store {
    /// A number no other context of the process has.
    pub(crate) context_id: u64,
    pub(crate) buffers: HandlePool<BufferHandle, Buffer>,
    pub(crate) textures: HandlePool<TextureHandle, Texture>,
    pub(crate) samplers: HandlePool<SamplerHandle, Sampler>,
    pub(crate) shader_modules: HandlePool<ShaderModuleHandle, ShaderModule>,
    pub(crate) render_pipelines: HandlePool<RenderPipelineHandle, RenderPipeline>,
    pub(crate) compute_pipelines: HandlePool<ComputePipelineHandle, ComputePipeline>,
    pub(crate) ray_tracing_pipelines: HandlePool<RayTracingPipelineHandle, RayTracingPipeline>,
    pub(crate) ray_tracing_libraries: HandlePool<RayTracingLibraryHandle, RayTracingLibrary>,
    pub(crate) query_pools: HandlePool<QueryPoolHandle, QueryPool>,
    pub(crate) accel_structs: HandlePool<AccelStructHandle, AccelStruct>,
    pub(crate) swapchains: HandlePool<SwapchainHandle, Swapchain>,
}

impl Store {
    pub(crate) fn new() -> Self {
        let mask = next_context_mask();
        Self {
            context_id: mask,
            buffers: HandlePool::new(mask),
            textures: HandlePool::new(mask),
            samplers: HandlePool::new(mask),
            shader_modules: HandlePool::new(mask),
            render_pipelines: HandlePool::new(mask),
            compute_pipelines: HandlePool::new(mask),
            ray_tracing_pipelines: HandlePool::new(mask),
            ray_tracing_libraries: HandlePool::new(mask),
            query_pools: HandlePool::new(mask),
            accel_structs: HandlePool::new(mask),
            swapchains: HandlePool::new(mask),
        }
    }

    /// Every object, kind by kind.
    pub(crate) fn live(&self) -> Vec<LiveObject> {
        [
            live(&self.buffers),
            live(&self.textures),
            live(&self.samplers),
            live(&self.shader_modules),
            live(&self.render_pipelines),
            live(&self.compute_pipelines),
            live(&self.ray_tracing_pipelines),
            live(&self.ray_tracing_libraries),
            live(&self.query_pools),
            live(&self.accel_structs),
            live(&self.swapchains),
        ]
        .concat()
    }

    /// Takes every object out.
    pub(crate) fn drain(&self) {
        self.buffers.drain();
        self.textures.drain();
        self.samplers.drain();
        self.shader_modules.drain();
        self.render_pipelines.drain();
        self.compute_pipelines.drain();
        self.ray_tracing_pipelines.drain();
        self.ray_tracing_libraries.drain();
        self.query_pools.drain();
        self.accel_structs.drain();
        self.swapchains.drain();
    }
}

/// An object that has a handle.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct LiveObject {
    /// Which kind of object, in the words of error messages: `buffer`, `render pipeline` and so on.
    pub kind: &'static str,
    /// Its debug name.
    pub name: String,
}

/// Objects that have a debug name.
trait Named {
    fn name(&self) -> &str;
}

macro_rules! named {
    ($($ty:ident)*) => {
        $(impl Named for $ty {
            fn name(&self) -> &str {
                &self.name
            }
        })*
    };
}

named! {
    Buffer Texture Sampler ShaderModule RenderPipeline ComputePipeline RayTracingPipeline RayTracingLibrary QueryPool
    AccelStruct Swapchain
}

/// Lists every object of a pool.
fn live<H: Handle, T: Named>(pool: &HandlePool<H, T>) -> Vec<LiveObject> {
    let describe = |object: &Arc<T>| LiveObject { kind: H::KIND, name: object.name().to_owned() };
    pool.all_objects().iter().map(describe).collect()
}
