//! Compaction: asked for, carried out once the GPU has said how small structures can be.

use std::sync::{Arc, Weak};

use ash::vk;

use super::Context;
use crate::accel::AccelStruct;
use crate::accel::blas::{BlasStructures, CompactionState};
use crate::accel::compaction::{CompactedSizeQuery, CompactionRefusal, Compactions, PlannedCopy};
use crate::accel::flags::BuildFlags;
use crate::accel::raw_accel_struct::RawAccelStruct;
use crate::device_state::DeferredObject;
use crate::error::{Error, Result};
use crate::handle::AccelStructHandle;
use crate::lock_order::Guard;
use crate::resource::QueryPool;
use crate::resource::query_pool::QueryPoolDesc;

impl Context {
    /// Asks for bottom-level structures to be copied into as little memory as they need. Nothing waits.
    ///
    /// The sizes are asked of the GPU before the next submission; at a later submission, or frame, that finds the
    /// answers there, the copies are made and the structures' handles stand for them. Top-level structures that refer
    /// to a copied one are written and built again before that submission. The old memory is freed when the GPU is done
    /// with it. [`accel_struct_info`](Self::accel_struct_info) tells how far things are and what was saved. A compacted
    /// structure may be refitted, but not rebuilt. While a command buffer that builds a structure is not submitted yet,
    /// its copy waits: [`next_frame`](Self::next_frame) and [`flush`](Self::flush) are good moments.
    ///
    /// A copy needs room beside what it replaces. One that has none waits for the others, whose memory comes back, and
    /// [fails](crate::Compaction::Failed) when there is still none then; nothing else does for it. Structures that are
    /// compacted already, or about to be, are left alone. What software traces is never larger than it needs to be: where
    /// nothing else is traced, compaction is done at once, saves nothing, and leaves rebuilds possible.
    ///
    /// # Errors
    /// [`InvalidUsage`](Error::InvalidUsage) for a structure without [`BuildFlags::ALLOW_COMPACTION`], and then nothing
    /// is asked for.
    pub fn compact(&self, structures: &[AccelStructHandle]) -> Result<()> {
        let mut targets = Vec::with_capacity(structures.len());
        for handle in structures {
            let target = self.device_state().store.accel_structs.get(*handle)?;
            if !target.flags.contains(BuildFlags::ALLOW_COMPACTION) {
                target.blas()?;
                let message = "compaction needs BuildFlags::ALLOW_COMPACTION when the structure is created";
                return Err(Error::usage(&target.name, message));
            }
            targets.push(target);
        }
        let mut wanted = Vec::with_capacity(targets.len());
        for target in targets {
            let blas = target.blas()?;
            let compacted = blas.structures().compacted_from.is_some();
            if self.device_state().gpu.accel.is_none() {
                // What software traces has the size it needs from the start.
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
        if wanted.is_empty() {
            return Ok(None);
        }
        let mut count = 0;
        let mut targets = Vec::with_capacity(wanted.len());
        for target in wanted {
            targets.push((Arc::clone(target), count));
            count += target.blas()?.parts.len() as u32;
        }
        let desc = QueryPoolDesc { count, debug_name: "compacted sizes", ..Default::default() };
        let ty = vk::QueryType::ACCELERATION_STRUCTURE_COMPACTED_SIZE_KHR;
        let pool = QueryPool::with_type(&self.device_state().gpu, &desc, ty)?;
        let query = Arc::new(CompactedSizeQuery::new(pool, targets));
        let asked = self.record_in_prologue(|cmd| cmd.query_compacted_sizes(&query));
        self.device_state().free_later(DeferredObject::SizeQuery(Arc::clone(&query)));
        asked.map(|()| Some(query))
    }

    /// Carries out compactions whose sizes are known, and builds top-level structures again that refer to what they
    /// replaced. What fails stays as it was, with a warning: no submission of the caller fails for it.
    pub(super) fn advance_compactions(&self) {
        let mut compactions = self.lock_compactions();
        let advanced = if compactions.is_empty() { Ok(()) } else { self.advance_all(&mut compactions) };
        drop(compactions);
        if let Err(error) = advanced {
            log::warn!("compaction does not go on: {error}");
        }
        if self.device_state().take_tlas_outdated()
            && let Err(error) = self.rewrite_outdated_tlas()
        {
            log::warn!("a top-level structure still refers to structures from before compaction: {error}");
        }
    }

    /// Copies that have no room wait for those that have, which give memory back.
    fn advance_all(&self, compactions: &mut Compactions) -> Result<()> {
        let shared = self.device_state();
        let (submitted, completed) = (shared.submitter.last_submitted(), shared.submitter.completed_up_to()?);
        shared.collect()?;
        compactions.drop_freed();
        for query in std::mem::take(&mut compactions.queries) {
            match query.results() {
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

    /// Copies one structure, unless a build of it was recorded meanwhile.
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
        // Its handle may be gone, and nobody else keep it until the copy is made.
        shared.free_later(DeferredObject::BlasStorage(blas.structures()));
        shared.mark_tlas_outdated();
        Ok(CompactionStep::Copied(freed))
    }

    /// Structures are looked for again once the command buffer is open: what another thread destroys before does not wait
    /// for it.
    fn rewrite_outdated_tlas(&self) -> Result<()> {
        if self.outdated_tlas().is_empty() {
            return Ok(());
        }
        self.record_in_prologue(|cmd| {
            self.outdated_tlas().iter().try_for_each(|object| cmd.rewrite_tlas(object))
        })
    }

    /// Top-level structures that refer to what compaction has replaced.
    fn outdated_tlas(&self) -> Vec<Arc<AccelStruct>> {
        let mut all = self.device_state().store.accel_structs.all_objects();
        all.retain(|object| object.tlas().is_ok_and(|tlas| tlas.contents().blas_refs.is_outdated()));
        all
    }

    fn lock_compactions(&self) -> Guard<'_, Compactions> {
        self.inner.compactions.lock()
    }
}

/// What became of a copy.
enum CompactionStep {
    /// It is recorded; this is what it takes the place of.
    Copied(Weak<BlasStructures>),
    /// A build is not submitted yet, or there is no more room than before.
    Retry,
    /// The sizes are those of an earlier build.
    QueryAgain,
}

fn abort_compaction(target: &Arc<AccelStruct>, error: &Error) {
    log::warn!("structure '{}' stays uncompacted: {error}", target.name);
    cancel_compactions(std::slice::from_ref(target), CompactionState::Failed);
}

fn cancel_compactions(targets: &[Arc<AccelStruct>], wish: CompactionState) {
    for blas in targets.iter().filter_map(|target| target.blas().ok()) {
        blas.set_compaction_state(wish);
    }
}
