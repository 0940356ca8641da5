//! Everything a context and its command buffers share.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, OnceLock};

use ash::vk;

use crate::accel::AccelStruct;
use crate::accel::accel_struct::AccelKind;
use crate::accel::blas::BlasStructures;
use crate::accel::blas_refs::{AccelGeneration, BlasRef};
use crate::accel::compaction::CompactedSizeQuery;
use crate::accel::scratch_buffer::ScratchBuffer;
use crate::accel::storage::AccelStorage;
use crate::accel::tlas::TlasContents;
use crate::accel::tlas_tracker::TlasTrackers;
use crate::barrier::{RayQueryStages, ResourceId};
use crate::bindless::index_checks::BindlessArray;
use crate::bindless::{Bindless, TEXTURE_ARRAYS};
use crate::error::Result;
use crate::gpu::Gpu;
use crate::handle::AccelStructHandle;
use crate::kernels::Kernels;
use crate::leak_report;
use crate::lock_order::{Guard, Mutex};
use crate::pipeline::{
    ComputePipeline, PipelineBase, PipelineCache, PipelineLayout, RayTracingPipeline, RenderPipeline,
};
use crate::resource::{Buffer, QueryPool, Sampler, Texture};
use crate::shader::ShaderCache;
use crate::store::Store;
use crate::submit::profiler::Profiler;
use crate::submit::{Finished, Submitter};
use crate::upload::{BufferRecycler, Staging};

/// The parts of a context below the command layer. Fields are dropped in this order, the device last.
pub(crate) struct DeviceState {
    /// What stands in bindless slots nobody owns.
    pub(crate) default_objects: OnceLock<DefaultObjects>,
    pub(crate) store: Store,
    pub(crate) staging: Staging,
    /// One for each queue, so that builds on one queue do not wait for those on another.
    pub(crate) scratch: [ScratchBuffer; 3],
    pub(crate) accel_storage: AccelStorage,
    pub(crate) kernels: Kernels,
    /// Mapped buffers for lists of instances that are kept for a while.
    pub(crate) instance_buffers: BufferRecycler,
    /// For each top-level structure where the rows of its instances lie; none without acceleration structures.
    pub(crate) tlas_table: Option<Arc<Buffer>>,
    pub(crate) layout: PipelineLayout,
    /// Where the context keeps compiled pipelines in a file.
    pub(crate) pipeline_cache: Option<PipelineCache>,
    /// Where the context keeps SPIR-V that was compiled from GLSL.
    pub(crate) shader_cache: Option<ShaderCache>,
    pub(crate) bindless: Bindless,
    /// Where the context keeps trees that the CPU has built.
    #[cfg(feature = "software-ray-query")]
    pub(crate) tree_cache: Option<crate::software_ray_query::bvh_cache::BvhCache>,
    pub(crate) submitter: Submitter<DeferredObject>,
    pub(crate) profiler: Profiler,
    /// Where graphics pipelines query rays.
    pub(crate) graphics_queries: RayQueryStages,
    /// Stands for every bottom-level structure at once: their builds add to it; builds of top levels, traces and
    /// queries read it.
    pub(crate) all_blas: ResourceId,
    /// As `all_blas`, for first builds of structures that nothing shows yet: only what comes later on the same queue is kept
    /// behind them. Other queues wait for the structures they name.
    pub(crate) new_blas: [ResourceId; 3],
    /// Stands for every top-level structure at once: their builds add to it, traces and queries read it.
    pub(crate) all_tlas: ResourceId,
    /// Stands for the table of top-level structures and all rows.
    pub(crate) hit_tables_id: ResourceId,
    /// Some top-level structure shows what compaction has replaced.
    pub(crate) outdated_tlas: AtomicBool,
    /// How often a bottom-level structure has moved.
    pub(crate) blas_moves: AtomicU64,
    /// Slots of top-level structures that are gone, where the table still says what software traced.
    pub(crate) freed_tlas_slots: Mutex<Vec<u32>>,
    pub(crate) gpu: Arc<Gpu>,
}

/// Objects behind the dummy slots.
pub(crate) struct DefaultObjects {
    pub(crate) _textures: Vec<Arc<Texture>>,
    pub(crate) _sampler: Sampler,
    pub(crate) _tlas: Option<Arc<AccelStruct>>,
}

