//! The BLAS that a TLAS references, without duplicates. The set is reused while the TLAS references the same BLAS.

use std::collections::HashMap;
use std::hash::BuildHasherDefault;
use std::sync::Arc;

use super::blas::{Blas, BlasStructures};
use super::flags::BuildFlags;
use crate::barrier::{IdHasher, ResourceId};
use crate::error::Result;
use crate::handle::AccelStructHandle;

/// Returns the BLAS of a handle.
pub(crate) type ResolveBlas<'a> = &'a (dyn Fn(AccelStructHandle) -> Result<BlasRef> + Sync);

/// Counters of destroyed and of moved acceleration structures. While both stay the same, resolved references stay
/// valid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct AccelGeneration {
    pub(crate) removals: u64,
    pub(crate) moves: u64,
}

/// A BLAS that instances reference, with its acceleration structures at that time.
#[derive(Clone)]
pub(crate) struct BlasRef {
    pub(crate) handle: AccelStructHandle,
    /// The resource that barriers and queue synchronisation track.
    pub(crate) id: ResourceId,
    allows_compaction: bool,
    pub(crate) blas: Arc<Blas>,
    pub(crate) structures: Arc<BlasStructures>,
}

impl BlasRef {
    /// References a BLAS with its present Vulkan structures.
    pub(crate) fn new(handle: AccelStructHandle, id: ResourceId, flags: BuildFlags, blas: Arc<Blas>) -> Self {
        let structures = blas.structures();
        let allows_compaction = flags.contains(BuildFlags::ALLOW_COMPACTION);
        Self { handle, id, allows_compaction, blas, structures }
    }

    fn is_outdated(&self) -> bool {
        !Arc::ptr_eq(&self.blas.structures(), &self.structures)
    }

    /// True if the BLAS may still be compacted, which changes its address.
    fn may_move(&self) -> bool {
        self.allows_compaction && self.structures.compacted_from.is_none()
    }

    /// True if an instance of the BLAS cannot be written with its address alone.
    pub(crate) fn needs_kernel(&self) -> bool {
        self.may_move() || self.needs_hit_remap()
    }

    /// True if hits of the BLAS need a hit remap table to map them to the caller's ids.
    fn needs_hit_remap(&self) -> bool {
        self.blas.parts.iter().any(|part| part.map.is_some()) || self.structures.structures.len() > 1
    }

    /// Address of the first part, for instances that are written with addresses.
    fn address(&self) -> u64 {
        self.structures.structures.first().map_or(0, |structure| structure.address)
    }
}

/// The BLAS that a list of instances references, with derived data. Immutable.
#[derive(Default)]
pub(crate) struct BlasRefSet {
    refs: Vec<BlasRef>,
    handles: Vec<AccelStructHandle>,
    /// Index of each handle in `refs`; empty for at most [`LINEAR_SEARCH_MAX`](Self::LINEAR_SEARCH_MAX) of them.
    index_map: HashMap<AccelStructHandle, u32, BuildHasherDefault<IdHasher>>,
    /// Address of the first part of each BLAS.
    addresses: Vec<u64>,
    /// First part and number of parts of each BLAS.
    part_spans: Vec<[u32; 2]>,
    /// Address of the acceleration structure and of the primitive map of each part.
    part_addresses: Vec<[u64; 2]>,
    /// True if any BLAS cannot be written with its address alone: it has several parts or a primitive map, or may
    /// move.
    pub(crate) needs_kernel: bool,
    /// True if any BLAS may still be compacted.
    pub(crate) may_move: bool,
    /// True if hits of any BLAS need a hit remap table.
    pub(crate) needs_hit_remap: bool,
}

impl BlasRefSet {
    /// Up to this many handles are searched one by one, which is faster than a map.
    const LINEAR_SEARCH_MAX: usize = 8;

