//! Space in a staging buffer that is reused in a circle.

use std::collections::VecDeque;

/// A piece of the ring, in the order of allocation.
#[derive(Debug, Clone, Copy)]
struct Region {
    /// Where the next region may start.
    end: u64,
    batch: u64,
    released: bool,
}

/// Hands out byte ranges of a buffer and takes them back by batch.
///
/// `tail..head` (around the end of the buffer) is in use. Regions are given back in the order of allocation: one that
/// is released early waits for those before it.
#[derive(Debug)]
pub(crate) struct Ring {
    size: u64,
    head: u64,
    tail: u64,
    regions: VecDeque<Region>,
}

impl Ring {
    /// A ring over a buffer of `size` bytes.
    pub(crate) fn new(size: u64) -> Self {
        Self { size, head: 0, tail: 0, regions: VecDeque::new() }
    }

    /// Offset, a multiple of `align`, of `size` bytes that stay untouched until `batch` is released. `None` if there
    /// is no such space now. An `align` of zero counts as one; an empty region needs a place, but takes no space.
    pub(crate) fn alloc(&mut self, size: u64, align: u64, batch: u64) -> Option<u64> {
        if self.regions.is_empty() {
            (self.head, self.tail) = (0, 0);
        }
        let offset = self.place(size, align.max(1))?;
        if size > 0 {
            self.head = offset + size;
            self.regions.push_back(Region { end: self.head, batch, released: false });
        }
        Some(offset)
    }

    /// Gives back every region of `batch`.
    pub(crate) fn release(&mut self, batch: u64) {
        for region in self.regions.iter_mut().filter(|region| region.batch == batch) {
            region.released = true;
        }
        let released = self.regions.iter().take_while(|region| region.released).count();
        if let Some(last) = self.regions.drain(..released).next_back() {
            self.tail = last.end;
        }
    }

    fn place(&self, size: u64, align: u64) -> Option<u64> {
        let next = self.head.checked_next_multiple_of(align)?;
        let wrapped = self.head < self.tail || (self.head == self.tail && !self.regions.is_empty());
        if wrapped {
            return fits(next, size, self.tail);
        }
        fits(next, size, self.size).or_else(|| fits(0, size, self.tail))
    }
}

fn fits(offset: u64, size: u64, limit: u64) -> Option<u64> {
    offset.checked_add(size).filter(|end| *end <= limit).map(|_| offset)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[derive(Debug, Clone)]
    enum Op {
        Alloc { size: u64, align: u64, batch: u64 },
        Release { batch: u64 },
    }

    fn op() -> impl Strategy<Value = Op> {
        prop_oneof![
            3 => (0..60_u64, 0..20_u64, 0..5_u64)
                .prop_map(|(size, align, batch)| Op::Alloc { size, align, batch }),
            1 => (0..5_u64).prop_map(|batch| Op::Release { batch }),
        ]
    }

    proptest! {
        #[test]
        fn live_regions_are_aligned_inside_and_apart(
            size in 0..200_u64, ops in prop::collection::vec(op(), 0..80)
        ) {
            let mut ring = Ring::new(size);
            let mut live: Vec<(u64, u64, u64)> = Vec::new();
            for op in ops {
                match op {
                    Op::Alloc { size: bytes, align, batch } => {
                        let Some(offset) = ring.alloc(bytes, align, batch) else {
                            prop_assert!(!live.is_empty() || bytes > size);
                            continue;
                        };
                        prop_assert_eq!(offset % align.max(1), 0);
                        prop_assert!(offset + bytes <= size);
                        let apart = |&(start, len, _): &(u64, u64, u64)| {
                            bytes == 0 || offset + bytes <= start || start + len <= offset
                        };
                        prop_assert!(live.iter().all(apart), "{}+{} in {:?}", offset, bytes, live);
                        if bytes > 0 {
                            live.push((offset, bytes, batch));
                        }
                    }
                    Op::Release { batch } => {
                        ring.release(batch);
                        live.retain(|region| region.2 != batch);
                    }
                }
            }
            (0..5).for_each(|batch| ring.release(batch));
            prop_assert_eq!(ring.alloc(size, 1, 9), Some(0));
        }

        #[test]
        fn steady_use_never_stalls(size in 1..50_u64, rounds in 1..200_u64) {
            let mut ring = Ring::new(4 * size);
            for round in 0..rounds {
                prop_assert!(ring.alloc(size, 1, round).is_some());
                if round >= 2 {
                    ring.release(round - 2);
                }
            }
        }
    }

    #[test]
    fn early_release_waits_for_the_regions_before() {
        let mut ring = Ring::new(30);
        assert_eq!(ring.alloc(10, 1, 1), Some(0));
        assert_eq!(ring.alloc(20, 1, 2), Some(10));
        ring.release(2);
        assert_eq!(ring.alloc(5, 1, 3), None);
        ring.release(1);
        assert_eq!(ring.alloc(30, 1, 3), Some(0));
    }

    #[test]
    fn region_is_not_split_at_the_end() {
        let mut ring = Ring::new(32);
        assert_eq!(ring.alloc(20, 1, 1), Some(0));
        assert_eq!(ring.alloc(8, 1, 2), Some(20));
        ring.release(1);
        assert_eq!(ring.alloc(16, 1, 3), Some(0));
        assert_eq!(ring.alloc(16, 1, 3), None);
    }

    #[test]
    fn absurd_requests_get_nothing() {
        let mut ring = Ring::new(64);
        assert_eq!(ring.alloc(1, 1, 0), Some(0));
        assert_eq!(ring.alloc(u64::MAX, u64::MAX, 0), None);
        assert_eq!(ring.alloc(1, u64::MAX, 0), None);
    }
}
