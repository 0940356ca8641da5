//! The sample's pipelines as data, with the texts that their stages use.

use crate::pipelines::{SamplePipeline, SampleStage};
use crate::raster::{RasterPipeline, fragment_stage, vertex_stage};
use crate::shaders::yuv as texts;

const PICTURE_STAGES: [SampleStage; 2] =
    [vertex_stage(texts::PICTURE_VERT, "picture.vert"), fragment_stage(texts::PICTURE_FRAG, "picture.frag")];
const PLANE_STAGES: [SampleStage; 2] =
    [vertex_stage(texts::PLANES_VERT, "planes.vert"), fragment_stage(texts::PLANES_FRAG, "planes.frag")];
/// The picture in colours.
pub(super) const PICTURE: RasterPipeline = RasterPipeline::flat("yuv", "yuv: picture", &PICTURE_STAGES);
/// Y, Cb and Cr as greys.
pub(super) const PLANES: RasterPipeline = RasterPipeline::flat("yuv", "yuv: planes", &PLANE_STAGES);

/// Every pipeline of the sample.
#[must_use]
pub fn pipelines() -> Vec<SamplePipeline> {
    vec![PICTURE.data(), PLANES.data()]
}
