//! Builds and refits of software BVHs by the library's kernels.

use std::sync::Arc;

use ash::vk;

use crate::accel::scratch::{aligned_scratch_address, plan_scratch};
use crate::barrier::{Stages, Use};
use crate::command::CommandBuffer;
use crate::error::Result;
use crate::kernels::spread_workgroups;
use crate::resource::Buffer;
use crate::software_ray_query::gpu_build::geometry::GpuGeometry;
use crate::software_ray_query::gpu_build::layout::{BuildSource, GpuBuildPlan};
use crate::software_ray_query::gpu_build::params::{BuildPushConstants, GpuBuildParams};
use crate::software_ray_query::gpu_build::refit_layout::GpuRefitPlan;
use crate::software_ray_query::gpu_build::steps::{BuildStep, build_steps, refit_steps};

/// Alignment of scratch memory ranges, in bytes: that of their widest accesses.
const SCRATCH_ALIGNMENT: u64 = 256;
const TABLE_ALIGNMENT: u64 = 16;

/// One build to record.
pub(crate) struct GpuBuild {
    pub(crate) plan: GpuBuildPlan,
    pub(crate) source: BuildSource,
    /// Address of the BVH, a multiple of 256, with at least the plan's `blob_bytes` of memory.
    pub(crate) blob: u64,
    /// The buffer that the BVH lies in.
    pub(crate) target: Arc<Buffer>,
    /// Buffers the build reads: inputs, and buffers of the BLAS that instances reference.
    pub(crate) read_buffers: Vec<Arc<Buffer>>,
}

/// One refit to record.
pub(crate) struct GpuRefit {
    pub(crate) plan: GpuRefitPlan,
    /// The geometries of the build, over buffers whose contents may have changed.
    pub(crate) geometries: Vec<GpuGeometry>,
    /// Address of the BVH.
    pub(crate) blob: u64,
    /// The buffer that the BVH lies in.
    pub(crate) target: Arc<Buffer>,
    /// Buffers the refit reads.
    pub(crate) read_buffers: Vec<Arc<Buffer>>,
}

impl CommandBuffer {
    /// Records builds, as many concurrently as fit in the scratch memory. Record a TLAS in a later call than the BLAS
    /// it references. On an error, neither the batch that failed nor later ones are recorded.
    pub(crate) fn record_gpu_builds(&mut self, builds: &[GpuBuild]) -> Result<()> {
        let sizes: Vec<_> = builds.iter().map(|build| build.plan.scratch_bytes).collect();
        self.for_each_scratch_batch(&sizes, |cmd, range, scratch| {
            let builds = &builds[range];
            let parts: Vec<_> = builds.iter().map(|build| (&build.plan, &build.source)).collect();
            let (order, steps) = build_steps(&parts);
            let mut jobs = Vec::with_capacity(builds.len());
            for index in order {
                let build = &builds[index];
                let inputs = match &build.source {
                    BuildSource::Geometries(list) => cmd.stage_records(list)?,
                    BuildSource::Instances { .. } => 0,
                };
                jobs.push(build.plan.build_params(&build.source, inputs, build.blob, scratch[index]));
            }
            let uses = builds.iter().map(|build| (&build.target, &build.read_buffers[..]));
            cmd.record_build_steps(&jobs, &steps, uses)
        })
    }

    /// Records refits, as many concurrently as fit in the scratch memory. The errors are those of
    /// [`record_gpu_builds`](Self::record_gpu_builds).
    pub(crate) fn record_gpu_refits(&mut self, refits: &[GpuRefit]) -> Result<()> {
        let sizes: Vec<_> = refits.iter().map(|refit| refit.plan.scratch_bytes()).collect();
        self.for_each_scratch_batch(&sizes, |cmd, range, scratch| {
            let refits = &refits[range];
            let plans: Vec<_> = refits.iter().map(|refit| refit.plan).collect();
            let mut jobs = Vec::with_capacity(refits.len());
            for (refit, scratch) in refits.iter().zip(scratch) {
                let inputs = cmd.stage_records(&refit.geometries)?;
                jobs.push(refit.plan.refit_params(
                    inputs,
                    refit.geometries.len() as u32,
                    refit.blob,
                    *scratch,
                ));
            }
            let uses = refits.iter().map(|refit| (&refit.target, &refit.read_buffers[..]));
            cmd.record_build_steps(&jobs, &refit_steps(&plans), uses)
        })
    }

