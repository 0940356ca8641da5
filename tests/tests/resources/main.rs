//! Buffers and handles, bindless indices and push constants: what shaders are given, and by what name.

mod bindless;
mod bindless_checks;
mod buffers;
mod handles;
mod host_copies;
mod push_constants;
mod uploads;
