//! Memory of the heap: an allocator that counts, and bounds in terms of the bytes of an input.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

/// Most memory of a reader: a fixed part, for what every input takes, and a multiple of the bytes of the input.
#[derive(Debug, Clone, Copy)]
pub struct MemoryBound {
    /// Bytes for every input.
    pub fixed: usize,
    /// Bytes for each byte of the input.
    pub multiple: usize,
}

impl MemoryBound {
    /// Returns the bound of an input of `bytes` bytes.
    #[must_use]
    pub fn bytes_for(self, bytes: usize) -> usize {
        self.fixed.saturating_add(self.multiple.saturating_mul(bytes))
    }
}

/// The allocator of the system, with counts for each thread: no reader has threads of its own, and tests run side by side. It
/// refuses memory far beyond the bound of an input, so that a defect does not take the memory of the machine.
pub struct Counting;

/// Bytes beyond the bound of an input that are still given, so that the reader can end and be told of.
const BEYOND: isize = 1 << 30;

/// What a thread holds. Less than zero where it frees what other threads have allocated.
struct Counts {
    held: Cell<isize>,
    peak: Cell<isize>,
    /// From here on, requests are refused.
    refused_from: Cell<isize>,
}

thread_local! {
    static COUNTS: Counts = const {
        Counts { held: Cell::new(0), peak: Cell::new(0), refused_from: Cell::new(isize::MAX) }
    };
}

/// Runs a reader, and returns the most bytes that this thread has held meanwhile beyond those it held before. Requests that were
/// refused count, too. `bound` bounds what is given.
pub(crate) fn peak_of(bound: usize, read: impl FnOnce()) -> usize {
    let bound = isize::try_from(bound).unwrap_or(isize::MAX);
    let before = COUNTS.with(|counts| {
        let before = counts.held.get();
        counts.peak.set(before);
        counts.refused_from.set(before.saturating_add(bound).saturating_add(BEYOND));
        before
    });
    read();
    let peak = COUNTS.with(|counts| {
        counts.refused_from.set(isize::MAX);
        counts.peak.get()
    });
    usize::try_from(peak.saturating_sub(before)).unwrap_or_default()
}

/// Counts a request. Returns false if it must be refused.
fn take(bytes: usize) -> bool {
    let count = |counts: &Counts| {
        let held = counts.held.get().saturating_add_unsigned(bytes);
        counts.peak.set(held.max(counts.peak.get()));
        let is_given = held < counts.refused_from.get();
        if is_given {
            counts.held.set(held);
        }
        is_given
    };
    // At the end of a thread there are no counts.
    COUNTS.try_with(count).unwrap_or(true)
}

fn give_back(bytes: usize) {
    _ = COUNTS.try_with(|counts| counts.held.set(counts.held.get().saturating_sub_unsigned(bytes)));
}

// SAFETY: each method passes its arguments to the system's allocator, or returns null, which stands for a failure.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        if !take(layout.size()) {
            return std::ptr::null_mut();
        }
        // SAFETY: the caller's promise.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        if !take(layout.size()) {
            return std::ptr::null_mut();
        }
        // SAFETY: the caller's promise.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn dealloc(&self, place: *mut u8, layout: Layout) {
        give_back(layout.size());
        // SAFETY: the caller's promise.
        unsafe { System.dealloc(place, layout) }
    }

    unsafe fn realloc(&self, place: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // Old and new memory may exist at the same time, but a large block grows in place: only the difference counts.
        if !take(size.saturating_sub(layout.size())) {
            return std::ptr::null_mut();
        }
        give_back(layout.size().saturating_sub(size));
        // SAFETY: the caller's promise.
        unsafe { System.realloc(place, layout, size) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_peak_counts_and_not_the_end() {
        let peak = peak_of(usize::MAX >> 1, || {
            let mut grown = vec![1_u8; 1 << 20];
            grown.resize(3 << 20, 0);
            drop(grown);
            drop(vec![0_u8; 1 << 20]);
        });
        assert!((3 << 20..4 << 20).contains(&peak), "{peak}");
    }

    #[test]
    fn far_more_than_the_bound_is_refused_and_counts() {
        let huge = 2 * BEYOND.unsigned_abs();
        let peak = peak_of(0, || assert!(Vec::<u8>::new().try_reserve_exact(huge).is_err()));
        assert!(peak >= huge);
    }
}
