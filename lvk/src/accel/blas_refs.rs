//! The bottom-level structures that a top-level one shows: listed once, and kept as long as the same are shown.

use std::collections::HashMap;
use std::hash::BuildHasherDefault;
use std::sync::Arc;

use super::accel_struct::AccelStruct;
use super::blas::BlasBody;
use super::flags::BuildFlags;
use crate::barrier::IdHasher;
use crate::error::Result;
use crate::handle::AccelStructHandle;

/// Finds the structure of a handle.
pub(crate) type Find<'a> = &'a (dyn Fn(AccelStructHandle) -> Result<Arc<AccelStruct>> + Sync);

/// Rises with every structure that is destroyed, and with every one that moves: while it stays the same, so does what was
/// found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Revision {
    pub(crate) removals: u64,
    pub(crate) moves: u64,
}

/// A bottom-level structure that instances refer to, with the body they refer to.
#[derive(Clone)]
pub(crate) struct Shown {
    pub(crate) handle: AccelStructHandle,
    pub(crate) blas: Arc<AccelStruct>,
    pub(crate) body: Arc<BlasBody>,
}

impl Shown {
    /// A structure as it stands now.
    pub(crate) fn new(handle: AccelStructHandle, blas: Arc<AccelStruct>) -> Result<Self> {
        let body = blas.blas()?.body();
        Ok(Self { handle, blas, body })
    }

    fn is_outdated(&self) -> bool {
        self.blas.blas().is_ok_and(|blas| !Arc::ptr_eq(&blas.body(), &self.body))
    }

    /// Whether it may yet be compacted, which gives it another address.
    fn may_move(&self) -> bool {
        self.blas.flags.contains(BuildFlags::ALLOW_COMPACTION) && self.body.compacted_from.is_none()
    }

    /// Whether its address does not do in an instance.
    pub(crate) fn needs_kernel(&self) -> bool {
        self.may_move() || self.has_rows()
    }

    /// Whether its hits need rows to become the caller's numbers.
    fn has_rows(&self) -> bool {
        let mapped = self.blas.blas().is_ok_and(|blas| blas.parts.iter().any(|part| part.map.is_some()));
        mapped || self.body.structures.len() > 1
    }

    /// What instances refer to, where they refer to an address.
    fn address(&self) -> u64 {
        self.body.structures.first().map_or(0, |structure| structure.address)
    }
}

/// What a list of instances refers to, with all that follows from it. Never changes.
#[derive(Default)]
pub(crate) struct ShownSet {
    list: Vec<Shown>,
    handles: Vec<AccelStructHandle>,
    /// The place of each in `list`, where they are more than a few.
    places: HashMap<AccelStructHandle, u32, BuildHasherDefault<IdHasher>>,
    /// What instances refer to, where they refer to an address.
    addresses: Vec<u64>,
    /// First part and number of parts of each.
    spans: Vec<[u32; 2]>,
    /// Address of the structure and of its map, for each part.
    parts: Vec<[u64; 2]>,
    /// Whether an address does not do for some: it has parts, maps, or may move.
    pub(crate) needs_kernel: bool,
    /// Whether some may yet be compacted.
    pub(crate) may_move: bool,
    /// Whether hits of some need rows.
    pub(crate) has_rows: bool,
}

impl ShownSet {
    /// So many are searched one by one, which is faster than a map.
    const FEW: usize = 8;

    pub(crate) fn new(list: Vec<Shown>) -> Self {
        let places = match list.len() {
            ..=Self::FEW => HashMap::default(),
            _ => (0..).zip(&list).map(|(place, shown)| (shown.handle, place)).collect(),
        };
        let (mut spans, mut parts) = (Vec::with_capacity(list.len()), Vec::with_capacity(list.len()));
        for shown in &list {
            spans.push([parts.len() as u32, shown.body.structures.len() as u32]);
            let shapes = shown.blas.blas().map_or(&[][..], |blas| &blas.parts);
            let maps = shapes.iter().map(|part| part.map.as_ref().map_or(0, |map| map.table.address));
            let structures = shown.body.structures.iter().map(|structure| structure.address);
            parts.extend(structures.zip(maps).map(|(structure, map)| [structure, map]));
        }
        Self {
            handles: list.iter().map(|shown| shown.handle).collect(),
            addresses: list.iter().map(Shown::address).collect(),
            needs_kernel: list.iter().any(Shown::needs_kernel),
            may_move: list.iter().any(Shown::may_move),
            has_rows: list.iter().any(Shown::has_rows),
            spans,
            parts,
            places,
            list,
        }
    }

    /// Everything shown, each at its place.
    pub(crate) fn list(&self) -> &[Shown] {
        &self.list
    }

