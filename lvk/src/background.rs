//! Jobs that run on threads in the background, in the order in which they were submitted.

use std::collections::VecDeque;
use std::mem::take;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::thread::{Builder, JoinHandle};

use crate::lock_order::{Mutex, Rank};

/// A piece of work. It may not submit further jobs.
pub(crate) type Job = Box<dyn FnOnce() + Send>;

/// A queue of jobs with a bounded number of threads. Threads start when there is work, and end when there is none. A
/// drop discards the waiting jobs, and joins the threads.
pub(crate) struct BackgroundJobs {
    queue: Arc<Mutex<JobQueue>>,
    max_threads: usize,
}

#[derive(Default)]
struct JobQueue {
    waiting: VecDeque<Job>,
    /// Number of threads that take jobs.
    running: usize,
    threads: Vec<JoinHandle<()>>,
}

impl BackgroundJobs {
    /// Creates an empty queue for up to `max_threads` threads, at least one.
    pub(crate) fn new(max_threads: usize) -> Self {
        let queue = Mutex::new(Rank::BackgroundJobs, JobQueue::default());
        Self { queue: Arc::new(queue), max_threads: max_threads.max(1) }
    }

    /// Adds a job. If the system refuses every thread, the job runs on the current one.
    pub(crate) fn submit(&self, job: Job) {
        let mut queue = self.queue.lock();
        queue.waiting.push_back(job);
        queue.threads.retain(|thread| !thread.is_finished());
        if queue.running == self.max_threads {
            return;
        }
        let shared = Arc::clone(&self.queue);
        match Builder::new().name("lvk background".to_owned()).spawn(move || run_jobs(&shared)) {
            Ok(thread) => {
                queue.running += 1;
                queue.threads.push(thread);
            }
            Err(error) if queue.running == 0 => {
                log::warn!("no thread for the background: {error}; the work is done at once");
                queue.running = 1;
                drop(queue);
                run_jobs(&self.queue);
            }
            Err(_) => {}
        }
    }
}

impl Drop for BackgroundJobs {
    fn drop(&mut self) {
        let (waiting, threads) = {
            let mut queue = self.queue.lock();
            (take(&mut queue.waiting), take(&mut queue.threads))
        };
        drop(waiting);
        for thread in threads {
            // Jobs that panic are caught, so the thread itself does not.
            let _ = thread.join();
        }
    }
}

/// Runs jobs until none is waiting.
fn run_jobs(queue: &Mutex<JobQueue>) {
    loop {
        let job = {
            let mut queue = queue.lock();
            match queue.waiting.pop_front() {
                Some(job) => job,
                None => {
                    queue.running -= 1;
                    return;
                }
            }
        };
        if catch_unwind(AssertUnwindSafe(job)).is_err() {
            log::error!("a job in the background panicked");
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Barrier;
    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::sync::mpsc::channel;
    use std::time::{Duration, Instant};

    use super::*;

    #[test]
    fn every_job_runs_once_on_few_threads() {
        let jobs = BackgroundJobs::new(3);
        let counts = Arc::new([const { AtomicUsize::new(0) }; 3]);
        let (done, wait) = channel();
        for _ in 0..200 {
            let (counts, done) = (Arc::clone(&counts), done.clone());
            jobs.submit(Box::new(move || {
                let [now, most, runs] = &*counts;
                most.fetch_max(now.fetch_add(1, Ordering::SeqCst) + 1, Ordering::SeqCst);
                std::thread::yield_now();
                now.fetch_sub(1, Ordering::SeqCst);
                runs.fetch_add(1, Ordering::SeqCst);
                done.send(()).unwrap();
            }));
        }
        (0..200).for_each(|_| wait.recv().unwrap());
        assert!(counts[1].load(Ordering::SeqCst) <= 3);
        assert_eq!(counts[2].load(Ordering::SeqCst), 200);
    }

    #[test]
    fn a_drop_waits_for_the_running_job_and_discards_the_others() {
        let (started, finished) = (Arc::new(Barrier::new(2)), Arc::new(AtomicUsize::new(0)));
        let jobs = BackgroundJobs::new(1);
        let (start, finish) = (Arc::clone(&started), Arc::clone(&finished));
        jobs.submit(Box::new(move || {
            start.wait();
            // Until the drop has discarded the others; else this thread may take them before the drop begins.
            let end = Instant::now() + Duration::from_secs(20);
            while Arc::strong_count(&finish) > 2 && Instant::now() < end {
                std::thread::yield_now();
            }
            std::thread::sleep(Duration::from_millis(50));
            finish.fetch_add(1, Ordering::SeqCst);
        }));
        for _ in 0..10 {
            let finish = Arc::clone(&finished);
            jobs.submit(Box::new(move || _ = finish.fetch_add(100, Ordering::SeqCst)));
        }
        started.wait();
        drop(jobs);
        assert_eq!(finished.load(Ordering::SeqCst), 1);
        assert_eq!(Arc::strong_count(&finished), 1, "the captures of all jobs are dropped");
    }

    #[test]
    fn a_panic_ends_its_own_job_only() {
        let jobs = BackgroundJobs::new(1);
        let (sender, receiver) = channel::<u32>();
        let lost = sender.clone();
        jobs.submit(Box::new(move || {
            let _lost = lost;
            std::panic::resume_unwind(Box::new(()));
        }));
        jobs.submit(Box::new(move || sender.send(7).unwrap()));
        assert_eq!(receiver.recv(), Ok(7));
        assert!(receiver.recv().is_err());
    }
}
