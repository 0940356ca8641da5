//! Creates many pipelines at once.

use super::Context;
use super::holder::Holder;
use crate::error::Result;
use crate::handle::{ComputePipelineHandle, RenderPipelineHandle};
use crate::parallel::parallel_map;
use crate::pipeline::compute::ComputePipelineDesc;
use crate::pipeline::graphics_desc::RenderPipelineDesc;

impl Context {
    /// [`create_render_pipeline`](Self::create_render_pipeline) for each description, on all cores of the CPU. Answers in
    /// the order of the descriptions; one that fails stops no other.
    pub fn create_render_pipelines(
        &self,
        descs: &[RenderPipelineDesc<'_>],
    ) -> Vec<Result<Holder<RenderPipelineHandle>>> {
        parallel_map(descs, |desc| self.create_render_pipeline(desc))
    }

    /// [`create_compute_pipeline`](Self::create_compute_pipeline) for each description, on all cores of the CPU. Answers
    /// in the order of the descriptions; one that fails stops no other.
    pub fn create_compute_pipelines(
        &self,
        descs: &[ComputePipelineDesc<'_>],
    ) -> Vec<Result<Holder<ComputePipelineHandle>>> {
        parallel_map(descs, |desc| self.create_compute_pipeline(desc))
    }
}
