//! The `render_to_cube_map` sample: the six faces of a cube map drawn in every frame, each in a pass of its own or all in one
//! pass that has a view for each (multiview), and shown by a drop that mirrors them.
//!
//! [`RenderToCubeMap`] is the sample for programs and tests, [`run`] the one for the command line.

mod args;
mod config;
mod cube_map;
mod pipelines;
mod renderer;
mod run;
mod surroundings;

pub use args::RenderToCubeMapArgs;
pub use config::{Faces, RenderToCubeMapConfig};
pub use pipelines::pipelines;
pub use renderer::RenderToCubeMap;
pub use run::run;
pub use surroundings::Block;
