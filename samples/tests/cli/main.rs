//! The `hybrid` program as a user meets it: what it prints, what it writes and its exit status.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on has failed")]

mod arguments;
mod devices;
mod images;
mod program;
#[cfg(unix)]
mod special_files;
