//! Dispatches.

use ash::vk;

use super::CommandBuffer;
use super::dependencies::Dependencies;
use crate::barrier::{Stages, Use};
use crate::error::{Error, Result, check_limit};
use crate::handle::{BufferHandle, ComputePipelineHandle};
use crate::pipeline::ComputePipeline;
use crate::resource::buffer::BufferUsage;

impl CommandBuffer {
    /// Binds a compute pipeline for the dispatches that follow (`vkCmdBindPipeline`).
    ///
    /// # Errors
    /// [`WrongQueue`](Error::WrongQueue) on the transfer queue; [`StaleHandle`](Error::StaleHandle).
    pub fn bind_compute_pipeline(&mut self, pipeline: ComputePipelineHandle) -> Result<()> {
        self.needs_compute("a dispatch")?;
        let pipeline = self.shared.store.compute_pipelines.get(pipeline)?;
        let point = vk::PipelineBindPoint::COMPUTE;
        self.bind_pipeline(point, pipeline.raw, &pipeline.name, pipeline.push_constant_bytes);
        self.compute = Some(pipeline);
        Ok(())
    }

    /// Runs `groups` workgroups along x, y and z (`vkCmdDispatch`).
    pub fn dispatch(&mut self, groups: [u32; 3], dependencies: &Dependencies<'_>) -> Result<()> {
        let pipeline = self.ready_compute()?;
        check_groups(&pipeline.name, groups, self.shared.gpu.caps.limits.max_dispatch_workgroups)?;
        let ray_query = pipeline.ray_query;
        self.flush_barriers_after(|cmd| cmd.use_compute(ray_query, dependencies))?;
        // SAFETY: a compute pipeline is bound and the counts are within the limits.
        unsafe { self.shared.gpu.device.cmd_dispatch(self.raw(), groups[0], groups[1], groups[2]) };
        Ok(())
    }

    /// Runs as many workgroups along x, y and z as the three `u32` at `offset` in `arguments`
    /// (`vkCmdDispatchIndirect`).
    ///
    /// `arguments` needs [`BufferUsage::INDIRECT`]; `offset` is a multiple of 4.
    pub fn dispatch_indirect(
        &mut self,
        arguments: BufferHandle,
        offset: u64,
        dependencies: &Dependencies<'_>,
    ) -> Result<()> {
        const ARGUMENT_BYTES: u64 = 12;
        let ray_query = self.ready_compute()?.ray_query;
        let buffer = self.shared.store.buffers.get(arguments)?;
        check_arguments(&buffer, offset, ARGUMENT_BYTES)?;
        self.flush_barriers_after(|cmd| {
            cmd.use_buffer(&buffer, Use::indirect());
            cmd.use_compute(ray_query, dependencies)
        })?;
        // SAFETY: a compute pipeline is bound and the arguments lie inside the buffer.
        unsafe { self.shared.gpu.device.cmd_dispatch_indirect(self.raw(), buffer.raw, offset) };
        Ok(())
    }

    #[inline]
    fn ready_compute(&self) -> Result<&ComputePipeline> {
        let Some(pipeline) = self.compute.as_deref() else {
            return Err(Error::usage("dispatch", "bind a compute pipeline first"));
        };
        self.check_pushed(&pipeline.name, pipeline.push_constant_bytes)?;
        Ok(pipeline)
    }

    #[inline]
    fn use_compute(&mut self, ray_query: bool, dependencies: &Dependencies<'_>) -> Result<()> {
        if ray_query {
            self.use_accel_structs(Stages::COMPUTE);
        }
        self.use_dependencies(dependencies, Stages::COMPUTE)
    }
}

/// Fails if there are more workgroups along an axis than the device supports.
#[inline]
fn check_groups(pipeline: &str, groups: [u32; 3], limits: [u32; 3]) -> Result<()> {
    if groups.iter().zip(&limits).all(|(count, limit)| count <= limit) {
        return Ok(());
    }
    let check =
        |(count, limit): (u32, u32)| check_limit(pipeline, "workgroup count", count.into(), limit.into());
    groups.into_iter().zip(limits).try_for_each(check)
}

/// Fails unless indirect arguments of `bytes` lie at `offset`.
pub(super) fn check_arguments(buffer: &crate::resource::Buffer, offset: u64, bytes: u64) -> Result<()> {
    buffer.check_usage(BufferUsage::INDIRECT)?;
    if !offset.is_multiple_of(4) {
        return Err(Error::usage(
            &buffer.name,
            format!("the offset {offset} of the arguments is no multiple of 4"),
        ));
    }
    buffer.check_range(offset, bytes)
}
