//! The sample's pipeline as data, with the texts that its stages use.

use lvk::ShaderStage;

use crate::pipelines::{SamplePipeline, SampleStage};
use crate::raster::{RasterPipeline, fragment_stage};
use crate::shaders::mesh_shaders as texts;

const STAGES: [SampleStage; 3] = [
    stage(ShaderStage::Task, texts::MESHLET_TASK, "meshlet.task"),
    stage(ShaderStage::Mesh, texts::MESHLET_MESH, "meshlet.mesh"),
    fragment_stage(texts::MESHLET_FRAG, "meshlet.frag"),
];
pub(super) const MESHLETS: RasterPipeline =
    RasterPipeline::with_depth("mesh_shaders", "mesh_shaders: meshlets", &STAGES);

/// Every pipeline of the sample.
#[must_use]
pub fn pipelines() -> Vec<SamplePipeline> {
    vec![MESHLETS.data()]
}

const fn stage(stage: ShaderStage, text: &'static str, name: &'static str) -> SampleStage {
    SampleStage { stage, text, defines: &[], name }
}
