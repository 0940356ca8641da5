//! The sample's pipeline as data, with the texts that its stages use.

use crate::pipelines::{SamplePipeline, SampleStage};
use crate::raster::{RasterPipeline, fragment_stage, vertex_stage};
use crate::shaders::hello_triangle as texts;

const STAGES: [SampleStage; 2] = [
    vertex_stage(texts::TRIANGLE_VERT, "triangle.vert"),
    fragment_stage(texts::TRIANGLE_FRAG, "triangle.frag"),
];
pub(super) const TRIANGLE: RasterPipeline =
    RasterPipeline::flat("hello_triangle", "hello_triangle: triangle", &STAGES);

/// Every pipeline of the sample.
#[must_use]
pub fn pipelines() -> Vec<SamplePipeline> {
    vec![TRIANGLE.data()]
}
