//! Ends the process if a program hangs.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// A program that takes longer hangs.
const HANG: Duration = Duration::from_secs(120);

/// Ends the process if the count of finished programs stands still.
pub struct Watchdog {
    finished: AtomicU64,
    is_over: AtomicBool,
}

impl Watchdog {
    /// Runs `work` under the watch.
    pub fn watch<T>(work: impl FnOnce(&Self) -> T) -> T {
        let dog = Self { finished: AtomicU64::new(0), is_over: AtomicBool::new(false) };
        std::thread::scope(|scope| {
            scope.spawn(|| dog.wait_for_hang());
            let result = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| work(&dog)));
            dog.is_over.store(true, Ordering::Relaxed);
            result.unwrap_or_else(|panic| std::panic::resume_unwind(panic))
        })
    }

    /// Counts a program.
    pub fn program_ended(&self) {
        self.finished.fetch_add(1, Ordering::Relaxed);
    }

    fn wait_for_hang(&self) {
        let (mut seen, mut since) = (u64::MAX, Instant::now());
        while !self.is_over.load(Ordering::Relaxed) {
            std::thread::sleep(Duration::from_millis(50));
            let finished = self.finished.load(Ordering::Relaxed);
            if finished != seen {
                (seen, since) = (finished, Instant::now());
            } else if since.elapsed() > HANG {
                eprintln!("a program hangs after {finished} finished ones");
                std::process::abort();
            }
        }
    }
}
