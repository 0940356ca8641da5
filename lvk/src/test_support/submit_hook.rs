//! A hook right before a thread acquires a command buffer, where tests act in place of another thread.

use std::cell::Cell;

type SubmitHook = Box<dyn FnOnce()>;

thread_local! {
    static NEXT: Cell<Option<SubmitHook>> = const { Cell::new(None) };
}

/// Sets a hook that runs once, on this thread, right before it acquires its next command buffer. The thread may hold
/// locks then.
pub(crate) fn before_next_command_buffer(hook: SubmitHook) {
    NEXT.set(Some(hook));
}

thread_local! {
    static SERIALIZE: std::cell::RefCell<Option<Box<dyn FnMut()>>> = const { std::cell::RefCell::new(None) };
}

/// Sets a hook that runs on this thread each time that a serialisation knows its sizes, in place of another thread.
pub(crate) fn before_serialize_copies(hook: Option<Box<dyn FnMut()>>) {
    SERIALIZE.replace(hook);
}

/// Runs the hook of this thread, which knows the sizes of a serialisation.
pub(crate) fn run_serialize_hook() {
    let hook = SERIALIZE.take();
    if let Some(mut hook) = hook {
        hook();
        SERIALIZE.replace(Some(hook));
    }
}

/// Runs the hook of this thread, which is about to acquire a command buffer.
pub(crate) fn run_submit_hook() {
    if let Some(hook) = NEXT.take() {
        hook();
    }
}
