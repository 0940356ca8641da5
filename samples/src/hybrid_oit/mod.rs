//! The `hybrid_oit` sample: raster and rays in one picture of opaque blocks and spheres of tinted glass, after KDGpu's
//! example "Hybrid Rasterization and Ray Tracing".
//!
//! A frame is seven passes: a compute shader places the spheres and writes what acceleration structures are built from
//! (boxes of the glass, records of the instances); the structures of moving things are built again, those of floor and
//! blocks were built once; a depth pass and a G-buffer pass draw what is opaque; shadow rays go from there to the sun,
//! stopped by what is opaque and tinted by glass, which any-hit shaders or the candidates of a query gather; glass is
//! drawn into a linked list for each pixel, from a pool of nodes that may run out but never over; the lists are sorted
//! and seen through by the pass that makes the picture.
//!
//! Spheres are exact everywhere: squares that fragment shaders cut to size, boxes with an intersection shader. That is
//! also why no shadow ray needs a minimal distance, where KDGpu's leaves out everything nearer than the largest
//! sphere's diameter: a ray that leaves a sphere on its outer side has it behind itself, which the intersection says
//! exactly (`shaders/hybrid_oit/sphere.glsl`); what rounding could spoil, an offset of a few units in the last place
//! along the normal mends. So spheres may touch, and contact shadows are whole.
//!
//! [`HybridOit`] is the sample for programs and tests, `info.rs` describes its program.

mod buffers;
mod config;
mod frame;
mod glass_lists;
mod image_passes;
mod info;
mod pipelines;
mod raster_passes;
mod sample;
mod scene;
mod sequence;
mod shadow_pass;
mod structures;
mod targets;

pub use config::HybridOitConfig;
pub use glass_lists::{GlassLists, GlassNode, NodeUse};
pub use info::HybridOitArgs;
pub use sample::HybridOit;
pub use scene::{Ball, Block, Glass, Motion, OitScene, PERIOD_SECONDS, Sun};
pub use sequence::HybridOitSequence;
