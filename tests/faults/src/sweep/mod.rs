//! Runs a program once for each fault, and judges each run.

pub mod plan;
#[cfg(target_os = "linux")]
pub mod report;
#[cfg(target_os = "linux")]
pub mod run;
pub mod verdict;
