//! Objects that a command buffer has found so far, to find them again without the pool's lock.

use std::sync::Arc;

use crate::barrier::{IdMap, ResourceId};
use crate::error::Result;
use crate::handle::Handle;
use crate::pool::HandlePool;

/// Every object that a command buffer has used, once, in a row of its own. Commands name rows, and count no references.
///
/// Nothing is found here by its handle that the pool would not find: once anything was taken out of the pool, all handles are
/// forgotten. The objects are not. `PLACES`, a power of two, says how many are kept in reach.
pub(crate) struct HandleCache<H, T, const PLACES: usize = 8> {
    objects: Vec<Arc<T>>,
    /// Rows by where the object lies, which no other one does while it is held; where they are more than a few.
    index_by_object: IdMap<usize>,
    /// Rows of the last handles, each at a place that follows from the handle.
    recent: [Option<(H, usize)>; PLACES],
    /// How many objects had been taken out of the pool when the first of these was found.
    removals: u64,
}

impl<H: Handle, T, const PLACES: usize> HandleCache<H, T, PLACES> {
    /// So many are searched one by one, which is faster than a map.
    const LINEAR_SEARCH_MAX: usize = 16;

    /// The row of the object of a handle.
    #[inline]
    pub(crate) fn index_of_handle(&mut self, pool: &HandlePool<H, T>, handle: H) -> Result<usize> {
        match self.recent[Self::cache_slot(handle)] {
            Some((known, index)) if known == handle && self.removals == pool.removals() => Ok(index),
            _ => self.find_in_pool(pool, handle),
        }
    }

    /// Finds by the pool.
    #[inline(never)]
    fn find_in_pool(&mut self, pool: &HandlePool<H, T>, handle: H) -> Result<usize> {
        let removals = pool.removals();
        if self.removals != removals {
            self.recent = [None; PLACES];
            self.removals = removals;
        }
        let object = pool.get(handle)?;
        let index = self.known_index(&object).unwrap_or_else(|| self.push(object));
        self.recent[Self::cache_slot(handle)] = Some((handle, index));
        Ok(index)
    }

    /// The row of an object.
    pub(crate) fn index_of(&mut self, object: &Arc<T>) -> usize {
        self.known_index(object).unwrap_or_else(|| self.push(Arc::clone(object)))
    }

    fn known_index(&self, object: &Arc<T>) -> Option<usize> {
        if self.objects.len() <= Self::LINEAR_SEARCH_MAX {
            return self.objects.iter().position(|known| Arc::ptr_eq(known, object));
        }
        self.index_by_object.get(&pointer_id(object)).copied()
    }

    fn push(&mut self, object: Arc<T>) -> usize {
        self.objects.push(object);
        let first = if self.objects.len() > Self::LINEAR_SEARCH_MAX {
            self.index_by_object.len()
        } else {
            self.objects.len()
        };
        let new = self.objects.iter().enumerate().skip(first);
        self.index_by_object.extend(new.map(|(index, object)| (pointer_id(object), index)));
        self.objects.len() - 1
    }

    /// Handles of one pool differ most in their low bits, which count objects.
    fn cache_slot(handle: H) -> usize {
        handle.bits() as usize % PLACES
    }

    /// Forgets everything; keeps the memory.
    pub(crate) fn clear(&mut self) {
        if !self.objects.is_empty() {
            self.objects.clear();
            self.index_by_object.clear();
            self.recent = [None; PLACES];
        }
    }

    /// How many there are.
    #[inline]
    pub(crate) fn len(&self) -> usize {
        self.objects.len()
    }

    /// The objects of this row and those behind it.
    pub(crate) fn objects_from(&self, index: usize) -> &[Arc<T>] {
        &self.objects[index..]
    }

    /// The object of a row.
    #[inline]
    pub(crate) fn object(&self, index: usize) -> &Arc<T> {
        &self.objects[index]
    }
}

impl<H: Copy, T, const PLACES: usize> Default for HandleCache<H, T, PLACES> {
    fn default() -> Self {
        Self { objects: Vec::new(), index_by_object: IdMap::default(), recent: [None; PLACES], removals: 0 }
    }
}

/// Where an object lies names it, as long as it is held.
fn pointer_id<T>(object: &Arc<T>) -> ResourceId {
    ResourceId(Arc::as_ptr(object) as u64)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::handle::BufferHandle;

    proptest! {
        /// More objects than places, and handles whose objects are gone, also those whose place was taken again.
        #[test]
        fn whatever_the_pool_finds_is_found_and_nothing_else(
            steps in prop::collection::vec((0..3_u8, any::<prop::sample::Index>()), 1..120)
        ) {
            let pool = HandlePool::<BufferHandle, u32>::new(0x9e37_79b9_7f4a_7c15);
            let mut found = HandleCache::<BufferHandle, u32>::default();
            let mut handles = vec![pool.insert(0)];
            for (kind, which) in steps {
                let handle = *which.get(&handles);
                match kind {
                    0 => handles.push(pool.insert(handles.len() as u32)),
                    1 => drop(pool.remove(handle)),
                    _ => {
                        let ours = found.index_of_handle(&pool, handle).map(|index| **found.object(index)).ok();
                        prop_assert_eq!(ours, pool.get(handle).map(|object| *object).ok());
                    }
                }
            }
        }
    }
}
