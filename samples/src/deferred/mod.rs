//! The `deferred` sample: deferred shading of a hall by hundreds of small lights. Surfaces are drawn once, into targets that
//! say what they are like, and each light then looks at the pixels that it reaches. In one pass, whose shaders read its own
//! targets, nothing but the picture leaves the tiles of a phone's GPU; where there is no such reading, passes follow each
//! other and sample what the ones before have drawn. Both pictures are the same.
//!
//! [`Deferred`] is the sample for programs and tests, [`run`] the one for the command line.

mod args;
mod config;
mod hall;
mod pipelines;
mod renderer;
mod run;
mod targets;

pub use args::DeferredArgs;
pub use config::{DeferredConfig, Passes, View};
pub use pipelines::pipelines;
pub use renderer::Deferred;
pub use run::run;
