//! The sample's pipelines as data, with the texts that their stages use.

use crate::app::render_target::RenderTarget;
use lvk::{CompareOp, DepthTest, FrontFace};

use super::cube_map::{ALL_FACES, COLOR};
use crate::pipelines::{SamplePipeline, SampleStage, shader};
use crate::raster::RasterPipeline;

/// Folder of the texts in `shaders/`.
const SAMPLE: &str = "render_to_cube_map";

const BLOCK_VERTEX: SampleStage = shader!("render_to_cube_map", "block.vert");
const BLOCK_FRAGMENT: SampleStage = shader!("render_to_cube_map", "block.frag");
const SKY_VERTEX: SampleStage = shader!("render_to_cube_map", "sky.vert");
const SKY_FRAGMENT: SampleStage = shader!("render_to_cube_map", "sky.frag");

/// Depth test of everything infinitely far away, which is drawn last.
const FARTHEST: DepthTest =
    DepthTest { compare: CompareOp::GreaterOrEqual, write: false, ..RenderTarget::NEAREST };

/// Pipelines of what stands around the drop, for one kind of target.
pub(super) struct SurroundingsDesc {
    /// Winding of faces that are seen: faces of cubes are mirrored.
    pub(super) front: FrontFace,
    pub(super) blocks: RasterPipeline,
    pub(super) sky: RasterPipeline,
}

/// Pipelines of the surroundings in the picture.
pub(super) const IN_PICTURE: SurroundingsDesc = SurroundingsDesc {
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
/// Pipelines of the surroundings on one face.
pub(super) const ON_FACE: SurroundingsDesc = SurroundingsDesc {
    front: FrontFace::Clockwise,
    blocks: on_faces(
        "render_to_cube_map: blocks on a face",
        &[BLOCK_VERTEX, BLOCK_FRAGMENT],
        RenderTarget::NEAREST,
        0,
    ),
    sky: on_faces("render_to_cube_map: sky on a face", &[SKY_VERTEX, SKY_FRAGMENT], FARTHEST, 0),
};
/// Pipelines of the surroundings on all faces at once.
pub(super) const ON_ALL_FACES: SurroundingsDesc = SurroundingsDesc {
    front: FrontFace::Clockwise,
    blocks: on_faces(
        "render_to_cube_map: blocks on all faces",
        &[of_all_faces(BLOCK_VERTEX), BLOCK_FRAGMENT],
        RenderTarget::NEAREST,
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
    &[shader!("render_to_cube_map", "drop.vert"), shader!("render_to_cube_map", "drop.frag")],
);

/// Returns every pipeline of the sample.
pub(super) fn pipelines() -> Vec<SamplePipeline> {
    let surroundings = [IN_PICTURE, ON_FACE, ON_ALL_FACES];
    let all = surroundings.iter().flat_map(|SurroundingsDesc { blocks, sky, .. }| [blocks, sky]);
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
    SampleStage { defines: &[("PICTURE", "1")], ..fragment }
}

const fn of_all_faces(vertex: SampleStage) -> SampleStage {
    SampleStage { defines: &[("ALL_FACES", "1")], ..vertex }
}
