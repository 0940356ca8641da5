//! The stages of the sample's pipelines, as its passes use them and as data for those who compile them only.

use lvk::{Context, Format, Holder, ShaderModuleHandle, ShaderStage};

use super::targets::Targets;
use crate::pipelines::{SamplePipeline, SampleStage};
use crate::shaders::hybrid_oit as texts;

pub(super) const ANIMATE: SampleStage = stage(ShaderStage::Compute, texts::ANIMATE_COMP, "animate.comp");
pub(super) const COMPOSITE: SampleStage =
    stage(ShaderStage::Compute, texts::COMPOSITE_COMP, "composite.comp");
pub(super) const SOLID_DEPTH: [SampleStage; 1] = [SOLID_VERT];
pub(super) const BALL_DEPTH: [SampleStage; 2] =
    [SPHERE_VERT, stage(ShaderStage::Fragment, texts::BALL_DEPTH_FRAG, "ball_depth.frag")];
pub(super) const SOLID: [SampleStage; 2] =
    [SOLID_VERT, stage(ShaderStage::Fragment, texts::SOLID_FRAG, "solid.frag")];
pub(super) const BALL: [SampleStage; 2] =
    [SPHERE_VERT, stage(ShaderStage::Fragment, texts::BALL_FRAG, "ball.frag")];
pub(super) const GLASS: [SampleStage; 2] =
    [SPHERE_VERT, stage(ShaderStage::Fragment, texts::GLASS_FRAG, "glass.frag")];
pub(super) const SHADOW_QUERY: SampleStage = stage(ShaderStage::Compute, texts::SHADOW_COMP, "shadow.comp");
/// Ray generation, miss, then the hit group of glass: intersection and any-hit.
pub(super) const SHADOW_TRACING: [SampleStage; 4] = [
    stage(ShaderStage::RayGen, texts::SHADOW_RGEN, "shadow.rgen"),
    stage(ShaderStage::Miss, texts::SHADOW_RMISS, "shadow.rmiss"),
    stage(ShaderStage::Intersection, texts::SPHERE_RINT, "sphere.rint"),
    stage(ShaderStage::AnyHit, texts::GLASS_RAHIT, "glass.rahit"),
];

const SOLID_VERT: SampleStage = stage(ShaderStage::Vertex, texts::SOLID_VERT, "solid.vert");
const SPHERE_VERT: SampleStage = stage(ShaderStage::Vertex, texts::SPHERE_VERT, "sphere.vert");

/// Every pipeline of the sample.
#[must_use]
pub fn pipelines() -> Vec<SamplePipeline> {
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

const fn stage(stage: ShaderStage, text: &'static str, name: &'static str) -> SampleStage {
    SampleStage { stage, text, defines: &[], name }
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
