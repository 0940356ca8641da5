//! Allocator of ranges of a shared buffer.

use std::collections::{BTreeMap, BTreeSet};

/// Alignment of range offsets: Vulkan's requirement for an acceleration structure in a buffer.
pub(crate) const RANGE_ALIGNMENT: u64 = 256;

/// The free ranges of one buffer. Allocation takes the smallest range that is large enough. Freed ranges merge with
/// their neighbours. Both take O(log n) time.
#[derive(Debug)]
pub(crate) struct RangeAllocator {
    size: u64,
    used: u64,
    /// Start and end of each free range; no two of them touch.
    free: BTreeMap<u64, u64>,
    /// Length and start of the same ranges.
    by_length: BTreeSet<(u64, u64)>,
}

impl RangeAllocator {
    /// Creates the allocator of a buffer of `size` bytes, all free.
    pub(crate) fn new(size: u64) -> Self {
        let mut ranges = Self { size, used: 0, free: BTreeMap::new(), by_length: BTreeSet::new() };
        if size > 0 {
            ranges.insert(0, size);
        }
        ranges
    }

    /// Offset of a new range of at least one byte, a multiple of [`RANGE_ALIGNMENT`]; `None` if no free range is large
    /// enough.
    pub(crate) fn alloc(&mut self, bytes: u64) -> Option<u64> {
        let bytes = bytes.max(1);
        let &(_, start) = self.by_length.range((bytes, 0)..).next()?;
        let end = self.remove(start)?;
        let taken = self.free_range_end(start, bytes);
        if taken < end {
            self.insert(taken, end);
        }
        self.used += taken - start;
        Some(start)
    }

    /// Frees a range: the offset that [`alloc`](Self::alloc) returned and the bytes it was called with. Does nothing
    /// unless the whole range is in use.
    pub(crate) fn free(&mut self, offset: u64, bytes: u64) {
        let (mut start, mut end) = (offset, self.free_range_end(offset, bytes.max(1)));
        let before = self.free.range(..=start).next_back().map(|(&start, &end)| (start, end));
        let behind = self.free.range(start..).next().map(|(&start, &end)| (start, end));
        let overlaps = before.is_some_and(|(_, before_end)| before_end > start)
            || behind.is_some_and(|(behind_start, _)| behind_start < end);
        if overlaps || start >= end {
            return;
        }
        self.used -= end - start;
        if let Some((before, _)) = before.filter(|(_, before_end)| *before_end == start) {
            self.remove(before);
            start = before;
        }
        if let Some((behind, behind_end)) = behind.filter(|(behind, _)| *behind == end) {
            self.remove(behind);
            end = behind_end;
        }
        self.insert(start, end);
    }

    /// True if no range is in use.
    pub(crate) fn is_empty(&self) -> bool {
        self.used == 0
    }

    /// Bytes in use, each range rounded up to [`RANGE_ALIGNMENT`].
    pub(crate) fn used_bytes(&self) -> u64 {
        self.used
    }

    /// End of a range: a multiple of the alignment, or the end of the buffer.
    fn free_range_end(&self, start: u64, bytes: u64) -> u64 {
        let end = start.saturating_add(bytes).checked_next_multiple_of(RANGE_ALIGNMENT);
        end.unwrap_or(u64::MAX).min(self.size)
    }

    fn insert(&mut self, start: u64, end: u64) {
        self.free.insert(start, end);
        self.by_length.insert((end - start, start));
    }

    fn remove(&mut self, start: u64) -> Option<u64> {
        let end = self.free.remove(&start)?;
        self.by_length.remove(&(end - start, start));
        Some(end)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn the_smallest_range_that_fits_is_taken() {
        let mut ranges = RangeAllocator::new(4096);
        let places: Vec<_> = [1024, 256, 512, 256].map(|bytes| ranges.alloc(bytes)).into();
        assert_eq!(places, [Some(0), Some(1024), Some(1280), Some(1792)]);
        ranges.free(0, 1024);
        ranges.free(1280, 512);
        assert_eq!(ranges.alloc(300), Some(1280));
        assert_eq!(ranges.alloc(2048), Some(2048));
        assert_eq!(ranges.alloc(1025), None);
        assert_eq!(ranges.alloc(1024), Some(0));
    }

    #[test]
    fn a_buffer_of_any_size_can_be_used_to_its_end() {
        let mut ranges = RangeAllocator::new(1000);
        assert_eq!(ranges.alloc(1000), Some(0));
        assert_eq!(ranges.used_bytes(), 1000);
        ranges.free(0, 1000);
        assert_eq!((ranges.alloc(700), ranges.alloc(232)), (Some(0), Some(768)));
        assert_eq!(ranges.alloc(0), None);
        assert_eq!(RangeAllocator::new(0).alloc(0), None);
    }

    #[test]
    fn freeing_what_is_not_in_use_changes_nothing() {
        let mut ranges = RangeAllocator::new(1024);
        assert_eq!(ranges.alloc(512), Some(0));
        for (offset, bytes) in [(512, 256), (256, 512), (0, 1024), (2048, 256), (u64::MAX, u64::MAX)] {
            ranges.free(offset, bytes);
            assert_eq!(ranges.used_bytes(), 512);
        }
        ranges.free(0, 512);
        ranges.free(0, 512);
        assert!(ranges.is_empty());
    }

    proptest! {
        #[test]
        fn ranges_in_use_never_overlap_and_all_come_back(
            size in 0..20_000_u64,
            steps in prop::collection::vec((any::<bool>(), 0..3_000_u64, any::<prop::sample::Index>()), 0..200),
        ) {
            let mut ranges = RangeAllocator::new(size);
            let mut live: Vec<(u64, u64)> = Vec::new();
            for (take, bytes, which) in steps {
                if take {
                    let fits = largest_gap(size, &live) >= bytes.max(1);
                    let place = ranges.alloc(bytes);
                    prop_assert_eq!(place.is_some(), fits);
                    live.extend(place.map(|place| (place, bytes)));
                } else if !live.is_empty() {
                    let (place, bytes) = live.swap_remove(which.index(live.len()));
                    ranges.free(place, bytes);
                }
                live.sort_unstable();
                prop_assert!(live.iter().all(|(place, bytes)| place % RANGE_ALIGNMENT == 0 && place + bytes <= size));
                prop_assert!(live.windows(2).all(|pair| pair[0].0 + pair[0].1.max(1) <= pair[1].0));
                prop_assert_eq!(ranges.is_empty(), live.is_empty());
                let used: u64 = live.iter().map(|&(place, bytes)| end(size, place, bytes) - place).sum();
                prop_assert_eq!(ranges.used_bytes(), used);
            }
            for (place, bytes) in live {
                ranges.free(place, bytes);
            }
            prop_assert!(ranges.is_empty());
            prop_assert_eq!(ranges.alloc(size), (size > 0).then_some(0));
        }
    }

    fn end(size: u64, place: u64, bytes: u64) -> u64 {
        (place + bytes.max(1)).next_multiple_of(RANGE_ALIGNMENT).min(size)
    }

    /// The longest gap in bytes between ranges.
    fn largest_gap(size: u64, live: &[(u64, u64)]) -> u64 {
        let mut sorted = live.to_vec();
        sorted.sort_unstable();
        let mut free = 0;
        let mut largest = 0;
        for (place, bytes) in sorted {
            largest = largest.max(place - free);
            free = end(size, place, bytes);
        }
        largest.max(size - free)
    }
}
