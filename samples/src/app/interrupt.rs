//! Ctrl-C as a flag.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Exit status of a program that was interrupted, by the custom of shells.
pub const STATUS: u8 = 130;

/// True if the user has pressed Ctrl-C, or a batch system has asked the process to end. The first time only raises the
/// flag, so that the frame under way becomes a whole picture; the second time ends the process at once, with status
/// 130. Either way no picture is left in part, because pictures get their names when they are complete. On Windows,
/// Ctrl-Break and the closing of the console count like Ctrl-C.
#[derive(Debug, Clone, Default)]
pub struct Interrupt {
    is_raised: Arc<AtomicBool>,
}

impl Interrupt {
    /// Listens from now on. If the system does not allow it, Ctrl-C ends the process as usual.
    #[must_use]
    pub fn listen() -> Self {
        let interrupt = Self::default();
        raise_when_interrupted(&interrupt.is_raised);
        interrupt
    }

    /// A flag without signal handlers; only [`Interrupt::raise`] raises it.
    #[must_use]
    pub fn without_handlers() -> Self {
        Self::default()
    }

    /// Raises the flag.
    pub fn raise(&self) {
        self.is_raised.store(true, Ordering::Relaxed);
    }

    /// True if the work is to end after the present frame.
    #[must_use]
    pub fn is_raised(&self) -> bool {
        self.is_raised.load(Ordering::Relaxed)
    }
}

#[cfg(unix)]
fn raise_when_interrupted(is_raised: &Arc<AtomicBool>) {
    use signal_hook::consts::{SIGINT, SIGTERM};
    use signal_hook::flag;

    for signal in [SIGINT, SIGTERM] {
        // In this order: the first signal must not find the flag that it raises itself.
        let ends = flag::register_conditional_shutdown(signal, i32::from(STATUS), Arc::clone(is_raised));
        if let Err(error) = ends.and_then(|_| flag::register(signal, Arc::clone(is_raised))) {
            log::warn!("cannot listen to signal {signal}: {error}");
        }
    }
}

// The signals of Windows' C library know neither Ctrl-Break nor a closed console.
#[cfg(windows)]
fn raise_when_interrupted(is_raised: &Arc<AtomicBool>) {
    let is_raised = Arc::clone(is_raised);
    let listening = ctrlc::try_set_handler(move || {
        if is_raised.swap(true, Ordering::Relaxed) {
            std::process::exit(STATUS.into());
        }
    });
    if let Err(error) = listening {
        log::warn!("cannot listen to Ctrl-C: {error}");
    }
}
