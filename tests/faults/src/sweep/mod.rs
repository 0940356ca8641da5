//! Runs a program once for each fault, and judges each run.

#[cfg(target_os = "linux")]
pub mod clean_program;
mod error_line;
mod evidence;
pub mod fallbacks;
pub mod object_names;
pub mod plan;
#[cfg(target_os = "linux")]
pub mod report;
#[cfg(target_os = "linux")]
pub mod run;
pub mod verdict;
