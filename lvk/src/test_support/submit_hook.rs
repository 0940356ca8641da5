//! What other threads may do right before one takes a command buffer, for tests to have it done just then.

use std::cell::Cell;

type SubmitHook = Box<dyn FnOnce()>;

thread_local! {
    static NEXT: Cell<Option<SubmitHook>> = const { Cell::new(None) };
}

/// Runs once, on this thread, right before it takes its next command buffer, under whatever locks it has then.
pub(crate) fn before_next_command_buffer(hook: SubmitHook) {
    NEXT.set(Some(hook));
}

/// This thread is about to take a command buffer.
pub(crate) fn run_submit_hook() {
    if let Some(hook) = NEXT.take() {
        hook();
    }
}
