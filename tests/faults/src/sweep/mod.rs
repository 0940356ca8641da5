//! Runs a program once for each fault, and judges each run.

mod error_line;
pub mod fallbacks;
pub mod plan;
#[cfg(target_os = "linux")]
pub mod report;
#[cfg(target_os = "linux")]
pub mod run;
pub mod verdict;
