//! Harness of the tests: a device with silent validation, or a loud failure.

pub mod device;

pub use device::{TestDevice, device, device_with};
