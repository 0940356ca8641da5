//! The `triplanar` sample: bodies without texture coordinates, whose textures are projected along three axes; they are unloaded
//! and loaded again while frames are on their way, and a placeholder is shown meanwhile.
//!
//! [`Triplanar`] is the sample for programs and tests, `info.rs` describes its program.

mod info;
mod loader;
mod models;
mod pipelines;
mod renderer;
mod streamed;

pub use info::TriplanarArgs;
pub use renderer::Triplanar;
pub use streamed::Residency;
