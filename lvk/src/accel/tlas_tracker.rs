//! Contents that TLAS have once a command buffer is submitted.

use std::sync::Arc;

use super::AccelStruct;
use super::blas_refs::{AccelGeneration, BlasRefSet};
use super::instance::{InstanceSource, PlanMemory};
use super::tlas::{Tlas, TlasContents};
use crate::error::{Error, Result};
use crate::handle::AccelStructHandle;
use crate::handle_cache::HandleCache;
use crate::pool::HandlePool;

/// Changes of a command buffer to one TLAS.
#[derive(Default)]
pub(crate) struct TlasTracker {
    /// Contents after the last recorded command, or without one those of the last submission when they were loaded.
    contents: Option<TlasContents>,
    /// True if a command of this command buffer updates the TLAS.
    is_recorded: bool,
    /// Address that the last such command writes to the TLAS's hit remap table entry. `None` if no command writes it,
    /// and all commands rely on an empty entry.
    hit_table_address: Option<u64>,
    /// True if a command was recorded before any wrote the hit remap table entry. Such a command relies on an empty
    /// entry.
    expects_no_hit_table: bool,
    /// Instance counts that the first command requires at submission, if that command is a refit.
    expected_counts: Option<(u32, u32)>,
}

/// A recorded build or refit.
pub(crate) struct RecordedTlasBuild {
    /// Number of instances of the caller, and for Vulkan.
    pub(crate) counts: (u32, u32),
    pub(crate) refit: bool,
    /// Address that the command writes to the hit remap table entry; `None` if it does not write the entry.
    pub(crate) hit_table_address: Option<u64>,
    /// The generation at which the referenced BLAS were checked.
    pub(crate) generation: AccelGeneration,
}

/// New contents of a TLAS, set by a command.
pub(crate) struct TlasChange {
    /// Number of instances of the caller.
    pub(crate) count: u32,
    /// Number of instances for Vulkan.
    pub(crate) built_count: u32,
    /// The BLAS that the instances reference; `None` if they are the same as before.
    pub(crate) blas_refs: Option<Arc<BlasRefSet>>,
    pub(crate) source: Option<Arc<InstanceSource>>,
    pub(crate) refit: bool,
}

impl TlasTracker {
    /// Contents of the TLAS before the next command.
    #[inline(always)]
    pub(crate) fn current(&mut self, tlas: &Tlas) -> &TlasContents {
        if !self.is_recorded {
            self.load_submitted(tlas);
        }
        self.contents.get_or_insert_default()
    }

    /// Loads the contents of the last submission.
    #[inline(never)]
    fn load_submitted(&mut self, tlas: &Tlas) {
        self.contents = Some(tlas.contents().clone_without_source());
    }

    /// True if a command of this command buffer updates the TLAS.
    #[inline]
    pub(crate) fn is_recorded(&self) -> bool {
        self.is_recorded
    }

    /// Updates the counts for a recorded command. Returns true if an earlier command of this command buffer was
    /// recorded.
    #[inline(always)]
    fn record(&mut self, recorded: &RecordedTlasBuild) -> bool {
        let RecordedTlasBuild { counts, refit, hit_table_address, generation } = *recorded;
        self.hit_table_address = hit_table_address.or(self.hit_table_address);
        self.expects_no_hit_table |= self.hit_table_address.is_none();
        let was_recorded = std::mem::replace(&mut self.is_recorded, true);
        if refit && !was_recorded {
            self.expected_counts = Some(counts);
        }
        let contents = self.contents.get_or_insert_default();
        let refits = if refit { contents.refits.saturating_add(1) } else { 0 };
        (contents.instance_count, contents.built_count, contents.refits) = (Some(counts.0), counts.1, refits);
        contents.generation = generation;
        was_recorded
    }

