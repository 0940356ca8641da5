//! Documents that must say what is there.

mod bindless_core;
mod held_by;
mod parity;
mod programs;
mod readme;
