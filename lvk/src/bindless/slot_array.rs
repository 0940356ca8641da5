//! Slots of one descriptor array with their owners.

use super::slot_allocator::Slots;
use crate::error::limit_origin::LimitOrigin;
use crate::error::{Error, Result};

/// Slots of one kind and their owners.
pub(super) struct SlotArray<T> {
    kind: &'static str,
    pub(super) slots: Slots,
    pub(super) owners: Vec<Option<T>>,
}

impl<T: Copy> SlotArray<T> {
    pub(super) fn new(kind: &'static str, capacity: u32) -> Self {
        Self { kind, slots: Slots::new(capacity), owners: vec![None; capacity as usize] }
    }

    pub(super) fn reserve(&mut self, object: &str) -> Result<u32> {
        let limit = u64::from(self.slots.capacity()).saturating_sub(1);
        self.slots.alloc().ok_or_else(|| Error::LimitExceeded {
            object: object.to_owned(),
            what: self.kind,
            requested: limit + 1,
            limit,
            origin: LimitOrigin::Descriptors,
        })
    }

    pub(super) fn set(&mut self, slot: u32, owner: Option<T>) {
        if let Some(entry) = self.owners.get_mut(slot as usize) {
            *entry = owner;
            self.slots.mark_dirty(slot);
        }
    }

    pub(super) fn take_dirty(&mut self) -> Vec<(u32, Option<T>)> {
        let dirty = self.slots.take_dirty();
        dirty.into_iter().map(|slot| (slot, self.owners.get(slot as usize).copied().flatten())).collect()
    }
}

/// Marks the descriptors of an array that refer to an owner. All others hold the default descriptor.
pub(super) struct WrittenDescriptors(Vec<bool>);

impl WrittenDescriptors {
    pub(super) fn new(capacity: u32) -> Self {
        Self(vec![false; capacity as usize])
    }

    /// True if the descriptor of a slot must be written. `has_owner` is the new state of the slot, which counts as
    /// written from then on.
    pub(super) fn must_write(&mut self, slot: u32, has_owner: bool) -> bool {
        match self.0.get_mut(slot as usize) {
            Some(shown) => std::mem::replace(shown, has_owner) || has_owner,
            None => false,
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn descriptors_are_those_of_their_owners_and_no_default_replaces_a_default(
            changes in prop::collection::vec((0..6_u32, prop::option::of(1..4_u32)), 0..60)
        ) {
            const DUMMY: u32 = 0;
            let (mut shown, mut descriptors) = (WrittenDescriptors::new(5), [DUMMY; 5]);
            for (slot, owner) in changes {
                let must_write = shown.must_write(slot, owner.is_some());
                let Some(descriptor) = descriptors.get_mut(slot as usize) else {
                    prop_assert!(!must_write);
                    continue;
                };
                let wanted = owner.unwrap_or(DUMMY);
                prop_assert!(must_write != (wanted == DUMMY && *descriptor == DUMMY));
                if must_write {
                    *descriptor = wanted;
                }
                prop_assert_eq!(*descriptor, wanted);
            }
        }
    }
}
