//! The sample's pipelines as data, with the texts and formats that its passes use.

use lvk::Format;

use super::targets::{ALBEDO, DEPTH, NUMBERS};
use crate::hybrid::RayPath;
use crate::pipelines::{SamplePipeline, SampleStage, shader};

/// Folder of the texts in `shaders/`.
pub(super) const SAMPLE: &str = "rtx_ao";

pub(super) const SURFACE_VERTEX: SampleStage = shader!("rtx_ao", "surface.vert");
const LIT_FRAGMENT: SampleStage = shader!("rtx_ao", "surface.frag");
const TARGETS_FRAGMENT: SampleStage = SampleStage { defines: &[("RTX_AO_TARGETS", "1")], ..LIT_FRAGMENT };
pub(super) const LIGHT_RAYS: SampleStage = shader!("rtx_ao", "light.rgen");
pub(super) const OPEN_MISS: SampleStage = shader!("rtx_ao", "open.rmiss");
pub(super) const ACCUMULATE: SampleStage = shader!("rtx_ao", "accumulate.comp");

/// The fragment stage of a path, and the formats that it draws to.
pub(super) fn surface_fragment(path: RayPath) -> (SampleStage, Vec<Format>) {
    match path {
        RayPath::Pipeline => (TARGETS_FRAGMENT, vec![ALBEDO, NUMBERS, NUMBERS, NUMBERS]),
        RayPath::Query => (LIT_FRAGMENT, vec![ALBEDO, NUMBERS]),
    }
}

/// Returns every pipeline of the sample but the one of depth alone, which has no fragment stage.
pub(super) fn pipelines() -> Vec<SamplePipeline> {
    let raster = |name, path| {
        let (fragment, color) = surface_fragment(path);
        SamplePipeline { name, stages: vec![SURFACE_VERTEX, fragment], color, depth: Some(DEPTH) }
    };
    let other = |name, stages| SamplePipeline { name, stages, color: Vec::new(), depth: None };
    vec![
        raster("rtx_ao: surfaces and rays by query", RayPath::Query),
        raster("rtx_ao: surfaces", RayPath::Pipeline),
        other("rtx_ao: rays by pipeline", vec![LIGHT_RAYS, OPEN_MISS]),
        other("rtx_ao: cache", vec![ACCUMULATE]),
    ]
}
