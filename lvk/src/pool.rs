//! The pool of one kind of object: maps a handle to its object, or to [`Error::StaleHandle`] or
//! [`Error::ForeignHandle`].

use std::collections::VecDeque;
use std::marker::PhantomData;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use slotmap::{DefaultKey, Key, KeyData, SlotMap};

use crate::error::{Error, Result};
use crate::handle::Handle;
use crate::lock_order::{Rank, RwLock};

/// Objects of one kind, by handle.
///
/// A handle is a key combined with a mask of the context, so that the pool has no object for a handle of another
/// context. Index and generation fill the 64 bits of a handle, which leaves none for a number of the context: a pool
/// tells a stale handle from a foreign one by its own keys ([`IssuedKeys`]), and only if a lookup has failed.
pub(crate) struct HandlePool<H, T> {
    slots: RwLock<Slots<T>>,
    /// Number of objects removed so far. While it stays the same, every object found before is still in the pool.
    removals: AtomicU64,
    mask: u64,
    name_of: fn(&T) -> &str,
    handle: PhantomData<fn() -> H>,
}

struct Slots<T> {
    objects: SlotMap<DefaultKey, Arc<T>>,
    issued: IssuedKeys,
    removed: RemovedNames,
}

impl<H: Handle, T> HandlePool<H, T> {
    /// Creates an empty pool. `name_of` returns the debug name of an object, for errors about its stale handles.
    pub(crate) fn new(mask: u64, name_of: fn(&T) -> &str) -> Self {
        let slots = Slots {
            objects: SlotMap::new(),
            issued: IssuedKeys::default(),
            removed: RemovedNames::default(),
        };
        let slots = RwLock::new(Rank::Store, slots);
        Self { slots, removals: AtomicU64::new(0), mask, name_of, handle: PhantomData }
    }

    pub(crate) fn insert(&self, object: T) -> H {
        let mut slots = self.slots.write();
        let key = slots.objects.insert(Arc::new(object)).data().as_ffi();
        slots.issued.add(key);
        H::from_bits(key ^ self.mask)
    }

    pub(crate) fn get(&self, handle: H) -> Result<Arc<T>> {
        let slots = self.slots.read();
        slots.objects.get(self.key(handle)).cloned().ok_or_else(|| self.missing_error(&slots, handle))
    }

    pub(crate) fn remove(&self, handle: H) -> Result<Arc<T>> {
        let mut slots = self.slots.write();
        let Some(object) = slots.objects.remove(self.key(handle)) else {
            return Err(self.missing_error(&slots, handle));
        };
        slots.removed.add(handle.bits(), (self.name_of)(&object));
        self.removals.fetch_add(1, Ordering::Release);
        Ok(object)
    }

    /// Returns the number of objects removed so far.
    #[inline]
    pub(crate) fn removals(&self) -> u64 {
        self.removals.load(Ordering::Acquire)
    }

    /// Returns every object.
    pub(crate) fn all_objects(&self) -> Vec<Arc<T>> {
        let slots = self.slots.read();
        slots.objects.values().cloned().collect()
    }

    /// Removes and returns every object.
    pub(crate) fn drain(&self) -> Vec<Arc<T>> {
        let mut slots = self.slots.write();
        slots.objects.drain().map(|(_, object)| object).collect()
    }

    fn key(&self, handle: H) -> DefaultKey {
        KeyData::from_ffi(handle.bits() ^ self.mask).into()
    }

    /// Returns the error for a handle without an object.
    #[cold]
    fn missing_error(&self, slots: &Slots<T>, handle: H) -> Error {
        if slots.issued.contains(handle.bits() ^ self.mask) {
            let name = slots.removed.name(handle.bits()).map(str::to_owned);
            Error::StaleHandle { kind: H::KIND, name }
        } else {
            Error::ForeignHandle { kind: H::KIND }
        }
    }
}

/// The range of the keys that a pool has given out: the largest index, and the largest generation.
///
/// A key of the pool lies in the range. A handle of another context, decoded with the mask of this one, has an index
/// and a generation that are spread over 32 bits each. It lies in the range with a probability of (objects / 2^32) x
/// (generations / 2^32): about one in twenty million for a million objects and a million reuses of a place. Then the
/// error says `stale` in place of `foreign`.
#[derive(Debug, Default)]
struct IssuedKeys {
    max_index: u32,
    max_generation: u32,
}

impl IssuedKeys {
    fn add(&mut self, key: u64) {
        let (index, generation) = index_and_generation(key);
        self.max_index = self.max_index.max(index);
        self.max_generation = self.max_generation.max(generation);
    }

    fn contains(&self, key: u64) -> bool {
        let (index, generation) = index_and_generation(key);
        // Generations of objects are odd.
        index > 0 && index <= self.max_index && generation % 2 == 1 && generation <= self.max_generation
    }
}

/// Returns the two halves of a key in the form of [`KeyData::as_ffi`].
fn index_and_generation(key: u64) -> (u32, u32) {
    (key as u32, (key >> 32) as u32)
}

