//! The sample's pipelines as data, with the texts and formats that its passes use. All are made when the sample starts.

use lvk::{Format, ShaderStage};

use super::targets::{COMPOSITE_FORMAT, DEPTH_FORMAT, SURFACE_FORMAT};
use crate::pipelines::{SamplePipeline, SampleStage};
use crate::shaders::reflections as texts;

pub(super) const SKIN: SampleStage = stage(ShaderStage::Compute, texts::SKIN_COMP, "skin.comp");
pub(super) const LEAVES: SampleStage = stage(ShaderStage::Compute, texts::LEAVES_COMP, "leaves.comp");
pub(super) const FILTER: SampleStage = stage(ShaderStage::Compute, texts::FILTER_COMP, "filter.comp");
pub(super) const SMOOTH: SampleStage = stage(ShaderStage::Compute, texts::SMOOTH_COMP, "smooth.comp");
pub(super) const COMPOSITE: SampleStage =
    stage(ShaderStage::Compute, texts::COMPOSITE_COMP, "composite.comp");
pub(super) const RESOLVE: SampleStage = stage(ShaderStage::Compute, texts::RESOLVE_COMP, "resolve.comp");
pub(super) const OPAQUE_QUERY: SampleStage = stage(ShaderStage::Compute, texts::OPAQUE_COMP, "opaque.comp");
pub(super) const TRANSPARENT_QUERY: SampleStage =
    stage(ShaderStage::Compute, texts::TRANSPARENT_COMP, "transparent.comp");
pub(super) const SURFACE_VERTEX: SampleStage =
    stage(ShaderStage::Vertex, texts::SURFACE_VERT, "surface.vert");
pub(super) const OPAQUE_FRAGMENT: SampleStage =
    stage(ShaderStage::Fragment, texts::OPAQUE_FRAG, "opaque.frag");
pub(super) const TRANSPARENT_FRAGMENT: SampleStage =
    stage(ShaderStage::Fragment, texts::TRANSPARENT_FRAG, "transparent.frag");
pub(super) const BLEND_FRAGMENT: SampleStage = stage(ShaderStage::Fragment, texts::BLEND_FRAG, "blend.frag");
pub(super) const OPAQUE_RAYS: SampleStage = stage(ShaderStage::RayGen, texts::OPAQUE_RGEN, "opaque.rgen");
pub(super) const TRANSPARENT_RAYS: SampleStage =
    stage(ShaderStage::RayGen, texts::TRANSPARENT_RGEN, "transparent.rgen");
pub(super) const CLOSEST_MISS: SampleStage = stage(ShaderStage::Miss, texts::CLOSEST_RMISS, "closest.rmiss");
pub(super) const SHADOW_MISS: SampleStage = stage(ShaderStage::Miss, texts::SHADOW_RMISS, "shadow.rmiss");
pub(super) const CLOSEST_HIT: SampleStage =
    stage(ShaderStage::ClosestHit, texts::CLOSEST_RCHIT, "closest.rchit");
pub(super) const LEAF_ANY_HIT: SampleStage = stage(ShaderStage::AnyHit, texts::LEAF_RAHIT, "leaf.rahit");

/// Every pipeline of the sample.
#[must_use]
pub fn pipelines() -> Vec<SamplePipeline> {
    vec![
        compute("reflections: skinning", SKIN),
        compute("reflections: leaves", LEAVES),
        raster("reflections: opaque surfaces", OPAQUE_FRAGMENT, SURFACE_FORMAT, Some(DEPTH_FORMAT)),
        raster("reflections: transparent surfaces", TRANSPARENT_FRAGMENT, SURFACE_FORMAT, Some(DEPTH_FORMAT)),
        SamplePipeline {
            name: "reflections: rays by pipeline",
            stages: vec![OPAQUE_RAYS, TRANSPARENT_RAYS, CLOSEST_MISS, SHADOW_MISS, CLOSEST_HIT, LEAF_ANY_HIT],
            color: Vec::new(),
            depth: None,
        },
        compute("reflections: opaque rays by query", OPAQUE_QUERY),
        compute("reflections: transparent rays by query", TRANSPARENT_QUERY),
        compute("reflections: smoothing of shadows", SMOOTH),
        compute("reflections: filter", FILTER),
        compute("reflections: composite", COMPOSITE),
        raster("reflections: blend", BLEND_FRAGMENT, COMPOSITE_FORMAT, None),
        compute("reflections: resolve", RESOLVE),
    ]
}

fn raster(name: &'static str, fragment: SampleStage, color: Format, depth: Option<Format>) -> SamplePipeline {
    SamplePipeline { name, stages: vec![SURFACE_VERTEX, fragment], color: vec![color], depth }
}

fn compute(name: &'static str, stage: SampleStage) -> SamplePipeline {
    SamplePipeline { name, stages: vec![stage], color: Vec::new(), depth: None }
}

const fn stage(stage: ShaderStage, text: &'static str, name: &'static str) -> SampleStage {
    SampleStage { stage, text, defines: &[], name }
}
