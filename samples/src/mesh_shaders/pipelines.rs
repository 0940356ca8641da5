//! The sample's pipeline as data, with the texts that its stages use.

use crate::pipelines::{SampleStage, shader};
use crate::raster::RasterPipeline;

const STAGES: [SampleStage; 3] = [
    shader!("mesh_shaders", "meshlet.task"),
    shader!("mesh_shaders", "meshlet.mesh"),
    shader!("mesh_shaders", "meshlet.frag"),
];
pub(super) const MESHLETS: RasterPipeline =
    RasterPipeline::with_depth("mesh_shaders", "mesh_shaders: meshlets", &STAGES);
