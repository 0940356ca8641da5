//! Creation of many pipelines at once.

use super::Context;
use super::holder::Holder;
use crate::error::Result;
use crate::handle::{ComputePipelineHandle, RenderPipelineHandle};
use crate::parallel::parallel_map;
use crate::pipeline::compute::ComputePipelineDesc;
use crate::pipeline::graphics_desc::RenderPipelineDesc;

impl Context {
    /// Calls [`create_render_pipeline`](Self::create_render_pipeline) for each description, on all CPU cores. Returns
    /// the results in the order of the descriptions. A failed description does not stop the others.
    pub fn create_render_pipelines(
        &self,
        descs: &[RenderPipelineDesc<'_>],
    ) -> Vec<Result<Holder<RenderPipelineHandle>>> {
        parallel_map(descs, |desc| self.create_render_pipeline(desc))
    }

    /// Calls [`create_compute_pipeline`](Self::create_compute_pipeline) for each description, on all CPU cores. Returns
    /// the results in the order of the descriptions. A failed description does not stop the others.
    pub fn create_compute_pipelines(
        &self,
        descs: &[ComputePipelineDesc<'_>],
    ) -> Vec<Result<Holder<ComputePipelineHandle>>> {
        parallel_map(descs, |desc| self.create_compute_pipeline(desc))
    }
}
