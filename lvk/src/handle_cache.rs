//! A cache of the objects that a command buffer uses, to find them again without the pool's lock.

use std::sync::Arc;

use crate::barrier::{IdMap, ResourceId};
use crate::error::Result;
use crate::handle::Handle;
use crate::pool::HandlePool;

/// The objects that a command buffer has used, each once. Commands name an object by its index, and count no
/// references.
///
/// A lookup by handle returns no object that the pool would not return: if an object was removed from the pool, the
/// cache drops all handles. It keeps the objects. `ENTRIES`, a power of two, is the number of handles it keeps.
pub(crate) struct HandleCache<H, T, const ENTRIES: usize = 8> {
    objects: Vec<Arc<T>>,
    /// Indices by the address of the object, which is unique while the object is held. Empty while there are few
    /// objects.
    index_by_object: IdMap<usize>,
    /// Indices of recent handles, each in a slot that follows from the handle.
    recent: [Option<(H, usize)>; ENTRIES],
    /// Number of removals from the pool when the first of `recent` was found.
    removals: u64,
}

impl<H: Handle, T, const ENTRIES: usize> HandleCache<H, T, ENTRIES> {
    /// Up to this many objects are searched linearly, which is faster than a map.
    const LINEAR_SEARCH_MAX: usize = 16;

    /// Returns the index of the object of a handle.
    #[inline]
    pub(crate) fn index_of_handle(&mut self, pool: &HandlePool<H, T>, handle: H) -> Result<usize> {
        match self.recent[Self::cache_slot(handle)] {
            Some((known, index)) if known == handle && self.removals == pool.removals() => Ok(index),
            _ => self.find_in_pool(pool, handle),
        }
    }

    /// Looks the handle up in the pool.
    #[inline(never)]
    fn find_in_pool(&mut self, pool: &HandlePool<H, T>, handle: H) -> Result<usize> {
        let removals = pool.removals();
        if self.removals != removals {
            self.recent = [None; ENTRIES];
            self.removals = removals;
        }
        let object = pool.get(handle)?;
        let index = self.known_index(&object).unwrap_or_else(|| self.push(object));
        self.recent[Self::cache_slot(handle)] = Some((handle, index));
        Ok(index)
    }

    /// Returns the index of an object, which is added if it is new.
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

    /// Returns the slot of a handle. Handles of one pool differ most in their low bits, which count objects.
    fn cache_slot(handle: H) -> usize {
        handle.bits() as usize % ENTRIES
    }

    /// Clears everything and keeps the memory.
    pub(crate) fn clear(&mut self) {
        if !self.objects.is_empty() {
            self.objects.clear();
            self.index_by_object.clear();
            self.recent = [None; ENTRIES];
        }
    }

    /// Returns the number of objects.
    #[inline]
    pub(crate) fn len(&self) -> usize {
        self.objects.len()
    }

    /// Returns the objects from `index` on.
    pub(crate) fn objects_from(&self, index: usize) -> &[Arc<T>] {
        &self.objects[index..]
    }

    /// Returns the object at `index`.
    #[inline]
    pub(crate) fn object(&self, index: usize) -> &Arc<T> {
        &self.objects[index]
    }
}

impl<H: Copy, T, const ENTRIES: usize> Default for HandleCache<H, T, ENTRIES> {
    fn default() -> Self {
        Self { objects: Vec::new(), index_by_object: IdMap::default(), recent: [None; ENTRIES], removals: 0 }
    }
}

/// Returns the address of an object as its id, which is unique while the object is held.
fn pointer_id<T>(object: &Arc<T>) -> ResourceId {
    ResourceId(Arc::as_ptr(object) as u64)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::handle::BufferHandle;

    proptest! {
        /// Cases: more objects than slots, and handles whose objects were removed, also if their place in the pool
        /// was reused.
        #[test]
        fn the_cache_answers_as_the_pool_does(
            steps in prop::collection::vec((0..3_u8, any::<prop::sample::Index>()), 1..120)
        ) {
            let pool = HandlePool::<BufferHandle, u32>::new(0x9e37_79b9_7f4a_7c15, |_| "");
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
