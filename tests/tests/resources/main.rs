//! Buffers, handles, bindless indices and push constants.

mod bindless;
mod bindless_checks;
mod buffers;
mod every_handle;
mod handles;
mod host_copies;
mod push_constants;
mod uploaded_values;
mod uploads;
