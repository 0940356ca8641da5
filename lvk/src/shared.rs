//! Everything a context and its command buffers share.

use std::sync::{Arc, OnceLock};

use crate::accel::AccelStruct;
use crate::accel::scratch_buffer::ScratchBuffer;
use crate::accel::structure::AccelKind;
use crate::barrier::ResourceId;
use crate::bindless::Bindless;
use crate::error::Result;
use crate::gpu::Gpu;
use crate::pipeline::{ComputePipeline, PipelineLayout, RayTracingPipeline, RenderPipeline};
use crate::resource::{Buffer, QueryPool, Sampler, Texture};
use crate::store::Store;
use crate::submit::Submitter;
use crate::upload::Staging;

/// The parts of a context below the command layer. Fields are dropped in this order, the device last.
pub(crate) struct Shared {
    /// What stands in bindless slots nobody owns.
    pub(crate) dummies: OnceLock<DummyObjects>,
    pub(crate) store: Store,
    pub(crate) staging: Staging,
    pub(crate) scratch: ScratchBuffer,
    pub(crate) scratch_budget_bytes: u64,
    pub(crate) layout: PipelineLayout,
    pub(crate) bindless: Bindless,
    pub(crate) submitter: Submitter<Garbage>,
    /// Stands for every bottom-level structure at once: their builds add to it; builds of top levels, traces and
    /// queries read it.
    pub(crate) all_blas: ResourceId,
    /// Stands for every top-level structure at once: their builds add to it, traces and queries read it.
    pub(crate) all_tlas: ResourceId,
    pub(crate) gpu: Arc<Gpu>,
}

/// Objects behind the dummy slots.
pub(crate) struct DummyObjects {
    pub(crate) _textures: [Arc<Texture>; 2],
    pub(crate) _sampler: Sampler,
    pub(crate) _tlas: Option<Arc<AccelStruct>>,
}

/// An object that waits until the GPU is done with it.
pub(crate) enum Garbage {
    Buffer(Arc<Buffer>),
    Texture(Arc<Texture>),
    Sampler(Arc<Sampler>),
    RenderPipeline(#[expect(dead_code, reason = "held only to be dropped")] Arc<RenderPipeline>),
    ComputePipeline(#[expect(dead_code, reason = "held only to be dropped")] Arc<ComputePipeline>),
    RayTracingPipeline(Arc<RayTracingPipeline>),
    QueryPool(#[expect(dead_code, reason = "held only to be dropped")] Arc<QueryPool>),
    AccelStruct(Arc<AccelStruct>),
    /// A structure some top-level structure referred to; its handle may still be in use.
    Kept(#[expect(dead_code, reason = "held only to be dropped")] Arc<AccelStruct>),
}

impl Shared {
    /// Destroys an object later, once no command buffer can use it.
    pub(crate) fn retire(&self, garbage: Garbage) {
        const OFTEN_ENOUGH: usize = 256;
        let waiting = self.submitter.retire(garbage);
        if waiting.is_multiple_of(OFTEN_ENOUGH)
            && let Err(error) = self.collect()
        {
            log::error!("what was destroyed is not freed yet: {error}");
        }
    }

    /// Takes a bindless slot; where none is free, takes back what the GPU has finished with and tries again.
    pub(crate) fn reserve(&self, slot: impl Fn() -> Result<u32>) -> Result<u32> {
        slot().or_else(|_| {
            self.collect()?;
            slot()
        })
    }

    /// Takes back what the GPU has finished with.
    pub(crate) fn collect(&self) -> Result<()> {
        let finished = self.submitter.collect()?;
        for sequence in finished.sequences {
            self.staging.release(sequence);
        }
        finished.garbage.into_iter().for_each(|garbage| self.dispose(garbage));
        Ok(())
    }

    /// Drops an object the GPU is done with, and frees its slot.
    pub(crate) fn dispose(&self, garbage: Garbage) {
        match garbage {
            Garbage::Buffer(buffer) => self.submitter.forget(buffer.id),
            Garbage::Texture(texture) => {
                self.submitter.forget(texture.id);
                self.bindless.free_texture(texture.slot);
            }
            Garbage::Sampler(sampler) => self.bindless.free_sampler(sampler.slot),
            Garbage::AccelStruct(object) => self.dispose_accel_struct(&object),
            Garbage::RayTracingPipeline(pipeline) => self.submitter.forget(pipeline.table.id),
            Garbage::RenderPipeline(_)
            | Garbage::ComputePipeline(_)
            | Garbage::QueryPool(_)
            | Garbage::Kept(_) => {}
        }
    }

    /// Takes every object out that is still alive and reports it by name.
    fn drain_store(&mut self) {
        let store = &self.store;
        let report = |kind: &str, name: &str| log::warn!("{kind} '{name}' was alive when its context ended");
        store.buffers.drain().iter().for_each(|object| report("buffer", &object.name));
        store.textures.drain().iter().for_each(|object| report("texture", &object.name));
        store.samplers.drain().iter().for_each(|object| report("sampler", &object.name));
        store.shader_modules.drain().iter().for_each(|object| report("shader module", &object.name));
        store.render_pipelines.drain().iter().for_each(|object| report("render pipeline", &object.name));
        store.compute_pipelines.drain().iter().for_each(|object| report("compute pipeline", &object.name));
        store
            .ray_tracing_pipelines
            .drain()
            .iter()
            .for_each(|object| report("ray tracing pipeline", &object.name));
        store.query_pools.drain().iter().for_each(|object| report("query pool", &object.name));
        store.accel_structs.drain().iter().for_each(|object| report("acceleration structure", &object.name));
    }

    fn dispose_accel_struct(&self, object: &AccelStruct) {
        self.submitter.forget(object.id);
        if let AccelKind::Tlas(tlas) = &object.kind {
            self.bindless.free_tlas(tlas.slot);
        }
    }
}

impl Drop for Shared {
    fn drop(&mut self) {
        // SAFETY: no command buffer is being recorded or submitted: each holds a reference to `self`.
        if let Err(result) = unsafe { self.gpu.device.device_wait_idle() } {
            log::error!("vkDeviceWaitIdle answered {result} at the end of a context");
        }
        drop(self.submitter.drain());
        self.drain_store();
    }
}