/// The names of the objects that were removed last, by handle, for error messages. The memory is bounded and reused.
#[derive(Debug, Default)]
struct RemovedNames(VecDeque<(u64, String)>);

impl RemovedNames {
    const MAX_COUNT: usize = 64;
    const MAX_BYTES: usize = 64;

    fn add(&mut self, handle: u64, name: &str) {
        let oldest = if self.0.len() < Self::MAX_COUNT { None } else { self.0.pop_front() };
        let mut text = oldest.map(|(_, text)| text).unwrap_or_default();
        text.clear();
        let ends = name.char_indices().map(|(start, letter)| start + letter.len_utf8());
        let end = ends.take_while(|end| *end <= Self::MAX_BYTES).last().unwrap_or(0);
        text.push_str(&name[..end]);
        self.0.push_back((handle, text));
    }

    fn name(&self, handle: u64) -> Option<&str> {
        self.0.iter().rev().find(|(own, _)| *own == handle).map(|(_, name)| name.as_str())
    }
}

/// Returns a different mask for each context of the process: multiples of an odd number, spread over all bits.
pub(crate) fn next_context_mask() -> u64 {
    static CONTEXTS: AtomicU64 = AtomicU64::new(1);
    CONTEXTS.fetch_add(1, Ordering::Relaxed).wrapping_mul(0x9e37_79b9_7f4a_7c15)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::handle::BufferHandle;

    type Pool = HandlePool<BufferHandle, String>;

    /// Most steps of a random use. Each step asks for all handles.
    const STEPS: usize = if cfg!(miri) { 20 } else { 200 };

    fn pool() -> Pool {
        HandlePool::new(next_context_mask(), |name| name)
    }

    fn stale_name(pool: &Pool, handle: BufferHandle) -> Option<String> {
        match pool.get(handle) {
            Err(Error::StaleHandle { kind: "buffer", name }) => name,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn a_removed_object_is_stale_even_when_its_place_is_taken_again() {
        let pool = pool();
        let first = pool.insert("first".to_owned());
        assert_eq!(*pool.remove(first).unwrap(), "first");
        let second = pool.insert("second".to_owned());
        assert_eq!(stale_name(&pool, first).as_deref(), Some("first"));
        assert!(matches!(pool.remove(first), Err(Error::StaleHandle { .. })));
        assert_eq!(*pool.get(second).unwrap(), "second");
    }

    #[test]
    fn a_handle_of_another_context_finds_nothing_and_is_foreign() {
        // Miri takes a millisecond for each question.
        let (pools, objects) = if cfg!(miri) { (4, 10) } else { (64, 100) };
        let pools: Vec<_> = (0..pools).map(|_| pool()).collect();
        let handles: Vec<Vec<_>> = pools
            .iter()
            .map(|pool| (0..objects).map(|value| pool.insert(format!("{value}"))).collect())
            .collect();
        for (owner, handles) in handles.iter().enumerate() {
            for (other, pool) in pools.iter().enumerate() {
                for (value, handle) in handles.iter().enumerate() {
                    let found = pool.get(*handle);
                    if owner == other {
                        assert_eq!(*found.unwrap(), format!("{value}"));
                    } else {
                        assert!(matches!(found, Err(Error::ForeignHandle { kind: "buffer" })), "{found:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn names_of_removed_objects_take_bounded_memory() {
        let pool = pool();
        let long = "\u{e9}".repeat(1000);
        let first = pool.insert(long);
        pool.remove(first).unwrap();
        assert_eq!(stale_name(&pool, first).unwrap(), "\u{e9}".repeat(32));
        let others: Vec<_> = (0..RemovedNames::MAX_COUNT).map(|n| pool.insert(format!("{n}"))).collect();
        others.iter().for_each(|handle| drop(pool.remove(*handle)));
        assert_eq!(stale_name(&pool, first), None);
        assert_eq!(stale_name(&pool, others[0]).as_deref(), Some("0"));
        assert_eq!(pool.slots.read().removed.0.len(), RemovedNames::MAX_COUNT);
    }

    proptest! {
        /// Every handle of the pool finds its object or is stale; none is foreign.
        #[test]
        fn own_handles_are_never_foreign(
            steps in prop::collection::vec((any::<bool>(), any::<prop::sample::Index>()), 1..STEPS)
        ) {
            let pool = pool();
            let mut handles = vec![pool.insert("0".to_owned())];
            for (inserts, which) in steps {
                if inserts {
                    handles.push(pool.insert(handles.len().to_string()));
                } else {
                    drop(pool.remove(*which.get(&handles)));
                }
                for (number, handle) in handles.iter().enumerate() {
                    match pool.get(*handle) {
                        Ok(name) => prop_assert_eq!(name.parse().ok(), Some(number)),
                        Err(Error::StaleHandle { name: Some(name), .. }) => {
                            prop_assert_eq!(name.parse().ok(), Some(number));
                        }
                        Err(error) => prop_assert!(matches!(error, Error::StaleHandle { .. }), "{}", error),
                    }
                }
            }
        }
    }
}
