//! Harness of the tests: a device with silent validation, or a loud failure.

pub mod agreement;
pub mod child;
pub mod compute;
pub mod device;
pub mod meshes;
pub mod noise;
pub mod random;
pub mod raster;
pub mod ray_scene;
pub mod ray_tracer;
pub mod rays;
pub mod reference;

pub use device::{TestDevice, device, device_with};
