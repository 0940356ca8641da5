//! Memory of the heap: an allocator that counts, and bounds in terms of the bytes of an input.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::fmt;

/// Most memory of a reader: a fixed part, for what every input takes, a multiple of the bytes of the input, and one of the bytes that
/// they stand for. Never more than a ceiling.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MemoryBound {
    /// Bytes for every input.
    pub fixed: usize,
    /// Bytes for each byte of the input.
    pub per_byte: usize,
    /// Bytes for each byte that the reader may make of an input that states its decoded size; 0 for other readers.
    pub per_decoded: usize,
    /// Bytes of the longest input.
    pub most: usize,
}

impl MemoryBound {
    /// Returns the bound of an input of `bytes` bytes, of which the reader may make `decoded` bytes.
    #[must_use]
    pub fn bytes_for(self, bytes: usize, decoded: usize) -> usize {
        let multiples =
            self.per_byte.saturating_mul(bytes).saturating_add(self.per_decoded.saturating_mul(decoded));
        self.fixed.saturating_add(multiples).min(self.most)
    }
}

/// Shows the bound as the table in `docs/reliability.md` has it.
impl fmt::Display for MemoryBound {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "{} + {} a byte", Bytes(self.fixed), self.per_byte)?;
        if self.per_decoded > 0 {
            write!(out, " + {} a decoded byte", self.per_decoded)?;
        }
        write!(out, ", at most {}", Bytes(self.most))
    }
}

/// A number of bytes, shown in the largest unit of which it is a whole number.
struct Bytes(usize);

impl fmt::Display for Bytes {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0.trailing_zeros() {
            20.. => write!(out, "{} MiB", self.0 >> 20),
            10.. => write!(out, "{} KiB", self.0 >> 10),
            _ => write!(out, "{} bytes", self.0),
        }
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
    fn bounds_have_a_ceiling() {
        let bound = MemoryBound { fixed: 1_000, per_byte: 10, per_decoded: 2, most: 1 << 20 };
        assert_eq!(bound.bytes_for(0, 0), 1_000);
        assert_eq!(bound.bytes_for(5, 7), 1_064);
        assert_eq!(bound.bytes_for(1 << 20, 0), 1 << 20);
        assert_eq!(bound.bytes_for(0, 1 << 20), 1 << 20);
        assert_eq!(bound.bytes_for(usize::MAX, usize::MAX), 1 << 20);
    }

    #[test]
    fn bounds_are_shown_with_their_units() {
        let bound = MemoryBound { fixed: 96 << 10, per_byte: 64, per_decoded: 4, most: 32 << 20 };
        assert_eq!(bound.to_string(), "96 KiB + 64 a byte + 4 a decoded byte, at most 32 MiB");
        let bound = MemoryBound { fixed: 100, per_byte: 4, per_decoded: 0, most: 1_152 << 10 };
        assert_eq!(bound.to_string(), "100 bytes + 4 a byte, at most 1152 KiB");
    }

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
