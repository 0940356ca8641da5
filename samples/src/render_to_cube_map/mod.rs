//! The `render_to_cube_map` sample: the six faces of a cube map drawn in every frame, each in a pass of its own or all in one
//! pass that has a view for each (multiview), and shown by a drop that mirrors them.
//!
//! [`RenderToCubeMap`] is the sample for programs and tests, `info.rs` describes its program.

mod config;
mod cube_map;
mod info;
mod pipelines;
mod renderer;
mod surroundings;

pub use config::{CubeMapFaces, RenderToCubeMapConfig};
pub use info::RenderToCubeMapArgs;
pub use renderer::RenderToCubeMap;
pub use surroundings::Block;
