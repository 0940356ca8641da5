//! The sample's pipelines as data, with the texts that their stages use.

use lvk::{CompareOp, DepthTest, FrontFace};

use super::cube_map::{ALL_FACES, COLOR};
use crate::pipelines::{SamplePipeline, SampleStage};
use crate::raster::{Canvas, RasterPipeline, fragment_stage, vertex_stage};
use crate::shaders::render_to_cube_map as texts;

/// Folder of the texts in `shaders/`.
const SAMPLE: &str = "render_to_cube_map";

const BLOCK_VERTEX: SampleStage = vertex_stage(texts::BLOCK_VERT, "block.vert");
const BLOCK_FRAGMENT: SampleStage = fragment_stage(texts::BLOCK_FRAG, "block.frag");
const SKY_VERTEX: SampleStage = vertex_stage(texts::SKY_VERT, "sky.vert");
const SKY_FRAGMENT: SampleStage = fragment_stage(texts::SKY_FRAG, "sky.frag");

/// Of what is infinitely far away, drawn last.
const FARTHEST: DepthTest = DepthTest { compare: CompareOp::GreaterOrEqual, write: false, ..Canvas::NEAREST };

/// Pipelines of what stands around the drop, for one kind of target.
pub(super) struct Surroundings {
    /// Winding of faces that are seen: faces of cubes are mirrored.
    pub(super) front: FrontFace,
    pub(super) blocks: RasterPipeline,
    pub(super) sky: RasterPipeline,
}

/// In the picture.
pub(super) const IN_PICTURE: Surroundings = Surroundings {
    front: FrontFace::CounterClockwise,
    blocks: RasterPipeline::with_depth(
        SAMPLE,
        "render_to_cube_map: blocks in the picture",
        &[BLOCK_VERTEX, of_picture(BLOCK_FRAGMENT)],
    ),
    sky: RasterPipeline {
        depth: Some(FARTHEST),
        ..RasterPipeline::with_depth(
            SAMPLE,
            "render_to_cube_map: sky in the picture",
            &[SKY_VERTEX, of_picture(SKY_FRAGMENT)],
        )
    },
};
/// On one face.
pub(super) const ON_FACE: Surroundings = Surroundings {
    front: FrontFace::Clockwise,
    blocks: on_faces(
        "render_to_cube_map: blocks on a face",
        &[BLOCK_VERTEX, BLOCK_FRAGMENT],
        Canvas::NEAREST,
        0,
    ),
    sky: on_faces("render_to_cube_map: sky on a face", &[SKY_VERTEX, SKY_FRAGMENT], FARTHEST, 0),
};
/// On all faces at once.
pub(super) const ON_ALL_FACES: Surroundings = Surroundings {
    front: FrontFace::Clockwise,
    blocks: on_faces(
        "render_to_cube_map: blocks on all faces",
        &[of_all_faces(BLOCK_VERTEX), BLOCK_FRAGMENT],
        Canvas::NEAREST,
        ALL_FACES,
    ),
    sky: on_faces(
        "render_to_cube_map: sky on all faces",
        &[of_all_faces(SKY_VERTEX), SKY_FRAGMENT],
        FARTHEST,
        ALL_FACES,
    ),
};
pub(super) const DROP: RasterPipeline = RasterPipeline::with_depth(
    SAMPLE,
    "render_to_cube_map: drop",
    &[vertex_stage(texts::DROP_VERT, "drop.vert"), fragment_stage(texts::DROP_FRAG, "drop.frag")],
);

/// Every pipeline of the sample.
#[must_use]
pub fn pipelines() -> Vec<SamplePipeline> {
    let surroundings = [IN_PICTURE, ON_FACE, ON_ALL_FACES];
    let all = surroundings.iter().flat_map(|Surroundings { blocks, sky, .. }| [blocks, sky]);
    all.chain([&DROP]).map(RasterPipeline::data).collect()
}

const fn on_faces(
    name: &'static str,
    stages: &'static [SampleStage],
    depth: DepthTest,
    view_mask: u32,
) -> RasterPipeline {
    let (color, depth) = (&[COLOR], Some(depth));
    RasterPipeline { sample: SAMPLE, name, stages, color, depth, samples: 1, view_mask }
}

const fn of_picture(fragment: SampleStage) -> SampleStage {
    SampleStage { defines: texts::OF_PICTURE, ..fragment }
}

const fn of_all_faces(vertex: SampleStage) -> SampleStage {
    SampleStage { defines: texts::OF_ALL_FACES, ..vertex }
}
