//! The pools of a context, one for each kind of object.

use std::sync::Arc;

use crate::accel::AccelStruct;
use crate::accel::micromap::Micromap;
use crate::handle::{
    AccelStructHandle, BufferHandle, ComputePipelineHandle, Handle, OpacityMicromapHandle, QueryPoolHandle,
    RayTracingLibraryHandle, RayTracingPipelineHandle, RenderPipelineHandle, SamplerHandle,
    ShaderModuleHandle, TextureHandle,
};
use crate::pipeline::{ComputePipeline, RayTracingLibrary, RayTracingPipeline, RenderPipeline, ShaderModule};
use crate::pool::{HandlePool, next_context_mask};
use crate::resource::{Buffer, QueryPool, Sampler, Texture};

/// Defines the store from one list: each pool with its handles and objects.
macro_rules! pools {
    ($($(#[$attribute:meta])* $pool:ident: $handle:ty => $object:ty;)*) => {
        /// Every object of a context, by handle.
        pub(crate) struct Store {
            /// A number that is unique among the contexts of the process.
            pub(crate) context_id: u64,
            $($(#[$attribute])* pub(crate) $pool: HandlePool<$handle, $object>,)*
        }

        impl Store {
            pub(crate) fn new() -> Self {
                let mask = next_context_mask();
                Self {
                    context_id: mask,
                    $($(#[$attribute])* $pool: HandlePool::new(mask, <$object as Named>::name),)*
                }
            }

            /// Returns every object, kind by kind.
            pub(crate) fn live(&self) -> Vec<LiveObject> {
                [$($(#[$attribute])* live(&self.$pool),)*].concat()
            }

            /// Removes every object.
            pub(crate) fn drain(&self) {
                $($(#[$attribute])* self.$pool.drain();)*
            }
        }

        $($(#[$attribute])* impl Named for $object {
            fn name(&self) -> &str {
                &self.name
            }
        })*
    };
}

pools! {
    buffers: BufferHandle => Buffer;
    textures: TextureHandle => Texture;
    samplers: SamplerHandle => Sampler;
    shader_modules: ShaderModuleHandle => ShaderModule;
    render_pipelines: RenderPipelineHandle => RenderPipeline;
    compute_pipelines: ComputePipelineHandle => ComputePipeline;
    ray_tracing_pipelines: RayTracingPipelineHandle => RayTracingPipeline;
    ray_tracing_libraries: RayTracingLibraryHandle => RayTracingLibrary;
    query_pools: QueryPoolHandle => QueryPool;
    micromaps: OpacityMicromapHandle => Micromap;
    accel_structs: AccelStructHandle => AccelStruct;
    #[cfg(feature = "window")]
    swapchains: crate::handle::SwapchainHandle => crate::swapchain::state::Swapchain;
}

/// An object that has a handle.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct LiveObject {
    /// Kind of the object, in the words of error messages: `buffer`, `render pipeline` and so on.
    pub kind: &'static str,
    /// Debug name of the object.
    pub name: String,
}

/// Objects that have a debug name.
trait Named {
    fn name(&self) -> &str;
}

/// Returns every object of a pool.
fn live<H: Handle, T: Named>(pool: &HandlePool<H, T>) -> Vec<LiveObject> {
    let describe = |object: &Arc<T>| LiveObject { kind: H::KIND, name: object.name().to_owned() };
    pool.all_objects().iter().map(describe).collect()
}
