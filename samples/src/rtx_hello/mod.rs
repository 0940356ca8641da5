//! The `rtx_hello` sample: first triangles by ray tracing. One bottom-level structure of one triangle, shown often by a
//! top-level one that is updated in every frame, by a ray tracing pipeline or by ray queries.
//!
//! [`RtxHello`] is the sample for programs and tests, `info.rs` describes its program.

mod info;
mod instances;
mod panel;
mod pipelines;
mod renderer;

pub use panel::{RtxHelloSettings, TlasUpdate};
pub use renderer::RtxHello;
