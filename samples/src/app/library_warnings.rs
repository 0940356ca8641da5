//! Prints warnings of the library: damaged caches, refused features, leaked objects, validation messages.

use log::{Level, LevelFilter, Log, Metadata, Record};

/// Log target of the messages of the validation layer.
const VALIDATION: &str = "lvk::gpu::debug::messenger";

struct ToStandardError;

impl Log for ToStandardError {
    fn enabled(&self, metadata: &Metadata<'_>) -> bool {
        metadata.level() <= Level::Warn && metadata.target().starts_with("lvk")
    }

    fn log(&self, record: &Record<'_>) {
        if self.enabled(record.metadata()) {
            let subject = if record.target() == VALIDATION { "validation" } else { "warning" };
            super::print_message(subject, record.args());
        }
    }

    fn flush(&self) {}
}

/// Prints them to standard error from now on, unless the program has a logger already.
pub fn print() {
    if log::set_logger(&ToStandardError).is_ok() {
        log::set_max_level(LevelFilter::Warn);
    }
}
