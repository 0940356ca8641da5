//! Tests that hold documents and the tree of sources against each other.

mod android;
mod bad_input;
mod bad_input_of_crates;
mod calls_without_error;
mod circles;
mod contributing;
mod defaults;
mod defects;
mod dependencies;
mod docstrings;
mod examples;
mod features;
mod glossary;
mod held_by;
mod layers;
mod map;
mod package;
mod parity;
mod porting;
mod programs;
mod readme;
mod rust_modules;
mod rust_tokens;
mod sums;
mod tables;
mod unsafety;
