//! The sample's pipelines as data, with the texts that their stages use.

use lvk::ShaderStage;

use crate::pipelines::{SamplePipeline, SampleStage};
use crate::rtx::RayStages;
use crate::shaders::rtx_textures as texts;

pub(super) const INSTANCES: SampleStage =
    stage(ShaderStage::Compute, texts::INSTANCES_COMP, "instances.comp");
pub(super) const RAYS: RayStages = RayStages {
    sample: "rtx_textures",
    names: ["rtx_textures: rays by pipeline", "rtx_textures: rays by query"],
    ray_gen: stage(ShaderStage::RayGen, texts::TEXTURES_RGEN, "textures.rgen"),
    misses: &[stage(ShaderStage::Miss, texts::SKY_RMISS, "sky.rmiss")],
    // In the order of `kPainted` and `kGlazed` in `shaders/rtx_textures/frame.glsl`.
    hits: &[
        stage(ShaderStage::ClosestHit, texts::PAINTED_RCHIT, "painted.rchit"),
        stage(ShaderStage::ClosestHit, texts::GLAZED_RCHIT, "glazed.rchit"),
    ],
    max_recursion: 1,
    query: stage(ShaderStage::Compute, texts::TEXTURES_COMP, "textures.comp"),
};

/// Every pipeline of the sample.
#[must_use]
pub fn pipelines() -> Vec<SamplePipeline> {
    let instances = SamplePipeline {
        name: "rtx_textures: instances",
        stages: vec![INSTANCES],
        color: Vec::new(),
        depth: None,
    };
    [vec![instances], RAYS.pipelines()].concat()
}

const fn stage(stage: ShaderStage, text: &'static str, name: &'static str) -> SampleStage {
    SampleStage { stage, text, defines: &[], name }
}
