//! The sample's pipelines as data, with the texts and formats that its passes use.

use lvk::ShaderStage;

use super::geometry_pass::GBuffer;
use crate::pipelines::{SamplePipeline, SampleStage};
use crate::shaders::hybrid as texts;

type Defines = &'static [(&'static str, &'static str)];

/// Every pipeline of the sample.
#[must_use]
pub fn pipelines() -> Vec<SamplePipeline> {
    vec![
        geometry(),
        tracing("hybrid: rays by pipeline", texts::WITH_GBUFFER),
        tracing("stand-alone: rays by pipeline", &[]),
        compute("hybrid: rays by query", texts::WITH_GBUFFER),
        compute("stand-alone: rays by query", &[]),
    ]
}

fn geometry() -> SamplePipeline {
    SamplePipeline {
        name: "hybrid: geometry pass",
        stages: vec![
            stage(ShaderStage::Vertex, texts::GEOMETRY_VERT, &[], "geometry.vert"),
            stage(ShaderStage::Fragment, texts::GEOMETRY_FRAG, &[], "geometry.frag"),
        ],
        color: GBuffer::COLOR.to_vec(),
        depth: Some(GBuffer::DEPTH),
    }
}

fn tracing(name: &'static str, defines: Defines) -> SamplePipeline {
    let stages = vec![
        stage(ShaderStage::RayGen, texts::RENDER_RGEN, defines, "render.rgen"),
        stage(ShaderStage::Miss, texts::CLOSEST_RMISS, &[], "closest.rmiss"),
        stage(ShaderStage::Miss, texts::SHADOW_RMISS, &[], "shadow.rmiss"),
        stage(ShaderStage::ClosestHit, texts::CLOSEST_RCHIT, &[], "closest.rchit"),
    ];
    SamplePipeline { name, stages, color: Vec::new(), depth: None }
}

fn compute(name: &'static str, defines: Defines) -> SamplePipeline {
    let stages = vec![stage(ShaderStage::Compute, texts::RENDER_COMP, defines, "render.comp")];
    SamplePipeline { name, stages, color: Vec::new(), depth: None }
}

fn stage(stage: ShaderStage, text: &'static str, defines: Defines, name: &'static str) -> SampleStage {
    SampleStage { stage, text, defines, name }
}
