//! The sample's pipelines as data, with the texts and formats that its passes use.

use crate::app::render_target::RenderTarget;
use lvk::{CompareOp, DepthTest, Format};

use crate::pipelines::{SampleStage, shader};
use crate::raster::RasterPipeline;

/// Folder of the texts in `shaders/`.
const SAMPLE: &str = "omni_shadows";
/// Format of the cube map.
pub(super) const CUBE: Format = Format::D32Float;
/// A bit for each face of it.
pub(super) const ALL_FACES: u32 = 0b11_1111;

const CASTER: SampleStage = shader!("omni_shadows", "caster.vert");
const CASTERS: [SampleStage; 1] = [CASTER];
const CASTERS_MULTIVIEW: [SampleStage; 1] = [SampleStage { defines: &[("OMNI_MULTIVIEW", "1")], ..CASTER }];
const SURFACE: [SampleStage; 2] =
    [shader!("omni_shadows", "surface.vert"), shader!("omni_shadows", "surface.frag")];
const CUBE_VIEW: [SampleStage; 2] =
    [shader!("omni_shadows", "cube_view.vert"), shader!("omni_shadows", "cube_view.frag")];

/// Shadow casters, to one face of the cube map.
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
    depth: Some(DepthTest { format: RenderTarget::DEPTH, compare: CompareOp::Always, write: false }),
    ..RasterPipeline::flat(SAMPLE, "omni_shadows: unfolded cube", &CUBE_VIEW)
};

/// Every pipeline of the sample.
pub(super) const ALL: [RasterPipeline; 4] = [FACE, FACES, SURFACES, UNFOLDED];
