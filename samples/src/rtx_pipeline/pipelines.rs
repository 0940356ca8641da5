//! The sample's pipelines as data, with the texts that their stages use.

use lvk::ShaderStage;

use super::RtxPipelineConfig;
use crate::pipelines::{SamplePipeline, SampleStage};
use crate::rtx::RayStages;
use crate::shaders::rtx_pipeline as texts;

/// Both ways to trace, with the deepest recursion there is.
pub(super) const RAYS: RayStages = RayStages {
    sample: "rtx_pipeline",
    names: ["rtx_pipeline: rays by pipeline", "rtx_pipeline: rays by query"],
    ray_gen: stage(ShaderStage::RayGen, texts::PICTURE_RGEN, "picture.rgen"),
    // In the order of `kSky` and `kLight` in `shaders/rtx_pipeline/radiance.glsl`.
    misses: &[
        stage(ShaderStage::Miss, texts::SKY_RMISS, "sky.rmiss"),
        stage(ShaderStage::Miss, texts::LIGHT_RMISS, "light.rmiss"),
    ],
    // In the order of `kSolid` and `kGlass` there.
    hits: &[
        stage(ShaderStage::ClosestHit, texts::SOLID_RCHIT, "solid.rchit"),
        stage(ShaderStage::ClosestHit, texts::GLASS_RCHIT, "glass.rchit"),
    ],
    max_recursion: RtxPipelineConfig::MAX_RECURSION,
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
