//! Traces of ray tracing pipelines.

use std::sync::Arc;

use ash::vk;

use super::CommandBuffer;
use super::compute::check_arguments;
use super::dependencies::Dependencies;
use super::trace_lowered::LoweredTrace;
use crate::barrier::{Stages, Use};
use crate::error::{Error, Result, check_limit};
use crate::gpu::caps::limits::Limits;
use crate::handle::{BufferHandle, RayTracingPipelineHandle};
use crate::pipeline::RayTracingPipeline;
use crate::pipeline::ray_tracing::{PipelineCode, TraceRegions};

impl CommandBuffer {
    /// Binds a ray tracing pipeline for the traces that follow (`vkCmdBindPipeline`). A lowered pipeline is bound by each
    /// trace, and the bound compute pipeline stays.
    ///
    /// # Errors
    /// [`WrongQueue`](Error::WrongQueue) on the transfer queue; [`StaleHandle`](Error::StaleHandle).
    pub fn bind_ray_tracing_pipeline(&mut self, pipeline: RayTracingPipelineHandle) -> Result<()> {
        self.needs_compute("a trace")?;
        let pipeline = self.shared.store.ray_tracing_pipelines.get(pipeline)?;
        // A pass that was forgotten instead of dropped is still open, and Vulkan sets no stack size in a pass.
        self.end_rendering();
        match &pipeline.code {
            PipelineCode::Hardware(hardware) => {
                let point = vk::PipelineBindPoint::RAY_TRACING_KHR;
                self.bind_pipeline(point, hardware.raw, &pipeline.name, pipeline.push_constant_bytes);
                let ext = self.shared.gpu.ray_tracing_functions()?;
                // SAFETY: the command buffer is being recorded outside of a pass, and the size is that of the pipeline just
                // bound.
                unsafe { ext.cmd_set_ray_tracing_pipeline_stack_size(self.raw(), hardware.stack_bytes) };
            }
            PipelineCode::Lowered(_) => {
                self.expect_push_block(&pipeline.name, pipeline.push_constant_bytes);
            }
        }
        self.ray_tracing = Some(pipeline);
        Ok(())
    }

    /// Runs the first ray generation shader `size[0] * size[1] * size[2]` times (`vkCmdTraceRaysKHR`). The shader of a
    /// lowered pipeline runs by `vkCmdDispatch`.
    pub fn trace_rays(&mut self, size: [u32; 3], dependencies: &Dependencies<'_>) -> Result<()> {
        self.trace_rays_with(0, size, dependencies)
    }

    /// As [`trace_rays`](Self::trace_rays), with the ray generation shader at index `ray_gen` of the pipeline's list.
    pub fn trace_rays_with(
        &mut self,
        ray_gen: u32,
        size: [u32; 3],
        dependencies: &Dependencies<'_>,
    ) -> Result<()> {
        let (pipeline, regions) = self.check_trace(ray_gen)?;
        if let PipelineCode::Lowered(lowered) = &pipeline.code {
            let trace = LoweredTrace::new(&pipeline, lowered, &regions, ray_gen)?;
            return self.trace_lowered(&trace, size, dependencies);
        }
        check_size(&self.shared.gpu.caps.limits, &pipeline.name, size)?;
        if size.contains(&0) {
            return Ok(());
        }
        self.flush_barriers_after(|cmd| cmd.use_trace(&pipeline, Stages::RAY_TRACING, dependencies))?;
        let ext = self.shared.gpu.ray_tracing_functions()?;
        // SAFETY: a ray tracing pipeline is bound, the regions are its own, and the size is within the limit.
        unsafe {
            ext.cmd_trace_rays(
                self.raw(),
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

    /// Runs the ray generation shader at index `ray_gen` with a size from a buffer (`vkCmdTraceRaysIndirectKHR`). Three
    /// `u32` at `offset` in `arguments` hold the width, height and depth, of which any may be 0. For a lowered pipeline a
    /// kernel reads them, and `vkCmdDispatchIndirect` runs the shader.
    ///
    /// `arguments` needs [`INDIRECT`](crate::BufferUsage::INDIRECT); `offset` is a multiple of 4. The caller keeps the
    /// size in the buffer within the device's limits.
    ///
    /// # Errors
    /// [`Unsupported`](Error::Unsupported) without
    /// [`trace_rays_indirect`](crate::Capabilities::trace_rays_indirect).
    pub fn trace_rays_indirect(
        &mut self,
        ray_gen: u32,
        arguments: BufferHandle,
        offset: u64,
        dependencies: &Dependencies<'_>,
    ) -> Result<()> {
        const ARGUMENT_BYTES: u64 = 12;
        if !self.shared.gpu.caps.trace_rays_indirect {
            return Err(self.shared.gpu.unsupported("trace_rays_indirect"));
        }
        let (pipeline, regions) = self.check_trace(ray_gen)?;
        let buffer = self.shared.store.buffers.get(arguments)?;
        check_arguments(&buffer, offset, ARGUMENT_BYTES)?;
        if let PipelineCode::Lowered(lowered) = &pipeline.code {
            let trace = LoweredTrace::new(&pipeline, lowered, &regions, ray_gen)?;
            return self.trace_lowered_indirect(&trace, &buffer, offset, dependencies);
        }
        self.flush_barriers_after(|cmd| {
            cmd.use_buffer(&buffer, Use::indirect());
            cmd.use_trace(&pipeline, Stages::RAY_TRACING, dependencies)
        })?;
        let ext = self.shared.gpu.ray_tracing_functions()?;
        // SAFETY: a ray tracing pipeline is bound, the regions are its own, and the arguments lie inside the buffer.
        unsafe {
            ext.cmd_trace_rays_indirect(
                self.raw(),
                &regions.ray_gen,
                &regions.miss,
                &regions.hit,
                &regions.callable,
                buffer.address + offset,
            );
        }
        Ok(())
    }

    /// Returns the bound pipeline and the regions of its shader binding table. Fails unless all push constants of its
    /// shaders were pushed.
    fn check_trace(&self, ray_gen: u32) -> Result<(Arc<RayTracingPipeline>, TraceRegions)> {
        let pipeline = self.ray_tracing.clone();
        let pipeline =
            pipeline.ok_or_else(|| Error::usage("trace_rays", "bind a ray tracing pipeline first"))?;
        self.check_pushed(&pipeline.name, pipeline.push_constant_bytes)?;
        let regions = pipeline.trace_regions(ray_gen)?;
        Ok((pipeline, regions))
    }

    /// Declares what a trace uses, whose shaders run in `stages`.
    pub(super) fn use_trace(
        &mut self,
        pipeline: &RayTracingPipeline,
        stages: Stages,
        dependencies: &Dependencies<'_>,
    ) -> Result<()> {
        self.use_accel_structs(stages);
        self.use_buffer(&pipeline.table, Use::shader_read(stages));
        self.use_dependencies(dependencies, stages)
    }
}

fn check_size(limits: &Limits, pipeline: &str, size: [u32; 3]) -> Result<()> {
    for (axis, side) in size.into_iter().enumerate() {
        let groups = u64::from(limits.max_dispatch_workgroups[axis]);
        let most = groups * u64::from(limits.max_workgroup_size[axis]);
        check_limit(pipeline, "number of rays along an axis", side.into(), most)?;
    }
    let rays = size.iter().fold(1_u64, |all, side| all.saturating_mul((*side).into()));
    check_limit(pipeline, "number of rays", rays, limits.max_trace_invocations.into())
}
