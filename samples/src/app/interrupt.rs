//! Ctrl-C as a flag.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use lvk::temporary_file;

/// Exit status of a program that was interrupted, by the custom of shells.
pub const STATUS: u8 = 130;

/// Ctrl-C, or the request of a batch system to end the process (SIGTERM). At first it ends the process at once, with status
/// 130. After [`Interrupt::defer`] the first time only raises a flag, so that the frame under way becomes a whole picture,
/// and the second time ends the process. Either way no picture and no cache file is left in part, because files get their
/// names when they are complete, and the temporary files are removed. On Windows, Ctrl-Break and the closing of the console
/// count like Ctrl-C.
#[derive(Debug, Clone, Default)]
pub struct Interrupt {
    flags: Arc<Flags>,
}

#[derive(Debug, Default)]
struct Flags {
    is_deferred: AtomicBool,
    is_raised: AtomicBool,
}

impl Interrupt {
    /// Listens from now on. If the system does not allow it, Ctrl-C ends the process as usual.
    #[must_use]
    pub fn listen() -> Self {
        let interrupt = Self::default();
        let heard = interrupt.clone();
        end_when_interrupted(move || heard.ends_process());
        interrupt
    }

    /// A flag without signal handlers; only [`Interrupt::raise`] raises it.
    #[must_use]
    pub fn without_handlers() -> Self {
        Self::default()
    }

    /// Leaves it to the caller from now on to end the work when the flag is raised.
    pub fn defer(&self) {
        self.flags.is_deferred.store(true, Ordering::SeqCst);
    }

    /// Raises the flag.
    pub fn raise(&self) {
        self.flags.is_raised.store(true, Ordering::SeqCst);
    }

    /// True if the work is to end after the present frame.
    #[must_use]
    pub fn is_raised(&self) -> bool {
        self.flags.is_raised.load(Ordering::SeqCst)
    }

    /// Raises the flag. True if this is to end the process at once.
    fn ends_process(&self) -> bool {
        let is_again = self.flags.is_raised.swap(true, Ordering::SeqCst);
        is_again || !self.flags.is_deferred.load(Ordering::SeqCst)
    }
}

/// Calls `ends_process` at each signal, on a thread of its own, and ends the process where that is true.
#[cfg(unix)]
fn end_when_interrupted(ends_process: impl Fn() -> bool + Send + 'static) {
    use signal_hook::consts::{SIGINT, SIGTERM};
    use signal_hook::iterator::Signals;

    let listening = Signals::new([SIGINT, SIGTERM]).and_then(|mut signals| {
        std::thread::Builder::new().name("interrupt".to_owned()).spawn(move || {
            if signals.forever().any(|_| ends_process()) {
                temporary_file::remove_all_before_exit();
                // Without the handlers of the C library: other threads still use what these destroy.
                signal_hook::low_level::exit(STATUS.into());
            }
        })
    });
    if let Err(error) = listening {
        log::warn!("cannot listen to signals: {error}");
    }
}

// The signals of Windows' C library know neither Ctrl-Break nor a closed console.
#[cfg(windows)]
fn end_when_interrupted(ends_process: impl Fn() -> bool + Send + 'static) {
    let listening = ctrlc::try_set_handler(move || {
        if ends_process() {
            temporary_file::remove_all_before_exit();
            std::process::exit(STATUS.into());
        }
    });
    if let Err(error) = listening {
        log::warn!("cannot listen to Ctrl-C: {error}");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_signal_ends_the_process_unless_it_is_deferred() {
        assert!(Interrupt::without_handlers().ends_process());
        let deferred = Interrupt::without_handlers();
        deferred.defer();
        assert!(!deferred.is_raised());
        assert!(!deferred.ends_process() && deferred.is_raised());
        assert!(deferred.ends_process(), "the second time");
    }
}
