//! Allocator of the slots of one bindless descriptor array, with the list of slots to write.

/// State of a slot: whether it is taken, and whether it is on the list of slots to write.
#[derive(Debug, Clone, Copy, Default)]
struct SlotMark {
    taken: bool,
    dirty: bool,
}

/// Slots of one descriptor array. Slot 0 is the default descriptor, which shaders read in place of no object. It is
/// never allocated.
#[derive(Debug)]
pub(crate) struct Slots {
    capacity: u32,
    /// State of each slot ever used, the default descriptor first.
    marks: Vec<SlotMark>,
    free: Vec<u32>,
    dirty: Vec<u32>,
}

impl Slots {
    /// Creates the slots `0..capacity`. The default descriptor is on the list of slots to write.
    pub(crate) fn new(capacity: u32) -> Self {
        let mut slots = Self { capacity, marks: Vec::new(), free: Vec::new(), dirty: Vec::new() };
        if capacity > 0 {
            slots.marks.push(SlotMark { taken: true, dirty: false });
            slots.mark_dirty(0);
        }
        slots
    }

    /// Allocates a free slot and marks it to be written; `None` if all are taken.
    pub(crate) fn alloc(&mut self) -> Option<u32> {
        let slot = match self.free.pop() {
            Some(slot) => slot,
            None => self.grow()?,
        };
        self.marks[slot as usize].taken = true;
        self.mark_dirty(slot);
        Some(slot)
    }

    /// Frees a slot and marks it to be written with the default descriptor. The caller must have waited until the GPU
    /// no longer reads the slot. Slot 0 and slots that are not taken are ignored.
    pub(crate) fn free(&mut self, slot: u32) {
        if slot == 0 || !self.is_taken(slot) {
            return;
        }
        self.mark_dirty(slot);
        self.marks[slot as usize].taken = false;
        self.free.push(slot);
    }

    /// Marks a taken slot to be written again.
    pub(crate) fn mark_dirty(&mut self, slot: u32) {
        match self.marks.get_mut(slot as usize) {
            Some(mark) if mark.taken && !mark.dirty => mark.dirty = true,
            _ => return,
        }
        self.dirty.push(slot);
    }

    /// True if no slot must be written.
    pub(crate) fn is_clean(&self) -> bool {
        self.dirty.is_empty()
    }

    /// Returns the slots to write in ascending order, without duplicates, and clears the list.
    pub(crate) fn take_dirty(&mut self) -> Vec<u32> {
        let mut dirty = std::mem::take(&mut self.dirty);
        dirty.sort_unstable();
        for &slot in &dirty {
            self.marks[slot as usize].dirty = false;
        }
        dirty
    }

    /// True if the slot is taken. Slot 0 is always taken.
    pub(crate) fn is_taken(&self, slot: u32) -> bool {
        self.marks.get(slot as usize).is_some_and(|mark| mark.taken)
    }

    /// Returns the number of slots, slot 0 included.
    pub(crate) fn capacity(&self) -> u32 {
        self.capacity
    }

    /// Returns the number of slots that are taken, without slot 0.
    #[cfg(any(test, feature = "test-hooks"))]
    pub(crate) fn taken_count(&self) -> usize {
        self.marks.iter().skip(1).filter(|mark| mark.taken).count()
    }

    fn grow(&mut self) -> Option<u32> {
        let slot = u32::try_from(self.marks.len()).ok().filter(|slot| *slot < self.capacity)?;
        self.marks.push(SlotMark::default());
        Some(slot)
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use proptest::prelude::*;

    use super::*;

    #[derive(Debug, Clone)]
    enum SlotOp {
        Alloc,
        Free(u32),
        Dirty(u32),
        Take,
    }

    fn op() -> impl Strategy<Value = SlotOp> {
        let slot = || prop_oneof![9 => 0..14_u32, 1 => Just(u32::MAX)];
        prop_oneof![
            4 => Just(SlotOp::Alloc),
            2 => slot().prop_map(SlotOp::Free),
            2 => slot().prop_map(SlotOp::Dirty),
            1 => Just(SlotOp::Take),
        ]
    }

    proptest! {
        #[test]
        fn slots_behave_like_two_sets(
            capacity in 0..12_u32, ops in prop::collection::vec(op(), 0..80)
        ) {
            let mut slots = Slots::new(capacity);
            let mut taken: BTreeSet<u32> = BTreeSet::new();
            let mut dirty: BTreeSet<u32> = (0..capacity.min(1)).collect();
            for op in ops {
                match op {
                    SlotOp::Alloc => match slots.alloc() {
                        Some(slot) => {
                            prop_assert!(slot > 0 && slot < capacity);
                            prop_assert!(taken.insert(slot), "slot {} handed out twice", slot);
                            dirty.insert(slot);
                        }
                        None => prop_assert_eq!(taken.len() as u32, capacity.saturating_sub(1)),
                    },
                    SlotOp::Free(slot) => {
                        slots.free(slot);
                        if taken.remove(&slot) {
                            dirty.insert(slot);
                        }
                    }
                    SlotOp::Dirty(slot) => {
                        slots.mark_dirty(slot);
                        if taken.contains(&slot) || (slot == 0 && capacity > 0) {
                            dirty.insert(slot);
                        }
                    }
                    SlotOp::Take => {
                        prop_assert_eq!(slots.take_dirty(), dirty.iter().copied().collect::<Vec<_>>());
                        dirty.clear();
                    }
                }
                prop_assert_eq!(slots.is_clean(), dirty.is_empty());
                prop_assert_eq!(slots.taken_count(), taken.len());
                prop_assert!((0..14).all(|slot| slot == 0 || slots.is_taken(slot) == taken.contains(&slot)));
            }
        }
    }

    #[test]
    fn the_default_descriptor_is_written_first_and_never_allocated() {
        let mut slots = Slots::new(3);
        assert_eq!(slots.take_dirty(), [0]);
        slots.free(0);
        assert_eq!([slots.alloc(), slots.alloc(), slots.alloc()], [Some(1), Some(2), None]);
        assert_eq!(slots.capacity(), 3);
    }

    #[test]
    fn slot_freed_twice_is_handed_out_once() {
        let mut slots = Slots::new(3);
        let slot = slots.alloc().unwrap();
        slots.free(slot);
        slots.free(slot);
        assert_ne!(slots.alloc(), slots.alloc());
    }
}