    pub(crate) fn new(list: Vec<BlasRef>) -> Self {
        let index_map = match list.len() {
            ..=Self::LINEAR_SEARCH_MAX => HashMap::default(),
            _ => (0..).zip(&list).map(|(ref_index, blas_ref)| (blas_ref.handle, ref_index)).collect(),
        };
        let (mut spans, mut parts) = (Vec::with_capacity(list.len()), Vec::with_capacity(list.len()));
        for blas_ref in &list {
            spans.push([parts.len() as u32, blas_ref.structures.structures.len() as u32]);
            let maps =
                blas_ref.blas.parts.iter().map(|part| part.map.as_ref().map_or(0, |map| map.table.address));
            let structures = blas_ref.structures.structures.iter().map(|structure| structure.address);
            parts.extend(structures.zip(maps).map(|(structure, map)| [structure, map]));
        }
        Self {
            handles: list.iter().map(|blas_ref| blas_ref.handle).collect(),
            addresses: list.iter().map(BlasRef::address).collect(),
            needs_kernel: list.iter().any(BlasRef::needs_kernel),
            may_move: list.iter().any(BlasRef::may_move),
            needs_hit_remap: list.iter().any(BlasRef::needs_hit_remap),
            part_spans: spans,
            part_addresses: parts,
            index_map,
            refs: list,
        }
    }

    /// The BLAS references, by index.
    pub(crate) fn refs(&self) -> &[BlasRef] {
        &self.refs
    }

    /// First part and number of parts of each BLAS.
    pub(crate) fn part_spans(&self) -> &[[u32; 2]] {
        &self.part_spans
    }

    /// Address of the acceleration structure and of the primitive map of each part of each BLAS.
    pub(crate) fn part_addresses(&self) -> &[[u64; 2]] {
        &self.part_addresses
    }

    /// True if any BLAS has moved since the set was created.
    pub(crate) fn is_outdated(&self) -> bool {
        self.refs.iter().any(BlasRef::is_outdated)
    }

    /// True if every BLAS still exists and none has moved.
    pub(crate) fn is_current(&self, resolve: ResolveBlas<'_>) -> bool {
        let is_same = |known: &BlasRef, now: BlasRef| Arc::ptr_eq(&known.structures, &now.structures);
        self.refs.iter().all(|known| resolve(known.handle).is_ok_and(|now| is_same(known, now)))
    }

    /// Returns a set of the same BLAS with their present acceleration structures.
    pub(crate) fn refreshed(&self) -> Self {
        let refresh = |known: &BlasRef| BlasRef { structures: known.blas.structures(), ..known.clone() };
        Self::new(self.refs.iter().map(refresh).collect())
    }

    /// True if the set has exactly these handles, in this order.
    pub(crate) fn has_handles(&self, handles: &[AccelStructHandle]) -> bool {
        self.handles == handles
    }

    /// Index and address of a BLAS; `None` if the set does not have it.
    #[inline]
    pub(crate) fn index_and_address(&self, handle: AccelStructHandle) -> Option<(u32, u64)> {
        let ref_index = self.index_of(handle)?;
        Some((ref_index as u32, self.addresses[ref_index]))
    }

    #[inline]
    fn index_of(&self, handle: AccelStructHandle) -> Option<usize> {
        if self.handles.len() <= Self::LINEAR_SEARCH_MAX {
            return self.handles.iter().position(|known| *known == handle);
        }
        self.index_in_map(handle)
    }

    #[inline(never)]
    fn index_in_map(&self, handle: AccelStructHandle) -> Option<usize> {
        self.index_map.get(&handle).map(|ref_index| *ref_index as usize)
    }
}

/// A set of indices. Its memory is reused, so it rarely allocates.
#[derive(Debug, Default)]
pub(crate) struct BitSet {
    first: u64,
    /// Bits of the indices from 64 on.
    more: Vec<u64>,
    count: usize,
}

impl BitSet {
    #[inline]
    fn reset(&mut self, len: usize) {
        self.first = 0;
        self.count = 0;
        if len > 64 {
            self.more.clear();
            self.more.resize(len.div_ceil(64) - 1, 0);
        }
    }

