//! The sample's pipelines as data, with the texts and formats that its passes use. All are made when the sample starts.

use lvk::Format;

use super::targets::{COMPOSITE_FORMAT, DEPTH_FORMAT, SURFACE_FORMAT};
use crate::pipelines::{SamplePipeline, SampleStage, shader};

pub(super) const SKIN: SampleStage = shader!("reflections", "skin.comp");
pub(super) const LEAVES: SampleStage = shader!("reflections", "leaves.comp");
pub(super) const FILTER: SampleStage = shader!("reflections", "filter.comp");
pub(super) const SMOOTH: SampleStage = shader!("reflections", "smooth.comp");
pub(super) const COMPOSITE: SampleStage = shader!("reflections", "composite.comp");
pub(super) const RESOLVE: SampleStage = shader!("reflections", "resolve.comp");
pub(super) const OPAQUE_QUERY: SampleStage = shader!("reflections", "opaque.comp");
pub(super) const TRANSPARENT_QUERY: SampleStage = shader!("reflections", "transparent.comp");
pub(super) const SURFACE_VERTEX: SampleStage = shader!("reflections", "surface.vert");
pub(super) const OPAQUE_FRAGMENT: SampleStage = shader!("reflections", "opaque.frag");
pub(super) const TRANSPARENT_FRAGMENT: SampleStage = shader!("reflections", "transparent.frag");
pub(super) const BLEND_FRAGMENT: SampleStage = shader!("reflections", "blend.frag");
pub(super) const OPAQUE_RAYS: SampleStage = shader!("reflections", "opaque.rgen");
pub(super) const TRANSPARENT_RAYS: SampleStage = shader!("reflections", "transparent.rgen");
pub(super) const CLOSEST_MISS: SampleStage = shader!("reflections", "closest.rmiss");
pub(super) const CLOSEST_HIT: SampleStage = shader!("reflections", "closest.rchit");
pub(super) const LEAF_ANY_HIT: SampleStage = shader!("reflections", "leaf.rahit");

/// Returns every pipeline of the sample.
pub(super) fn pipelines() -> Vec<SamplePipeline> {
    vec![
        compute("reflections: skinning", SKIN),
        compute("reflections: leaves", LEAVES),
        raster("reflections: opaque surfaces", OPAQUE_FRAGMENT, SURFACE_FORMAT, Some(DEPTH_FORMAT)),
        raster("reflections: transparent surfaces", TRANSPARENT_FRAGMENT, SURFACE_FORMAT, Some(DEPTH_FORMAT)),
        SamplePipeline {
            name: "reflections: rays by pipeline",
            stages: vec![OPAQUE_RAYS, TRANSPARENT_RAYS, CLOSEST_MISS, CLOSEST_HIT, LEAF_ANY_HIT],
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
