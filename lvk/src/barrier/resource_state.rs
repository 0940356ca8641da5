//! Synchronisation state of one resource or image subresource, and the barrier that its next use needs.

use super::access::{Access, Layout, StageAccess, Stages, Use};

/// Both sides of one barrier.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct BarrierScopes {
    /// Stages that must have finished.
    pub(crate) src_stages: Stages,
    /// Writes of those stages that must be flushed.
    pub(crate) src_access: Access,
    /// Stages that must not start earlier.
    pub(crate) dst_stages: Stages,
    /// Accesses of those stages that must see the writes.
    pub(crate) dst_access: Access,
    /// Layout before; equal to `new_layout` where no transition is needed.
    pub(crate) old_layout: Layout,
    /// Layout after.
    pub(crate) new_layout: Layout,
}

/// Stages together with their accesses: one side of a barrier.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct BarrierScope {
    stages: Stages,
    access: Access,
}

impl BarrierScope {
    fn from_accesses(table: &StageAccess) -> Self {
        Self { stages: table.stages(), access: table.access() }
    }

    /// Returns stages without accesses, for dependencies that flush nothing and make nothing visible.
    fn execution_only(stages: Stages) -> Self {
        Self { stages, access: Access::empty() }
    }

    /// Returns the scope as a use. A barrier affects every access of every stage it names.
    fn as_use(self) -> Use {
        Use { stages: self.stages, access: self.access, layout: Layout::Undefined }
    }

    /// Returns both scopes as one.
    pub(super) fn union(self, other: Self) -> Self {
        Self { stages: self.stages | other.stages, access: self.access | other.access }
    }
}

/// Accumulated writes, which do not wait for each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Epoch {
    /// Scope that all of them wait for.
    before: BarrierScope,
    /// Accesses that already wait for it.
    waited: StageAccess,
}

/// Synchronisation state that later uses of one (sub)resource may have to wait for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct ResourceState {
    layout: Layout,
    /// The last write. After a layout transition: the stages that waited for it, without accesses, since
    /// Vulkan flushes its own transitions.
    write: BarrierScope,
    /// Stages that have read since the last write, except those that another reading stage has waited for.
    readers: Stages,
    /// Reads to which the last write is already visible.
    visible: StageAccess,
    /// `Some` if the last write is accumulated.
    epoch: Option<Epoch>,
}

impl ResourceState {
    /// Returns the state before any use, with the layout that the first use finds.
    pub(crate) fn untouched_in(layout: Layout) -> Self {
        Self { layout, ..Self::default() }
    }

    /// Returns the state of an image acquired from the presentation engine. Its contents are unknown, and a
    /// semaphore wait happens at `stages`.
    pub(crate) fn acquired(stages: Stages) -> Self {
        Self { write: BarrierScope::execution_only(stages), ..Self::default() }
    }

    /// Returns the state of an image from the caller or from another queue, with a semaphore wait at
    /// `stages`.
    pub(crate) fn imported(layout: Layout, stages: Stages) -> Self {
        Self { layout, write: BarrierScope::execution_only(stages), ..Self::default() }
    }

    /// Returns the layout after the last use.
    pub(crate) fn layout(&self) -> Layout {
        self.layout
    }

    /// True if the resource was read since the last write.
    pub(crate) fn is_read(&self) -> bool {
        !self.readers.is_empty()
    }

    /// True if a wait for `stages` and `access` includes the last write.
    pub(crate) fn write_is_within(&self, stages: Stages, access: Access) -> bool {
        stages.contains(self.write.stages) && access.contains(self.write.access)
    }

    /// True if a use writes or changes the layout, so that later uses have to wait for it.
    #[inline]
    pub(crate) fn is_changed_by(&self, next: Use) -> bool {
        next.is_write() || (next.layout != Layout::Undefined && next.layout != self.layout)
    }

    /// Returns the barrier in front of a use that repeats the last write with no use in between. Such a use
    /// leaves the state unchanged. `None` for every other use.
    #[inline(always)]
    pub(crate) fn repeated(&self, next: Use) -> Option<BarrierScopes> {
        let write = BarrierScope { stages: next.stages, access: next.access & Access::WRITES };
        let is_last = self.write == write && self.layout == next.layout && self.readers.is_empty();
        let is_repeated = is_last && !write.access.is_empty() && self.epoch.is_none();
        is_repeated.then(|| {
            self.scopes(write, BarrierScope { stages: next.stages, access: next.access }, self.layout)
        })
    }

