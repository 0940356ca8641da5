//! A thread that loads something while frames are shown.

use std::panic::resume_unwind;
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

#[cfg(feature = "window")]
use super::overlay;
use super::status::Status;
use crate::app::progress::Progress;
use crate::app::run_error::RunError;

/// A thread that loads. Dropping this asks it to end, and waits for that.
#[derive(Debug)]
pub struct LoadThread<T> {
    status: Status,
    thread: Option<JoinHandle<T>>,
    start: Instant,
}

impl<T: Send + 'static> LoadThread<T> {
    /// Runs `load` on a thread of its own. `load` must call [`Progress::go_on`] from time to time.
    ///
    /// # Errors
    /// [`RunError`] if the thread cannot be created.
    pub fn start(load: impl FnOnce(&mut Progress) -> T + Send + 'static) -> Result<Self, RunError> {
        let status = Status::default();
        let mut progress = Progress::with_log_lines().with_status(&status);
        let thread = thread::Builder::new()
            .name("loading".to_owned())
            .spawn(move || load(&mut progress))
            .map_err(RunError::device)?;
        Ok(Self { status, thread: Some(thread), start: Instant::now() })
    }
}

impl<T> LoadThread<T> {
    /// Takes what was loaded, once the thread has ended.
    ///
    /// # Panics
    /// If the thread has.
    pub fn take(&mut self) -> Option<T> {
        let thread = self.thread.take_if(|thread| thread.is_finished())?;
        Some(thread.join().unwrap_or_else(|panic| resume_unwind(panic)))
    }

    /// Time since the start.
    #[must_use]
    pub fn elapsed(&self) -> Duration {
        self.start.elapsed()
    }

    /// Lays out how far it is, in the middle of the window.
    #[cfg(feature = "window")]
    pub fn show(&self, ui: &egui::Context) {
        overlay::show(ui, &self.status.stage(), self.elapsed());
    }
}

impl<T> Drop for LoadThread<T> {
    fn drop(&mut self) {
        self.status.stop();
        if let Some(thread) = self.thread.take() {
            // The result is no longer needed, and neither is its error.
            let _ = thread.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn taken<T>(thread: &mut LoadThread<T>) -> T {
        let deadline = Instant::now() + Duration::from_secs(60);
        loop {
            if let Some(loaded) = thread.take() {
                return loaded;
            }
            assert!(Instant::now() < deadline, "the thread does not end");
            thread::sleep(Duration::from_millis(1));
        }
    }

    #[test]
    fn a_loaded_value_is_taken_once() {
        let mut thread = LoadThread::start(|_| 7).unwrap();
        assert_eq!((taken(&mut thread), thread.take()), (7, None));
    }

    #[test]
    fn a_thread_that_is_no_longer_needed_is_asked_to_end() {
        let (tell, told) = std::sync::mpsc::channel();
        let thread = LoadThread::start(move |progress: &mut Progress| {
            while progress.go_on().is_ok() {
                thread::sleep(Duration::from_millis(1));
            }
            tell.send(()).unwrap();
        });
        drop(thread.unwrap());
        assert_eq!(told.try_recv(), Ok(()));
    }
}
