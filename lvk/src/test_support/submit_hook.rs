//! What other threads may do right before one takes a command buffer, for tests to have it done just then.

use std::cell::Cell;

type Deed = Box<dyn FnOnce()>;

thread_local! {
    static NEXT: Cell<Option<Deed>> = const { Cell::new(None) };
}

/// Runs once, on this thread, right before it takes its next command buffer, under whatever locks it has then.
pub(crate) fn before_next_command_buffer(deed: Deed) {
    NEXT.set(Some(deed));
}

/// This thread is about to take a command buffer.
pub(crate) fn interrupt() {
    if let Some(deed) = NEXT.take() {
        deed();
    }
}
