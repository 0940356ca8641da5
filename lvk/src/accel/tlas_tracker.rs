//! What top-level structures show once a command buffer is submitted.

use std::sync::Arc;

use super::AccelStruct;
use super::blas_refs::{Revision, ShownSet};
use super::instance_plan::PlanMemory;
use super::tlas::{InstanceSource, Tlas, TlasContents};
use crate::error::{Error, Result};
use crate::handle::AccelStructHandle;
use crate::handle_cache::Found;
use crate::store::Pool;

/// What a command buffer makes of one top-level structure.
#[derive(Default)]
pub(crate) struct TlasUpdate {
    /// What it shows after the last command; where there was none yet, by the last submission that was looked at.
    contents: Option<TlasContents>,
    /// Whether a command has updated it.
    is_recorded: bool,
    /// The rows that the last command to do so has the table name; `None` where none did, and all rely on the table naming none.
    named_rows: Option<u64>,
    /// Whether a command was recorded before any had the table name rows: it relies on the table naming none.
    relies_on_no_rows: bool,
    /// The counts that a first command relies on which moves what is shown when the command buffer is submitted.
    relies_on: Option<(u32, u32)>,
}

/// A command as it was recorded.
pub(crate) struct Recorded {
    /// Instances of the caller, and those Vulkan is given.
    pub(crate) counts: (u32, u32),
    pub(crate) refit: bool,
    /// The rows that it has the table of structures name, where it writes that.
    pub(crate) named_rows: Option<u64>,
    /// When what is shown was looked at.
    pub(crate) revision: Revision,
}

/// What a command has a structure show.
pub(crate) struct Change {
    /// Instances of the caller.
    pub(crate) count: u32,
    /// Instances Vulkan is given.
    pub(crate) built_count: u32,
    /// What the instances refer to; `None` for the same as before.
    pub(crate) shown: Option<Arc<ShownSet>>,
    pub(crate) source: Option<Arc<InstanceSource>>,
    pub(crate) refit: bool,
}

impl TlasUpdate {
    /// What the structure shows before the next command.
    #[inline(always)]
    pub(crate) fn look(&mut self, tlas: &Tlas) -> &TlasContents {
        if !self.is_recorded {
            self.look_at_submitted(tlas);
        }
        self.contents.get_or_insert_default()
    }

    /// Looks at what the last submission has it show.
    #[inline(never)]
    fn look_at_submitted(&mut self, tlas: &Tlas) {
        self.contents = Some(tlas.contents().without_source());
    }

    /// Whether a command has updated it.
    #[inline]
    pub(crate) fn is_recorded(&self) -> bool {
        self.is_recorded
    }

    /// A command was recorded. Answers whether one was before.
    #[inline(always)]
    fn note(&mut self, recorded: &Recorded) -> bool {
        let Recorded { counts, refit, named_rows, revision } = *recorded;
        self.named_rows = named_rows.or(self.named_rows);
        self.relies_on_no_rows |= self.named_rows.is_none();
        let was_recorded = std::mem::replace(&mut self.is_recorded, true);
        if refit && !was_recorded {
            self.relies_on = Some(counts);
        }
        let contents = self.contents.get_or_insert_default();
        let refits = if refit { contents.refits.saturating_add(1) } else { 0 };
        (contents.instance_count, contents.built_count, contents.refits) = (Some(counts.0), counts.1, refits);
        contents.revision = revision;
        was_recorded
    }

    /// A command has it show this from now on, and where it is `None` what was shown before, written from this source. Answers
    /// what is shown no longer, though commands of this command buffer are to read it.
    fn replace(
        &mut self,
        shown: Option<Arc<ShownSet>>,
        source: Option<Arc<InstanceSource>>,
        was_recorded: bool,
    ) -> Option<TlasContents> {
        let contents = self.contents.get_or_insert_default();
        let shown = shown.filter(|shown| !Arc::ptr_eq(shown, &contents.shown));
        let source = std::mem::replace(&mut contents.source, source);
        let shown = shown.map(|shown| std::mem::replace(&mut contents.shown, shown));
        // What was submitted stays with the structure until this is submitted, too.
        if !was_recorded || (source.is_none() && shown.is_none()) {
            return None;
        }
        Some(TlasContents { shown: shown.unwrap_or_default(), source, ..TlasContents::default() })
    }

