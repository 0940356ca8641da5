//! The `rtx_textures` sample: bindless textures in ray tracing stages. Two hit groups, paint and glaze, read the texture
//! whose number stands in the custom index of what was hit; a compute shader writes all instances in every frame, and the
//! top-level structure is built from its buffer. By queries the same is done by hand.
//!
//! [`RtxTextures`] is the sample for programs and tests, [`run`] the one for the command line.

mod args;
mod models;
mod pipelines;
mod renderer;
mod run;
mod switches;

pub use args::RtxTexturesArgs;
pub use pipelines::pipelines;
pub use renderer::RtxTextures;
pub use run::run;
pub use switches::RtxTexturesSwitches;
