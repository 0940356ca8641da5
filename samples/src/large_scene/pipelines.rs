//! The sample's pipelines as data, with the texts that their stages use.

use lvk::BlockLayout;

use super::renderer::FrameConstants;
use crate::pipelines::shader;
use crate::rtx::RayStages;

/// Both ways to trace.
pub(super) const RAYS: RayStages = RayStages {
    sample: "large_scene",
    names: ["large_scene: rays by pipeline", "large_scene: rays by query"],
    ray_gen: shader!("large_scene", "picture.rgen"),
    // In the order of `kNearest` and `kOpen` in `shaders/large_scene/picture.rgen.glsl`.
    misses: &[shader!("large_scene", "nearest.rmiss"), shader!("large_scene", "open.rmiss")],
    hits: &[shader!("large_scene", "nearest.rchit")],
    max_recursion: 1,
    query: shader!("large_scene", "picture.comp"),
    layouts: &[BlockLayout::buffer_reference::<FrameConstants>("Frame")],
};
