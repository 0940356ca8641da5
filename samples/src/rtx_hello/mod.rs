//! The `rtx_hello` sample: first triangles by ray tracing. One bottom-level structure of one triangle, shown often by a
//! top-level one that is updated in every frame, by a ray tracing pipeline or by ray queries.
//!
//! [`RtxHello`] is the sample for programs and tests, [`run`] the one for the command line.

mod args;
mod instances;
mod pipelines;
mod renderer;
mod run;
mod switches;

pub use args::RtxHelloArgs;
pub use pipelines::pipelines;
pub use renderer::RtxHello;
pub use run::run;
pub use switches::{Following, RtxHelloSwitches};