    /// Replaces the BLAS references, or keeps them for `None`, and replaces the source. Returns replaced contents that
    /// commands of this command buffer still read.
    fn replace_contents(
        &mut self,
        blas_refs: Option<Arc<BlasRefSet>>,
        source: Option<Arc<InstanceSource>>,
        was_recorded: bool,
    ) -> Option<TlasContents> {
        let contents = self.contents.get_or_insert_default();
        let blas_refs = blas_refs.filter(|blas_refs| !Arc::ptr_eq(blas_refs, &contents.blas_refs));
        let source = std::mem::replace(&mut contents.source, source);
        let blas_refs = blas_refs.map(|blas_refs| std::mem::replace(&mut contents.blas_refs, blas_refs));
        // The submitted contents stay with the TLAS until this command buffer is submitted, too.
        if !was_recorded || (source.is_none() && blas_refs.is_none()) {
            return None;
        }
        Some(TlasContents { blas_refs: blas_refs.unwrap_or_default(), source, ..TlasContents::default() })
    }

    /// True if the contents have a source from which they can be written again.
    #[inline(always)]
    fn has_source(&self) -> bool {
        self.contents.as_ref().is_some_and(|contents| contents.source.is_some())
    }

    /// Fails if another submission changed the number of instances since the refit was recorded.
    fn check(&self, target: &AccelStruct) -> Result<()> {
        let Some(counts) = self.expected_counts else { return Ok(()) };
        if target.tlas()?.contents().counts() == Some(counts) {
            return Ok(());
        }
        let message =
            "a refit was recorded, but a submission since then changed the number of instances; rebuild";
        Err(Error::usage(&target.name, message))
    }

    /// Sets the contents of the TLAS. Returns the previous contents if the BLAS references changed or if they had a
    /// source.
    fn apply(&mut self, tlas: &Tlas) -> Option<TlasContents> {
        let Self { contents, hit_table_address, .. } = std::mem::take(self);
        let contents = TlasContents { hit_table_address: hit_table_address.unwrap_or(0), ..contents? };
        let mut place = tlas.contents();
        let shows_the_same = Arc::ptr_eq(&place.blas_refs, &contents.blas_refs);
        let before = std::mem::replace(&mut *place, contents);
        drop(place);
        (!shows_the_same || before.source.is_some()).then_some(before)
    }
}

/// The TLAS updates of one command buffer. Its memory is reused.
#[derive(Default)]
pub(crate) struct TlasTrackers {
    /// The TLAS of the command buffer, by handle.
    cache: HandleCache<AccelStructHandle, AccelStruct, 32>,
    /// One tracker for each TLAS in `cache`.
    trackers: Vec<TlasTracker>,
    /// Contents that recorded commands read and later commands replaced.
    replaced: Vec<TlasContents>,
    /// An empty set, for TLAS without known contents.
    no_refs: Arc<BlasRefSet>,
    plan_memory: PlanMemory,
}

/// One TLAS and its tracker.
pub(crate) struct TlasEntry<'a> {
    pub(crate) target: &'a Arc<AccelStruct>,
    pub(crate) tracker: &'a mut TlasTracker,
    pub(crate) no_refs: &'a Arc<BlasRefSet>,
    pub(crate) plan_memory: &'a mut PlanMemory,
}

impl TlasTrackers {
    /// Memory for more instances is not kept.
    const MAX_KEPT_INSTANCES: usize = 1 << 16;

    /// Index of the TLAS with this handle.
    #[inline]
    pub(crate) fn index_of_handle(
        &mut self,
        pool: &HandlePool<AccelStructHandle, AccelStruct>,
        handle: AccelStructHandle,
    ) -> Result<usize> {
        let index = self.cache.index_of_handle(pool, handle)?;
        self.grow();
        Ok(index)
    }

    /// Index of this TLAS.
    pub(crate) fn index_of(&mut self, target: &Arc<AccelStruct>) -> usize {
        let index = self.cache.index_of(target);
        self.grow();
        index
    }

