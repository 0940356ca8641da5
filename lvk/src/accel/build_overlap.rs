//! Consecutive TLAS builds: decides which of them need no barrier between them. Records nothing.

use std::ops::Range;

use crate::barrier::ResourceId;

/// TLAS builds that may run concurrently: each has its own target and its own scratch memory. Alignments are powers of
/// two.
#[derive(Debug, Default)]
pub(crate) struct ConcurrentBuilds {
    /// Scratch address of the next build.
    next: u64,
    /// End of the scratch memory; at most `next` if no concurrent builds are open.
    end: u64,
    targets: BuildTargets,
}

impl ConcurrentBuilds {
    /// Starts with a build of `target` at the start of `memory`, an aligned address. This build waits for all earlier
    /// commands.
    pub(crate) fn start(&mut self, target: ResourceId, memory: Range<u64>, bytes: u64, alignment: u64) {
        let after = aligned_end(memory.start, bytes, alignment);
        (self.next, self.end) = (after.unwrap_or(u64::MAX), memory.end);
        self.targets.clear();
        self.targets.insert(target);
    }

    /// Returns the scratch address of the next build, of `target`; `None` if it must wait for the builds before.
    #[inline]
    pub(crate) fn try_add(&mut self, target: ResourceId, bytes: u64, alignment: u64) -> Option<u64> {
        let address = self.next;
        let after = aligned_end(address, bytes, alignment).filter(|after| *after <= self.end)?;
        // A build without scratch memory would fit even if no concurrent builds are open.
        if after == address || !self.targets.insert(target) {
            return None;
        }
        self.next = after;
        Some(address)
    }

    /// Makes the next build wait for those before.
    #[inline]
    pub(crate) fn stop(&mut self) {
        self.end = 0;
    }
}

/// The targets of concurrent builds, each once.
#[derive(Debug, Default)]
struct BuildTargets {
    /// One bit for each target. Several targets may share a bit.
    bits: u64,
    ids: Vec<ResourceId>,
}

impl BuildTargets {
    /// Limit of concurrent builds: this many occupy a device, and searches in `ids` stay short.
    const MAX_TARGETS: usize = 64;

    fn clear(&mut self) {
        self.bits = 0;
        self.ids.clear();
    }

    /// Adds a target. Returns false if the list has it already or is full.
    #[inline]
    fn insert(&mut self, id: ResourceId) -> bool {
        let bit = id.bit();
        if self.ids.len() == Self::MAX_TARGETS || (self.bits & bit != 0 && self.ids.contains(&id)) {
            return false;
        }
        self.bits |= bit;
        self.ids.push(id);
        true
    }
}

/// The first aligned address after `bytes` bytes at `address`.
#[inline]
fn aligned_end(address: u64, bytes: u64, alignment: u64) -> Option<u64> {
    let mask = alignment.saturating_sub(1);
    Some(address.checked_add(bytes)?.checked_add(mask)? & !mask)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[derive(Debug, Clone)]
    enum BuildRunCommand {
        /// A build of one of a few TLAS.
        Build { target: u64, bytes: u64 },
        /// Another command, which may have a barrier before it.
        Other,
    }

    fn command() -> impl Strategy<Value = BuildRunCommand> {
        let bytes = prop_oneof![9 => 0..900_u64, 1 => Just(u64::MAX)];
        // Some targets share a bit.
        let target = prop_oneof![0..6_u64, 64..70_u64];
        prop_oneof![
            9 => (target, bytes).prop_map(|(target, bytes)| BuildRunCommand::Build { target, bytes }),
            1 => Just(BuildRunCommand::Other),
        ]
    }

    /// Builds without a barrier between them: targets, each with its scratch memory.
    type Unordered = Vec<(u64, Range<u64>)>;

    fn need_barrier(unordered: &Unordered, target: u64, memory: &Range<u64>) -> bool {
        unordered
            .iter()
            .any(|(other, taken)| *other == target || (taken.start < memory.end && memory.start < taken.end))
    }

    proptest! {
        /// A build waits for an earlier one of the same TLAS or in the same scratch memory, and for no other.
        #[test]
        fn builds_wait_for_the_same_structure_and_for_memory_and_for_nothing_else(
            commands in prop::collection::vec(command(), 1..60),
            start in 1..1_000_u64,
            room in 0..6_000_u64,
            alignment in (0..9_u32).prop_map(|bit| 1_u64 << bit),
        ) {
            let start = start.next_multiple_of(alignment);
            let (mut run, mut unordered) = (ConcurrentBuilds::default(), None::<Unordered>);
            for command in commands {
                let BuildRunCommand::Build { target, bytes } = command else {
                    run.stop();
                    unordered = None;
                    continue;
                };
                let next = unordered.iter().flatten().last().map(|(_, last)| {
                    last.end.checked_next_multiple_of(alignment)
                });
                let end = next.flatten().and_then(|next| {
                    next.checked_add(bytes)?.checked_next_multiple_of(alignment)
                });
                let fits = bytes > 0 && end.is_some_and(|end| end <= start + room);
                match run.try_add(ResourceId(target), bytes, alignment) {
                    Some(address) => {
                        let memory = address..address + bytes;
                        prop_assert!(fits && address.is_multiple_of(alignment));
                        prop_assert!(unordered.is_some(), "the first waits");
                        let before = unordered.get_or_insert_default();
                        prop_assert!(!need_barrier(before, target, &memory), "{target} at {memory:?} beside {before:?}");
                        before.push((target, memory));
                    }
                    None => {
                        let is_new = unordered.iter().flatten().all(|(other, _)| *other != target);
                        prop_assert!(!(fits && is_new), "{target} waits for nothing");
                        run.start(ResourceId(target), start..start + room, bytes, alignment);
                        unordered = Some(vec![(target, start..start.saturating_add(bytes))]);
                    }
                }
            }
        }
    }

    #[test]
    fn a_second_update_of_one_structure_waits_and_one_of_another_does_not() {
        let [first, second] = [ResourceId(1), ResourceId(2)];
        let mut run = ConcurrentBuilds::default();
        assert_eq!(run.try_add(first, 16, 16), None);
        run.start(first, 0..256, 16, 16);
        assert_eq!(run.try_add(second, 16, 16), Some(16));
        assert_eq!(run.try_add(first, 16, 16), None);
        run.start(first, 0..256, 16, 16);
        assert_eq!(run.try_add(second, 16, 16), Some(16), "what was before waits already");
        run.stop();
        assert_eq!(run.try_add(ResourceId(3), 16, 16), None);
    }

    #[test]
    fn a_build_without_memory_leaves_its_address_to_the_next() {
        let [first, second] = [ResourceId(1), ResourceId(2)];
        let mut run = ConcurrentBuilds::default();
        run.start(first, 1..2956, 0, 1);
        assert_eq!(run.try_add(second, 1, 1), Some(1));
    }

    #[test]
    fn a_long_run_ends_where_its_targets_are_many() {
        let mut run = ConcurrentBuilds::default();
        run.start(ResourceId(0), 0..u64::MAX, 16, 16);
        let most = BuildTargets::MAX_TARGETS as u64;
        assert!((1..most).all(|id| run.try_add(ResourceId(id), 16, 16).is_some()));
        assert_eq!(run.try_add(ResourceId(most), 16, 16), None);
    }
}
