//! Builds of acceleration structures.

use std::sync::Arc;

use ash::khr::acceleration_structure::Device as ExtDevice;
use ash::vk;

use super::CommandBuffer;
use crate::accel::AccelStruct;
use crate::accel::build::{BuildInput, instance_bytes};
use crate::accel::instance::{Instances, TlasInstance};
use crate::accel::scratch::{ScratchBatch, aligned_scratch_address, plan_scratch};
use crate::accel::structure::{AccelKind, BuildMode, Tlas, TlasContents};
use crate::barrier::{Stages, Use};
use crate::error::{Error, Result, check_limit};
use crate::handle::AccelStructHandle;
use crate::resource::Buffer;
use crate::shared::{Garbage, Shared};

/// Addresses of instances must be a multiple of this.
const INSTANCE_ALIGNMENT: u64 = 16;

/// What a top-level structure shows once the command buffer is submitted.
pub(crate) struct TlasUpdate {
    target: Arc<AccelStruct>,
    contents: TlasContents,
    /// Moves what is shown when the command buffer is submitted, so that must have as many instances.
    refits_submitted: bool,
}

impl TlasUpdate {
    /// Fails if another submission changed the number of instances since the refit was recorded.
    fn check(&self) -> Result<()> {
        let now = self.target.tlas()?.contents().instance_count;
        if !self.refits_submitted || now == self.contents.instance_count {
            return Ok(());
        }
        let message =
            "a refit was recorded, but a submission since then changed the number of instances; rebuild";
        Err(Error::usage(&self.target.name, message))
    }

    /// Makes it so. Structures shown before may go once the GPU is done with them.
    pub(crate) fn apply(self, shared: &Shared) {
        if let Ok(tlas) = self.target.tlas() {
            let before = std::mem::replace(&mut *tlas.contents(), self.contents);
            before.blas.into_iter().for_each(|blas| shared.retire(Garbage::Kept(blas)));
        }
    }
}

/// One build to record.
struct Build {
    target: Arc<AccelStruct>,
    input: BuildInput,
    mode: BuildMode,
    scratch_bytes: u64,
    reads: Vec<Arc<Buffer>>,
}

impl CommandBuffer {
    /// Builds bottom-level structures again from their buffers, or refits them
    /// (`vkCmdBuildAccelerationStructuresKHR`). Contents may have changed, counts may not.
    ///
    /// Rays traced later in the same command buffer, or in later submissions, see the result.
    pub fn build_blas(&mut self, structures: &[AccelStructHandle], mode: BuildMode) -> Result<()> {
        let found: Result<Vec<_>> =
            structures.iter().map(|handle| self.shared.store.accel_structs.get(*handle)).collect();
        let found = found?;
        for (index, target) in found.iter().enumerate() {
            if found[..index].iter().any(|other| other.id == target.id) {
                return Err(Error::usage(&target.name, "the structure is listed twice in one build"));
            }
        }
        self.build_all(&found, mode)
    }

    /// As [`build_blas`](Self::build_blas), by object.
    pub(crate) fn build_all(&mut self, structures: &[Arc<AccelStruct>], mode: BuildMode) -> Result<()> {
        let builds: Result<Vec<_>> = structures.iter().map(|target| self.plan_blas(target, mode)).collect();
        self.record_builds(&builds?)
    }

    /// Shows other instances in a top-level structure: at most its capacity, and for a refit as many as before.
    pub fn update_tlas(
        &mut self,
        tlas: AccelStructHandle,
        instances: &[TlasInstance],
        mode: BuildMode,
    ) -> Result<()> {
        let target = self.shared.store.accel_structs.get(tlas)?;
        self.update_tlas_object(&target, instances, mode)
    }

    /// As [`update_tlas`](Self::update_tlas), by object.
    pub(crate) fn update_tlas_object(
        &mut self,
        target: &Arc<AccelStruct>,
        instances: &[TlasInstance],
        mode: BuildMode,
    ) -> Result<()> {
        let tlas = target.tlas()?;
        let count = instances.len() as u64;
        check_limit(&target.name, "instance count", count, tlas.capacity.into())?;
        let count = count as u32;
        if mode == BuildMode::Refit && self.instance_count(target, tlas) != Some(count) {
            let message = format!("a refit keeps the number of instances; {count} are new, so rebuild");
            return Err(Error::usage(&target.name, message));
        }
        let scratch_bytes = target.scratch_bytes(mode)?;
        let shared = Arc::clone(&self.shared);
        let converted =
            Instances::convert(&target.name, instances, |handle| shared.store.accel_structs.get(handle))?;
        let bytes = instance_bytes(count.max(1));
        let region =
            shared.staging.write_with(bytes, INSTANCE_ALIGNMENT, self.recording.sequence, |staged| {
                let raw: &[u8] = bytemuck::cast_slice(&converted.raw);
                staged[..raw.len()].copy_from_slice(raw);
            })?;
        self.retire_temporary(region.temporary);
        let input = BuildInput::tlas(target.flags, region.address, count);
        let build = Build { target: Arc::clone(target), input, mode, scratch_bytes, reads: Vec::new() };
        self.record_builds(&[build])?;
        let contents = TlasContents { instance_count: Some(count), blas: converted.blas };
        let refits_submitted = mode == BuildMode::Refit && self.own_update(target).is_none();
        self.tlas_updates.push(TlasUpdate { target: Arc::clone(target), contents, refits_submitted });
        Ok(())
    }

