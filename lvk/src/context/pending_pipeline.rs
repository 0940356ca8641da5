//! A pipeline that is compiled in the background.

use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, TryRecvError};

use super::Context;
use super::destroy::Destroy;
use super::holder::Holder;
use crate::error::{Error, Result};
use crate::lock_order::{Mutex, Rank};

/// Makes the compiled pipeline an object of the context.
pub(super) type Finish<H> = Box<dyn FnOnce(&Context) -> Result<Holder<H>> + Send>;

/// A pipeline that is compiled in the background, such as by
/// [`Context::create_render_pipeline_in_background`].
///
/// [`handle_or`](Self::handle_or) names the pipeline in each frame: a placeholder until the pipeline is ready. Dropping
/// the value destroys the pipeline like a [`Holder`], or cancels its creation. An error that was never returned is then
/// logged.
#[must_use = "dropping the pipeline cancels its creation"]
pub struct PendingPipeline<H: Destroy> {
    state: State<H>,
    name: Arc<str>,
    /// True if nothing waits for the pipeline any more.
    cancelled: Arc<AtomicBool>,
    ctx: Context,
}

enum State<H: Destroy> {
    /// The lock makes the value `Sync`. Methods reach the receiver by unique access.
    Compiling(Mutex<Receiver<Result<Finish<H>>>>),
    Ready(Holder<H>),
    /// The error was returned.
    Failed,
}

impl<H: Destroy> PendingPipeline<H> {
    pub(super) fn new(
        ctx: &Context,
        name: Arc<str>,
        cancelled: Arc<AtomicBool>,
        result: Receiver<Result<Finish<H>>>,
    ) -> Self {
        let state = State::Compiling(Mutex::new(Rank::PendingPipeline, result));
        Self { state, name, cancelled, ctx: ctx.clone() }
    }

    /// Returns the name of the pipeline, the `debug_name` of its description.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns true if the pipeline is ready, without waiting.
    ///
    /// # Errors
    /// Those of the creation, once. Later calls return false.
    pub fn poll(&mut self) -> Result<bool> {
        let State::Compiling(result) = &mut self.state else {
            return Ok(matches!(self.state, State::Ready(_)));
        };
        match result.get_mut().try_recv() {
            Err(TryRecvError::Empty) => Ok(false),
            Ok(result) => self.finish(result).map(|()| true),
            Err(TryRecvError::Disconnected) => self.finish(Err(self.lost())).map(|()| true),
        }
    }

    /// Returns the handle of the pipeline if it is ready, and otherwise `placeholder`. Call it in each frame.
    ///
    /// # Errors
    /// Those of the creation, once. Later calls return `placeholder`.
    pub fn handle_or(&mut self, placeholder: H) -> Result<H> {
        self.poll()?;
        Ok(self.handle().unwrap_or(placeholder))
    }

    /// Returns the handle if [`poll`](Self::poll) or [`handle_or`](Self::handle_or) has found the pipeline ready.
    pub fn handle(&self) -> Option<H> {
        match &self.state {
            State::Ready(holder) => Some(holder.handle()),
            State::Compiling(_) | State::Failed => None,
        }
    }

    /// Waits until the pipeline is ready, and returns its owner.
    ///
    /// # Errors
    /// Those of the creation. [`InvalidUsage`](Error::InvalidUsage) if the error was returned before.
    pub fn wait(mut self) -> Result<Holder<H>> {
        if let State::Compiling(result) = &mut self.state {
            let result = result.get_mut().recv().unwrap_or_else(|_| Err(self.lost()));
            self.finish(result)?;
        }
        match std::mem::replace(&mut self.state, State::Failed) {
            State::Ready(holder) => Ok(holder),
            State::Compiling(_) | State::Failed => {
                Err(Error::usage(&*self.name, "its creation failed, and the error was returned before"))
            }
        }
    }

    fn finish(&mut self, result: Result<Finish<H>>) -> Result<()> {
        self.state = State::Failed;
        let finish = result.and_then(|finish| finish(&self.ctx));
        let holder = finish.map_err(|error| error.with_object(&self.name))?;
        self.state = State::Ready(holder);
        Ok(())
    }

    /// Returns the error for a job that ended without a result, because it panicked.
    fn lost(&self) -> Error {
        Error::usage(&*self.name, "its creation in the background ended without a result; create it again")
    }
}

impl<H: Destroy> Drop for PendingPipeline<H> {
    fn drop(&mut self) {
        self.cancelled.store(true, Ordering::Relaxed);
        let State::Compiling(result) = &mut self.state else { return };
        if let Ok(Err(error)) = result.get_mut().try_recv() {
            log::warn!(
                "a pipeline was dropped before its error was returned: {}",
                error.with_object(&self.name)
            );
        }
    }
}

impl<H: Destroy> fmt::Debug for PendingPipeline<H> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("PendingPipeline").field("name", &self.name).field("handle", &self.handle()).finish()
    }
}
