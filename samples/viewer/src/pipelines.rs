//! The sample's stages and pipelines as data.

use crate::hybrid::{DEPTH_FORMAT, TRIANGLE_FORMAT};
use crate::launch::RayStages;
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

/// Paths of the path tracer.
pub(crate) const PATHS: RayStages =
    RayStages { rays: stage!("path.rgen"), query: stage!("path.comp"), debug_name: "viewer paths" };
/// Paths of the real-time method.
pub(crate) const LIGHT: RayStages = RayStages {
    rays: stage!("visible_light.rgen"),
    query: stage!("visible_light.comp"),
    debug_name: "viewer light",
};
/// Light with ambient occlusion, of the real-time method.
pub(crate) const AMBIENT_OCCLUSION: RayStages = RayStages {
    rays: stage!("ambient_occlusion.rgen"),
    query: stage!("ambient_occlusion.comp"),
    debug_name: "viewer ambient occlusion",
};
/// The probe of the surfaces around the eye, for ambient light.
pub(crate) const AMBIENT_PROBE: RayStages = RayStages {
    rays: stage!("ambient_probe.rgen"),
    query: stage!("ambient_probe.comp"),
    debug_name: "viewer ambient probe",
};
pub(crate) const NEAREST_MISS: SampleStage = stage!("nearest.rmiss");
pub(crate) const NEAREST_HIT: SampleStage = stage!("nearest.rchit");
pub(crate) const CANDIDATE: SampleStage = stage!("candidate.rahit");
pub(crate) const DEFORM: SampleStage = stage!("deform.comp");
pub(crate) const CULL: SampleStage = stage!("cull.comp");
pub(crate) const DEPTH_PYRAMID: SampleStage = stage!("depth_pyramid.comp");
pub(crate) const VISIBILITY_VERTEX: SampleStage = stage!("visibility.vert");
pub(crate) const VISIBILITY_FRAGMENT: SampleStage = stage!("visibility.frag");
pub(crate) const TEMPORAL: SampleStage = stage!("temporal.comp");
pub(crate) const FILTER: SampleStage = stage!("filter.comp");
pub(crate) const ANTIALIAS: SampleStage = stage!("antialias.comp");
pub(crate) const RADIANCE_CACHE: SampleStage = stage!("radiance_cache.comp");
pub(crate) const STEPS: SampleStage = stage!("steps.comp");
pub(crate) const PRESENT: SampleStage = stage!("present.comp");

/// Returns every pipeline of the sample.
pub(crate) fn pipelines() -> Vec<SamplePipeline> {
    vec![
        SamplePipeline::new("viewer: paths by pipeline", &[PATHS.rays, NEAREST_MISS, NEAREST_HIT, CANDIDATE]),
        SamplePipeline::new("viewer: paths by query", &[PATHS.query]),
        SamplePipeline::new("viewer: morph targets and joints", &[DEFORM]),
        SamplePipeline::new("viewer: culling", &[CULL]),
        SamplePipeline::new("viewer: depth pyramid", &[DEPTH_PYRAMID]),
        SamplePipeline::raster(
            "viewer: visible triangles",
            &[VISIBILITY_VERTEX, VISIBILITY_FRAGMENT],
            &[TRIANGLE_FORMAT],
            Some(DEPTH_FORMAT),
        ),
        SamplePipeline::new("viewer: light by pipeline", &[LIGHT.rays, NEAREST_MISS, NEAREST_HIT, CANDIDATE]),
        SamplePipeline::new("viewer: light by query", &[LIGHT.query]),
        SamplePipeline::new(
            "viewer: ambient occlusion by pipeline",
            &[AMBIENT_OCCLUSION.rays, NEAREST_MISS, NEAREST_HIT, CANDIDATE],
        ),
        SamplePipeline::new("viewer: ambient occlusion by query", &[AMBIENT_OCCLUSION.query]),
        SamplePipeline::new(
            "viewer: ambient probe by pipeline",
            &[AMBIENT_PROBE.rays, NEAREST_MISS, NEAREST_HIT, CANDIDATE],
        ),
        SamplePipeline::new("viewer: ambient probe by query", &[AMBIENT_PROBE.query]),
        SamplePipeline::new("viewer: radiance cache", &[RADIANCE_CACHE]),
        SamplePipeline::new("viewer: means over time", &[TEMPORAL]),
        SamplePipeline::new("viewer: filter", &[FILTER]),
        SamplePipeline::new("viewer: antialiasing", &[ANTIALIAS]),
        SamplePipeline::new("viewer: steps of rays", &[STEPS]),
        SamplePipeline::new("viewer: picture", &[PRESENT]),
    ]
}
