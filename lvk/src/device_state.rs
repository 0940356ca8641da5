//! Everything a context and its command buffers share.

use std::mem::ManuallyDrop;
use std::ops::Deref;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, OnceLock};
use std::time::Duration;

use ash::vk;

use crate::accel::AccelStruct;
use crate::accel::accel_struct::AccelKind;
use crate::accel::blas::BlasStructures;
use crate::accel::blas_refs::{AccelGeneration, BlasRef};
use crate::accel::compaction::CompactedSizeQuery;
use crate::accel::micromap::Micromap;
use crate::accel::scratch_buffer::ScratchBuffer;
use crate::accel::storage::AccelStorage;
use crate::accel::tlas::TlasContents;
use crate::accel::tlas_tracker::TlasTrackers;
use crate::barrier::{RayQueryStages, ResourceId};
use crate::bindless::index_checks::BindlessArray;
use crate::bindless::{Bindless, TEXTURE_ARRAYS};
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::gpu::caps::queues::IdleFailure;
use crate::handle::AccelStructHandle;
use crate::kernels::Kernels;
use crate::leak_report;
use crate::lock_order::{Guard, Mutex};
use crate::parallel::core_count;
use crate::pipeline::{
    ComputePipeline, GraphicsParts, PipelineBase, PipelineCache, PipelineLayout, RayTracingPipeline,
    RenderPipeline,
};
use crate::resource::image::Image;
use crate::resource::{Buffer, QueryPool, Sampler, Texture};
use crate::shader::ShaderCache;
use crate::store::Store;
use crate::submit::profiler::Profiler;
use crate::submit::{Finished, Submitter};
use crate::upload::{BufferRecycler, Staging};

/// The parts of a context below the command layer. Fields are dropped in this order, the device last.
pub(crate) struct DeviceState {
    /// The objects in bindless slots without an owner.
    pub(crate) default_objects: OnceLock<DefaultObjects>,
    pub(crate) store: Store,
    pub(crate) staging: Staging,
    /// A scratch buffer for each queue, so that builds on one queue do not wait for those on another.
    pub(crate) scratch: [ScratchBuffer; 3],
    pub(crate) accel_storage: AccelStorage,
    pub(crate) kernels: Kernels,
    /// Mapped buffers for lists of instances that outlive their command buffer.
    pub(crate) instance_buffers: BufferRecycler,
    /// Launches of indirect traces of lowered pipelines.
    pub(crate) launch_buffers: BufferRecycler,
    /// The addresses of the hit remap table and of the software TLAS of each TLAS; `None` without acceleration
    /// structures.
    pub(crate) tlas_table: Option<Arc<Buffer>>,
    pub(crate) layout: PipelineLayout,
    /// The file of compiled pipelines, if the context keeps one.
    pub(crate) pipeline_cache: Option<PipelineCache>,
    /// Parts that graphics pipelines are linked from.
    pub(crate) graphics_parts: GraphicsParts,
    /// The cache of SPIR-V that was compiled from GLSL, if the context keeps one.
    pub(crate) shader_cache: Option<ShaderCache>,
    pub(crate) bindless: Bindless,
    /// The cache of BVHs that the CPU has built, if the context keeps one.
    #[cfg(feature = "software-ray-query")]
    pub(crate) tree_cache: Option<crate::software_ray_query::bvh_cache::BvhCache>,
    pub(crate) submitter: Submitter<DeferredObject>,
    pub(crate) profiler: Profiler,
    /// The stages in which graphics pipelines query rays.
    pub(crate) graphics_queries: RayQueryStages,
    /// A pseudo-resource for all BLAS: builds of BLAS write it; builds of TLAS, traces and ray queries read it.
    pub(crate) all_blas: ResourceId,
    /// As `all_blas`, for first builds of BLAS that no TLAS references yet. Only later commands on the same queue wait
    /// for them. Other queues wait for the BLAS that they name.
    pub(crate) new_blas: [ResourceId; 3],
    /// A pseudo-resource for all TLAS: their builds write it; traces and ray queries read it.
    pub(crate) all_tlas: ResourceId,
    /// A pseudo-resource for the TLAS table and all hit remap tables.
    pub(crate) hit_tables_id: ResourceId,
    /// True if a TLAS references acceleration structures that compaction has replaced.
    pub(crate) outdated_tlas: AtomicBool,
    /// Number of moves of BLAS so far.
    pub(crate) blas_moves: AtomicU64,
    /// Slots of destroyed TLAS whose entry in the TLAS table still has the address of the software TLAS.
    pub(crate) freed_tlas_slots: Mutex<Vec<u32>>,
    pub(crate) gpu: Arc<Gpu>,
}

