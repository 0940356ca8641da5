//! Suballocation from blocks of 64 slots, as plain data without Vulkan.
//!
//! A slot is found without a search, independent of the number of slots. A general allocator searches all
//! free ranges for the best fit, which takes longer than the driver's creation of a small buffer.

use slotmap::{DefaultKey, SlotMap};

/// Slots of one size. `B` is the memory of a block of them.
pub(crate) struct Slab<B> {
    blocks: SlotMap<DefaultKey, SlabBlock<B>>,
    /// The blocks that have both used and free slots.
    open: Vec<DefaultKey>,
    /// An empty block, kept for the next allocation.
    spare: Option<DefaultKey>,
}

struct SlabBlock<B> {
    memory: B,
    /// A bit for each free slot.
    free: u64,
    /// Index in `open`, valid while the block is in `open`.
    place: usize,
}

/// An allocated slot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Slot {
    block: DefaultKey,
    /// Index in the block, below [`Slab::SLOTS`].
    pub(crate) number: u32,
}

impl<B> Default for Slab<B> {
    fn default() -> Self {
        Self { blocks: SlotMap::default(), open: Vec::new(), spare: None }
    }
}

impl<B> Slab<B> {
    /// Number of slots in a block.
    pub(crate) const SLOTS: u64 = u64::BITS as u64;

    /// Allocates a slot and returns it with the memory of its block. If all slots are used, `new` creates the
    /// memory of another block.
    pub(crate) fn allocate<E>(&mut self, new: impl FnOnce() -> Result<B, E>) -> Result<(Slot, &B), E> {
        let key = match self.open.last() {
            Some(key) => *key,
            None => {
                let key = match self.spare.take() {
                    Some(key) => key,
                    None => self.blocks.insert(SlabBlock { memory: new()?, free: u64::MAX, place: 0 }),
                };
                self.link_free_block(key);
                key
            }
        };
        let block = &mut self.blocks[key];
        let number = block.free.trailing_zeros();
        block.free &= !(1 << number);
        if block.free == 0 {
            self.open.pop();
        }
        Ok((Slot { block: key, number }, &self.blocks[key].memory))
    }

    /// Frees a slot, which must happen once. Returns the memory of the slot's block if the block is not
    /// needed any more.
    pub(crate) fn free(&mut self, slot: Slot) -> Option<B> {
        let block = self.blocks.get_mut(slot.block)?;
        let was_full = block.free == 0;
        block.free |= 1 << slot.number;
        let is_empty = block.free == u64::MAX;
        if was_full {
            self.link_free_block(slot.block);
        }
        if !is_empty {
            return None;
        }
        self.unlink_full_block(slot.block);
        if self.spare.is_none() {
            self.spare = Some(slot.block);
            return None;
        }
        self.blocks.remove(slot.block).map(|block| block.memory)
    }

    fn link_free_block(&mut self, key: DefaultKey) {
        self.blocks[key].place = self.open.len();
        self.open.push(key);
    }

    fn unlink_full_block(&mut self, key: DefaultKey) {
        let place = self.blocks[key].place;
        self.open.swap_remove(place);
        if let Some(moved) = self.open.get(place) {
            self.blocks[*moved].place = place;
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;
    use std::convert::Infallible;

    use proptest::prelude::*;

    use super::*;

    #[derive(Debug, Clone)]
    enum SlabOp {
        Take(usize),
        Give(Vec<prop::sample::Index>),
        GiveAll,
    }

    fn op() -> impl Strategy<Value = SlabOp> {
        let index = any::<prop::sample::Index>;
        prop_oneof![
            3 => (1..200_usize).prop_map(SlabOp::Take),
            3 => prop::collection::vec(index(), 1..150).prop_map(SlabOp::Give),
            1 => Just(SlabOp::GiveAll),
        ]
    }

    /// A slab whose block memory is a number, with the expected contents.
    #[derive(Default)]
    struct SlabModel {
        slab: Slab<u32>,
        blocks: BTreeSet<u32>,
        last: u32,
        taken: Vec<(Slot, u32)>,
    }

    impl SlabModel {
        fn take(&mut self) {
            let has_room = (self.blocks.len() * 64) > self.taken.len();
            let mut is_new = false;
            let new = || -> Result<u32, Infallible> {
                is_new = true;
                self.last += 1;
                Ok(self.last)
            };
            let (slot, block) = self.slab.allocate(new).unwrap();
            let block = *block;
            assert_eq!(is_new, !has_room, "a block is made where all slots are taken, and only there");
            assert_eq!(is_new, self.blocks.insert(block));
            let place = (block, slot.number);
            assert!(slot.number < 64 && self.places().all(|other| other != place), "{place:?} is taken");
            self.taken.push((slot, block));
        }

        fn places(&self) -> impl Iterator<Item = (u32, u32)> {
            self.taken.iter().map(|(slot, block)| (*block, slot.number))
        }

        fn give_back(&mut self, place: usize) {
            let (slot, block) = self.taken.swap_remove(place);
            if let Some(gone) = self.slab.free(slot) {
                assert_eq!(gone, block);
                assert!(self.places().all(|(other, _)| other != gone), "block {gone} is still used");
                assert!(self.blocks.remove(&gone));
            }
        }

        fn empty_blocks(&self) -> usize {
            let used: BTreeSet<u32> = self.places().map(|(block, _)| block).collect();
            self.blocks.len() - used.len()
        }
    }

    proptest! {
        #[test]
        fn no_slot_is_taken_twice_and_one_empty_block_at_most_is_kept(
            ops in prop::collection::vec(op(), 0..30)
        ) {
            let mut model = SlabModel::default();
            for op in ops {
                match op {
                    SlabOp::Take(count) => (0..count).for_each(|_| model.take()),
                    SlabOp::Give(which) => {
                        for index in which {
                            if !model.taken.is_empty() {
                                model.give_back(index.index(model.taken.len()));
                            }
                        }
                    }
                    SlabOp::GiveAll => (0..model.taken.len()).rev().for_each(|place| model.give_back(place)),
                }
                prop_assert!(model.empty_blocks() <= 1);
            }
        }
    }

    #[test]
    fn a_block_that_cannot_be_made_changes_nothing() {
        let mut slab = Slab::default();
        assert_eq!(slab.allocate(|| Err::<u32, _>("full")).unwrap_err(), "full");
        let (slot, block) = slab.allocate(|| Ok::<_, &str>(7)).unwrap();
        assert_eq!((slot.number, *block), (0, 7));
    }
}
