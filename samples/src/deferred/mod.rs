//! The `deferred` sample: deferred shading of a hall by hundreds of small lights. Surfaces are drawn once, into targets that
//! say what they are like, and each light then looks at the pixels that it reaches. In one pass, whose shaders read its own
//! targets, nothing but the picture leaves the tiles of a phone's GPU; where there is no such reading, passes follow each
//! other and sample what the ones before have drawn. Both pictures are the same.
//!
//! [`Deferred`] is the sample for programs and tests, `info.rs` describes its program.

mod config;
mod hall;
mod info;
mod pipelines;
mod renderer;
mod targets;

pub use config::{DeferredConfig, Passes, View};
pub use info::DeferredArgs;
pub use renderer::Deferred;