    /// Adds a read in the current layout.
    pub(crate) fn read_by(&mut self, next: Use) -> Option<BarrierScopes> {
        self.read(&next.into())
    }

    /// Adds reads in the current layout. Returns a barrier if the last write is not visible yet to some of
    /// them.
    pub(crate) fn read(&mut self, reads: &StageAccess) -> Option<BarrierScopes> {
        let src = self.flushed_write();
        let dst = BarrierScope::from_accesses(&self.visible.missing(reads));
        let needed = !src.stages.is_empty() && !dst.stages.is_empty();
        if needed {
            self.visible.insert(dst.as_use());
            // Earlier readers in these stages are now covered by a wait for the new ones.
            self.readers -= src.stages;
        }
        self.readers |= reads.stages();
        needed.then(|| self.scopes(src, dst, self.layout))
    }

    /// Adds reads in the current layout, before a write that waits for these reads only. Earlier readers that
    /// the write would not wait for are chained to these reads.
    pub(crate) fn read_for_all(&mut self, reads: &StageAccess) -> Option<BarrierScopes> {
        let loose = self.readers - reads.stages();
        if loose.is_empty() {
            return self.read(reads);
        }
        let unseen = BarrierScope::from_accesses(&self.visible.missing(reads));
        let nothing_new = self.write.stages.is_empty() || unseen.stages.is_empty();
        let dst = if nothing_new { BarrierScope::execution_only(last_stage(reads.stages())) } else { unseen };
        let src = self.through_readers(loose);
        self.readers = reads.stages();
        self.visible.insert(dst.as_use());
        Some(self.scopes(src, dst, self.layout))
    }

    /// Returns the scope that a read has to wait for. If a stage of the write has also read since, it has
    /// waited for the whole write and its flush. Waiting for that stage is then enough.
    fn flushed_write(&self) -> BarrierScope {
        let seen = last_stage(self.write.stages & self.visible.stages());
        if seen.is_empty() { self.write } else { BarrierScope::execution_only(seen) }
    }

    /// Applies a use that waits for everything before it.
    #[inline]
    pub(crate) fn overwrite(&mut self, next: Use) -> Option<BarrierScopes> {
        let src = self.unfinished();
        let new_layout = if next.layout == Layout::Undefined { self.layout } else { next.layout };
        let needed = !src.stages.is_empty() || new_layout != self.layout;
        let dst = BarrierScope { stages: next.stages, access: next.access };
        let scopes = self.scopes(src, dst, new_layout);
        let write = BarrierScope { stages: next.stages, access: next.access & Access::WRITES };
        // Field by field, so that no state is built elsewhere and moved here.
        self.layout = new_layout;
        self.write = write;
        self.readers = Stages::empty();
        self.visible = StageAccess::default();
        self.epoch = None;
        if !next.is_write() {
            self.readers = next.stages;
            self.visible.insert(next);
        }
        needed.then_some(scopes)
    }

    fn start_epoch(&mut self, writes: &StageAccess) -> Option<BarrierScopes> {
        let before = self.unfinished();
        let scopes = self.overwrite(BarrierScope::from_accesses(writes).as_use());
        self.epoch = Some(Epoch { before, waited: *writes });
        scopes
    }

    fn continue_epoch(&mut self, mut epoch: Epoch, writes: &StageAccess) -> Option<BarrierScopes> {
        let dst = BarrierScope::from_accesses(&epoch.waited.missing(writes));
        epoch.waited.insert(dst.as_use());
        self.write.stages |= writes.stages();
        self.write.access |= writes.access() & Access::WRITES;
        self.epoch = Some(epoch);
        let needed = !epoch.before.stages.is_empty() && !dst.stages.is_empty();
        needed.then(|| self.scopes(epoch.before, dst, self.layout))
    }

    /// Adds the accesses of `scope` to the last write, so that later uses wait for them too.
    pub(super) fn extend_write(&mut self, scope: BarrierScope) {
        *self = Self { layout: self.layout, write: self.unfinished().union(scope), ..Self::default() };
    }

    /// Returns the scope that a write has to wait for.
    #[inline]
    pub(super) fn unfinished(&self) -> BarrierScope {
        if self.readers.is_empty() { self.write } else { self.through_readers(self.readers) }
    }