    /// Whether what it shows can be written again from a source of its own.
    #[inline(always)]
    fn has_source(&self) -> bool {
        self.contents.as_ref().is_some_and(|contents| contents.source.is_some())
    }

    /// Fails if another submission changed the number of instances since the refit was recorded.
    fn check(&self, target: &AccelStruct) -> Result<()> {
        let Some(counts) = self.relies_on else { return Ok(()) };
        if target.tlas()?.contents().counts() == Some(counts) {
            return Ok(());
        }
        let message =
            "a refit was recorded, but a submission since then changed the number of instances; rebuild";
        Err(Error::usage(&target.name, message))
    }

    /// Makes it so. Answers what was shown before, unless that is still shown.
    fn apply(&mut self, tlas: &Tlas) -> Option<TlasContents> {
        let Self { contents, named_rows, .. } = std::mem::take(self);
        let contents = TlasContents { named_rows: named_rows.unwrap_or(0), ..contents? };
        let mut place = tlas.contents();
        let shows_the_same = Arc::ptr_eq(&place.shown, &contents.shown);
        let before = std::mem::replace(&mut *place, contents);
        drop(place);
        (!shows_the_same || before.source.is_some()).then_some(before)
    }
}

/// The updates of one command buffer, with memory that is used again.
#[derive(Default)]
pub(crate) struct TlasUpdates {
    /// Structures that were named.
    found: Found<AccelStructHandle, AccelStruct, 32>,
    /// One for each of them.
    list: Vec<TlasUpdate>,
    /// What commands were to read and later ones have replaced.
    replaced: Vec<TlasContents>,
    /// What structures show of which nothing is known.
    nothing: Arc<ShownSet>,
    memory: PlanMemory,
}

/// One structure and what becomes of it.
pub(crate) struct Row<'a> {
    pub(crate) target: &'a Arc<AccelStruct>,
    pub(crate) update: &'a mut TlasUpdate,
    pub(crate) nothing: &'a Arc<ShownSet>,
    pub(crate) memory: &'a mut PlanMemory,
}

impl TlasUpdates {
    /// Memory for more instances is let go.
    const MOST_KEPT: usize = 1 << 16;

    /// The row of a structure.
    #[inline]
    pub(crate) fn find(
        &mut self,
        pool: &Pool<AccelStructHandle, AccelStruct>,
        handle: AccelStructHandle,
    ) -> Result<usize> {
        let row = self.found.find(pool, handle)?;
        self.make_room();
        Ok(row)
    }

    /// The row of a structure.
    pub(crate) fn row(&mut self, target: &Arc<AccelStruct>) -> usize {
        let row = self.found.row(target);
        self.make_room();
        row
    }

    #[inline]
    fn make_room(&mut self) {
        if self.list.len() < self.found.count() {
            self.list.resize_with(self.found.count(), TlasUpdate::default);
        }
    }