/// An object that waits until the GPU is done with it.
pub(crate) enum DeferredObject {
    Buffer(Arc<Buffer>),
    Texture(Arc<Texture>),
    Sampler(Arc<Sampler>),
    RenderPipeline(#[expect(dead_code, reason = "held only to be dropped")] Arc<RenderPipeline>),
    ComputePipeline(#[expect(dead_code, reason = "held only to be dropped")] Arc<ComputePipeline>),
    RayTracingPipeline(Arc<RayTracingPipeline>),
    QueryPool(Arc<QueryPool>),
    AccelStruct(Arc<AccelStruct>),
    #[cfg(feature = "window")]
    Swapchain(
        #[expect(dead_code, reason = "held only to be dropped")] Arc<crate::swapchain::state::Swapchain>,
    ),
    /// What a top-level structure showed; handles of it may still be in use.
    TlasContents(Box<TlasContents>),
    /// What a compacted structure took the place of, or what took its place.
    BlasStorage(#[expect(dead_code, reason = "held only to be dropped")] Arc<BlasStructures>),
    /// A buffer that a command buffer uses, whoever else holds it: its owner may fail to come into being.
    BufferRef(Arc<Buffer>),
    /// As [`BufferRef`](Self::BufferRef), one of those who [share](crate::resource::image::Image::add_texture) the image.
    TextureRef(Arc<Texture>),
    /// A structure of the library's own that a command buffer fills, whoever else holds it.
    #[cfg(feature = "software-ray-query")]
    SoftwareStorage(
        #[expect(dead_code, reason = "held only to be dropped")]
        Arc<crate::software_ray_query::storage::SoftwareAccelStorage>,
    ),
    /// Answered sizes, which may be there before the GPU is done with the command buffer that asked.
    SizeQuery(#[expect(dead_code, reason = "held only to be dropped")] Arc<CompactedSizeQuery>),
}

impl DeviceState {
    /// What pipelines are made with.
    pub(crate) fn pipeline_base(&self) -> PipelineBase {
        let cache = self.pipeline_cache.as_ref().map_or(vk::PipelineCache::null(), |cache| cache.raw);
        PipelineBase { layout: self.layout.raw, cache }
    }

    /// Destroys an object later, once no command buffer can use it.
    pub(crate) fn free_later(&self, garbage: DeferredObject) {
        const COLLECT_INTERVAL: usize = 256;
        self.mark_slot_retired(&garbage);
        let waiting = self.submitter.retire(garbage);
        if waiting.is_multiple_of(COLLECT_INTERVAL)
            && let Err(error) = self.collect()
        {
            log::error!("destroyed objects are not freed yet: {error}");
        }
    }

    /// The slot of the object may be reached no longer by what is recorded from now on.
    fn mark_slot_retired(&self, garbage: &DeferredObject) {
        let newest = || self.submitter.newest_sequence();
        match garbage {
            // Indices of textures in Y'CbCr are constants, which nobody checks.
            DeferredObject::Texture(texture) if texture.is_yuv() => {}
            DeferredObject::Texture(texture) => {
                self.bindless.record_retired(&TEXTURE_ARRAYS, texture.slot, newest)
            }
            DeferredObject::Sampler(sampler) => {
                self.bindless.record_retired(&[BindlessArray::Samplers], sampler.slot, newest);
            }
            DeferredObject::AccelStruct(object) => {
                if let AccelKind::Tlas(tlas) = &object.kind {
                    self.bindless.record_retired(&[BindlessArray::AccelStructs], tlas.slot, newest);
                }
            }
            _ => {}
        }
    }

    /// Takes a bindless slot; where none is free, takes back what the GPU has finished with and tries again.
    pub(crate) fn reserve_slot(&self, slot: impl Fn() -> Result<u32>) -> Result<u32> {
        slot().or_else(|_| {
            self.collect()?;
            slot()
        })
    }

    /// Takes back what the GPU has finished with.
    pub(crate) fn collect(&self) -> Result<()> {
        self.release_finished(self.submitter.collect()?)
    }

    /// The same, as far as is known without asking the GPU: for who has just waited.
    pub(crate) fn collect_known(&self) -> Result<()> {
        self.release_finished(self.submitter.collect_known())
    }

    pub(crate) fn release_finished(&self, finished: Finished<DeferredObject>) -> Result<()> {
        finished.staged.into_iter().for_each(|sequence| self.staging.release(sequence));
        finished.garbage.into_iter().for_each(|garbage| self.free_now(garbage));
        self.profiler.collect(finished.passed)
    }

    /// Drops an object the GPU is done with, and frees its slot.
    pub(crate) fn free_now(&self, garbage: DeferredObject) {
        match garbage {
            DeferredObject::Buffer(buffer) => self.submitter.forget(buffer.id),
            DeferredObject::QueryPool(pool) => self.submitter.forget(pool.id),
            DeferredObject::Texture(texture) => {
                if texture.image.remove_texture() {
                    self.submitter.forget(texture.image.id);
                }
                if texture.is_yuv() {
                    self.bindless.free_yuv(texture.slot);
                } else {
                    self.bindless.free_texture(texture.slot);
                }
            }
            DeferredObject::Sampler(sampler) => self.bindless.free_sampler(sampler.slot),
            DeferredObject::AccelStruct(object) => self.free_accel_struct(&object),
            DeferredObject::RayTracingPipeline(pipeline) => self.submitter.forget(pipeline.table.id),
            DeferredObject::TlasContents(contents) => self.recycle_instance_source(*contents),
            DeferredObject::BufferRef(buffer) => {
                if let Some(unused) = Arc::into_inner(buffer) {
                    self.submitter.forget(unused.id);
                }
            }
            DeferredObject::TextureRef(texture) => {
                if texture.image.remove_texture() {
                    self.submitter.forget(texture.image.id);
                }
            }
            DeferredObject::RenderPipeline(_)
            | DeferredObject::ComputePipeline(_)
            | DeferredObject::BlasStorage(_)
            | DeferredObject::SizeQuery(_) => {}
            #[cfg(feature = "software-ray-query")]
            DeferredObject::SoftwareStorage(_) => {}
            #[cfg(feature = "window")]
            DeferredObject::Swapchain(_) => {}
        }
    }

    /// Takes every object out that is still alive and reports it by name.
    fn free_leaked_objects(&mut self) {
        if let Some(report) = leak_report::leak_report(&self.store.live()) {
            log::warn!("{report}");
        }
        self.store.drain();
    }

    fn free_accel_struct(&self, object: &AccelStruct) {
        self.submitter.forget(object.id);
        match &object.kind {
            AccelKind::Tlas(tlas) => {
                // Before somebody else may take the slot.
                tlas.software.iter().for_each(|_| self.freed_tlas_slots().push(tlas.slot));
                self.bindless.free_tlas(tlas.slot);
                tlas.records.get().into_iter().for_each(|buffer| self.submitter.forget(buffer.id));
                let contents = std::mem::take(&mut *tlas.contents());
                self.recycle_instance_source(contents);
            }
            AccelKind::Blas(blas) => {
                for map in blas.parts.iter().filter_map(|part| part.map.as_ref()) {
                    self.submitter.forget(map.table.id);
                    map.gathered_inputs().into_iter().for_each(|inputs| self.submitter.forget(inputs.id));
                }
            }
        }
    }

    /// Slots whose entry in the table is to be emptied before anything else is submitted.
    pub(crate) fn freed_tlas_slots(&self) -> Guard<'_, Vec<u32>> {
        self.freed_tlas_slots.lock()
    }

    /// A source that was kept lies in buffers of the library's own; the next one may have the mapped one.
    fn recycle_instance_source(&self, contents: TlasContents) {
        // Contents written again share the source.
        let Some(source) = contents.source.and_then(Arc::into_inner) else { return };
        let bytes = [Some(source.instances), source.owners];
        for buffer in bytes.into_iter().flatten().filter_map(|bytes| bytes.buffer) {
            self.submitter.forget(buffer.id);
            self.instance_buffers.recycle(buffer);
        }
    }

    /// What updates say is submitted; `note` is told of each structure.
    pub(crate) fn apply_tlas_updates(
        &self,
        updates: &mut TlasTrackers,
        mut note: impl FnMut(&Arc<AccelStruct>),
    ) {
        updates.apply(|target, contents| {
            if contents.generation.moves != self.blas_moves() && contents.blas_refs.is_outdated() {
                self.mark_tlas_outdated();
            }
            note(target);
        });
        updates
            .drain_replaced()
            .for_each(|contents| self.free_later(DeferredObject::TlasContents(Box::new(contents))));
    }

    /// References the BLAS that a handle names.
    pub(crate) fn blas_ref(&self, handle: AccelStructHandle) -> Result<BlasRef> {
        self.store.accel_structs.get(handle)?.blas_ref(handle)
    }

    /// Rises with every structure that is destroyed or moves.
    #[inline]
    pub(crate) fn accel_generation(&self) -> AccelGeneration {
        AccelGeneration { removals: self.store.accel_structs.removals(), moves: self.blas_moves() }
    }

    /// How often a bottom-level structure has moved.
    #[inline]
    pub(crate) fn blas_moves(&self) -> u64 {
        self.blas_moves.load(Ordering::Acquire)
    }

    /// A bottom-level structure has moved.
    pub(crate) fn count_blas_move(&self) {
        self.blas_moves.fetch_add(1, Ordering::Release);
    }

    /// Some top-level structure shows what compaction has replaced.
    pub(crate) fn mark_tlas_outdated(&self) {
        self.outdated_tlas.store(true, Ordering::Release);
    }

    /// Whether that was noted since this was last asked.
    pub(crate) fn take_tlas_outdated(&self) -> bool {
        self.outdated_tlas.load(Ordering::Relaxed) && self.outdated_tlas.swap(false, Ordering::AcqRel)
    }
}

impl Drop for DeviceState {
    fn drop(&mut self) {
        // SAFETY: no command buffer is being recorded or submitted: each holds a reference to `self`.
        if let Err(result) = unsafe { self.gpu.device.device_wait_idle() } {
            log::error!("vkDeviceWaitIdle answered {result} at the end of a context");
        }
        drop(self.submitter.drain());
        self.free_leaked_objects();
    }
}
