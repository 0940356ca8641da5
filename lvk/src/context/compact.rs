//! Compaction of BLAS. A request is carried out once the GPU has returned the compacted sizes.

use std::sync::{Arc, Weak};

use ash::vk;

use super::Context;
use crate::accel::AccelStruct;
use crate::accel::blas::{BlasStructures, CompactionState};
use crate::accel::compaction::{CompactedSizeQuery, CompactionRefusal, Compactions, PlannedCopy};
use crate::accel::flags::BuildFlags;
use crate::accel::raw_accel_struct::RawAccelStruct;
use crate::device_state::DeferredObject;
use crate::error::readable::readable_name;
use crate::error::{Error, Result};
use crate::handle::AccelStructHandle;
use crate::lock_order::Guard;
use crate::resource::QueryPool;
use crate::resource::query_pool::QueryPoolDesc;

impl Context {
    /// Requests that BLAS are copied into as little memory as they need. Does not wait.
    ///
    /// The library queries the sizes on the GPU before the next submission. A later submission or frame finds the
    /// results and records the copies. The handles then refer to the copies. Every TLAS that references a copied BLAS
    /// is written and built again before that submission. The old memory is freed when the GPU is done with it.
    /// [`accel_struct_info`](Self::accel_struct_info) returns the progress and the saved bytes. A compacted BLAS may be
    /// refitted, but not rebuilt. While a command buffer that builds the BLAS is not submitted yet, the copy waits:
    /// [`next_frame`](Self::next_frame) and [`flush`](Self::flush) are good moments.
    ///
    /// A copy needs memory beside the original. A copy without memory waits until other compactions free theirs. It
    /// [fails](crate::Compaction::Failed) if there is still no memory then; nothing else fails because of it. Already
    /// compacted BLAS, and those with a pending compaction, are left unchanged. BVHs for software ray queries are never
    /// larger than needed. With software ray queries only, compaction is done at once, saves nothing, and
    /// rebuilds stay possible.
    ///
    /// # Errors
    /// [`InvalidUsage`](Error::InvalidUsage) for a BLAS without [`BuildFlags::ALLOW_COMPACTION`]. Then no compaction of
    /// the call is requested.
    pub fn compact(&self, structures: &[AccelStructHandle]) -> Result<()> {
        let mut targets = Vec::with_capacity(structures.len());
        for handle in structures {
            let target = self.device_state().store.accel_structs.get(*handle)?;
            if !target.flags.contains(BuildFlags::ALLOW_COMPACTION) {
                target.blas()?;
                let message = "compaction needs BuildFlags::ALLOW_COMPACTION when the BLAS is created";
                return Err(Error::usage(&target.name, message));
            }
            targets.push(target);
        }
        let mut wanted = Vec::with_capacity(targets.len());
        for target in targets {
            let blas = target.blas()?;
            let compacted = blas.structures().compacted_from.is_some();
            if self.device_state().gpu.accel.is_none() {
                // BVHs for software ray queries have the size they need from the start.
                blas.set_compaction_state(CompactionState::Idle);
                continue;
            }
            if !compacted && blas.set_compaction_state(CompactionState::Open) != CompactionState::Open {
                wanted.push(target);
            }
        }
        let query = self
            .query_compacted_sizes(&wanted)
            .inspect_err(|_| cancel_compactions(&wanted, CompactionState::None))?;
        self.lock_compactions().queries.extend(query);
        Ok(())
    }

    fn query_compacted_sizes(&self, wanted: &[Arc<AccelStruct>]) -> Result<Option<Arc<CompactedSizeQuery>>> {
        let [first, ..] = wanted else { return Ok(None) };
        let mut count = 0;
        let mut targets = Vec::with_capacity(wanted.len());
        for target in wanted {
            targets.push((Arc::clone(target), count));
            count += target.blas()?.parts.len() as u32;
        }
        let desc = QueryPoolDesc { count, debug_name: &first.name, ..Default::default() };
        let ty = vk::QueryType::ACCELERATION_STRUCTURE_COMPACTED_SIZE_KHR;
        let pool = QueryPool::with_type(&self.device_state().gpu, &desc, ty)?;
        let query = Arc::new(CompactedSizeQuery::new(pool, targets));
        let asked = self.record_in_prologue(|cmd| cmd.query_compacted_sizes(&query));
        self.device_state().free_later(DeferredObject::SizeQuery(Arc::clone(&query)));
        asked.map(|()| Some(query))
    }

    /// Records compactions whose sizes are known, and rebuilds each TLAS that references a replaced BLAS. A failed
    /// compaction leaves its BLAS unchanged and logs a warning. It never fails a submission of the caller.
    pub(super) fn advance_compactions(&self) {
        let mut compactions = self.lock_compactions();
        let advanced = if compactions.is_empty() { Ok(()) } else { self.advance_all(&mut compactions) };
        drop(compactions);
        if let Err(error) = advanced {
            log::warn!("compaction failed to advance: {error}");
        }
        if self.device_state().take_tlas_outdated() {
            let rewritten = self.rewrite_outdated_tlas();
            let failed_before =
                std::mem::replace(&mut self.lock_compactions().rewrite_failed, rewritten.is_err());
            if let Err(error) = rewritten {
                self.device_state().mark_tlas_outdated();
                if !failed_before {
                    let remedy = "each later submission tries again";
                    log::warn!("a TLAS references BLAS from before their compaction, and {remedy}: {error}");
                }
            }
        }
    }

