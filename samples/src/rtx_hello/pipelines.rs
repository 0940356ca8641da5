//! The sample's pipelines as data, with the texts that its stages use.

use lvk::ShaderStage;

use crate::pipelines::{SamplePipeline, SampleStage};
use crate::rtx::RayStages;
use crate::shaders::rtx_hello as texts;

pub(super) const RAYS: RayStages = RayStages {
    sample: "rtx_hello",
    names: ["rtx_hello: rays by pipeline", "rtx_hello: rays by query"],
    ray_gen: stage(ShaderStage::RayGen, texts::HELLO_RGEN, "hello.rgen"),
    misses: &[stage(ShaderStage::Miss, texts::HELLO_RMISS, "hello.rmiss")],
    hits: &[stage(ShaderStage::ClosestHit, texts::HELLO_RCHIT, "hello.rchit")],
    max_recursion: 1,
    query: stage(ShaderStage::Compute, texts::HELLO_COMP, "hello.comp"),
};

/// Every pipeline of the sample.
#[must_use]
pub fn pipelines() -> Vec<SamplePipeline> {
    RAYS.pipelines()
}

const fn stage(stage: ShaderStage, text: &'static str, name: &'static str) -> SampleStage {
    SampleStage { stage, text, defines: &[], name }
}
