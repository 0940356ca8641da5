//! Processes that are killed, signalled, run at once, or find folders that are read-only, full or gone: every file is whole, and
//! the next start works.
#![cfg(unix)]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on has failed")]

mod at_once;
mod folders;
mod kill_point;
mod kills;
mod program;
mod signals;
