//! The sample's pipelines as data, with the texts that its stages use.

use lvk::BlockLayout;

use super::renderer::Push;
use crate::pipelines::{SamplePipeline, shader};
use crate::rtx::RayStages;

pub(super) const RAYS: RayStages = RayStages {
    sample: "rtx_hello",
    names: ["rtx_hello: rays by pipeline", "rtx_hello: rays by query"],
    ray_gen: shader!("rtx_hello", "hello.rgen"),
    misses: &[shader!("rtx_hello", "hello.rmiss")],
    hits: &[shader!("rtx_hello", "hello.rchit")],
    max_recursion: 1,
    query: shader!("rtx_hello", "hello.comp"),
    layouts: &[BlockLayout::push_constants::<Push>()],
};

/// Returns every pipeline of the sample.
pub(super) fn pipelines() -> Vec<SamplePipeline> {
    RAYS.pipelines()
}