    /// Takes the updates so far for submitted: for the command buffer that goes before every other one.
    pub(crate) fn apply_tlas_updates(&mut self) {
        let shared = Arc::clone(&self.shared);
        std::mem::take(&mut self.tlas_updates).into_iter().for_each(|update| update.apply(&shared));
    }

    /// Instances shown by the last build before the next command.
    fn instance_count(&self, target: &Arc<AccelStruct>, tlas: &Tlas) -> Option<u32> {
        let own = self.own_update(target);
        own.map_or_else(|| tlas.contents().instance_count, |update| update.contents.instance_count)
    }

    /// The last update recorded in this command buffer.
    fn own_update(&self, target: &AccelStruct) -> Option<&TlasUpdate> {
        self.tlas_updates.iter().rev().find(|update| update.target.id == target.id)
    }

    /// Fails if what was recorded no longer fits what was submitted since.
    pub(crate) fn check_tlas_updates(&self) -> Result<()> {
        self.tlas_updates.iter().try_for_each(TlasUpdate::check)
    }

    /// Keeps a buffer of its own that the staging ring had no room for until the GPU is done with it.
    pub(super) fn retire_temporary(&self, temporary: Option<Arc<Buffer>>) {
        if let Some(buffer) = temporary {
            self.shared.retire(Garbage::Buffer(buffer));
        }
    }

    fn plan_blas(&self, target: &Arc<AccelStruct>, mode: BuildMode) -> Result<Build> {
        let blas = target.blas()?;
        let scratch_bytes = target.scratch_bytes(mode)?;
        let find = |handle| self.shared.store.buffers.get(handle);
        let transforms = blas.transforms.as_ref().map(|buffer| buffer.address);
        let input = BuildInput::blas(
            &self.shared.gpu,
            &target.name,
            &blas.geometries,
            target.flags,
            &find,
            transforms,
        )?;
        let reads: Result<Vec<_>> =
            blas.geometries.iter().flat_map(|geometry| geometry.buffers()).map(find).collect();
        Ok(Build { target: Arc::clone(target), input, mode, scratch_bytes, reads: reads? })
    }

    fn record_builds(&mut self, builds: &[Build]) -> Result<()> {
        let limits = &self.shared.gpu.caps.limits;
        let alignment = limits.scratch_alignment.into();
        let largest = limits.max_buffer_bytes.saturating_sub(alignment);
        let sizes: Vec<_> = builds.iter().map(|build| build.scratch_bytes).collect();
        let batches = plan_scratch(&sizes, alignment, self.shared.scratch_budget_bytes.min(largest));
        let most = batches.iter().map(|batch| batch.bytes).max().unwrap_or(0);
        let shared = Arc::clone(&self.shared);
        let ext = shared.gpu.accel()?;
        let (scratch, replaced) = shared.scratch.get(&shared.gpu, most)?;
        self.retire_temporary(replaced);
        for batch in batches {
            self.use_buffer(&scratch, Use::accel_build_write());
            let base = aligned_scratch_address(scratch.address, alignment);
            self.record_batch(ext, &builds[batch.builds.clone()], &batch, base);
        }
        Ok(())
    }

    /// Records builds that share the scratch buffer without overlapping in it.
    fn record_batch(&mut self, ext: &ExtDevice, builds: &[Build], batch: &ScratchBatch, base: u64) {
        builds.iter().for_each(|build| self.use_build(build));
        self.flush();
        let infos: Vec<_> = builds
            .iter()
            .zip(&batch.offsets)
            .map(|(build, offset)| build.input.build(&build.target, build.mode, base + offset))
            .collect();
        let ranges: Vec<&[vk::AccelerationStructureBuildRangeInfoKHR]> =
            builds.iter().map(|build| &build.input.ranges[..]).collect();
        // SAFETY: inputs, structures and scratch memory are alive, checked, aligned and large enough; barriers keep
        // them apart from other commands.
        unsafe { ext.cmd_build_acceleration_structures(self.raw(), &infos, &ranges) };
    }

    fn use_build(&mut self, build: &Build) {
        let (all_blas, all_tlas) = (self.shared.all_blas, self.shared.all_tlas);
        self.uses.id(build.target.id, Use::accel_build_write());
        match build.target.kind {
            AccelKind::Blas(_) => {
                self.uses.accumulate(all_blas, Use::accel_build_write());
            }
            AccelKind::Tlas(_) => {
                self.uses.id(all_blas, Use::accel_read(Stages::ACCEL_BUILD));
                self.uses.accumulate(all_tlas, Use::accel_build_write());
            }
        }
        for buffer in &build.reads {
            self.use_buffer(buffer, Use::accel_build_input());
        }
    }
}