/// The objects behind default descriptors.
pub(crate) struct DefaultObjects {
    pub(crate) _textures: Vec<Arc<Texture>>,
    pub(crate) _sampler: Sampler,
    pub(crate) _tlas: Option<Arc<AccelStruct>>,
}

/// An object that is freed once the GPU is done with it.
pub(crate) enum DeferredObject {
    Buffer(Arc<Buffer>),
    Texture(Arc<Texture>),
    Sampler(Arc<Sampler>),
    RenderPipeline(#[expect(dead_code, reason = "held only to be dropped")] Arc<RenderPipeline>),
    ComputePipeline(#[expect(dead_code, reason = "held only to be dropped")] Arc<ComputePipeline>),
    RayTracingPipeline(Arc<RayTracingPipeline>),
    QueryPool(Arc<QueryPool>),
    /// A micromap. Each BLAS whose triangles have it has a reference too.
    Micromap(Arc<Micromap>),
    AccelStruct(Arc<AccelStruct>),
    #[cfg(feature = "window")]
    Swapchain(
        #[expect(dead_code, reason = "held only to be dropped")] Arc<crate::swapchain::state::Swapchain>,
    ),
    /// The previous contents of a TLAS. Handles of the BLAS in it may still be in use.
    TlasContents(Box<TlasContents>),
    /// The acceleration structures before or after a compaction, which a command buffer copies.
    BlasStorage(#[expect(dead_code, reason = "held only to be dropped")] Arc<BlasStructures>),
    /// A reference to a buffer that a command buffer uses. There may be other references; the creation of its owner may
    /// fail.
    BufferRef(Arc<Buffer>),
    /// A launch of an indirect trace, to be recycled.
    LaunchBuffer(Arc<Buffer>),
    /// As [`BufferRef`](Self::BufferRef), for one of the textures that
    /// [share](crate::resource::image::Image::add_texture) an image.
    TextureRef(Arc<Texture>),
    /// A reference to the storage of a software BVH that a command buffer fills. There may be other references.
    #[cfg(feature = "software-ray-query")]
    SoftwareStorage(
        #[expect(dead_code, reason = "held only to be dropped")]
        Arc<crate::software_ray_query::storage::SoftwareAccelStorage>,
    ),
    /// A query of compacted sizes, whose results may be there before the GPU is done with its command buffer.
    SizeQuery(#[expect(dead_code, reason = "held only to be dropped")] Arc<CompactedSizeQuery>),
}

impl DeviceState {
    /// Returns the layout and the cache for new pipelines.
    pub(crate) fn pipeline_base(&self) -> PipelineBase {
        let cache = self.pipeline_cache.as_ref().map_or(vk::PipelineCache::null(), |cache| cache.raw);
        let PipelineLayout { raw: layout, push_constant_bytes, .. } = self.layout;
        PipelineBase { layout, push_constant_bytes, cache, max_threads: core_count() }
    }

    /// Destroys an object once no command buffer can use it.
    pub(crate) fn free_later(&self, deferred: DeferredObject) {
        const COLLECT_INTERVAL: usize = 256;
        self.mark_slot_retired(&deferred);
        let waiting = self.submitter.retire(deferred);
        if waiting.is_multiple_of(COLLECT_INTERVAL)
            && let Err(error) = self.collect()
        {
            log::error!("destroyed objects are not freed yet: {error}");
        }
    }

    /// Marks the bindless slot of an object as invalid for commands recorded from now on.
    fn mark_slot_retired(&self, deferred: &DeferredObject) {
        let newest = || self.submitter.newest_sequence();
        match deferred {
            // Indices of Y'CbCr textures are constants, which the index checks do not cover.
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

    /// Reserves a bindless slot. If none is free, frees what the GPU has finished with and tries again.
    pub(crate) fn reserve_slot(&self, slot: impl Fn() -> Result<u32>) -> Result<u32> {
        slot().or_else(|_| {
            self.collect()?;
            slot()
        })
    }

    /// Frees the objects and the staging memory that the GPU has finished with.
    pub(crate) fn collect(&self) -> Result<()> {
        self.release_finished(self.submitter.collect()?)
    }

    /// As [`collect`](Self::collect), without asking the GPU for its progress. For callers that have just waited.
    pub(crate) fn collect_known(&self) -> Result<()> {
        self.release_finished(self.submitter.collect_known())
    }

    pub(crate) fn release_finished(&self, finished: Finished<DeferredObject>) -> Result<()> {
        finished.staged.into_iter().for_each(|sequence| self.staging.release(sequence));
        finished.deferred.into_iter().for_each(|deferred| self.free_now(deferred));
        self.submitter.explain_loss(self.profiler.collect(finished.passed))
    }

    /// Drops an object that the GPU is done with, and frees its slot.
    pub(crate) fn free_now(&self, deferred: DeferredObject) {
        match deferred {
            DeferredObject::Buffer(buffer) => self.submitter.forget(buffer.id),
            DeferredObject::QueryPool(pool) => self.submitter.forget(pool.id),
            DeferredObject::Texture(texture) => {
                if texture.image.remove_texture() {
                    self.forget_image(&texture.image);
                }
                if texture.is_yuv() {
                    self.bindless.free_yuv(texture.slot);
                } else {
                    self.bindless.free_texture(texture.slot);
                }
            }
            DeferredObject::Sampler(sampler) => self.bindless.free_sampler(sampler.slot),
            DeferredObject::Micromap(micromap) => {
                if let Some(unused) = Arc::into_inner(micromap) {
                    self.submitter.forget(unused.storage.id);
                }
            }
            DeferredObject::AccelStruct(object) => self.free_accel_struct(&object),
            DeferredObject::RayTracingPipeline(pipeline) => self.submitter.forget(pipeline.table.id),
            DeferredObject::TlasContents(contents) => self.recycle_instance_source(*contents),
            DeferredObject::BufferRef(buffer) => {
                if let Some(unused) = Arc::into_inner(buffer) {
                    self.submitter.forget(unused.id);
                }
            }
            DeferredObject::LaunchBuffer(buffer) => {
                self.submitter.forget(buffer.id);
                self.launch_buffers.recycle(buffer);
            }
            DeferredObject::TextureRef(texture) => {
                if texture.image.remove_texture() {
                    self.forget_image(&texture.image);
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

    fn forget_image(&self, image: &Image) {
        self.submitter.forget(image.id);
        image.transient_place.iter().for_each(|place| self.submitter.forget(place.member().bytes));
    }

    /// Removes every object that is still alive, and reports the objects by name.
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
                // The entry is queued before another TLAS can take the slot.
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

    /// Returns the slots whose entries in the TLAS table must be cleared before the next submission.
    pub(crate) fn freed_tlas_slots(&self) -> Guard<'_, Vec<u32>> {
        self.freed_tlas_slots.lock()
    }

    /// Frees the buffers of a kept instance source, and recycles the mapped one.
    fn recycle_instance_source(&self, contents: TlasContents) {
        // Rewritten contents share the source.
        let Some(source) = contents.source.and_then(Arc::into_inner) else { return };
        let bytes = [Some(source.instances), source.owners];
        for buffer in bytes.into_iter().flatten().filter_map(|bytes| bytes.buffer) {
            self.submitter.forget(buffer.id);
            self.instance_buffers.recycle(buffer);
        }
    }

    /// Applies TLAS updates that are submitted. Calls `note` with each TLAS.
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

    /// Returns a reference to the BLAS with this handle.
    pub(crate) fn blas_ref(&self, handle: AccelStructHandle) -> Result<BlasRef> {
        self.store.accel_structs.get(handle)?.blas_ref(handle)
    }

    /// Returns the generation of acceleration structures, which changes if one is destroyed or moves.
    #[inline]
    pub(crate) fn accel_generation(&self) -> AccelGeneration {
        AccelGeneration { removals: self.store.accel_structs.removals(), moves: self.blas_moves() }
    }

    /// Returns the number of moves of BLAS so far.
    #[inline]
    pub(crate) fn blas_moves(&self) -> u64 {
        self.blas_moves.load(Ordering::Acquire)
    }

    /// Counts the move of a BLAS.
    pub(crate) fn count_blas_move(&self) {
        self.blas_moves.fetch_add(1, Ordering::Release);
    }

    /// Records that a TLAS references acceleration structures that compaction has replaced.
    pub(crate) fn mark_tlas_outdated(&self) {
        self.outdated_tlas.store(true, Ordering::Release);
    }

    /// Returns true if a TLAS was marked as outdated since the last call.
    pub(crate) fn take_tlas_outdated(&self) -> bool {
        self.outdated_tlas.load(Ordering::Relaxed) && self.outdated_tlas.swap(false, Ordering::AcqRel)
    }
}

/// The state, which a context and its command buffers share. With the last of them the state is destroyed, or leaked where the
/// device may still use its objects: to destroy those is undefined, to keep their memory is not.
pub(crate) struct SharedDeviceState(ManuallyDrop<DeviceState>);

impl SharedDeviceState {
    pub(crate) fn new(state: DeviceState) -> Self {
        Self(ManuallyDrop::new(state))
    }
}

impl Deref for SharedDeviceState {
    type Target = DeviceState;

    #[inline]
    fn deref(&self) -> &DeviceState {
        &self.0
    }
}

impl Drop for SharedDeviceState {
    fn drop(&mut self) {
        let idle = persistent_wait(|| self.gpu.queues.wait_idle(&self.gpu.device), std::thread::sleep);
        // The caller has the report of a loss.
        if let Err(failure) = idle
            && self.submitter.loss().get().is_none()
        {
            let poll = || wait_by_polling(|| self.submitter.is_all_done(), std::thread::sleep);
            if !has_work_ended(failure, poll) {
                let error = failure.into_error();
                log::error!(
                    "the end of a context: {error}; its objects are leaked, because the device may still use them"
                );
                return;
            }
            if !failure.lacks_memory() {
                log::error!("the end of a context: {}", failure.into_error());
            }
        }
        drop(self.submitter.drain());
        if let Some(checks) = &self.bindless.checks {
            checks.log_faults();
        }
        self.0.free_leaked_objects();
        // SAFETY: the state is not used again.
        unsafe { ManuallyDrop::drop(&mut self.0) };
    }
}

/// Returns true if the device no longer uses any object after a failed wait: a lost device uses none, and another has none to
/// use once `poll` has seen the end of all submissions.
fn has_work_ended(failure: IdleFailure, poll: impl FnOnce() -> bool) -> bool {
    failure.result == vk::Result::ERROR_DEVICE_LOST || poll()
}

/// Waits for the queues. A wait that fails for lack of memory is tried again for about a second: objects that the device
/// still uses must not be destroyed, and the work that is under way ends in the meantime.
fn persistent_wait(
    mut wait: impl FnMut() -> Result<(), IdleFailure>,
    mut pause: impl FnMut(Duration),
) -> Result<(), IdleFailure> {
    const PAUSE: Duration = Duration::from_millis(20);
    const TRIES: usize = 50;
    for _ in 0..TRIES {
        match wait() {
            Err(failure) if failure.lacks_memory() => pause(PAUSE),
            ended => return ended,
        }
    }
    wait()
}

/// Waits for a minute at most until `is_done`, where a wait of the device fails. Questions that fail for
/// lack of memory too are asked again for a second. Returns true if the device no longer uses any object: the work is done, or the
/// device is lost. Returns false if the work never was done, or it cannot be known.
fn wait_by_polling(mut is_done: impl FnMut() -> Result<bool>, mut pause: impl FnMut(Duration)) -> bool {
    const PAUSE: Duration = Duration::from_millis(20);
    const TRIES: usize = 3_000;
    const MOST_FAILURES: usize = 50;
    let mut failures = 0;
    for _ in 0..TRIES {
        match is_done() {
            Ok(true) => return true,
            Ok(false) => {}
            Err(error) if error.lacks_memory() && failures < MOST_FAILURES => failures += 1,
            // A lost device uses no objects.
            Err(error) => return matches!(error, Error::DeviceLost { .. }),
        }
        pause(PAUSE);
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::queue::Queue;

    #[test]
    fn polling_ends_with_the_work_or_with_an_error() {
        let polled = |answers: &[std::result::Result<bool, vk::Result>]| {
            let (mut calls, mut pauses) = (0, 0);
            let is_done = || {
                calls += 1;
                let answer = answers[(calls - 1).min(answers.len() - 1)];
                answer.map_err(Error::vulkan("vkGetSemaphoreCounterValue", "test"))
            };
            (wait_by_polling(is_done, |_| pauses += 1), pauses)
        };
        let short = Err(vk::Result::ERROR_OUT_OF_HOST_MEMORY);
        assert_eq!(polled(&[Ok(true)]), (true, 0));
        assert_eq!(polled(&[Ok(false), short, Ok(true)]), (true, 2));
        assert_eq!(polled(&[Ok(false), Err(vk::Result::ERROR_UNKNOWN)]), (false, 1));
        assert_eq!(
            polled(&[short, Err(vk::Result::ERROR_DEVICE_LOST)]),
            (true, 1),
            "a lost device uses no objects"
        );
        assert_eq!(polled(&[short]), (false, 50));
        assert_eq!(polled(&[Ok(false)]), (false, 3_000));
    }

    /// Returns the results of the wait, and the number of pauses, for a wait that gives these results, the last for good.
    fn waited(results: &[Result<(), IdleFailure>]) -> (Result<(), IdleFailure>, usize) {
        let (mut calls, mut pauses) = (0, 0);
        let wait = || {
            calls += 1;
            results[(calls - 1).min(results.len() - 1)]
        };
        (persistent_wait(wait, |_| pauses += 1), pauses)
    }

    #[test]
    fn objects_are_destroyed_once_the_work_has_ended_or_the_device_is_lost() {
        let failed = |result| IdleFailure { queue: Queue::Graphics, result };
        for result in [vk::Result::ERROR_OUT_OF_HOST_MEMORY, vk::Result::ERROR_UNKNOWN] {
            assert!(has_work_ended(failed(result), || true));
            assert!(!has_work_ended(failed(result), || false));
        }
        assert!(
            has_work_ended(failed(vk::Result::ERROR_DEVICE_LOST), || false),
            "a lost device does not work"
        );
    }

    #[test]
    fn a_wait_that_lacks_memory_is_tried_again() {
        let failed = |result| Err(IdleFailure { queue: Queue::Graphics, result });
        let host = failed(vk::Result::ERROR_OUT_OF_HOST_MEMORY);
        let device = failed(vk::Result::ERROR_OUT_OF_DEVICE_MEMORY);
        assert_eq!(waited(&[Ok(())]), (Ok(()), 0));
        assert_eq!(waited(&[host, device, Ok(())]), (Ok(()), 2));
        assert_eq!(waited(&[host]), (host, 50));
        let lost = failed(vk::Result::ERROR_DEVICE_LOST);
        assert_eq!(waited(&[device, lost]), (lost, 1), "no wait brings a lost device back");
    }
}
