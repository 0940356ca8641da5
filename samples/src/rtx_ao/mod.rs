//! The `rtx_ao` sample: ambient occlusion and sunlight by ray queries in the fragment shader of a rasterised scene, or by a
//! ray tracing pipeline that starts from what was rasterised.
//!
//! * Depth is drawn first, so that each pixel's rays are traced once, for what is seen.
//! * A pass sends one ray to the sun and some to the surroundings, at other places of the pixel and to other directions
//!   than the passes before; a cache adds them up, so that the picture converges. It begins anew when the camera or
//!   something else moves.
//!
//! [`RtxAo`] is the sample for programs and tests, `info.rs` describes its program.

mod body;
mod config;
mod frame;
mod info;
mod light_pass;
mod pipelines;
mod raster;
mod renderer;
mod targets;

pub use config::RtxAoConfig;
pub use info::RtxAoArgs;
pub use renderer::{RtxAo, View};
