//! The `omni_shadows` sample: a lamp in a lattice, and what its light leaves dark all around. The depth of everything around
//! the lamp is drawn into a cube map, all six faces in one pass by multiview, or one after the other where a device has none;
//! the picture compares with it, filtered as softly as the size of the lamp says, on surfaces and in the air before them.
//!
//! [`OmniShadows`] is the sample for programs and tests, `info.rs` describes its program.

mod config;
mod frame;
mod info;
mod lattice;
mod models;
mod pipelines;
mod renderer;
mod scene_pass;
mod shadow_cube;

pub use config::{OmniShadowsConfig, ShadowFaces, ShadowFilter};
pub use info::OmniShadowsArgs;
pub use renderer::OmniShadows;
