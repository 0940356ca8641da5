//! The stages of the sample's pipelines, for its passes and as data.

use lvk::{Context, Format, Holder, ShaderModuleHandle};

use super::targets::Targets;
use crate::pipelines::{SamplePipeline, SampleStage, shader};

pub(super) const ANIMATE: SampleStage = shader!("hybrid_oit", "animate.comp");
pub(super) const COMPOSITE: SampleStage = shader!("hybrid_oit", "composite.comp");
pub(super) const SOLID_DEPTH: [SampleStage; 1] = [SOLID_VERT];
pub(super) const BALL_DEPTH: [SampleStage; 2] = [SPHERE_VERT, shader!("hybrid_oit", "ball_depth.frag")];
pub(super) const SOLID: [SampleStage; 2] = [SOLID_VERT, shader!("hybrid_oit", "solid.frag")];
pub(super) const BALL: [SampleStage; 2] = [SPHERE_VERT, shader!("hybrid_oit", "ball.frag")];
pub(super) const GLASS: [SampleStage; 2] = [SPHERE_VERT, shader!("hybrid_oit", "glass.frag")];
pub(super) const SHADOW_QUERY: SampleStage = shader!("hybrid_oit", "shadow.comp");
/// Ray generation, miss, then the hit group of glass: intersection and any-hit.
pub(super) const SHADOW_TRACING: [SampleStage; 4] = [
    shader!("hybrid_oit", "shadow.rgen"),
    shader!("hybrid_oit", "shadow.rmiss"),
    shader!("hybrid_oit", "sphere.rint"),
    shader!("hybrid_oit", "glass.rahit"),
];

const SOLID_VERT: SampleStage = shader!("hybrid_oit", "solid.vert");
const SPHERE_VERT: SampleStage = shader!("hybrid_oit", "sphere.vert");

/// Returns every pipeline of the sample.
pub(super) fn pipelines() -> Vec<SamplePipeline> {
    let gbuffer = &Targets::GBUFFER;
    vec![
        compute("oit: placing the spheres", ANIMATE),
        raster("oit: depth of solids", &SOLID_DEPTH, &[]),
        raster("oit: depth of balls", &BALL_DEPTH, &[]),
        raster("oit: g-buffer of solids", &SOLID, gbuffer),
        raster("oit: g-buffer of balls", &BALL, gbuffer),
        raster("oit: lists of glass", &GLASS, &[]),
        tracing("oit: shadows by pipeline"),
        compute("oit: shadows by query", SHADOW_QUERY),
        compute("oit: picture", COMPOSITE),
    ]
}

/// Compiles a stage.
pub(super) fn module(ctx: &Context, stage: &SampleStage) -> lvk::Result<Holder<ShaderModuleHandle>> {
    stage.create(ctx, "hybrid_oit")
}

fn compute(name: &'static str, stage: SampleStage) -> SamplePipeline {
    SamplePipeline { name, stages: vec![stage], color: Vec::new(), depth: None }
}

fn raster(name: &'static str, stages: &[SampleStage], color: &[Format]) -> SamplePipeline {
    SamplePipeline { name, stages: stages.to_vec(), color: color.to_vec(), depth: Some(Targets::DEPTH) }
}

fn tracing(name: &'static str) -> SamplePipeline {
    SamplePipeline { name, stages: SHADOW_TRACING.to_vec(), color: Vec::new(), depth: None }
}
