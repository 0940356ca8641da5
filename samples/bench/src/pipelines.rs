//! Descriptions of the benchmarks' pipelines.

use lvk::ShaderStage;

use lvk_samples::pipelines::{SamplePipeline, SampleStage};
use lvk_samples::shaders::bench as texts;

/// Folder of the shaders.
pub(super) const SAMPLE: &str = "bench";

/// Returns every pipeline of the benchmarks.
#[must_use]
pub fn pipelines() -> Vec<SamplePipeline> {
    vec![
        tracing("bench: rays by pipeline", &[]),
        tracing("bench: rays by pipeline, built-in numbers", texts::BUILT_IN_NUMBERS),
        compute("bench: primary rays by query", &[]),
        compute("bench: shadow rays by query", texts::SHADOW_RAYS),
        compute("bench: bounce rays by query", texts::BOUNCE_RAYS),
    ]
}

fn tracing(name: &'static str, defines: &'static [(&'static str, &'static str)]) -> SamplePipeline {
    SamplePipeline { name, stages: stages(defines).to_vec(), color: Vec::new(), depth: None }
}

/// Returns the stages for primary, shadow and bounce rays: three ray generation shaders, two miss shaders, one closest-hit shader.
pub(super) fn stages(defines: &'static [(&'static str, &'static str)]) -> [SampleStage; 6] {
    let stage = |stage, text, name| SampleStage { stage, text, defines, name };
    [
        stage(ShaderStage::RayGen, texts::PRIMARY_RGEN, "primary.rgen"),
        stage(ShaderStage::RayGen, texts::SHADOW_RGEN, "shadow.rgen"),
        stage(ShaderStage::RayGen, texts::BOUNCE_RGEN, "bounce.rgen"),
        stage(ShaderStage::Miss, texts::PRIMARY_RMISS, "primary.rmiss"),
        stage(ShaderStage::Miss, texts::SHADOW_RMISS, "shadow.rmiss"),
        stage(ShaderStage::ClosestHit, texts::PRIMARY_RCHIT, "primary.rchit"),
    ]
}

fn compute(name: &'static str, defines: &'static [(&'static str, &'static str)]) -> SamplePipeline {
    SamplePipeline { name, stages: vec![query_stage(defines)], color: Vec::new(), depth: None }
}

/// Returns the compute stage that traces by ray query: primary rays, or shadow or bounce rays by `defines`.
pub(super) fn query_stage(defines: &'static [(&'static str, &'static str)]) -> SampleStage {
    SampleStage { stage: ShaderStage::Compute, text: texts::RAYS_COMP, defines, name: "rays.comp" }
}
