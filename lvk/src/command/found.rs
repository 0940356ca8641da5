//! Objects that a command buffer has found lately, to find them again without the pool's lock.

use std::sync::Arc;

use crate::error::{Error, Result};
use crate::handle::Handle;
use crate::store::Pool;

/// How many are kept; a power of two.
const PLACES: usize = 8;

/// The last objects found, each at a place that follows from its handle.
///
/// Nothing is found here that the pool would not find: once anything was taken out of the pool, all is forgotten.
pub(super) struct Found<H, T> {
    places: [Option<(H, Arc<T>)>; PLACES],
    /// How many objects had been taken out of the pool when the first of them was found.
    removals: u64,
}

impl<H: Handle, T> Found<H, T> {
    /// The object of a handle.
    pub(super) fn get(&mut self, pool: &Pool<H, T>, handle: H) -> Result<&Arc<T>> {
        let removals = pool.removals();
        if self.removals != removals {
            *self = Self { removals, ..Self::default() };
        }
        let place = &mut self.places[place_of(handle)];
        if place.as_ref().is_none_or(|(known, _)| *known != handle) {
            *place = Some((handle, pool.get(handle)?));
        }
        place.as_ref().map(|(_, object)| object).ok_or(Error::StaleHandle { kind: H::KIND })
    }
}

impl<H, T> Default for Found<H, T> {
    fn default() -> Self {
        Self { places: std::array::from_fn(|_| None), removals: 0 }
    }
}

/// Handles of one pool differ most in their low bits, which count objects.
fn place_of(handle: impl Handle) -> usize {
    handle.bits() as usize % PLACES
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
            let pool = Pool::<BufferHandle, u32>::new(0x9e37_79b9_7f4a_7c15);
            let mut found = Found::default();
            let mut handles = vec![pool.insert(0)];
            for (kind, which) in steps {
                let handle = *which.get(&handles);
                match kind {
                    0 => handles.push(pool.insert(handles.len() as u32)),
                    1 => drop(pool.remove(handle)),
                    _ => {
                        let ours = found.get(&pool, handle).map(|object| **object).ok();
                        prop_assert_eq!(ours, pool.get(handle).map(|object| *object).ok());
                    }
                }
            }
        }
    }
}
