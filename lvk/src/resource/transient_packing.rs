//! Placement of objects with known lifetimes in one memory block: objects that never live at once may share bytes.

use std::cmp::Reverse;

/// Size and lifetime of one object.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct PackItem {
    /// Size in bytes.
    pub(crate) bytes: u64,
    /// Alignment of the offset in bytes, a power of two.
    pub(crate) alignment: u64,
    /// First and last step of the lifetime, both inclusive.
    pub(crate) steps: [u32; 2],
}

impl PackItem {
    /// True if both objects live in a common step.
    fn lives_with(&self, other: &Self) -> bool {
        self.steps[0] <= other.steps[1] && other.steps[0] <= self.steps[1]
    }
}

/// Offsets of objects in one block.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Packing {
    /// Offset of each object in bytes.
    pub(crate) offsets: Vec<u64>,
    /// Size of the block in bytes.
    pub(crate) bytes: u64,
}

impl Packing {
    /// Places the objects, from large to small. Each takes the lowest offset that no placed object of a common step
    /// covers.
    pub(crate) fn new(items: &[PackItem]) -> Self {
        let mut order: Vec<usize> = (0..items.len()).collect();
        order.sort_by_key(|&index| Reverse(items[index].bytes));
        let mut packing = Self { offsets: vec![0; items.len()], bytes: 0 };
        for (placed, &index) in order.iter().enumerate() {
            let item = &items[index];
            let mut taken: Vec<[u64; 2]> = order[..placed]
                .iter()
                .filter(|&&other| item.lives_with(&items[other]))
                .map(|&other| packing.range(items, other))
                .collect();
            taken.sort_unstable();
            packing.offsets[index] = lowest_gap(&taken, item);
            packing.bytes = packing.bytes.max(packing.offsets[index] + item.bytes);
        }
        packing
    }

    /// Returns, for each object, the objects with common bytes, itself among them.
    pub(crate) fn sharers(&self, items: &[PackItem]) -> Vec<Vec<usize>> {
        let shares = |a: usize, b: usize| {
            let ([start, end], [other_start, other_end]) = (self.range(items, a), self.range(items, b));
            a == b || (start < other_end && other_start < end)
        };
        let all = 0..items.len();
        all.clone().map(|a| all.clone().filter(|&b| shares(a, b)).collect()).collect()
    }

    /// Returns begin and end of an object in bytes.
    fn range(&self, items: &[PackItem], index: usize) -> [u64; 2] {
        let start = self.offsets[index];
        [start, start + items[index].bytes]
    }
}

/// Returns the lowest aligned offset at which the object overlaps none of the ranges, which are in ascending order.
fn lowest_gap(taken: &[[u64; 2]], item: &PackItem) -> u64 {
    let mut offset = 0_u64;
    for &[start, end] in taken {
        if offset + item.bytes <= start {
            break;
        }
        offset = offset.max(end).next_multiple_of(item.alignment);
    }
    offset
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn item() -> impl Strategy<Value = PackItem> {
        (1..5000_u64, 0..9_u32, 0..12_u32, 0..6_u32).prop_map(|(bytes, alignment, first, steps)| PackItem {
            bytes,
            alignment: 1 << alignment,
            steps: [first, first + steps],
        })
    }

    fn live_bytes(items: &[PackItem], step: u32) -> u64 {
        let live = items.iter().filter(|item| item.steps[0] <= step && step <= item.steps[1]);
        live.map(|item| item.bytes).sum()
    }

    proptest! {
        #[test]
        fn objects_of_a_common_step_share_no_byte(items in prop::collection::vec(item(), 0..24)) {
            let packing = Packing::new(&items);
            let sharers = packing.sharers(&items);
            for (a, item) in items.iter().enumerate() {
                prop_assert!(packing.offsets[a].is_multiple_of(item.alignment));
                prop_assert!(packing.offsets[a] + item.bytes <= packing.bytes);
                for (b, other) in items.iter().enumerate() {
                    let start = packing.offsets[a].max(packing.offsets[b]);
                    let end = (packing.offsets[a] + item.bytes).min(packing.offsets[b] + other.bytes);
                    prop_assert_eq!(sharers[a].contains(&b), start < end);
                    prop_assert!(start >= end || a == b || !item.lives_with(other));
                }
            }
        }

        #[test]
        fn a_block_is_never_larger_than_separate_objects_nor_smaller_than_the_fullest_step(
            items in prop::collection::vec(item(), 0..24)
        ) {
            let packing = Packing::new(&items);
            let separate: u64 = items.iter().map(|item| item.bytes.next_multiple_of(256)).sum();
            prop_assert!(packing.bytes <= separate);
            prop_assert!((0..18).all(|step| live_bytes(&items, step) <= packing.bytes));
        }

        #[test]
        fn a_chain_of_equal_objects_takes_two_places(bytes in 1..99_u64, count in 2..20_u32) {
            let item = |step| PackItem { bytes: bytes * 64, alignment: 64, steps: [step, step + 1] };
            let items: Vec<_> = (0..count).map(item).collect();
            prop_assert_eq!(Packing::new(&items).bytes, 2 * 64 * bytes);
        }
    }

    #[test]
    fn a_gap_is_filled_before_the_block_grows() {
        let item = |bytes, first, last| PackItem { bytes, alignment: 16, steps: [first, last] };
        let items = [item(100, 0, 1), item(64, 0, 3), item(90, 2, 3), item(40, 1, 2)];
        let packing = Packing::new(&items);
        assert_eq!(packing.offsets, [0, 112, 0, 176]);
        assert_eq!(packing.bytes, 216);
        assert_eq!(packing.sharers(&items)[0], [0, 2]);
    }

    #[test]
    fn nothing_takes_nothing() {
        assert_eq!(Packing::new(&[]), Packing::default());
    }
}