    /// Returns the scope that waits for `readers`. They have waited for the last write and its flush, so
    /// waiting for them is enough. The host is the exception: no stage of the device waits for it.
    #[inline]
    fn through_readers(&self, readers: Stages) -> BarrierScope {
        if readers.contains(Stages::HOST) {
            return BarrierScope { stages: readers | self.write.stages, access: self.write.access };
        }
        BarrierScope::execution_only(readers)
    }

    #[inline]
    fn scopes(&self, src: BarrierScope, dst: BarrierScope, new_layout: Layout) -> BarrierScopes {
        BarrierScopes {
            src_stages: src.stages,
            src_access: src.access,
            dst_stages: dst.stages,
            dst_access: dst.access,
            old_layout: self.layout,
            new_layout,
        }
    }
}

/// Advances `state` by `next` and returns the barrier to be recorded in front of it, if one is needed.
///
/// * A read waits for the last write, unless that write is already visible to exactly these accesses of these
///   stages.
/// * A write waits for all readers since the last write. If there are none, it waits for that write.
/// * A layout change is a write by the barrier itself. Later readers in other stages chain from it.
///
/// [`Layout::Undefined`] in `next.layout` requests no layout.
#[inline]
pub(crate) fn transition(state: &mut ResourceState, next: Use) -> Option<BarrierScopes> {
    if state.is_changed_by(next) { state.overwrite(next) } else { state.read_by(next) }
}

/// Advances `state` by accumulated writes: several writes to disjoint parts of the resource, which need not
/// wait for each other. They only wait for the accesses before the first of them: readers, or an ordinary
/// write.
pub(crate) fn accumulate(state: &mut ResourceState, writes: &StageAccess) -> Option<BarrierScopes> {
    match state.epoch {
        Some(epoch) if state.readers.is_empty() => state.continue_epoch(epoch, writes),
        _ => state.start_epoch(writes),
    }
}

