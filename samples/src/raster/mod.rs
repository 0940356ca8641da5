//! Pipelines of samples that only rasterise, as data.

mod pipeline;

pub use pipeline::RasterPipeline;
