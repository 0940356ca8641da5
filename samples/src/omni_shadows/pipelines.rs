//! The sample's pipelines as data, with the texts and formats that its passes use.

use lvk::{CompareOp, DepthTest, Format};

use crate::pipelines::{SamplePipeline, SampleStage};
use crate::raster::{Canvas, RasterPipeline, fragment_stage, vertex_stage};
use crate::shaders::omni_shadows as texts;

/// Folder of the texts in `shaders/`.
const SAMPLE: &str = "omni_shadows";
/// Of the cube map.
pub(super) const CUBE: Format = Format::D32Float;
/// A bit for each face of it.
pub(super) const ALL_FACES: u32 = 0b11_1111;

const CASTER: SampleStage = vertex_stage(texts::CASTER_VERT, "caster.vert");
const CASTERS: [SampleStage; 1] = [CASTER];
const CASTERS_MULTIVIEW: [SampleStage; 1] = [SampleStage { defines: texts::MULTIVIEW, ..CASTER }];
const SURFACE: [SampleStage; 2] =
    [vertex_stage(texts::SURFACE_VERT, "surface.vert"), fragment_stage(texts::SURFACE_FRAG, "surface.frag")];
const CUBE_VIEW: [SampleStage; 2] = [
    vertex_stage(texts::CUBE_VIEW_VERT, "cube_view.vert"),
    fragment_stage(texts::CUBE_VIEW_FRAG, "cube_view.frag"),
];

/// What throws shadows, to one face of the cube map.
pub(super) const FACE: RasterPipeline = RasterPipeline {
    sample: SAMPLE,
    name: "omni_shadows: face of the cube",
    stages: &CASTERS,
    color: &[],
    depth: Some(DepthTest { format: CUBE, compare: CompareOp::Greater, write: true }),
    samples: 1,
    view_mask: 0,
};
/// The same to all faces at once.
pub(super) const FACES: RasterPipeline = RasterPipeline {
    name: "omni_shadows: faces of the cube",
    stages: &CASTERS_MULTIVIEW,
    view_mask: ALL_FACES,
    ..FACE
};
/// Everything in the light of the lamp.
pub(super) const SURFACES: RasterPipeline =
    RasterPipeline::with_depth(SAMPLE, "omni_shadows: surfaces", &SURFACE);
/// The cube map unfolded, over the picture.
pub(super) const UNFOLDED: RasterPipeline = RasterPipeline {
    depth: Some(DepthTest { format: Canvas::DEPTH, compare: CompareOp::Always, write: false }),
    ..RasterPipeline::flat(SAMPLE, "omni_shadows: unfolded cube", &CUBE_VIEW)
};

/// Every pipeline of the sample.
#[must_use]
pub fn pipelines() -> Vec<SamplePipeline> {
    [FACE, FACES, SURFACES, UNFOLDED].map(|pipeline| pipeline.data()).to_vec()
}
