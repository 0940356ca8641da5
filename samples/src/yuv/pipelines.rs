//! The sample's pipelines as data, with the texts that their stages use.

use crate::pipelines::{SampleStage, shader};
use crate::raster::RasterPipeline;

const PICTURE_STAGES: [SampleStage; 2] = [shader!("yuv", "picture.vert"), shader!("yuv", "picture.frag")];
const PLANE_STAGES: [SampleStage; 2] = [shader!("yuv", "planes.vert"), shader!("yuv", "planes.frag")];
/// The picture in colours.
pub(super) const PICTURE: RasterPipeline = RasterPipeline::flat("yuv", "yuv: picture", &PICTURE_STAGES);
/// Y, Cb and Cr as greys.
pub(super) const PLANES: RasterPipeline = RasterPipeline::flat("yuv", "yuv: planes", &PLANE_STAGES);
