//! The sample's pipeline as data, with the texts that its stages use.

use crate::pipelines::{SamplePipeline, SampleStage};
use crate::raster::{RasterPipeline, fragment_stage, vertex_stage};
use crate::shaders::triplanar as texts;

const STAGES: [SampleStage; 2] =
    [vertex_stage(texts::BODY_VERT, "body.vert"), fragment_stage(texts::BODY_FRAG, "body.frag")];
pub(super) const BODIES: RasterPipeline =
    RasterPipeline::with_depth("triplanar", "triplanar: bodies", &STAGES);

/// Every pipeline of the sample.
#[must_use]
pub fn pipelines() -> Vec<SamplePipeline> {
    vec![BODIES.data()]
}
