//! Parallel work on threads. If the system refuses some of the threads, the others do all of the work.

use std::num::NonZero;
use std::sync::OnceLock;
use std::thread::{Builder, available_parallelism, scope};

use crate::lock_order::{HeldLocks, Mutex, Rank};

/// Returns the number of threads that is useful for work of any size. The system is asked once: it reads files for the
/// answer.
pub(crate) fn core_count() -> usize {
    static COUNT: OnceLock<usize> = OnceLock::new();
    *COUNT.get_or_init(|| available_parallelism().map_or(1, NonZero::get))
}

/// Runs `work` on `threads` threads, including the current one. Fewer if the system refuses some.
pub(crate) fn run_on_threads(threads: usize, work: impl Fn() + Sync) {
    run_on_built_threads(threads, || Builder::new().name("lvk".to_owned()), work);
}

/// As [`run_on_threads`], with a thread builder from `thread`.
fn run_on_built_threads(threads: usize, thread: impl Fn() -> Builder, work: impl Fn() + Sync) {
    let waiting = HeldLocks::of_current_thread();
    scope(|scope| {
        for _ in 1..threads {
            if thread().spawn_scoped(scope, || waiting.run_with(&work)).is_err() {
                break;
            }
        }
        work();
    });
}

/// Processes the items on `threads` threads. Each thread takes the next item when it is done, because items
/// take very different times.
pub(crate) fn parallel_for<T: Send>(
    threads: usize,
    items: impl Iterator<Item = T> + Send,
    work: impl Fn(T) + Sync,
) {
    let queue = Mutex::new(Rank::SharedWork, items);
    let next = || queue.lock().next();
    run_on_threads(threads, || {
        while let Some(item) = next() {
            work(item);
        }
    });
}

/// Maps the items with `make` on all cores, and returns the results in order.
pub(crate) fn parallel_map<T: Sync, R: Send>(items: &[T], make: impl Fn(&T) -> R + Sync) -> Vec<R> {
    let mut made: Vec<Option<R>> = items.iter().map(|_| None).collect();
    let places = items.iter().zip(&mut made);
    parallel_for(core_count().min(items.len()), places, |(item, place)| *place = Some(make(item)));
    made.into_iter().flatten().collect()
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;

    #[test]
    fn threads_that_the_system_refuses_are_done_without() {
        const TOO_LARGE: usize = usize::MAX / 2;
        let (asked, runs) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let thread = || {
            let is_first = asked.fetch_add(1, Ordering::Relaxed) == 0;
            Builder::new().stack_size(if is_first { 64 << 10 } else { TOO_LARGE })
        };
        run_on_built_threads(7, thread, || {
            runs.fetch_add(1, Ordering::Relaxed);
        });
        assert_eq!((asked.into_inner(), runs.into_inner()), (2, 2), "one is given, the next is not");
    }

    #[test]
    fn every_item_is_worked_on_once() {
        for threads in [0, 1, 2, 7] {
            let mut items = vec![0_u32; 1000];
            parallel_for(threads, items.chunks_mut(3), |chunk| chunk.iter_mut().for_each(|item| *item += 1));
            assert!(items.iter().all(|item| *item == 1));
        }
    }

    #[test]
    fn answers_stand_in_the_order_of_the_items() {
        for count in [0, 1, 2, 1_000_u64] {
            let items: Vec<u64> = (0..count).collect();
            let expected: Vec<u64> = items.iter().map(|item| item * item).collect();
            assert_eq!(parallel_map(&items, |item| item * item), expected);
        }
    }
}
