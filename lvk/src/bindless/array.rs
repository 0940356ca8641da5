//! Slots of one array with their owners.

use super::slots::Slots;
use crate::error::{Error, Result};

/// Slots of one kind and who owns them.
pub(super) struct Array<T> {
    kind: &'static str,
    pub(super) slots: Slots,
    pub(super) owners: Vec<Option<T>>,
}

impl<T: Copy> Array<T> {
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
        })
    }

    pub(super) fn set(&mut self, slot: u32, owner: Option<T>) {
        if let Some(entry) = self.owners.get_mut(slot as usize) {
            *entry = owner;
            self.slots.dirty(slot);
        }
    }

    pub(super) fn take_dirty(&mut self) -> Vec<(u32, Option<T>)> {
        let dirty = self.slots.take_dirty();
        dirty.into_iter().map(|slot| (slot, self.owners.get(slot as usize).copied().flatten())).collect()
    }
}