    /// Calls `record` for each batch that shares the scratch buffer, with the addresses of its scratch memory ranges.
    fn for_each_scratch_batch(
        &mut self,
        sizes: &[u64],
        mut record: impl FnMut(&mut Self, std::ops::Range<usize>, &[u64]) -> Result<()>,
    ) -> Result<()> {
        let shared = Arc::clone(&self.shared);
        let alignment = u64::from(shared.gpu.caps.limits.scratch_alignment).max(SCRATCH_ALIGNMENT);
        let own = &shared.scratch[self.recording.queue_index];
        let budget = own.tiers.batch_bytes().saturating_sub(alignment);
        let batches = plan_scratch(sizes, alignment, budget);
        let most = batches.iter().map(|batch| batch.bytes).max().unwrap_or(0);
        let (scratch, replaced) = own.get_or_grow(&shared.gpu, most.saturating_add(alignment))?;
        self.free_replaced_scratch(replaced);
        let base = aligned_scratch_address(scratch.address, alignment);
        for batch in batches {
            let addresses: Vec<_> = batch.offsets.iter().map(|offset| base + offset).collect();
            self.state.accesses.add_id(own.id, Use::shader_write(Stages::COMPUTE));
            record(self, batch.builds, &addresses).inspect_err(|_| self.state.accesses.clear())?;
        }
        Ok(())
    }

    /// Records the steps of some jobs, with barriers between phases. Expects the scratch buffer among the declared
    /// accesses.
    pub(crate) fn record_build_steps<'a>(
        &mut self,
        jobs: &[GpuBuildParams],
        steps: &[BuildStep],
        uses: impl Iterator<Item = (&'a Arc<Buffer>, &'a [Arc<Buffer>])>,
    ) -> Result<()> {
        let jobs = self.stage_records(jobs)?;
        let pipelines =
            steps.iter().map(|step| self.kernel_pipeline(step.kernel)).collect::<Result<Vec<_>>>()?;
        for (target, reads) in uses {
            self.use_buffer(target, Use::shader_write(Stages::COMPUTE));
            reads.iter().for_each(|buffer| self.use_buffer(buffer, Use::shader_read(Stages::COMPUTE)));
        }
        self.flush_barriers();
        for (place, (step, pipeline)) in steps.iter().zip(pipelines).enumerate() {
            let before = place.checked_sub(1).map(|place| steps[place]);
            if before.is_some_and(|before| before.phase != step.phase) {
                self.compute_barrier();
            }
            let push = BuildPushConstants {
                jobs,
                first_job: step.job,
                pass_or_jobs: step.pass_or_jobs,
                groups_of_job: step.groups_of_job,
                unused: 0,
            };
            let bind = before.is_none_or(|before| before.kernel != step.kernel);
            self.dispatch_kernel(
                bind.then_some(&pipeline),
                bytemuck::bytes_of(&push),
                spread_workgroups(step.groups),
            );
        }
        self.restore_compute();
        Ok(())
    }

    /// Makes writes of earlier dispatches of a build visible to later ones. The tracker covers only the barriers before
    /// the first dispatch and after the last one.
    fn compute_barrier(&self) {
        let written = vk::AccessFlags2::SHADER_STORAGE_WRITE;
        let barrier = [vk::MemoryBarrier2::default()
            .src_stage_mask(vk::PipelineStageFlags2::COMPUTE_SHADER)
            .src_access_mask(written)
            .dst_stage_mask(vk::PipelineStageFlags2::COMPUTE_SHADER)
            .dst_access_mask(written | vk::AccessFlags2::SHADER_STORAGE_READ)];
        let info = vk::DependencyInfo::default().memory_barriers(&barrier);
        // SAFETY: the command buffer is being recorded, outside of a render pass.
        unsafe { self.shared.gpu.device.cmd_pipeline_barrier2(self.raw(), &info) };
    }

    /// Writes records to staging memory, where the GPU may read them until the command buffer is done. Returns their
    /// address.
    fn stage_records<T: bytemuck::NoUninit>(&mut self, records: &[T]) -> Result<u64> {
        let bytes = bytemuck::cast_slice(records);
        let region = self.shared.staging.write(bytes, TABLE_ALIGNMENT, self.recording.staging_key())?;
        Ok(region.address)
    }
}
