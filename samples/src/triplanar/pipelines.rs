//! The sample's pipeline as data, with the texts that its stages use.

use crate::pipelines::{SampleStage, shader};
use crate::raster::RasterPipeline;

const STAGES: [SampleStage; 2] = [shader!("triplanar", "body.vert"), shader!("triplanar", "body.frag")];
pub(super) const MODELS: RasterPipeline =
    RasterPipeline::with_depth("triplanar", "triplanar: bodies", &STAGES);
