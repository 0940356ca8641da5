//! Warnings of the library.

use std::sync::{Mutex, Once, PoisonError};

use log::{LevelFilter, Log, Metadata, Record};

/// Collects every warning of the process.
struct WarningLog;

static LOG: WarningLog = WarningLog;
static WARNINGS: Mutex<Vec<String>> = Mutex::new(Vec::new());

impl Log for WarningLog {
    fn enabled(&self, metadata: &Metadata<'_>) -> bool {
        metadata.level() <= LevelFilter::Warn
    }

    fn log(&self, record: &Record<'_>) {
        if self.enabled(record.metadata()) {
            WARNINGS.lock().unwrap_or_else(PoisonError::into_inner).push(record.args().to_string());
        }
    }

    fn flush(&self) {}
}

/// Starts to collect warnings. Earlier warnings are lost.
///
/// # Panics
/// When another logger is installed.
#[expect(clippy::expect_used, reason = "a test that cannot hear has failed")]
pub fn capture_warnings() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        log::set_logger(&LOG).expect("no other logger is installed");
        log::set_max_level(LevelFilter::Warn);
    });
}

/// Removes and returns the collected warnings that contain `words`. Rare words leave out those of other tests in the
/// process.
pub fn take_warnings(words: &str) -> Vec<String> {
    let mut heard = WARNINGS.lock().unwrap_or_else(PoisonError::into_inner);
    heard.extract_if(.., |warning| warning.contains(words)).collect()
}