/// Returns the last of the stages. If one stage is enough to wait for or to chain through, the last one
/// delays the least.
fn last_stage(stages: Stages) -> Stages {
    Stages::from_bits_retain(stages.bits().checked_ilog2().map_or(0, |last| 1 << last))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const COMPUTE_WRITE: Use = on_buffer(Use::shader_write(Stages::COMPUTE));
    const FRAGMENT_READ: Use = on_buffer(Use::shader_read(Stages::FRAGMENT));

    const fn on_buffer(touch: Use) -> Use {
        touch.with_layout(Layout::Undefined)
    }

    fn uses() -> impl Strategy<Value = Use> {
        let stages = || {
            prop::sample::select(vec![Stages::COMPUTE, Stages::FRAGMENT, Stages::COMPUTE | Stages::FRAGMENT])
        };
        prop_oneof![
            3 => stages().prop_map(Use::shader_write),
            1 => stages().prop_map(Use::shader_read),
            1 => Just(Use::transfer_write()),
            1 => Just(Use::present()),
            1 => Just(COMPUTE_WRITE),
            1 => Just(Use::host_read()),
        ]
    }

    proptest! {
        /// Checks every reachable state: no use is taken for a repetition by mistake.
        #[test]
        fn a_repeated_use_has_the_barrier_of_any_other_and_changes_nothing(
            before in prop::collection::vec((uses(), any::<bool>()), 0..5), next in uses()
        ) {
            let mut state = ResourceState::default();
            for (touch, accumulated) in before {
                let _ = match accumulated {
                    true => accumulate(&mut state, &touch.into()),
                    false => transition(&mut state, touch),
                };
            }
            let (repeated, was) = (state.repeated(next), state);
            let barrier = transition(&mut state, next);
            if repeated.is_some() {
                prop_assert_eq!(repeated, barrier);
                prop_assert_eq!(state, was);
            }
            // A write repeats itself.
            prop_assert_eq!(state.repeated(next).is_some(), next.is_write() && next.layout == state.layout);
        }
    }

    #[test]
    fn fresh_buffer_needs_no_barrier() {
        assert_eq!(transition(&mut ResourceState::default(), FRAGMENT_READ), None);
        assert_eq!(transition(&mut ResourceState::default(), COMPUTE_WRITE), None);
    }

    #[test]
    fn fresh_texture_waits_for_nothing_but_changes_its_layout() {
        let scopes = transition(&mut ResourceState::default(), Use::color_target(false)).unwrap();
        assert_eq!((scopes.src_stages, scopes.src_access), (Stages::empty(), Access::empty()));
        assert_eq!((scopes.old_layout, scopes.new_layout), (Layout::Undefined, Layout::ColorTarget));
    }

    #[test]
    fn second_reader_of_another_stage_only_waits_for_itself() {
        let mut state = ResourceState::default();
        transition(&mut state, COMPUTE_WRITE);
        transition(&mut state, FRAGMENT_READ);
        let both = on_buffer(Use::shader_read(Stages::FRAGMENT | Stages::RAY_TRACING));
        let scopes = transition(&mut state, both).unwrap();
        assert_eq!((scopes.src_stages, scopes.src_access), (Stages::COMPUTE, Access::SHADER_WRITE));
        assert_eq!((scopes.dst_stages, scopes.dst_access), (Stages::RAY_TRACING, Access::SHADER_READ));
        assert_eq!(transition(&mut state, both), None);
    }

    #[test]
    fn write_after_reads_waits_for_all_readers_without_a_flush() {
        let mut state = ResourceState::default();
        transition(&mut state, COMPUTE_WRITE);
        transition(&mut state, FRAGMENT_READ);
        transition(&mut state, Use::index());
        let scopes = transition(&mut state, on_buffer(Use::transfer_write())).unwrap();
        assert_eq!(scopes.src_stages, Stages::FRAGMENT | Stages::VERTEX_INPUT);
        assert_eq!(scopes.src_access, Access::empty());
    }

    #[test]
    fn write_only_waits_for_the_last_of_readers_that_waited_for_each_other() {
        let mut state = ResourceState::default();
        transition(&mut state, on_buffer(Use::transfer_write()));
        transition(&mut state, on_buffer(Use::transfer_read()));
        let scopes = transition(&mut state, FRAGMENT_READ).unwrap();
        assert_eq!((scopes.src_stages, scopes.src_access), (Stages::TRANSFER, Access::empty()));
        assert_eq!(transition(&mut state, COMPUTE_WRITE).unwrap().src_stages, Stages::FRAGMENT);
    }

    #[test]
    fn write_after_a_host_read_still_waits_for_the_device() {
        let mut state = ResourceState::default();
        transition(&mut state, COMPUTE_WRITE);
        transition(&mut state, on_buffer(Use::host_read()));
        let scopes = transition(&mut state, COMPUTE_WRITE).unwrap();
        assert!(scopes.src_stages.contains(Stages::COMPUTE) && scopes.src_access == Access::SHADER_WRITE);
    }

    #[test]
    fn reader_after_a_layout_change_chains_from_the_stages_that_waited_for_it() {
        let mut state = ResourceState::default();
        transition(&mut state, Use::color_target(false));
        transition(&mut state, Use::shader_read(Stages::FRAGMENT));
        let scopes = transition(&mut state, Use::shader_read(Stages::COMPUTE)).unwrap();
        assert_eq!((scopes.src_stages, scopes.dst_stages), (Stages::FRAGMENT, Stages::COMPUTE));
        assert_eq!(scopes.old_layout, scopes.new_layout);
    }

    #[test]
    fn accumulated_writers_wait_for_readers_once_per_stage_and_never_for_each_other() {
        let mut state = ResourceState::default();
        let build = &Use::accel_build_write().into();
        assert_eq!(accumulate(&mut state, build), None);
        assert_eq!(accumulate(&mut state, build), None);
        transition(&mut state, Use::accel_read(Stages::RAY_TRACING));
        let scopes = accumulate(&mut state, build).unwrap();
        assert_eq!((scopes.src_stages, scopes.dst_stages), (Stages::RAY_TRACING, Stages::ACCEL_BUILD));
        assert_eq!(accumulate(&mut state, build), None);
        let scopes = accumulate(&mut state, &Use::transfer_write().into()).unwrap();
        assert_eq!((scopes.src_stages, scopes.dst_stages), (Stages::RAY_TRACING, Stages::TRANSFER));
        let scopes = transition(&mut state, Use::accel_read(Stages::RAY_TRACING)).unwrap();
        assert_eq!(scopes.src_stages, Stages::ACCEL_BUILD | Stages::TRANSFER);
        assert_eq!(scopes.src_access, Access::ACCEL_WRITE | Access::TRANSFER_WRITE);
    }
}
