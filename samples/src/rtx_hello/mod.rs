//! The `rtx_hello` sample: first triangles by ray tracing. One bottom-level structure of one triangle, shown often by a
//! top-level one that is updated in every frame, by a ray tracing pipeline or by ray queries.
//!
//! [`RtxHello`] is the sample for programs and tests, `info.rs` describes its program.

mod info;
mod instances;
mod pipelines;
mod renderer;
mod switches;

pub use renderer::RtxHello;
pub use switches::{Following, RtxHelloSwitches};
