//! Counts the heap allocations of the program.

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicU64, Ordering};

static COUNT: AtomicU64 = AtomicU64::new(0);
/// Bytes of the large allocations that live.
static LARGE_BYTES: AtomicU64 = AtomicU64::new(0);
/// Their maximum since [`restart_peak`].
static PEAK_BYTES: AtomicU64 = AtomicU64::new(0);

/// Bytes from which an allocation counts for the peak. Smaller ones are many, and the counter costs time.
const LARGE: usize = 4096;

/// The system allocator with a counter. It is the global allocator of the `bench` program.
#[derive(Debug, Clone, Copy, Default)]
pub struct CountingAllocator;

// SAFETY: every call is forwarded to the system allocator.
unsafe impl GlobalAlloc for CountingAllocator {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.fetch_add(1, Ordering::Relaxed);
        add_large(layout.size());
        // SAFETY: the caller keeps the contract of `GlobalAlloc`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        COUNT.fetch_add(1, Ordering::Relaxed);
        add_large(layout.size());
        // SAFETY: as above.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        remove_large(layout.size());
        // SAFETY: as above.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        COUNT.fetch_add(1, Ordering::Relaxed);
        add_large(size);
        remove_large(layout.size());
        // SAFETY: as above.
        unsafe { System.realloc(pointer, layout, size) }
    }
}

fn add_large(size: usize) {
    if size >= LARGE {
        let bytes = LARGE_BYTES.fetch_add(size as u64, Ordering::Relaxed) + size as u64;
        PEAK_BYTES.fetch_max(bytes, Ordering::Relaxed);
    }
}

fn remove_large(size: usize) {
    if size >= LARGE {
        LARGE_BYTES.fetch_sub(size as u64, Ordering::Relaxed);
    }
}

/// Returns the bytes of the large allocations that live, and starts to watch for their maximum.
pub(crate) fn restart_peak() -> u64 {
    let bytes = LARGE_BYTES.load(Ordering::Relaxed);
    PEAK_BYTES.store(bytes, Ordering::Relaxed);
    bytes
}

/// Returns the maximum bytes of large allocations since [`restart_peak`]; 0 if [`CountingAllocator`] is not the global
/// allocator.
pub(crate) fn peak_bytes() -> u64 {
    PEAK_BYTES.load(Ordering::Relaxed)
}

/// Returns the number of allocations by Rust code so far; 0 if [`CountingAllocator`] is not the global allocator.
pub(super) fn allocation_count() -> u64 {
    COUNT.load(Ordering::Relaxed)
}