    /// Advances all compactions. Copies without memory wait for other copies, which free memory.
    fn advance_all(&self, compactions: &mut Compactions) -> Result<()> {
        let shared = self.device_state();
        let (submitted, completed) = (shared.submitter.last_submitted(), shared.submitter.completed_up_to()?);
        shared.collect()?;
        compactions.drop_freed();
        for query in std::mem::take(&mut compactions.queries) {
            match shared.submitter.explain_loss(query.results(completed)) {
                Ok(Some(copies)) => compactions.copies.extend(copies),
                Ok(None) => compactions.queries.push(query),
                Err(error) => query.targets.iter().for_each(|(target, _)| abort_compaction(target, &error)),
            }
        }
        let mut again = Vec::new();
        for mut copy in std::mem::take(&mut compactions.copies) {
            let Some(target) = copy.target.upgrade() else { continue };
            let used_bytes = shared.accel_storage.used_bytes();
            match self.record_compaction(&target, &copy, used_bytes) {
                Ok(CompactionStep::Copied(old)) => compactions.replaced.push(old),
                Ok(CompactionStep::Retry) => compactions.copies.push(copy),
                Ok(CompactionStep::QueryAgain) => again.push(target),
                Err(error @ (Error::OverBudget { .. } | Error::OutOfDeviceMemory { .. })) => {
                    copy.refused = Some(CompactionRefusal { error, used_bytes, submitted });
                    compactions.copies.push(copy);
                }
                Err(error) => abort_compaction(&target, &error),
            }
        }
        match self.query_compacted_sizes(&again) {
            Ok(query) => compactions.queries.extend(query),
            Err(error) => again.iter().for_each(|target| abort_compaction(target, &error)),
        }
        for PlannedCopy { target, refused, .. } in compactions.drain_stuck(completed) {
            if let (Some(target), Some(refusal)) = (target.upgrade(), refused) {
                abort_compaction(&target, &refusal.error);
            }
        }
        Ok(())
    }

    /// Copies one BLAS, unless a build of it was recorded since the size query.
    fn record_compaction(
        &self,
        target: &Arc<AccelStruct>,
        copy: &PlannedCopy,
        used_bytes: u64,
    ) -> Result<CompactionStep> {
        let (shared, blas) = (self.device_state(), target.blas()?);
        if blas.build_count() != copy.builds {
            return Ok(CompactionStep::QueryAgain);
        }
        if blas.has_open_builds() || !copy.should_retry(used_bytes) {
            return Ok(CompactionStep::Retry);
        }
        let ty = vk::AccelerationStructureTypeKHR::BOTTOM_LEVEL;
        let structure =
            |bytes: &u64| RawAccelStruct::new(&shared.gpu, &shared.accel_storage, &target.name, ty, *bytes);
        let structures = copy.sizes.iter().map(structure).collect::<Result<Vec<_>>>()?;
        let compacted_from = Some(blas.structures().memory_bytes());
        let body = BlasStructures { structures, compacted_from, rebuildable: false };
        let replaced = self.record_in_prologue(|cmd| {
            let Some(old) = blas.replace_structures(body, copy.builds) else { return Ok(None) };
            shared.count_blas_move();
            cmd.copy_compacted(target, &old, &blas.structures())?;
            Ok(Some(old))
        })?;
        let Some(old) = replaced else { return Ok(CompactionStep::Retry) };
        blas.set_compaction_state(CompactionState::None);
        let freed = Arc::downgrade(&old);
        shared.free_later(DeferredObject::BlasStorage(old));
        // The caller may have destroyed the handle, and nothing else keeps the copy alive until it is made.
        shared.free_later(DeferredObject::BlasStorage(blas.structures()));
        shared.mark_tlas_outdated();
        Ok(CompactionStep::Copied(freed))
    }

    /// Writes and builds again each TLAS that references replaced BLAS. Collects them a second time once the command
    /// buffer is open: objects that another thread destroys earlier do not wait for that command buffer. Returns the
    /// first error once all were tried.
    fn rewrite_outdated_tlas(&self) -> Result<()> {
        if self.outdated_tlas().is_empty() {
            return Ok(());
        }
        self.record_in_prologue(|cmd| {
            let rewritten = self.outdated_tlas().into_iter().map(|object| cmd.rewrite_tlas(&object));
            rewritten.fold(Ok(()), Result::and)
        })
    }

    /// Returns each TLAS that references a BLAS which compaction has replaced.
    fn outdated_tlas(&self) -> Vec<Arc<AccelStruct>> {
        let mut all = self.device_state().store.accel_structs.all_objects();
        all.retain(|object| object.tlas().is_ok_and(|tlas| tlas.contents().blas_refs.is_outdated()));
        all
    }

    fn lock_compactions(&self) -> Guard<'_, Compactions> {
        self.inner.compactions.lock()
    }
}

/// Result of one attempt to copy a BLAS.
enum CompactionStep {
    /// The copy is recorded. Holds the replaced structures.
    Copied(Weak<BlasStructures>),
    /// A build is not submitted yet, or no memory was freed since the last attempt.
    Retry,
    /// The sizes belong to an earlier build.
    QueryAgain,
}

fn abort_compaction(target: &Arc<AccelStruct>, error: &Error) {
    log::warn!("BLAS '{}' stays uncompacted: {error}", readable_name(&*target.name));
    cancel_compactions(std::slice::from_ref(target), CompactionState::Failed);
}

fn cancel_compactions(targets: &[Arc<AccelStruct>], wish: CompactionState) {
    for blas in targets.iter().filter_map(|target| target.blas().ok()) {
        blas.set_compaction_state(wish);
    }
}
