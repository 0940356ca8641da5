//! Threads of builds on the CPU.

use std::sync::atomic::{AtomicUsize, Ordering};

use crate::parallel::core_count;

/// Running builds of the process.
static RUNNING_BUILDS: AtomicUsize = AtomicUsize::new(0);

/// A running build. All builds share the cores.
pub(crate) struct ThreadBudget(());

impl ThreadBudget {
    pub(crate) fn new() -> Self {
        RUNNING_BUILDS.fetch_add(1, Ordering::Relaxed);
        Self(())
    }

    /// Returns the number of threads for this many AABBs, including the calling thread.
    pub(crate) fn thread_count(&self, boxes: usize) -> usize {
        /// Minimum AABBs for each thread.
        const BOXES_PER_THREAD: usize = 16_384;
        let worth = boxes / BOXES_PER_THREAD;
        if worth < 2 {
            return 1;
        }
        (core_count() / RUNNING_BUILDS.load(Ordering::Relaxed).max(1)).min(worth).max(1)
    }
}

impl Drop for ThreadBudget {
    fn drop(&mut self) {
        RUNNING_BUILDS.fetch_sub(1, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn builds_share_the_cores() {
        const MANY: usize = usize::MAX;
        let alone = ThreadBudget::new();
        let before = alone.thread_count(MANY);
        assert!(before >= 1 && alone.thread_count(100) == 1 && alone.thread_count(40_000) <= 2);
        let others: Vec<_> = (0..2 * before).map(|_| ThreadBudget::new()).collect();
        assert_eq!(alone.thread_count(MANY), 1);
        drop(others);
    }
}
