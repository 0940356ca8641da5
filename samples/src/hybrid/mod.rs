//! The `hybrid` sample: hard shadows, mirror reflections and refractions by ray tracing, after "A Hybrid Approach
//! for Vulkan-Based Ray Tracing Implementations" by Kim and Baek.
//!
//! Two methods give the same picture: [`Method::Standalone`] traces every pixel's ray, [`Method::Hybrid`] finds
//! what a pixel shows with a rasteriser and traces from there ([`Geometry`] says how). Both run by a ray tracing
//! pipeline and by ray queries ([`RayPath`]), from one text of shading code (`shaders/hybrid/integrator.glsl`).
//!
//! [`HybridRenderer`] is the sample for programs and tests, `info.rs` describes its program.

mod accumulation;
mod args;
mod compute_raster;
mod config;
mod frame;
mod frame_passes;
mod frame_timings;
mod geometry_pass;
mod geometry_stage;
mod gpu_scene;
pub(crate) mod half_float;
mod hardware_raster;
mod info;
mod launch_tiles;
#[cfg(feature = "window")]
mod panel;
mod pipelines;
mod pixel_order;
mod raster_choice;
mod ray_pass;
mod reflective_pixels;
mod renderer;
mod scene_arrays;
mod scene_check;
mod sequence;
mod shader_module;
mod texture_density;
mod texture_fit;
mod visibility_pass;

pub use args::HybridArgs;
pub use config::{Bounces, Geometry, HybridConfig, Method, Raster, RasterTuning, RayPath};
pub(crate) use frame::{Lighting, SceneAddresses, SceneFrame, near_plane};
pub use frame_timings::FrameTimings;
pub(crate) use gpu_scene::{GpuScene, HitGroups};
#[cfg(feature = "window")]
pub(crate) use panel::path_switch;
pub use raster_choice::RasterChoice;
pub use renderer::HybridRenderer;
pub(crate) use scene_arrays::SceneArrays;
pub(crate) use scene_check::check_promises;
pub use sequence::HybridSequence;
pub use texture_fit::{fit_textures, textures_needed};