    #[inline]
    fn grow(&mut self) {
        if self.trackers.len() < self.cache.len() {
            self.trackers.resize_with(self.cache.len(), TlasTracker::default);
        }
    }

    /// The entry at an index.
    #[inline]
    pub(crate) fn entry(&mut self, index: usize) -> TlasEntry<'_> {
        let Self { cache: found, trackers: list, no_refs, plan_memory: memory, .. } = self;
        TlasEntry { target: found.object(index), tracker: &mut list[index], no_refs, plan_memory: memory }
    }

    /// Records that a command changes the contents of the TLAS at an index.
    pub(crate) fn record_build(
        &mut self,
        index: usize,
        recorded: &RecordedTlasBuild,
        blas_refs: Option<Arc<BlasRefSet>>,
        source: Option<Arc<InstanceSource>>,
    ) {
        let update = &mut self.trackers[index];
        let was_recorded = update.record(recorded);
        self.replaced.extend(update.replace_contents(blas_refs, source, was_recorded));
    }

    /// As [`record_build`](Self::record_build), for the same BLAS references as before and instances written with
    /// addresses.
    #[inline(always)]
    pub(crate) fn record_unchanged(&mut self, index: usize, recorded: &RecordedTlasBuild) {
        let update = &mut self.trackers[index];
        let was_recorded = update.record(recorded);
        if update.has_source() {
            self.replaced.extend(update.replace_contents(None, None, was_recorded));
        }
    }

    /// Fails if a recorded refit no longer matches the submitted contents.
    pub(crate) fn check(&self) -> Result<()> {
        self.cache
            .objects_from(0)
            .iter()
            .zip(&self.trackers)
            .try_for_each(|(target, update)| update.check(target))
    }

    /// TLAS with a hit remap table in their entry, though a recorded command relies on an empty entry.
    pub(crate) fn with_unexpected_hit_table(&self) -> impl Iterator<Item = &Tlas> {
        let relying = self
            .cache
            .objects_from(0)
            .iter()
            .zip(&self.trackers)
            .filter(|(_, update)| update.expects_no_hit_table);
        relying
            .filter_map(|(target, _)| target.tlas().ok())
            .filter(|tlas| tlas.contents().hit_table_address != 0)
    }

    /// Sets the contents of all updated TLAS. Calls `before` with each TLAS and its new contents.
    pub(crate) fn apply(&mut self, mut before: impl FnMut(&Arc<AccelStruct>, &TlasContents)) {
        for (target, update) in self.cache.objects_from(0).iter().zip(&mut self.trackers) {
            if let (Ok(tlas), true, Some(contents)) = (target.tlas(), update.is_recorded, &update.contents) {
                before(target, contents);
                self.replaced.extend(update.apply(tlas));
            }
        }
    }

    /// Takes replaced contents, which must stay alive until the GPU has completed the applied commands.
    pub(crate) fn drain_replaced(&mut self) -> impl Iterator<Item = TlasContents> + '_ {
        self.replaced.drain(..)
    }

    /// True if the memory is small enough to keep for the next command buffer.
    pub(crate) fn is_worth_keeping(&self) -> bool {
        self.plan_memory.ref_indices.capacity() <= Self::MAX_KEPT_INSTANCES
    }

    /// Removes all entries and keeps the memory.
    pub(crate) fn clear(&mut self) {
        self.cache.clear();
        self.trackers.clear();
        self.replaced.clear();
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Weak;

    use super::*;
    use crate::accel::accel_struct::AccelKind;
    use crate::accel::flags::{AccelStructSizes, BuildFlags, BuildMode};

    fn structure() -> Arc<AccelStruct> {
        let kind = AccelKind::Tlas(Tlas::new(0, 4, 4, None, None));
        Arc::new(AccelStruct::new("scene", BuildFlags::empty(), AccelStructSizes::default(), kind))
    }

    fn recorded(count: u32, refit: bool) -> RecordedTlasBuild {
        RecordedTlasBuild {
            counts: (count, count),
            refit,
            hit_table_address: None,
            generation: AccelGeneration::default(),
        }
    }

    fn set() -> (Option<Arc<BlasRefSet>>, Weak<BlasRefSet>) {
        let set = Arc::new(BlasRefSet::default());
        let watch = Arc::downgrade(&set);
        (Some(set), watch)
    }

    fn submit(updates: &mut TlasTrackers) {
        updates.check().unwrap();
        updates.apply(|_, _| {});
    }

    /// Several command buffers, each of which begins with the submitted contents.
    #[test]
    fn auto_counts_the_refits_since_the_last_rebuild() {
        let (target, auto) = (structure(), BuildMode::Auto { max_refits: 2 });
        let mut refits = Vec::new();
        for _ in 0..4 {
            let mut updates = TlasTrackers::default();
            let index = updates.index_of(&target);
            for _ in 0..2 {
                let TlasEntry { target, tracker: update, .. } = updates.entry(index);
                let contents = update.current(target.tlas().unwrap());
                let refit = auto.refits(contents.counts() == Some((1, 1)), contents.refits);
                updates.record_unchanged(index, &recorded(1, refit));
                refits.push(refit);
            }
            submit(&mut updates);
        }
        assert_eq!(refits, [false, true, true, false, true, true, false, true]);
    }

    /// Contents that one command sets and the next command of the same command buffer replaces are still read by the
    /// first.
    #[test]
    fn referenced_blas_are_kept_until_the_gpu_is_done_with_them() {
        let target = structure();
        let [(first, is_first), (second, is_second), (third, is_third)] = [set(), set(), set()];
        let mut updates = TlasTrackers::default();
        let index = updates.index_of(&target);
        updates.record_build(index, &recorded(1, false), first, None);
        submit(&mut updates);
        drop(updates.drain_replaced());
        updates.clear();
        assert!(is_first.strong_count() > 0);
        let index = updates.index_of(&target);
        updates.record_build(index, &recorded(1, false), second, None);
        updates.record_build(index, &recorded(1, false), third, None);
        updates.record_unchanged(index, &recorded(1, true));
        let is_alive = || [&is_first, &is_second, &is_third].map(|set| set.strong_count() > 0);
        assert_eq!(is_alive(), [true; 3]);
        submit(&mut updates);
        assert_eq!(is_alive(), [true; 3]);
        let kept: Vec<_> = updates.drain_replaced().collect();
        updates.clear();
        assert_eq!(is_alive(), [true; 3]);
        drop(kept);
        assert_eq!(is_alive(), [false, false, true]);
    }

    /// Command buffers that are not submitted change no contents and keep nothing alive.
    #[test]
    fn a_cancelled_command_buffer_keeps_nothing() {
        let target = structure();
        let mut updates = TlasTrackers::default();
        let [(first, is_first), (second, is_second)] = [set(), set()];
        let index = updates.index_of(&target);
        updates.record_build(index, &recorded(1, false), first, None);
        updates.record_build(index, &recorded(2, false), second, None);
        updates.clear();
        assert_eq!((is_first.strong_count(), is_second.strong_count()), (0, 0));
        assert_eq!(target.tlas().unwrap().contents().counts(), None);
    }

    #[test]
    fn a_refit_needs_the_number_of_instances_it_was_recorded_for() {
        let target = structure();
        let [mut first, mut other, mut late] = [(); 3].map(|()| TlasTrackers::default());
        let record = |updates: &mut TlasTrackers, count, refit| {
            let index = updates.index_of(&target);
            updates.record_unchanged(index, &recorded(count, refit));
        };
        record(&mut first, 2, false);
        submit(&mut first);
        record(&mut late, 2, true);
        assert!(late.check().is_ok());
        record(&mut other, 3, false);
        submit(&mut other);
        let message = late.check().unwrap_err().to_string();
        assert!(message.contains("scene") && message.contains("rebuild"), "{message}");
    }
}
