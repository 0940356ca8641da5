//! The `rtx_textures` sample: bindless textures in ray tracing stages. Two hit groups, paint and glaze, read the texture
//! whose number stands in the custom index of what was hit; a compute shader writes all instances in every frame, and the
//! top-level structure is built from its buffer. By queries the same is done by hand.
//!
//! [`RtxTextures`] is the sample for programs and tests, `info.rs` describes its program.

mod info;
mod models;
mod panel;
mod pipelines;
mod renderer;

pub use panel::RtxTexturesSettings;
pub use renderer::RtxTextures;