    #[inline]
    fn insert(&mut self, ref_index: usize) {
        let word = match ref_index / 64 {
            0 => &mut self.first,
            word => &mut self.more[word - 1],
        };
        let bit = 1 << (ref_index % 64);
        self.count += usize::from(*word & bit == 0);
        *word |= bit;
    }

    fn contains(&self, ref_index: usize) -> bool {
        let word = match ref_index / 64 {
            0 => self.first,
            word => self.more[word - 1],
        };
        word >> (ref_index % 64) & 1 == 1
    }
}

/// Collects the BLAS that instances reference, beginning with those of the previous set.
pub(crate) struct BlasRefCollector<'a> {
    previous: &'a BlasRefSet,
    seen: &'a mut BitSet,
    resolve: ResolveBlas<'a>,
    /// BLAS that the previous set does not have; `None` if there are none, as is usual.
    new: Option<Box<NewRefs>>,
    /// True if any BLAS cannot be written with its address alone.
    pub(crate) needs_kernel: bool,
}

/// BLAS that the previous set does not have, without duplicates.
#[derive(Default)]
struct NewRefs {
    refs: Vec<BlasRef>,
    index_map: HashMap<AccelStructHandle, usize, BuildHasherDefault<IdHasher>>,
}

impl<'a> BlasRefCollector<'a> {
    #[inline]
    pub(crate) fn new(known: &'a BlasRefSet, marks: &'a mut BitSet, resolve: ResolveBlas<'a>) -> Self {
        marks.reset(known.refs.len());
        Self { previous: known, seen: marks, resolve, new: None, needs_kernel: known.needs_kernel }
    }

    /// Adds a BLAS and returns its index. Indices of new BLAS follow those of the previous set.
    #[inline]
    pub(crate) fn add(&mut self, handle: AccelStructHandle) -> Result<usize> {
        let Some(ref_index) = self.previous.index_of(handle) else { return self.add_new(handle) };
        self.seen.insert(ref_index);
        Ok(ref_index)
    }

    /// Adds a BLAS and returns the address for its instances.
    #[inline]
    pub(crate) fn add_for_address(&mut self, handle: AccelStructHandle) -> Result<u64> {
        let Some(ref_index) = self.previous.index_of(handle) else { return self.add_new_for_address(handle) };
        self.seen.insert(ref_index);
        Ok(self.previous.addresses[ref_index])
    }

    #[cold]
    fn add_new_for_address(&mut self, handle: AccelStructHandle) -> Result<u64> {
        let ref_index = self.add_new(handle)? - self.previous.refs.len();
        Ok(self.new.as_ref().and_then(|new| new.refs.get(ref_index)).map_or(0, BlasRef::address))
    }

    #[cold]
    fn add_new(&mut self, handle: AccelStructHandle) -> Result<usize> {
        let before = self.previous.refs.len();
        let NewRefs { refs: list, index_map } = &mut **self.new.get_or_insert_default();
        if let Some(ref_index) = index_map.get(&handle) {
            return Ok(before + ref_index);
        }
        let blas_ref = (self.resolve)(handle)?;
        self.needs_kernel |= blas_ref.needs_kernel();
        index_map.insert(handle, list.len());
        list.push(blas_ref);
        Ok(before + list.len() - 1)
    }

    /// Returns the BLAS that the previous set does not have.
    pub(crate) fn into_new_refs(self) -> Vec<BlasRef> {
        self.new.map(|new| new.refs).unwrap_or_default()
    }

    /// True if all BLAS of the previous set were added, and no others.
    #[inline]
    pub(crate) fn is_unchanged(&self) -> bool {
        self.new.is_none() && self.seen.count == self.previous.refs.len()
    }

