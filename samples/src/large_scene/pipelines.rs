//! The sample's pipelines as data, with the texts that their stages use.

use lvk::ShaderStage;

use crate::pipelines::{SamplePipeline, SampleStage};
use crate::rtx::RayStages;
use crate::shaders::large_scene as texts;

/// Both ways to trace.
pub(super) const RAYS: RayStages = RayStages {
    sample: "large_scene",
    names: ["large_scene: rays by pipeline", "large_scene: rays by query"],
    ray_gen: stage(ShaderStage::RayGen, texts::PICTURE_RGEN, "picture.rgen"),
    // In the order of `kNearest` and `kOpen` in `shaders/large_scene/picture.rgen.glsl`.
    misses: &[
        stage(ShaderStage::Miss, texts::NEAREST_RMISS, "nearest.rmiss"),
        stage(ShaderStage::Miss, texts::OPEN_RMISS, "open.rmiss"),
    ],
    hits: &[stage(ShaderStage::ClosestHit, texts::NEAREST_RCHIT, "nearest.rchit")],
    max_recursion: 1,
    query: stage(ShaderStage::Compute, texts::PICTURE_COMP, "picture.comp"),
};

/// Every pipeline of the sample.
#[must_use]
pub fn pipelines() -> Vec<SamplePipeline> {
    RAYS.pipelines()
}

const fn stage(stage: ShaderStage, text: &'static str, name: &'static str) -> SampleStage {
    SampleStage { stage, text, defines: &[], name }
}
