//! Harness of the tests: contexts under validation, scenes, reference ray tracers and image comparison.

pub mod accel_backend;
pub mod broken_shaders;
pub mod bvh2;
pub mod bvh8;
pub mod compute;
pub mod device;
pub mod gpu_built;
pub mod guest_engine;
pub mod half;
pub mod hit_check;
pub mod hit_comparison;
pub mod hybrid;
pub mod image_comparison;
pub mod local_read;
pub mod meshes;
pub mod noise;
pub mod oit_reference;
pub mod pipeline_paths;
pub mod pipelines;
pub mod process;
pub mod queues;
pub mod radv;
pub mod random;
pub mod raster;
pub mod raster_sample;
pub mod ray_scene;
pub mod ray_tracer;
pub mod rays;
pub mod reference;
pub mod rtx_sample;
pub mod scene_normal_map;
pub mod scene_obj;
pub mod scene_shadow_mask;
pub mod shader_groups;
pub mod sphere_scene;
pub mod strange_window;
pub mod subprocess;
pub mod vertex_deform;
pub mod warnings;
#[cfg(target_os = "linux")]
pub mod windows;

pub use device::{TestDevice, device, device_with, without_software};
