//! The sample's pipelines as data, with the texts that their stages use.

use crate::app::render_target::RenderTarget;
use lvk::{CompareOp, DepthTest};

use super::shadow::Shadow;
use crate::pipelines::{SamplePipeline, SampleStage, shader};
use crate::raster::RasterPipeline;

/// Folder of the texts in `shaders/`.
pub(super) const SAMPLE: &str = "sponza";

/// Culls draws.
pub(super) const CULL: SampleStage = shader!("sponza", "cull.comp");

const SHADOW_STAGES: [SampleStage; 2] = [shader!("sponza", "shadow.vert"), shader!("sponza", "shadow.frag")];
const SURFACE_STAGES: [SampleStage; 2] =
    [shader!("sponza", "surface.vert"), shader!("sponza", "surface.frag")];
const SKY_STAGES: [SampleStage; 2] = [shader!("sponza", "sky.vert"), shader!("sponza", "sky.frag")];

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
/// Pipeline of the surfaces, of four samples a pixel.
pub(super) const SURFACES: RasterPipeline =
    RasterPipeline::with_depth(SAMPLE, "sponza: surfaces", &SURFACE_STAGES);
/// The sky where no surface hides it, of four samples a pixel.
pub(super) const SKY: RasterPipeline = RasterPipeline {
    depth: Some(DepthTest { compare: CompareOp::GreaterOrEqual, write: false, ..RenderTarget::NEAREST }),
    ..RasterPipeline::with_depth(SAMPLE, "sponza: sky", &SKY_STAGES)
};

/// Returns every pipeline of the sample.
pub(super) fn pipelines() -> Vec<SamplePipeline> {
    let cull = SamplePipeline { name: "sponza: culling", stages: vec![CULL], color: Vec::new(), depth: None };
    vec![cull, SHADOW.data(), SURFACES.data(), SKY.data()]
}
