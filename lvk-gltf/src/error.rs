//! Errors of loading a model.

/// Result of a load.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// A file that cannot be loaded. The message names the file, the object in it, and what to change.
#[derive(Debug, thiserror::Error)]
#[error("{file}: {problem}")]
pub struct Error {
    /// The file, as given, or `model` for bytes in memory.
    pub file: String,
    /// The problem.
    #[source]
    pub problem: Problem,
}

/// Why a file cannot be loaded.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Problem {
    /// The load was stopped by [`LoadOptions::on_progress`](crate::LoadOptions::on_progress).
    #[error("the load was stopped")]
    Stopped,
}