    /// First part and number of parts of everything shown.
    pub(crate) fn spans(&self) -> &[[u32; 2]] {
        &self.spans
    }

    /// Address of the structure and of its map, for every part of everything shown.
    pub(crate) fn parts(&self) -> &[[u64; 2]] {
        &self.parts
    }

    /// Whether anything shown has moved since.
    pub(crate) fn is_outdated(&self) -> bool {
        self.list.iter().any(Shown::is_outdated)
    }

    /// Whether everything is still there, where it was.
    pub(crate) fn stands(&self, find: Find<'_>) -> bool {
        self.list.iter().all(|shown| find(shown.handle).is_ok() && !shown.is_outdated())
    }

    /// The same structures as they stand now.
    pub(crate) fn renewed(&self) -> Result<Self> {
        let renew = |shown: &Shown| Shown::new(shown.handle, Arc::clone(&shown.blas));
        Ok(Self::new(self.list.iter().map(renew).collect::<Result<_>>()?))
    }

    /// Whether it lists exactly these, in this order.
    pub(crate) fn is_listed_as(&self, handles: &[AccelStructHandle]) -> bool {
        self.handles == handles
    }

    /// The place of a structure, and what an instance of it refers to.
    #[inline]
    pub(crate) fn address(&self, handle: AccelStructHandle) -> Option<(u32, u64)> {
        let place = self.place(handle)?;
        Some((place as u32, self.addresses[place]))
    }

    #[inline]
    fn place(&self, handle: AccelStructHandle) -> Option<usize> {
        if self.handles.len() <= Self::FEW {
            return self.handles.iter().position(|known| *known == handle);
        }
        self.place_among_many(handle)
    }

    #[inline(never)]
    fn place_among_many(&self, handle: AccelStructHandle) -> Option<usize> {
        self.places.get(&handle).map(|place| *place as usize)
    }
}

/// Which of those known were met. Kept and emptied, so that it seldom allocates.
#[derive(Debug, Default)]
pub(crate) struct Marks {
    first: u64,
    /// Of those behind the first 64.
    more: Vec<u64>,
    count: usize,
}

impl Marks {
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
    fn insert(&mut self, place: usize) {
        let word = match place / 64 {
            0 => &mut self.first,
            word => &mut self.more[word - 1],
        };
        let bit = 1 << (place % 64);
        self.count += usize::from(*word & bit == 0);
        *word |= bit;
    }

    fn contains(&self, place: usize) -> bool {
        let word = match place / 64 {
            0 => self.first,
            word => self.more[word - 1],
        };
        word >> (place % 64) & 1 == 1
    }
}

/// Finds what instances refer to, starting from what was shown before.
pub(crate) struct Gather<'a> {
    known: &'a ShownSet,
    marks: &'a mut Marks,
    find: Find<'a>,
    /// What was not known; mostly nothing.
    new: Option<Box<New>>,
    /// Whether an address does not do for some.
    pub(crate) needs_kernel: bool,
}

/// Structures that were not known, each once.
#[derive(Default)]
struct New {
    list: Vec<Shown>,
    places: HashMap<AccelStructHandle, usize, BuildHasherDefault<IdHasher>>,
}

impl<'a> Gather<'a> {
    #[inline]
    pub(crate) fn new(known: &'a ShownSet, marks: &'a mut Marks, find: Find<'a>) -> Self {
        marks.reset(known.list.len());
        Self { known, marks, find, new: None, needs_kernel: known.needs_kernel }
    }

    /// The place of a structure: among those known, or behind them.
    #[inline]
    pub(crate) fn place(&mut self, handle: AccelStructHandle) -> Result<usize> {
        let Some(place) = self.known.place(handle) else { return self.new_place(handle) };
        self.marks.insert(place);
        Ok(place)
    }

    /// What an instance of it refers to.
    #[inline]
    pub(crate) fn address(&mut self, handle: AccelStructHandle) -> Result<u64> {
        let Some(place) = self.known.place(handle) else { return self.new_address(handle) };
        self.marks.insert(place);
        Ok(self.known.addresses[place])
    }

    #[cold]
    fn new_address(&mut self, handle: AccelStructHandle) -> Result<u64> {
        let place = self.new_place(handle)? - self.known.list.len();
        Ok(self.new.as_ref().and_then(|new| new.list.get(place)).map_or(0, Shown::address))
    }

    #[cold]
    fn new_place(&mut self, handle: AccelStructHandle) -> Result<usize> {
        let before = self.known.list.len();
        let New { list, places } = &mut **self.new.get_or_insert_default();
        if let Some(place) = places.get(&handle) {
            return Ok(before + place);
        }
        let shown = Shown::new(handle, (self.find)(handle)?)?;
        self.needs_kernel |= shown.needs_kernel();
        places.insert(handle, list.len());
        list.push(shown);
        Ok(before + list.len() - 1)
    }

