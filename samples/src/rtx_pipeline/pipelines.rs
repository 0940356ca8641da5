//! The sample's pipelines as data, with the texts that their stages use.

use lvk::BlockLayout;

use super::RtxPipelineConfig;
use super::renderer::FrameConstants;
use crate::pipelines::{SamplePipeline, shader};
use crate::rtx::RayStages;

/// Both ways to trace, with the deepest recursion there is.
pub(super) const RAYS: RayStages = RayStages {
    sample: "rtx_pipeline",
    names: ["rtx_pipeline: rays by pipeline", "rtx_pipeline: rays by query"],
    ray_gen: shader!("rtx_pipeline", "picture.rgen"),
    // In the order of `kSky` and `kLight` in `shaders/rtx_pipeline/radiance.glsl`.
    misses: &[shader!("rtx_pipeline", "sky.rmiss"), shader!("rtx_pipeline", "light.rmiss")],
    // In the order of `kSolid` and `kGlass` there.
    hits: &[shader!("rtx_pipeline", "solid.rchit"), shader!("rtx_pipeline", "glass.rchit")],
    max_recursion: RtxPipelineConfig::MAX_RECURSION,
    query: shader!("rtx_pipeline", "picture.comp"),
    layouts: &[BlockLayout::buffer_reference::<FrameConstants>("Frame")],
};

/// Returns every pipeline of the sample.
pub(super) fn pipelines() -> Vec<SamplePipeline> {
    RAYS.pipelines()
}