    /// Returns the set of all added BLAS, and the index in it for each index that [`add`](Self::add) returned.
    pub(crate) fn finish(self) -> (BlasRefSet, Vec<u32>) {
        let Self { previous: known, seen: marks, new, .. } = self;
        let new = new.map(|new| new.refs).unwrap_or_default();
        let mut list = Vec::with_capacity(marks.count + new.len());
        let mut moved = Vec::with_capacity(known.refs.len() + new.len());
        for (ref_index, blas_ref) in known.refs.iter().enumerate() {
            moved.push(list.len() as u32);
            if marks.contains(ref_index) {
                list.push(blas_ref.clone());
            }
        }
        moved.extend((list.len() as u32..).take(new.len()));
        list.extend(new);
        (BlasRefSet::new(list), moved)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::pool::HandlePool;

    type Structures = HandlePool<AccelStructHandle, Blas>;

    fn blas() -> Blas {
        let body = BlasStructures { structures: Vec::new(), compacted_from: None, rebuildable: true };
        Blas::new(Vec::new(), None, Vec::new(), body, None)
    }

    fn find(pool: &Structures, handle: AccelStructHandle) -> Result<BlasRef> {
        Ok(BlasRef::new(handle, ResourceId(0), BuildFlags::empty(), pool.get(handle)?))
    }

    fn sorted(mut handles: Vec<AccelStructHandle>) -> Vec<u64> {
        handles.sort_by_key(|handle| crate::handle::Handle::bits(*handle));
        handles.dedup();
        handles.into_iter().map(crate::handle::Handle::bits).collect()
    }

    proptest! {
        /// Collects several lists in turn, each with the set of the one before as the previous set.
        #[test]
        fn a_set_is_what_the_list_refers_to_and_stays_while_that_is_the_same(
            count in 1..100_usize,
            lists in prop::collection::vec(prop::collection::vec(any::<prop::sample::Index>(), 0..200), 1..5)
        ) {
            let pool = Structures::new(7, |_| "");
            let handles: Vec<_> = (0..count).map(|_| pool.insert(blas())).collect();
            let resolve = |handle| find(&pool, handle);
            let (mut known, mut marks) = (BlasRefSet::default(), BitSet::default());
            for list in lists {
                let list: Vec<_> = list.iter().map(|index| *index.get(&handles)).collect();
                let before: Vec<_> = known.refs().iter().map(|blas_ref| blas_ref.handle).collect();
                let mut collector = BlasRefCollector::new(&known, &mut marks, &resolve);
                let index_map: Vec<_> = list.iter().map(|handle| collector.add(*handle).unwrap()).collect();
                prop_assert_eq!(collector.is_unchanged(), sorted(before) == sorted(list.clone()));
                let (found, moved) = collector.finish();
                let all: Vec<_> = found.refs().iter().map(|blas_ref| blas_ref.handle).collect();
                prop_assert_eq!(sorted(all.clone()).len(), all.len(), "each once");
                prop_assert_eq!(sorted(all.clone()), sorted(list.clone()));
                for (handle, ref_index) in list.iter().zip(index_map) {
                    prop_assert_eq!(all[moved[ref_index] as usize], *handle);
                    prop_assert_eq!(found.index_of(*handle), Some(moved[ref_index] as usize));
                }
                known = found;
            }
        }
    }

    #[test]
    fn a_set_stands_until_something_of_it_is_gone_or_has_moved() {
        let pool = Structures::new(7, |_| "");
        let handles = [pool.insert(blas()), pool.insert(blas())];
        let resolve = |handle| find(&pool, handle);
        let set = || BlasRefSet::new(handles.map(|handle| resolve(handle).unwrap()).into());
        let (first, other) = (set(), pool.insert(blas()));
        pool.remove(other).unwrap();
        assert!(first.is_current(&resolve) && !first.is_outdated());
        let body = BlasStructures { structures: Vec::new(), compacted_from: Some(1), rebuildable: false };
        pool.get(handles[1]).unwrap().replace_structures(body, 0).unwrap();
        assert!(!first.is_current(&resolve) && first.is_outdated());
        assert!(!first.refreshed().is_outdated());
        let second = set();
        assert!(second.is_current(&resolve));
        pool.remove(handles[0]).unwrap();
        assert!(!second.is_current(&resolve) && !second.is_outdated());
    }
}
