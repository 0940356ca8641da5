//! The sample's stages and pipelines as data.

use lvk_samples::pipelines::{SamplePipeline, SampleStage};

/// Name of the sample, and of its folder of shaders.
pub(crate) const SAMPLE: &str = "viewer";

/// The stage whose GLSL is `shaders/viewer/<name>.glsl`.
macro_rules! stage {
    ($name:literal) => {
        SampleStage::from_glsl(
            include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/../../shaders/viewer/", $name, ".glsl")),
            $name,
        )
    };
}

pub(crate) const PATH_RAYS: SampleStage = stage!("path.rgen");
pub(crate) const PATH_QUERY: SampleStage = stage!("path.comp");
pub(crate) const NEAREST_MISS: SampleStage = stage!("nearest.rmiss");
pub(crate) const NEAREST_HIT: SampleStage = stage!("nearest.rchit");
pub(crate) const CANDIDATE: SampleStage = stage!("candidate.rahit");
pub(crate) const PRESENT: SampleStage = stage!("present.comp");

/// Returns every pipeline of the sample.
pub(crate) fn pipelines() -> Vec<SamplePipeline> {
    vec![
        SamplePipeline::new("viewer: paths by pipeline", &[PATH_RAYS, NEAREST_MISS, NEAREST_HIT, CANDIDATE]),
        SamplePipeline::new("viewer: paths by query", &[PATH_QUERY]),
        SamplePipeline::new("viewer: picture", &[PRESENT]),
    ]
}
