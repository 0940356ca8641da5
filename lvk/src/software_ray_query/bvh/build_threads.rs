//! Threads of builds on the CPU. All builds of the process share them.

use std::sync::OnceLock;

use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::parallel::core_count;

/// Stack of a thread. A thread that waits for a part of its build may work on another build.
const STACK_BYTES: usize = 8 << 20;

/// Items of a task that does little for each, which threads share without much overhead. Sums of such chunks do not
/// depend on the number of threads.
pub(crate) const TASK_LENGTH: usize = 4096;

/// Runs `work` on the threads of builds, one for each core. If the system refuses them, the current thread does all of
/// the work.
pub(crate) fn on_build_threads<R: Send>(work: impl FnOnce() -> R + Send) -> R {
    static POOL: OnceLock<Option<ThreadPool>> = OnceLock::new();
    let pool = POOL.get_or_init(|| thread_pool(core_count()));
    on_pool(pool.as_ref(), work)
}

/// As [`on_build_threads`], with `threads` threads that end afterwards.
#[cfg(any(test, feature = "test-hooks"))]
pub(crate) fn on_new_threads<R: Send>(threads: usize, work: impl FnOnce() -> R + Send) -> R {
    on_pool(thread_pool(threads).as_ref(), work)
}

fn on_pool<R: Send>(pool: Option<&ThreadPool>, work: impl FnOnce() -> R + Send) -> R {
    match pool {
        Some(pool) => pool.install(work),
        None => {
            // A pool of the current thread takes no other, and its work stays on this thread.
            let _own = ThreadPoolBuilder::new().num_threads(1).use_current_thread().build();
            work()
        }
    }
}

fn thread_pool(threads: usize) -> Option<ThreadPool> {
    let name = |number| format!("lvk build {number}");
    let pool = ThreadPoolBuilder::new()
        .num_threads(threads.max(1))
        .stack_size(STACK_BYTES)
        .thread_name(name)
        .build();
    pool.map_err(|error| log::warn!("builds on the CPU use one thread: {error}")).ok()
}

#[cfg(test)]
mod tests {
    use rayon::prelude::*;

    use super::*;

    #[test]
    fn work_runs_on_the_threads_that_are_asked_for() {
        for threads in [1, 3] {
            assert_eq!(on_new_threads(threads, rayon::current_num_threads), threads);
        }
        assert_eq!(on_build_threads(rayon::current_num_threads), core_count());
    }

    #[test]
    fn the_current_thread_does_what_refused_threads_would() {
        let sum = std::thread::spawn(|| {
            let own = std::thread::current().id();
            on_pool(None, || {
                (0..1000)
                    .into_par_iter()
                    .map(|number| {
                        assert_eq!(std::thread::current().id(), own);
                        number
                    })
                    .sum::<u32>()
            })
        });
        assert_eq!(sum.join().unwrap(), 499_500);
    }
}
