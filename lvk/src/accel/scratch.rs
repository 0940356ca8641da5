//! Assignment of builds to batches that share a scratch buffer, and of each build's offset in it.

use std::ops::Range;

/// Builds that run concurrently in one scratch buffer.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct ScratchBatch {
    /// The builds, by index in the planned list.
    pub(crate) builds: Range<usize>,
    /// Offset of each build's scratch from the aligned start of the buffer, in bytes; a multiple of the alignment.
    pub(crate) offsets: Vec<u64>,
    /// Total bytes of the batch.
    pub(crate) bytes: u64,
}

/// Divides builds, in order, into batches whose aligned scratch sizes together stay within `budget` bytes. A build
/// that exceeds the budget gets its own batch.
pub(crate) fn plan_scratch(sizes: &[u64], alignment: u64, budget: u64) -> Vec<ScratchBatch> {
    let mut batches: Vec<ScratchBatch> = Vec::new();
    for (build, &size) in sizes.iter().enumerate() {
        let size = align_up(size, alignment);
        if let Some(batch) = batches.last_mut()
            && let Some(together) = batch.bytes.checked_add(size).filter(|sum| *sum <= budget)
        {
            batch.offsets.push(batch.bytes);
            batch.bytes = together;
            batch.builds.end = build + 1;
        } else {
            batches.push(ScratchBatch { builds: build..build + 1, offsets: vec![0], bytes: size });
        }
    }
    batches
}

/// Sizes of scratch buffers within a budget.
///
/// A buffer that has become too small is freed only when the GPU no longer uses it. Until then both buffers count. So
/// there are two sizes that together make the budget. A larger buffer is used only for a single build that needs it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct ScratchSizes {
    small: u64,
    large: u64,
}

impl ScratchSizes {
    /// Creates the sizes of buffers that together take at most `budget` bytes, including the alignment of their
    /// addresses.
    pub(crate) fn new(budget: u64, alignment: u64) -> Self {
        let small = budget / 8;
        let large = budget - small;
        let usable = |bytes: u64| bytes.saturating_sub(alignment.saturating_sub(1));
        Self { small: usable(small), large: usable(large) }
    }

    /// Maximum scratch memory of concurrent builds, in bytes.
    pub(crate) fn batch_bytes(&self) -> u64 {
        self.large
    }

    /// Scratch bytes of the buffer for a batch that needs `bytes`.
    pub(crate) fn buffer_bytes(&self, bytes: u64) -> u64 {
        if bytes <= self.small { self.small } else { self.large.max(bytes) }
    }
}

/// Bytes to allocate for `bytes` of scratch, so that they still fit after the address is rounded up. Vulkan requires
/// an aligned scratch address, and a buffer's address may have a smaller alignment.
pub(crate) fn scratch_buffer_bytes(bytes: u64, alignment: u64) -> u64 {
    bytes.saturating_add(alignment.saturating_sub(1))
}

/// First address at or after `buffer_address` at which scratch may start.
pub(crate) fn aligned_scratch_address(buffer_address: u64, alignment: u64) -> u64 {
    align_up(buffer_address, alignment)
}

/// Rounds up. Values that cannot be rounded up give the last aligned one, far beyond the address range of a device.
fn align_up(value: u64, alignment: u64) -> u64 {
    let alignment = alignment.max(1);
    value.checked_next_multiple_of(alignment).unwrap_or(u64::MAX - u64::MAX % alignment)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn builds_of_a_batch_never_overlap_whatever_the_address(
            sizes in prop::collection::vec(0..5_000_u64, 0..40),
            alignment in 1..=256_u64,
            budget in 0..20_000_u64,
            address in 1..1_000_000_u64,
        ) {
            let mut next = 0;
            for batch in plan_scratch(&sizes, alignment, budget) {
                prop_assert_eq!(batch.builds.start, next);
                next = batch.builds.end;
                prop_assert_eq!(batch.offsets.len(), batch.builds.len());
                prop_assert!(batch.bytes <= budget || batch.builds.len() == 1);
                let start = aligned_scratch_address(address, alignment);
                let end = address + scratch_buffer_bytes(batch.bytes, alignment);
                let mut free = start;
                for (offset, size) in batch.offsets.iter().zip(&sizes[batch.builds.clone()]) {
                    prop_assert_eq!((start + offset) % alignment, 0);
                    prop_assert!(start + offset >= free);
                    free = start + offset + size;
                }
                prop_assert!(free <= end);
            }
            prop_assert_eq!(next, sizes.len());
        }

        #[test]
        fn no_batch_could_have_taken_one_more_build(
            sizes in prop::collection::vec(0..5_000_u64, 1..40), alignment in 1..=256_u64, budget in 0..20_000_u64
        ) {
            let batches = plan_scratch(&sizes, alignment, budget);
            for pair in batches.windows(2) {
                let next = sizes[pair[1].builds.start].next_multiple_of(alignment);
                prop_assert!(pair[0].bytes + next > budget);
            }
        }
    }

    #[test]
    fn oversized_build_is_alone_between_the_others() {
        let batches = plan_scratch(&[100, 5_000, 100, 100], 128, 1_000);
        let builds: Vec<_> = batches.iter().map(|batch| batch.builds.clone()).collect();
        assert_eq!(builds, [0..1, 1..2, 2..4]);
        assert_eq!(batches[2].offsets, [0, 128]);
    }

    #[test]
    fn two_buffers_stay_within_the_budget() {
        for budget in [0, 1, 100, 4096, 64 << 20, u64::MAX] {
            for alignment in [1, 128, 256] {
                let tiers = ScratchSizes::new(budget, alignment);
                let bytes = |needed| scratch_buffer_bytes(tiers.buffer_bytes(needed), alignment);
                assert!(tiers.buffer_bytes(tiers.batch_bytes()) >= tiers.batch_bytes());
                if budget >= 16 * alignment {
                    assert!(bytes(1) + bytes(tiers.batch_bytes()) <= budget, "{budget} {alignment}");
                }
                assert_eq!(tiers.buffer_bytes(u64::MAX), u64::MAX);
            }
        }
    }

    #[test]
    fn absurd_sizes_do_not_overflow() {
        let batches = plan_scratch(&[u64::MAX, u64::MAX, 1], 0, u64::MAX);
        assert_eq!(batches.iter().map(|batch| batch.builds.len()).sum::<usize>(), 3);
        assert_eq!(scratch_buffer_bytes(u64::MAX, 256), u64::MAX);
        assert_eq!(aligned_scratch_address(u64::MAX, 256) % 256, 0);
    }
}
