//! The sample's pipelines as data, with the texts that their stages use.

use lvk::{CompareOp, DepthTest, ShaderStage};

use super::shadow::Shadow;
use crate::pipelines::{SamplePipeline, SampleStage};
use crate::raster::{Canvas, RasterPipeline, fragment_stage, vertex_stage};
use crate::shaders::sponza as texts;

/// Folder of the texts in `shaders/`.
pub(super) const SAMPLE: &str = "sponza";

/// Culls draws.
pub(super) const CULL: SampleStage =
    SampleStage { stage: ShaderStage::Compute, text: texts::CULL_COMP, defines: &[], name: "cull.comp" };

const SHADOW_STAGES: [SampleStage; 2] =
    [vertex_stage(texts::SHADOW_VERT, "shadow.vert"), fragment_stage(texts::SHADOW_FRAG, "shadow.frag")];
const SURFACE_STAGES: [SampleStage; 2] =
    [vertex_stage(texts::SURFACE_VERT, "surface.vert"), fragment_stage(texts::SURFACE_FRAG, "surface.frag")];
const SKY_STAGES: [SampleStage; 2] =
    [vertex_stage(texts::SKY_VERT, "sky.vert"), fragment_stage(texts::SKY_FRAG, "sky.frag")];

/// Depth as the sun sees it.
pub(super) const SHADOW: RasterPipeline = RasterPipeline {
    sample: SAMPLE,
    name: "sponza: shadow map",
    stages: &SHADOW_STAGES,
    color: &[],
    depth: Some(DepthTest { format: Shadow::FORMAT, compare: CompareOp::Less, write: true }),
    samples: 1,
    view_mask: 0,
};
/// Of four samples a pixel.
pub(super) const SURFACES: RasterPipeline =
    RasterPipeline::with_depth(SAMPLE, "sponza: surfaces", &SURFACE_STAGES);
/// What no surface hides, of four samples a pixel.
pub(super) const SKY: RasterPipeline = RasterPipeline {
    depth: Some(DepthTest { compare: CompareOp::GreaterOrEqual, write: false, ..Canvas::NEAREST }),
    ..RasterPipeline::with_depth(SAMPLE, "sponza: sky", &SKY_STAGES)
};

/// Every pipeline of the sample.
#[must_use]
pub fn pipelines() -> Vec<SamplePipeline> {
    let cull = SamplePipeline { name: "sponza: culling", stages: vec![CULL], color: Vec::new(), depth: None };
    vec![cull, SHADOW.data(), SURFACES.data(), SKY.data()]
}
