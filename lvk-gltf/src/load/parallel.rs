//! Work that threads share, with progress and a way to stop.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use super::{LoadOptions, Progress};
use crate::Problem;

/// Calls `work` for each index below `total`, in several threads, and returns the results in order. Of several errors the one of
/// the smallest index is returned.
pub(super) fn map<T: Send>(
    step: &'static str,
    total: usize,
    options: &LoadOptions<'_>,
    work: impl Fn(usize) -> Result<T, Problem> + Sync,
) -> Result<Vec<T>, Problem> {
    let (next, stop) = (AtomicUsize::new(0), AtomicBool::new(false));
    let results = Mutex::new(Vec::new());
    let work_on = |report: &dyn Fn(usize) -> bool| {
        while !stop.load(Ordering::Relaxed) {
            let index = next.fetch_add(1, Ordering::Relaxed);
            if index >= total {
                break;
            }
            let result = work(index);
            let failed = result.is_err();
            let mut results = results.lock().unwrap_or_else(PoisonError::into_inner);
            results.push((index, result));
            let done = results.len();
            drop(results);
            if failed || !report(done) {
                stop.store(true, Ordering::Relaxed);
            }
        }
    };
    let stopped = AtomicBool::new(false);
    let report = |done| {
        let flow = options
            .on_progress
            .map_or(ControlFlow::Continue(()), |on_progress| on_progress(Progress { step, done, total }));
        stopped.fetch_or(flow.is_break(), Ordering::Relaxed);
        flow.is_continue()
    };
    let cores = || std::thread::available_parallelism().map_or(1, usize::from);
    let threads = options.most_threads.unwrap_or_else(cores);
    std::thread::scope(|scope| {
        for _ in 1..threads.min(total) {
            scope.spawn(|| work_on(&|_| true));
        }
        work_on(&report);
    });
    let mut results = results.into_inner().unwrap_or_else(PoisonError::into_inner);
    results.sort_unstable_by_key(|(index, _)| *index);
    let results: Result<Vec<T>, Problem> = results.into_iter().map(|(_, result)| result).collect();
    if stopped.into_inner() && results.is_ok() { Err(Problem::Stopped) } else { results }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_are_in_order_and_errors_are_those_of_the_smallest_index() {
        let options = LoadOptions::default();
        let squares = map("squares", 1000, &options, |index| Ok(index * index)).unwrap();
        assert!(squares.iter().enumerate().all(|(index, square)| *square == index * index));
        let fail = |index| if index == 7 { Err(Problem::NotGltf) } else { Ok(()) };
        assert!(matches!(map("errors", 1000, &options, fail), Err(Problem::NotGltf)));
        assert!(map("none", 0, &options, |_| Ok(())).unwrap().is_empty());
    }

    #[test]
    fn progress_can_stop_the_work() {
        let stop = |progress: Progress| {
            assert_eq!((progress.step, progress.total), ("step", 1_000_000));
            ControlFlow::Break(())
        };
        let options = LoadOptions { on_progress: Some(&stop), ..LoadOptions::default() };
        let done = AtomicUsize::new(0);
        let result = map("step", 1_000_000, &options, |_| Ok(done.fetch_add(1, Ordering::Relaxed)));
        assert!(matches!(result, Err(Problem::Stopped)));
        assert!(done.into_inner() < 1_000_000);
    }
}
