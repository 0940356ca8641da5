//! Traces of ray tracing pipelines.

use ash::vk;

use super::CommandBuffer;
use super::dependencies::Dependencies;
use crate::barrier::{Stages, Use};
use crate::error::{Error, Result, check_limit};
use crate::gpu::caps::Limits;
use crate::handle::RayTracingPipelineHandle;

impl CommandBuffer {
    /// Binds a ray tracing pipeline for the traces that follow (`vkCmdBindPipeline`).
    pub fn bind_ray_tracing_pipeline(&mut self, pipeline: RayTracingPipelineHandle) -> Result<()> {
        let pipeline = self.shared.store.ray_tracing_pipelines.get(pipeline)?;
        let point = vk::PipelineBindPoint::RAY_TRACING_KHR;
        self.bind(point, pipeline.raw, &pipeline.name, pipeline.push_constant_bytes);
        self.ray_tracing = Some(pipeline);
        Ok(())
    }

    /// Runs the first ray generation shader `size[0] * size[1] * size[2]` times (`vkCmdTraceRaysKHR`).
    pub fn trace_rays(&mut self, size: [u32; 3], dependencies: &Dependencies<'_>) -> Result<()> {
        self.trace_rays_from(0, size, dependencies)
    }

    /// As [`trace_rays`](Self::trace_rays), with the ray generation shader at place `ray_gen` of the pipeline's list.
    pub fn trace_rays_from(
        &mut self,
        ray_gen: u32,
        size: [u32; 3],
        dependencies: &Dependencies<'_>,
    ) -> Result<()> {
        let pipeline = self.ray_tracing.clone();
        let pipeline =
            pipeline.ok_or_else(|| Error::usage("trace_rays", "bind a ray tracing pipeline first"))?;
        self.check_pushed(&pipeline.name, pipeline.push_constant_bytes)?;
        let regions = pipeline.regions(ray_gen)?;
        check_size(&self.shared.gpu.caps.limits, &pipeline.name, size)?;
        if size.contains(&0) {
            return Ok(());
        }
        self.flush_after(|cmd| {
            cmd.use_structures(Stages::RAY_TRACING);
            cmd.use_buffer(&pipeline.table, Use::shader_read(Stages::RAY_TRACING));
            cmd.use_dependencies(dependencies, Stages::RAY_TRACING)
        })?;
        let raw = self.raw();
        let ext = self.shared.gpu.ray_tracing()?;
        // SAFETY: a ray tracing pipeline is bound, the regions are its own, and the size is within the limit.
        unsafe {
            ext.cmd_trace_rays(
                raw,
                &regions.ray_gen,
                &regions.miss,
                &regions.hit,
                &regions.callable,
                size[0],
                size[1],
                size[2],
            );
        }
        Ok(())
    }
}

fn check_size(limits: &Limits, pipeline: &str, size: [u32; 3]) -> Result<()> {
    for (axis, side) in size.into_iter().enumerate() {
        let groups = u64::from(limits.max_dispatch_groups[axis]);
        let most = groups * u64::from(limits.max_group_size[axis]);
        check_limit(pipeline, "number of rays along an axis", side.into(), most)?;
    }
    let rays = size.iter().fold(1_u64, |all, side| all.saturating_mul((*side).into()));
    check_limit(pipeline, "number of rays", rays, limits.max_trace_invocations.into())
}
