//! What the samples share that only rasterise: a picture to draw on, pipelines as data, why a sample cannot render, and
//! what their programs say.

mod canvas;
mod error;
mod pipeline;
mod summary;

pub use canvas::Canvas;
pub(crate) use canvas::check_size;
pub use error::RasterError;
pub use pipeline::{RasterPipeline, fragment_stage, vertex_stage};
pub use summary::summary;
