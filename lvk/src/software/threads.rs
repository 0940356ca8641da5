//! Threads of builds on the CPU.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread::{Builder, available_parallelism, scope};

use crate::lock::{Mutex, Rank, Waiting};

/// Builds under way in the process.
static BUILDS: AtomicUsize = AtomicUsize::new(0);

/// A build under way: all of them share the cores.
pub(super) struct Build(());

impl Build {
    pub(super) fn begin() -> Self {
        BUILDS.fetch_add(1, Ordering::Relaxed);
        Self(())
    }

    /// Threads that so much work is for, the one that has it included.
    pub(super) fn threads(&self, boxes: usize) -> usize {
        /// So many boxes are worth a thread.
        const PER_THREAD: usize = 16_384;
        let worth = boxes / PER_THREAD;
        if worth < 2 {
            return 1;
        }
        let cores = available_parallelism().map_or(1, usize::from);
        (cores / BUILDS.load(Ordering::Relaxed).max(1)).min(worth).max(1)
    }
}

impl Drop for Build {
    fn drop(&mut self) {
        BUILDS.fetch_sub(1, Ordering::Relaxed);
    }
}

/// Has so many threads, or as many as the system gives, work on the items until none is left.
pub(super) fn share_out<T: Send>(
    threads: usize,
    items: impl Iterator<Item = T> + Send,
    work: impl Fn(T) + Sync,
) {
    let queue = Mutex::new(Rank::TreeWork, items);
    let next = || queue.lock().next();
    let run = || {
        while let Some(item) = next() {
            work(item);
        }
    };
    let waiting = Waiting::here();
    scope(|scope| {
        for _ in 1..threads {
            if Builder::new().spawn_scoped(scope, || waiting.work(run)).is_err() {
                break;
            }
        }
        run();
    });
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

    #[test]
    fn every_item_is_worked_on_once() {
        for threads in [1, 2, 7] {
            let mut items = vec![0_u32; 1000];
            share_out(threads, items.chunks_mut(3), |chunk| chunk.iter_mut().for_each(|item| *item += 1));
            assert!(items.iter().all(|item| *item == 1));
        }
    }
}
