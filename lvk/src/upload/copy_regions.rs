//! Copy regions of a buffer: each byte is copied once, from its last write.

use std::collections::BTreeMap;

/// A contiguous range of a buffer, copied from a contiguous range of one page.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct CopyRegion {
    /// Offset in the buffer, in bytes.
    pub(crate) target: u64,
    pub(crate) bytes: u64,
    /// The source page.
    pub(crate) page: usize,
    /// Offset in the page, in bytes.
    pub(crate) source: u64,
}

impl CopyRegion {
    fn end(&self) -> u64 {
        self.target + self.bytes
    }

    /// Returns the rest of the region from `start` on, which lies inside of it.
    fn starting_at(self, start: u64) -> Self {
        let cut = start - self.target;
        Self { target: start, bytes: self.bytes - cut, source: self.source + cut, ..self }
    }

    /// Returns true if `next` is adjacent to the end of this region, in both buffer and page.
    fn is_continued_by(&self, next: &Self) -> bool {
        self.end() == next.target && self.page == next.page && self.source + self.bytes == next.source
    }
}

/// Disjoint copy regions of one buffer, sorted by their offset in it.
#[derive(Debug, Default)]
pub(crate) struct CopyRegions {
    by_target: BTreeMap<u64, CopyRegion>,
}

impl CopyRegions {
    /// Adds a region and removes the bytes that it overwrites from earlier regions.
    pub(crate) fn add(&mut self, new: CopyRegion) {
        if new.bytes == 0 {
            return;
        }
        self.remove_range(new.target, new.end());
        let before = self.by_target.range_mut(..new.target).next_back();
        match before {
            Some((_, before)) if before.is_continued_by(&new) => before.bytes += new.bytes,
            _ => drop(self.by_target.insert(new.target, new)),
        }
    }

    /// Removes `start..end` from every region.
    fn remove_range(&mut self, start: u64, end: u64) {
        let before = self.by_target.range_mut(..start).next_back();
        if let Some((_, before)) = before
            && before.end() > start
        {
            let whole = *before;
            before.bytes = start - before.target;
            if whole.end() > end {
                self.by_target.insert(end, whole.starting_at(end));
            }
        }
        while let Some((&at, _)) = self.by_target.range(start..end).next() {
            if let Some(old) = self.by_target.remove(&at)
                && old.end() > end
            {
                self.by_target.insert(end, old.starting_at(end));
            }
        }
    }

    /// Returns the regions, grouped by page.
    pub(crate) fn split_by_page(&self) -> Vec<CopyRegion> {
        let mut pieces: Vec<_> = self.by_target.values().copied().collect();
        pieces.sort_by_key(|piece| piece.page);
        pieces
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// Compares with an array that holds the source of each byte.
        #[test]
        fn every_byte_comes_from_the_last_write(
            writes in prop::collection::vec((0..60_u64, 0..25_u64, 0..3_usize, 0..4_u64), 0..40)
        ) {
            let mut pieces = CopyRegions::default();
            let mut expected: Vec<Option<(usize, u64)>> = vec![None; 100];
            let mut used = [0_u64; 3];
            for (target, bytes, page, gap) in writes {
                let source = used[page] + gap;
                used[page] = source + bytes;
                pieces.add(CopyRegion { target, bytes, page, source });
                for byte in 0..bytes {
                    expected[(target + byte) as usize] = Some((page, source + byte));
                }
            }
            let mut found: Vec<Option<(usize, u64)>> = vec![None; 100];
            for piece in pieces.split_by_page() {
                prop_assert!(piece.bytes > 0);
                for byte in 0..piece.bytes {
                    let place = &mut found[(piece.target + byte) as usize];
                    prop_assert!(place.replace((piece.page, piece.source + byte)).is_none(), "a byte twice");
                }
            }
            prop_assert_eq!(found, expected);
            prop_assert!(pieces.split_by_page().windows(2).all(|pair| pair[0].page <= pair[1].page));
        }
    }

    #[test]
    fn adjacent_regions_become_one_and_others_do_not() {
        let mut pieces = CopyRegions::default();
        for number in 0..1000 {
            pieces.add(CopyRegion { target: 64 * number, bytes: 64, page: 0, source: 128 + 64 * number });
        }
        let whole = CopyRegion { target: 0, bytes: 64_000, page: 0, source: 128 };
        assert_eq!(pieces.split_by_page(), [whole]);
        let elsewhere = CopyRegion { target: 64_000, bytes: 8, page: 1, source: 64_128 };
        pieces.add(elsewhere);
        assert_eq!(pieces.split_by_page(), [whole, elsewhere]);
    }
}
