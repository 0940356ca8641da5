//! Numbers for keys that the caller keeps.

use std::hash::{BuildHasher, Hash, RandomState};

/// Numbers distinct keys from 0 in the order in which they come. The caller keeps the keys by number, so that the table takes 5 to
/// 11 bytes a key, whatever their size. Linear probing, at most three quarters full.
pub(super) struct KeyNumbers {
    /// Numbers of keys, or [`FREE`](Self::FREE); a power of two of them.
    slots: Vec<u32>,
    count: u32,
    hasher: RandomState,
}

impl KeyNumbers {
    const FREE: u32 = u32::MAX;

    /// Creates a table that needs not grow before it has this number of keys.
    pub fn with_capacity(keys: usize) -> Self {
        let slots = (keys + keys / 3 + 1).next_power_of_two().max(16);
        Self { slots: vec![Self::FREE; slots], count: 0, hasher: RandomState::new() }
    }

    /// Returns the number of a key, and true if the key is new: the caller then keeps it as the one of that number. `key_of` returns
    /// a key that is kept.
    pub fn number_of<K: Hash + PartialEq>(&mut self, key: &K, key_of: impl Fn(u32) -> K) -> (u32, bool) {
        if (self.count as usize + 1) * 4 > self.slots.len() * 3 {
            self.grow(&key_of);
        }
        let mut slot = self.start(key);
        loop {
            match self.slots[slot] {
                Self::FREE => break,
                number if key_of(number) == *key => return (number, false),
                _ => slot = (slot + 1) & (self.slots.len() - 1),
            }
        }
        self.slots[slot] = self.count;
        self.count += 1;
        (self.count - 1, true)
    }

    fn start<K: Hash>(&self, key: &K) -> usize {
        self.hasher.hash_one(key) as usize & (self.slots.len() - 1)
    }

    fn grow<K: Hash>(&mut self, key_of: impl Fn(u32) -> K) {
        let length = 2 * self.slots.len();
        // The old slots are not needed: the keys are numbered without a gap.
        self.slots = Vec::new();
        self.slots = vec![Self::FREE; length];
        for number in 0..self.count {
            let mut slot = self.start(&key_of(number));
            while self.slots[slot] != Self::FREE {
                slot = (slot + 1) & (length - 1);
            }
            self.slots[slot] = number;
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashMap;

    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn keys_are_numbered_as_by_a_map(keys in prop::collection::vec(0..200_u16, 0..600), capacity in 0..300_usize) {
            let mut numbers = KeyNumbers::with_capacity(capacity);
            let mut kept: Vec<u16> = Vec::new();
            let mut expected: HashMap<u16, u32> = HashMap::new();
            for key in keys {
                let next = expected.len() as u32;
                let is_known = expected.contains_key(&key);
                let (number, is_new) = numbers.number_of(&key, |number| kept[number as usize]);
                prop_assert_eq!(number, *expected.entry(key).or_insert(next));
                prop_assert_eq!(is_new, !is_known);
                kept.extend(is_new.then_some(key));
            }
            let grown = (kept.len() + 1) * 4 / 3 + 1;
            prop_assert!(numbers.slots.len() <= 2 * grown.max(capacity * 4 / 3 + 1).max(16));
        }
    }
}
