//! The samples' windows as a user meets them, on an X server without a screen.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod input;
mod loading;
#[path = "../missing_features/mod.rs"]
mod missing_features;
mod samples;
mod session;
