//! The sample's pipelines as data, with the texts that their stages use.

use lvk::BlockLayout;

use super::renderer::FrameConstants;
use crate::pipelines::{SamplePipeline, SampleStage, shader};
use crate::rtx::RayStages;

pub(super) const INSTANCES: SampleStage = shader!("rtx_textures", "instances.comp");
pub(super) const RAYS: RayStages = RayStages {
    sample: "rtx_textures",
    names: ["rtx_textures: rays by pipeline", "rtx_textures: rays by query"],
    ray_gen: shader!("rtx_textures", "textures.rgen"),
    misses: &[shader!("rtx_textures", "sky.rmiss")],
    // In the order of `kPainted` and `kGlazed` in `shaders/rtx_textures/frame.glsl`.
    hits: &[shader!("rtx_textures", "painted.rchit"), shader!("rtx_textures", "glazed.rchit")],
    max_recursion: 1,
    query: shader!("rtx_textures", "textures.comp"),
    layouts: &[BlockLayout::buffer_reference::<FrameConstants>("Frame")],
};

/// Returns every pipeline of the sample.
pub(super) fn pipelines() -> Vec<SamplePipeline> {
    let instances = SamplePipeline {
        name: "rtx_textures: instances",
        stages: vec![INSTANCES],
        color: Vec::new(),
        depth: None,
    };
    [vec![instances], RAYS.pipelines()].concat()
}
