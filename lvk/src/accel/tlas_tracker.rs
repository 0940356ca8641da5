//! What top-level structures show once a command buffer is submitted.

use std::sync::Arc;

use super::AccelStruct;
use super::blas_refs::{AccelGeneration, BlasRefSet};
use super::instance::{InstanceSource, PlanMemory};
use super::tlas::{Tlas, TlasContents};
use crate::error::{Error, Result};
use crate::handle::AccelStructHandle;
use crate::handle_cache::HandleCache;
use crate::pool::HandlePool;

/// What a command buffer makes of one top-level structure.
#[derive(Default)]
pub(crate) struct TlasTracker {
    /// What it shows after the last command; where there was none yet, by the last submission that was looked at.
    contents: Option<TlasContents>,
    /// Whether a command has updated it.
    is_recorded: bool,
    /// The rows that the last command to do so has the table name; `None` where none did, and all rely on the table naming none.
    hit_table_address: Option<u64>,
    /// Whether a command was recorded before any had the table name rows: it relies on the table naming none.
    expects_no_hit_table: bool,
    /// The counts that a first command relies on which moves what is shown when the command buffer is submitted.
    expected_counts: Option<(u32, u32)>,
}

/// A command as it was recorded.
pub(crate) struct RecordedTlasBuild {
    /// Instances of the caller, and those Vulkan is given.
    pub(crate) counts: (u32, u32),
    pub(crate) refit: bool,
    /// The rows that it has the table of structures name, where it writes that.
    pub(crate) hit_table_address: Option<u64>,
    /// When what is shown was looked at.
    pub(crate) generation: AccelGeneration,
}

/// What a command has a structure show.
pub(crate) struct TlasChange {
    /// Instances of the caller.
    pub(crate) count: u32,
    /// Instances Vulkan is given.
    pub(crate) built_count: u32,
    /// What the instances refer to; `None` for the same as before.
    pub(crate) blas_refs: Option<Arc<BlasRefSet>>,
    pub(crate) source: Option<Arc<InstanceSource>>,
    pub(crate) refit: bool,
}

impl TlasTracker {
    /// What the structure shows before the next command.
    #[inline(always)]
    pub(crate) fn current(&mut self, tlas: &Tlas) -> &TlasContents {
        if !self.is_recorded {
            self.load_submitted(tlas);
        }
        self.contents.get_or_insert_default()
    }

    /// Looks at what the last submission has it show.
    #[inline(never)]
    fn load_submitted(&mut self, tlas: &Tlas) {
        self.contents = Some(tlas.contents().clone_without_source());
    }

    /// Whether a command has updated it.
    #[inline]
    pub(crate) fn is_recorded(&self) -> bool {
        self.is_recorded
    }

    /// A command was recorded. Answers whether one was before.
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

    /// A command has it show this from now on, and where it is `None` what was shown before, written from this source. Answers
    /// what is shown no longer, though commands of this command buffer are to read it.
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
        // What was submitted stays with the structure until this is submitted, too.
        if !was_recorded || (source.is_none() && blas_refs.is_none()) {
            return None;
        }
        Some(TlasContents { blas_refs: blas_refs.unwrap_or_default(), source, ..TlasContents::default() })
    }

    /// Whether what it shows can be written again from a source of its own.
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

    /// Makes it so. Answers what was shown before, unless that is still shown.
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

/// The updates of one command buffer, with memory that is used again.
#[derive(Default)]
pub(crate) struct TlasTrackers {
    /// Structures that were named.
    cache: HandleCache<AccelStructHandle, AccelStruct, 32>,
    /// One for each of them.
    trackers: Vec<TlasTracker>,
    /// What commands were to read and later ones have replaced.
    replaced: Vec<TlasContents>,
    /// What structures show of which nothing is known.
    no_refs: Arc<BlasRefSet>,
    plan_memory: PlanMemory,
}

/// One structure and what becomes of it.
pub(crate) struct TlasEntry<'a> {
    pub(crate) target: &'a Arc<AccelStruct>,
    pub(crate) tracker: &'a mut TlasTracker,
    pub(crate) no_refs: &'a Arc<BlasRefSet>,
    pub(crate) plan_memory: &'a mut PlanMemory,
}

impl TlasTrackers {
    /// Memory for more instances is let go.
    const MAX_KEPT_INSTANCES: usize = 1 << 16;

    /// The row of a structure.
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

    /// The row of a structure.
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

    /// What is in a row.
    #[inline]
    pub(crate) fn entry(&mut self, index: usize) -> TlasEntry<'_> {
        let Self { cache: found, trackers: list, no_refs, plan_memory: memory, .. } = self;
        TlasEntry { target: found.object(index), tracker: &mut list[index], no_refs, plan_memory: memory }
    }

    /// A command was recorded that has the structure of a row show something.
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

    /// As [`record_build`](Self::record_build), where the same is shown as before, and instances were written with addresses.
    #[inline(always)]
    pub(crate) fn record_unchanged(&mut self, index: usize, recorded: &RecordedTlasBuild) {
        let update = &mut self.trackers[index];
        let was_recorded = update.record(recorded);
        if update.has_source() {
            self.replaced.extend(update.replace_contents(None, None, was_recorded));
        }
    }

    /// Fails if what was recorded no longer fits what was submitted since.
    pub(crate) fn check(&self) -> Result<()> {
        self.cache
            .objects_from(0)
            .iter()
            .zip(&self.trackers)
            .try_for_each(|(target, update)| update.check(target))
    }

    /// Structures for which the table names rows by now, though a command relies on there being none.
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

    /// Makes it all so; `before` is told of each structure with what it is to show.
    pub(crate) fn apply(&mut self, mut before: impl FnMut(&Arc<AccelStruct>, &TlasContents)) {
        for (target, update) in self.cache.objects_from(0).iter().zip(&mut self.trackers) {
            if let (Ok(tlas), true, Some(contents)) = (target.tlas(), update.is_recorded, &update.contents) {
                before(target, contents);
                self.replaced.extend(update.apply(tlas));
            }
        }
    }

    /// What has to stay until the GPU is done with what was applied.
    pub(crate) fn drain_replaced(&mut self) -> impl Iterator<Item = TlasContents> + '_ {
        self.replaced.drain(..)
    }

    /// Whether the memory is not too much to keep for what is recorded next.
    pub(crate) fn is_worth_keeping(&self) -> bool {
        self.plan_memory.ref_indices.capacity() <= Self::MAX_KEPT_INSTANCES
    }

    /// Forgets everything, and keeps the memory.
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

    /// Over several command buffers, as each begins with what was submitted.
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

    /// What a command shows, and the next of the same command buffer no longer, is still read by the first.
    #[test]
    fn what_is_shown_is_kept_until_the_gpu_is_done_with_it() {
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

    /// Those that are not submitted change nothing, and leave nothing behind.
    #[test]
    fn a_command_buffer_that_is_given_up_keeps_nothing() {
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
