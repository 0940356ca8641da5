//! The progress and cancellation of loading, shared by the loading thread and the window.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// The error of a load that was cancelled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("loading was stopped")]
pub struct Stopped;

/// The progress and cancellation of loading. Clones share their state.
#[derive(Debug, Clone, Default)]
pub struct Status {
    shared: Arc<Shared>,
}

#[derive(Debug, Default)]
struct Shared {
    stage: Mutex<Stage>,
    is_stopped: AtomicBool,
}

/// The current stage.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(super) struct Stage {
    pub(super) name: String,
    pub(super) done: u64,
    /// 0 where nothing can be counted.
    pub(super) total: u64,
}

impl Status {
    /// The next stage has begun, of `total` steps; 0 steps for one that cannot be counted.
    pub(in crate::app) fn begin(&self, name: &str, total: u64) {
        *self.lock() = Stage { name: name.to_owned(), done: 0, total };
    }

    /// Sets the number of finished steps of the stage.
    pub(in crate::app) fn set(&self, done: u64) {
        self.lock().done = done;
    }

    /// The stage under way.
    pub(super) fn stage(&self) -> Stage {
        self.lock().clone()
    }

    /// Asks the loading thread to stop.
    pub fn stop(&self) {
        self.shared.is_stopped.store(true, Ordering::Relaxed);
    }

    /// True if that was asked.
    #[must_use]
    pub fn is_stopped(&self) -> bool {
        self.shared.is_stopped.load(Ordering::Relaxed)
    }

    fn lock(&self) -> MutexGuard<'_, Stage> {
        self.shared.stage.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Stage {
    /// The share that is done, where that is known.
    pub(super) fn share(&self) -> Option<f32> {
        (self.total > 0).then(|| (self.done as f64 / self.total as f64).min(1.0) as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clones_tell_the_same_and_stages_begin_anew() {
        let status = Status::default();
        let seen = status.clone();
        status.begin("reading", 40);
        status.set(10);
        assert_eq!(seen.stage(), Stage { name: "reading".to_owned(), done: 10, total: 40 });
        assert_eq!(seen.stage().share(), Some(0.25));
        status.set(60);
        assert_eq!(seen.stage().share(), Some(1.0), "more than was announced");
        status.begin("shaders", 0);
        assert_eq!((seen.stage().done, seen.stage().share()), (0, None));
        assert!(!status.is_stopped());
        seen.stop();
        assert!(status.is_stopped());
    }
}
