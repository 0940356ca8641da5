//! Harness of the tests: a device with silent validation, or a loud failure.

pub mod agreement;
pub mod bender;
pub mod binary_tree;
pub mod board;
pub mod broken_shaders;
pub mod child;
pub mod compute;
pub mod device;
pub mod glass_room;
pub mod gpu_built;
pub mod half;
pub mod hit_check;
pub mod hybrid;
pub mod local_read;
pub mod meshes;
pub mod noise;
pub mod picture;
pub mod pipelines;
pub mod queues;
pub mod radv;
pub mod random;
pub mod raster;
pub mod raster_sample;
pub mod ray_scene;
pub mod ray_tracer;
pub mod rays;
pub mod reference;
pub mod relief;
pub mod shader_groups;
pub mod sphere_scene;
pub mod still_life;
pub mod structures;
pub mod warnings;
pub mod wide_tree;
pub mod windows;

pub use device::{TestDevice, device, device_with, without_software};
