//! The `sponza` sample: a large textured scene by rasterisation. A compute shader culls its many draws against the frustum of
//! the camera and of the sun and writes what is left, and how many, for indirect draws that take their number from there; the sun
//! casts shadows by a map with a comparison sampler and percentage-closer filtering.
//!
//! [`Sponza`] is the sample for programs and tests, `info.rs` describes its program.

mod config;
mod culling;
mod draws;
mod frame;
mod frustum;
mod info;
mod pipelines;
mod renderer;
mod shadow;
mod sun_view;

pub use config::{DrawPath, SponzaConfig};
pub use draws::Draw;
pub use frustum::Frustum;
pub use info::SponzaArgs;
pub use renderer::Sponza;