    /// What was not known.
    pub(crate) fn into_new(self) -> Vec<Shown> {
        self.new.map(|new| new.list).unwrap_or_default()
    }

    /// Whether everything known was met, and nothing else.
    #[inline]
    pub(crate) fn is_unchanged(&self) -> bool {
        self.new.is_none() && self.marks.count == self.known.list.len()
    }

    /// What was met, with the place that each of the [places](Self::place) has become.
    pub(crate) fn finish(self) -> (ShownSet, Vec<u32>) {
        let Self { known, marks, new, .. } = self;
        let new = new.map(|new| new.list).unwrap_or_default();
        let mut list = Vec::with_capacity(marks.count + new.len());
        let mut moved = Vec::with_capacity(known.list.len() + new.len());
        for (place, shown) in known.list.iter().enumerate() {
            moved.push(list.len() as u32);
            if marks.contains(place) {
                list.push(shown.clone());
            }
        }
        moved.extend((list.len() as u32..).take(new.len()));
        list.extend(new);
        (ShownSet::new(list), moved)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::accel::accel_struct::AccelKind;
    use crate::accel::blas::Blas;
    use crate::accel::flags::AccelStructSizes;
    use crate::store::Pool;

    type Structures = Pool<AccelStructHandle, AccelStruct>;

    fn blas() -> AccelStruct {
        let body = BlasBody { structures: Vec::new(), compacted_from: None, rebuildable: true };
        let blas = Blas::new(Vec::new(), None, Vec::new(), body, None);
        AccelStruct::new("mesh", BuildFlags::empty(), AccelStructSizes::default(), AccelKind::Blas(blas))
    }

    fn sorted(mut handles: Vec<AccelStructHandle>) -> Vec<u64> {
        handles.sort_by_key(|handle| crate::handle::Handle::bits(*handle));
        handles.dedup();
        handles.into_iter().map(crate::handle::Handle::bits).collect()
    }

    proptest! {
        /// Lists one after the other, each found from what the one before has shown.
        #[test]
        fn a_set_is_what_the_list_refers_to_and_stays_while_that_is_the_same(
            count in 1..100_usize,
            lists in prop::collection::vec(prop::collection::vec(any::<prop::sample::Index>(), 0..200), 1..5)
        ) {
            let pool = Structures::new(7);
            let handles: Vec<_> = (0..count).map(|_| pool.insert(blas())).collect();
            let find = |handle| pool.get(handle);
            let (mut known, mut marks) = (ShownSet::default(), Marks::default());
            for list in lists {
                let list: Vec<_> = list.iter().map(|index| *index.get(&handles)).collect();
                let before: Vec<_> = known.list().iter().map(|shown| shown.handle).collect();
                let mut gather = Gather::new(&known, &mut marks, &find);
                let places: Vec<_> = list.iter().map(|handle| gather.place(*handle).unwrap()).collect();
                prop_assert_eq!(gather.is_unchanged(), sorted(before) == sorted(list.clone()));
                let (found, moved) = gather.finish();
                let all: Vec<_> = found.list().iter().map(|shown| shown.handle).collect();
                prop_assert_eq!(sorted(all.clone()).len(), all.len(), "each once");
                prop_assert_eq!(sorted(all.clone()), sorted(list.clone()));
                for (handle, place) in list.iter().zip(places) {
                    prop_assert_eq!(all[moved[place] as usize], *handle);
                    prop_assert_eq!(found.place(*handle), Some(moved[place] as usize));
                }
                known = found;
            }
        }
    }

    #[test]
    fn a_set_stands_until_something_of_it_is_gone_or_has_moved() {
        let pool = Structures::new(7);
        let handles = [pool.insert(blas()), pool.insert(blas())];
        let find = |handle| pool.get(handle);
        let set =
            || ShownSet::new(handles.map(|handle| Shown::new(handle, find(handle).unwrap()).unwrap()).into());
        let (first, other) = (set(), pool.insert(blas()));
        pool.remove(other).unwrap();
        assert!(first.stands(&find) && !first.is_outdated());
        let body = BlasBody { structures: Vec::new(), compacted_from: Some(1), rebuildable: false };
        find(handles[1]).unwrap().blas().unwrap().replace_body(body, 0).unwrap();
        assert!(!first.stands(&find) && first.is_outdated());
        assert!(!first.renewed().unwrap().is_outdated());
        let second = set();
        assert!(second.stands(&find));
        pool.remove(handles[0]).unwrap();
        assert!(!second.stands(&find) && !second.is_outdated());
    }
}
