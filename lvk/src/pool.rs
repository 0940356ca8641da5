//! The pool of one kind of object: maps a handle to its object, or to [`Error::StaleHandle`].

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
/// context.
pub(crate) struct HandlePool<H, T> {
    objects: RwLock<SlotMap<DefaultKey, Arc<T>>>,
    /// Number of objects removed so far. While it stays the same, every object found before is still in the pool.
    removals: AtomicU64,
    mask: u64,
    handle: PhantomData<fn() -> H>,
}

impl<H: Handle, T> HandlePool<H, T> {
    pub(crate) fn new(mask: u64) -> Self {
        let objects = RwLock::new(Rank::Store, SlotMap::new());
        Self { objects, removals: AtomicU64::new(0), mask, handle: PhantomData }
    }

    pub(crate) fn insert(&self, object: T) -> H {
        let mut objects = self.objects.write();
        H::from_bits(objects.insert(Arc::new(object)).data().as_ffi() ^ self.mask)
    }

    pub(crate) fn get(&self, handle: H) -> Result<Arc<T>> {
        let objects = self.objects.read();
        objects.get(self.key(handle)).cloned().ok_or(Error::StaleHandle { kind: H::KIND })
    }

    pub(crate) fn remove(&self, handle: H) -> Result<Arc<T>> {
        let mut objects = self.objects.write();
        let object = objects.remove(self.key(handle)).ok_or(Error::StaleHandle { kind: H::KIND })?;
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
        let objects = self.objects.read();
        objects.values().cloned().collect()
    }

    /// Removes and returns every object.
    pub(crate) fn drain(&self) -> Vec<Arc<T>> {
        let mut objects = self.objects.write();
        objects.drain().map(|(_, object)| object).collect()
    }

    fn key(&self, handle: H) -> DefaultKey {
        KeyData::from_ffi(handle.bits() ^ self.mask).into()
    }
}

/// Returns a different mask for each context of the process: multiples of an odd number, spread over all bits.
pub(crate) fn next_context_mask() -> u64 {
    static CONTEXTS: AtomicU64 = AtomicU64::new(1);
    CONTEXTS.fetch_add(1, Ordering::Relaxed).wrapping_mul(0x9e37_79b9_7f4a_7c15)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::handle::BufferHandle;

    #[test]
    fn a_removed_object_is_stale_even_when_its_place_is_taken_again() {
        let pool = HandlePool::<BufferHandle, u32>::new(next_context_mask());
        let first = pool.insert(1);
        assert_eq!(*pool.remove(first).unwrap(), 1);
        let second = pool.insert(2);
        assert!(matches!(pool.get(first), Err(Error::StaleHandle { kind: "buffer" })));
        assert!(pool.remove(first).is_err());
        assert_eq!(*pool.get(second).unwrap(), 2);
    }

    #[test]
    fn a_handle_of_another_context_finds_nothing() {
        let pools: Vec<_> =
            (0..64).map(|_| HandlePool::<BufferHandle, usize>::new(next_context_mask())).collect();
        let handles: Vec<Vec<_>> =
            pools.iter().map(|pool| (0..100).map(|value| pool.insert(value)).collect()).collect();
        for (owner, handles) in handles.iter().enumerate() {
            for (other, pool) in pools.iter().enumerate() {
                for (value, handle) in handles.iter().enumerate() {
                    let found = pool.get(*handle).ok().map(|object| *object);
                    assert_eq!(found, (owner == other).then_some(value));
                }
            }
        }
    }
}
