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
    /// Kept for its end.
    _listener: Option<Arc<Listener>>,
}

#[derive(Debug, Default)]
struct Flags {
    is_deferred: AtomicBool,
    is_raised: AtomicBool,
}

impl Interrupt {
    /// Listens from now on, until the end of the last clone. If the system does not allow it, Ctrl-C ends the process as usual.
    #[must_use]
    pub fn listen() -> Self {
        let flags = Arc::<Flags>::default();
        let heard = flags.clone();
        let listener = Listener::start(move || heard.ends_process());
        Self { flags, _listener: listener.map(Arc::new) }
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
}

impl Flags {
    /// Raises the flag. True if this is to end the process at once.
    fn ends_process(&self) -> bool {
        let is_again = self.is_raised.swap(true, Ordering::SeqCst);
        is_again || !self.is_deferred.load(Ordering::SeqCst)
    }
}

/// Listens to signals on a thread of its own, which its end joins.
#[cfg(unix)]
#[derive(Debug)]
struct Listener {
    signals: signal_hook::iterator::Handle,
    thread: Option<std::thread::JoinHandle<()>>,
}

#[cfg(unix)]
impl Listener {
    /// Calls `ends_process` at each signal, and ends the process where that is true.
    fn start(ends_process: impl Fn() -> bool + Send + 'static) -> Option<Self> {
        Self::try_start(ends_process)
            .inspect_err(|error| log::warn!("cannot listen to signals: {error}"))
            .ok()
    }

    fn try_start(ends_process: impl Fn() -> bool + Send + 'static) -> std::io::Result<Self> {
        use signal_hook::consts::{SIGINT, SIGTERM};
        use signal_hook::iterator::Signals;

        let mut listening = Signals::new([SIGINT, SIGTERM])?;
        let signals = listening.handle();
        let thread = std::thread::Builder::new().name("interrupt".to_owned()).spawn(move || {
            if listening.forever().any(|_| ends_process()) {
                temporary_file::remove_all_before_exit();
                // Without the handlers of the C library: other threads still use what these destroy.
                signal_hook::low_level::exit(STATUS.into());
            }
        })?;
        Ok(Self { signals, thread: Some(thread) })
    }
}

#[cfg(unix)]
impl Drop for Listener {
    fn drop(&mut self) {
        self.signals.close();
        // A thread that has panicked has told so.
        let _ = self.thread.take().map(std::thread::JoinHandle::join);
    }
}

/// Listens until the process ends: the handler cannot be taken back.
#[cfg(windows)]
#[derive(Debug)]
struct Listener;

#[cfg(windows)]
impl Listener {
    // The signals of Windows' C library know neither Ctrl-Break nor a closed console.
    fn start(ends_process: impl Fn() -> bool + Send + 'static) -> Option<Self> {
        let listening = ctrlc::try_set_handler(move || {
            if ends_process() {
                temporary_file::remove_all_before_exit();
                std::process::exit(STATUS.into());
            }
        });
        listening.inspect_err(|error| log::warn!("cannot listen to Ctrl-C: {error}")).ok().map(|()| Self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_signal_ends_the_process_unless_it_is_deferred() {
        assert!(Interrupt::without_handlers().flags.ends_process());
        let deferred = Interrupt::without_handlers();
        deferred.defer();
        assert!(!deferred.is_raised());
        assert!(!deferred.flags.ends_process() && deferred.is_raised());
        assert!(deferred.flags.ends_process(), "the second time");
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_listener_ends_with_its_value() -> std::io::Result<()> {
        let threads = || -> std::io::Result<usize> {
            // By the name of the listener's thread.
            let tasks = std::fs::read_dir("/proc/self/task")?;
            let names = tasks.filter_map(|task| std::fs::read_to_string(task.ok()?.path().join("comm")).ok());
            Ok(names.filter(|name| name.trim() == "interrupt").count())
        };
        let interrupt = Interrupt::listen();
        // A thread names itself when it begins.
        while threads()? == 0 {
            std::thread::yield_now();
        }
        drop(interrupt);
        while threads()? > 0 {
            std::thread::yield_now();
        }
        Ok(())
    }
}
