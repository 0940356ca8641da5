//! Scopes for CPU profilers around calls that can take long.

/// Opens a scope of the crate `profiling` until the end of the block. Without the feature `profiling` it is nothing.
macro_rules! cpu_scope {
    ($name:literal) => {
        #[cfg(feature = "tracy")]
        $crate::cpu_scope::start_tracy();
        #[cfg(feature = "profiling")]
        ::profiling::scope!($name);
    };
}
pub(crate) use cpu_scope;

/// Starts Tracy's client if it is not running: scopes panic without one.
#[cfg(feature = "tracy")]
pub(crate) fn start_tracy() {
    tracy_client::Client::start();
}
