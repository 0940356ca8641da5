//! Threads of builds on the CPU.

use std::sync::atomic::{AtomicUsize, Ordering};

use crate::parallel::cores;

/// Builds under way in the process.
static BUILDS: AtomicUsize = AtomicUsize::new(0);

/// A build under way: all of them share the cores.
pub(crate) struct Build(());

impl Build {
    pub(crate) fn begin() -> Self {
        BUILDS.fetch_add(1, Ordering::Relaxed);
        Self(())
    }

    /// Threads that so much work is for, the one that has it included.
    pub(crate) fn threads(&self, boxes: usize) -> usize {
        /// So many boxes are worth a thread.
        const PER_THREAD: usize = 16_384;
        let worth = boxes / PER_THREAD;
        if worth < 2 {
            return 1;
        }
        (cores() / BUILDS.load(Ordering::Relaxed).max(1)).min(worth).max(1)
    }
}

impl Drop for Build {
    fn drop(&mut self) {
        BUILDS.fetch_sub(1, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn builds_share_the_cores() {
        const MANY: usize = 1 << 40;
        let alone = Build::begin();
        let before = alone.threads(MANY);
        assert!(before >= 1 && alone.threads(100) == 1 && alone.threads(40_000) <= 2);
        let others: Vec<_> = (0..2 * before).map(|_| Build::begin()).collect();
        assert_eq!(alone.threads(MANY), 1);
        drop(others);
    }
}
