//! Documents that must say what is there.

mod parity;
mod programs;
mod readme;
