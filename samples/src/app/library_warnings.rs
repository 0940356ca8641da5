//! Prints warnings of the library: damaged caches, refused features, leaked objects.

use log::{Level, LevelFilter, Log, Metadata, Record};

/// Log target of validation messages, which programs count and print themselves.
const VALIDATION: &str = "lvk::gpu::debug";

struct ToStandardError;

impl Log for ToStandardError {
    fn enabled(&self, metadata: &Metadata<'_>) -> bool {
        let target = metadata.target();
        metadata.level() <= Level::Warn && target.starts_with("lvk") && target != VALIDATION
    }

    fn log(&self, record: &Record<'_>) {
        if self.enabled(record.metadata()) {
            super::print_message("warning", record.args());
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