    /// What is in a row.
    #[inline]
    pub(crate) fn at(&mut self, row: usize) -> Row<'_> {
        let Self { found, list, nothing, memory, .. } = self;
        Row { target: found.at(row), update: &mut list[row], nothing, memory }
    }

    /// A command was recorded that has the structure of a row show something.
    pub(crate) fn record(
        &mut self,
        row: usize,
        recorded: &Recorded,
        shown: Option<Arc<ShownSet>>,
        source: Option<Arc<InstanceSource>>,
    ) {
        let update = &mut self.list[row];
        let was_recorded = update.note(recorded);
        self.replaced.extend(update.replace(shown, source, was_recorded));
    }

    /// As [`record`](Self::record), where the same is shown as before, and instances were written with addresses.
    #[inline(always)]
    pub(crate) fn record_alike(&mut self, row: usize, recorded: &Recorded) {
        let update = &mut self.list[row];
        let was_recorded = update.note(recorded);
        if update.has_source() {
            self.replaced.extend(update.replace(None, None, was_recorded));
        }
    }

    /// Fails if what was recorded no longer fits what was submitted since.
    pub(crate) fn check(&self) -> Result<()> {
        self.found.from(0).iter().zip(&self.list).try_for_each(|(target, update)| update.check(target))
    }

    /// Structures for which the table names rows by now, though a command relies on there being none.
    pub(crate) fn with_unknown_rows(&self) -> impl Iterator<Item = &Tlas> {
        let relying =
            self.found.from(0).iter().zip(&self.list).filter(|(_, update)| update.relies_on_no_rows);
        relying.filter_map(|(target, _)| target.tlas().ok()).filter(|tlas| tlas.contents().named_rows != 0)
    }

    /// Makes it all so; `before` is told of each structure with what it is to show.
    pub(crate) fn apply(&mut self, mut before: impl FnMut(&Arc<AccelStruct>, &TlasContents)) {
        for (target, update) in self.found.from(0).iter().zip(&mut self.list) {
            if let (Ok(tlas), true, Some(contents)) = (target.tlas(), update.is_recorded, &update.contents) {
                before(target, contents);
                self.replaced.extend(update.apply(tlas));
            }
        }
    }

    /// What has to stay until the GPU is done with what was applied.
    pub(crate) fn take_replaced(&mut self) -> impl Iterator<Item = TlasContents> + '_ {
        self.replaced.drain(..)
    }

    /// Whether the memory is not too much to keep for what is recorded next.
    pub(crate) fn is_worth_keeping(&self) -> bool {
        self.memory.refers.capacity() <= Self::MOST_KEPT
    }

    /// Forgets everything, and keeps the memory.
    pub(crate) fn clear(&mut self) {
        self.found.clear();
        self.list.clear();
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

    fn recorded(count: u32, refit: bool) -> Recorded {
        Recorded { counts: (count, count), refit, named_rows: None, revision: Revision::default() }
    }

    fn set() -> (Option<Arc<ShownSet>>, Weak<ShownSet>) {
        let set = Arc::new(ShownSet::default());
        let watch = Arc::downgrade(&set);
        (Some(set), watch)
    }

    fn submit(updates: &mut TlasUpdates) {
        updates.check().unwrap();
        updates.apply(|_, _| {});
    }

    /// Over several command buffers, as each begins with what was submitted.
    #[test]
    fn auto_counts_the_refits_since_the_last_rebuild() {
        let (target, auto) = (structure(), BuildMode::Auto { max_refits: 2 });
        let mut refits = Vec::new();
        for _ in 0..4 {
            let mut updates = TlasUpdates::default();
            let row = updates.row(&target);
            for _ in 0..2 {
                let Row { target, update, .. } = updates.at(row);
                let contents = update.look(target.tlas().unwrap());
                let refit = auto.refits(contents.counts() == Some((1, 1)), contents.refits);
                updates.record_alike(row, &recorded(1, refit));
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
        let mut updates = TlasUpdates::default();
        let row = updates.row(&target);
        updates.record(row, &recorded(1, false), first, None);
        submit(&mut updates);
        drop(updates.take_replaced());
        updates.clear();
        assert!(is_first.strong_count() > 0);
        let row = updates.row(&target);
        updates.record(row, &recorded(1, false), second, None);
        updates.record(row, &recorded(1, false), third, None);
        updates.record_alike(row, &recorded(1, true));
        let is_alive = || [&is_first, &is_second, &is_third].map(|set| set.strong_count() > 0);
        assert_eq!(is_alive(), [true; 3]);
        submit(&mut updates);
        assert_eq!(is_alive(), [true; 3]);
        let kept: Vec<_> = updates.take_replaced().collect();
        updates.clear();
        assert_eq!(is_alive(), [true; 3]);
        drop(kept);
        assert_eq!(is_alive(), [false, false, true]);
    }

    /// Those that are not submitted change nothing, and leave nothing behind.
    #[test]
    fn a_command_buffer_that_is_given_up_keeps_nothing() {
        let target = structure();
        let mut updates = TlasUpdates::default();
        let [(first, is_first), (second, is_second)] = [set(), set()];
        let row = updates.row(&target);
        updates.record(row, &recorded(1, false), first, None);
        updates.record(row, &recorded(2, false), second, None);
        updates.clear();
        assert_eq!((is_first.strong_count(), is_second.strong_count()), (0, 0));
        assert_eq!(target.tlas().unwrap().contents().counts(), None);
    }

    #[test]
    fn a_refit_needs_the_number_of_instances_it_was_recorded_for() {
        let target = structure();
        let [mut first, mut other, mut late] = [(); 3].map(|()| TlasUpdates::default());
        let record = |updates: &mut TlasUpdates, count, refit| {
            let row = updates.row(&target);
            updates.record_alike(row, &recorded(count, refit));
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
