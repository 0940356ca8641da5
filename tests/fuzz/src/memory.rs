//! Memory of the heap: an allocator that counts, and bounds in terms of the bytes of an input.

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering};

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

/// The allocator of the system, with counts for the whole process. It refuses memory far beyond the bound of an input, so that a
/// defect does not take the memory of the machine.
pub struct Counting;

/// Bytes beyond the bound of an input that are still given, so that the reader can end and be told of.
const BEYOND: usize = 1 << 30;

static HELD: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);
static REFUSED_FROM: AtomicUsize = AtomicUsize::new(usize::MAX);

/// Runs a reader, and returns the most bytes that the process has held meanwhile beyond those it held before. Requests that were
/// refused count, too. `bound` bounds what is given.
pub(crate) fn peak_of(bound: usize, read: impl FnOnce()) -> usize {
    let before = HELD.load(Ordering::Relaxed);
    PEAK.store(before, Ordering::Relaxed);
    REFUSED_FROM.store(before.saturating_add(bound).saturating_add(BEYOND), Ordering::Relaxed);
    read();
    REFUSED_FROM.store(usize::MAX, Ordering::Relaxed);
    PEAK.load(Ordering::Relaxed).saturating_sub(before)
}

/// Counts a request. Returns false if it must be refused.
fn take(bytes: usize) -> bool {
    let held = HELD.fetch_add(bytes, Ordering::Relaxed).saturating_add(bytes);
    PEAK.fetch_max(held, Ordering::Relaxed);
    let is_given = held < REFUSED_FROM.load(Ordering::Relaxed);
    if !is_given {
        give_back(bytes);
    }
    is_given
}

fn give_back(bytes: usize) {
    HELD.fetch_sub(bytes, Ordering::Relaxed);
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
        let huge = 2 * BEYOND;
        let peak = peak_of(0, || assert!(Vec::<u8>::new().try_reserve_exact(huge).is_err()));
        assert!(peak >= huge);
    }
}
