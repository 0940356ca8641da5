//! The `triplanar` sample: bodies without texture coordinates, whose textures are projected along three axes; they are unloaded
//! and loaded again while frames are on their way, and a placeholder is shown meanwhile.
//!
//! [`Triplanar`] is the sample for programs and tests, [`run`] the one for the command line.

mod args;
mod loader;
mod models;
mod pipelines;
mod renderer;
mod run;
mod streamed;

pub use args::TriplanarArgs;
pub use pipelines::pipelines;
pub use renderer::Triplanar;
pub use run::run;
pub use streamed::Residency;
