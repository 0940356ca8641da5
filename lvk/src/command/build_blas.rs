//! Builds and refits of acceleration structures.

use std::collections::HashSet;
use std::sync::Arc;

use ash::khr::acceleration_structure::Device as ExtDevice;
use ash::vk;

use super::CommandBuffer;
use super::open_build::{CpuBvhUpdate, OpenBuild};
use super::queue_support::BUILD_ON_QUEUE;
use super::software_ray_query::{SoftwareBuilds, check_unmoved};
use crate::accel::AccelStruct;
use crate::accel::blas::{Blas, BlasPart, BlasStructures};
use crate::accel::build::BuildInput;
use crate::accel::flags::BuildMode;
use crate::accel::scratch::{ScratchBatch, aligned_scratch_address, plan_scratch};
use crate::barrier::Use;
use crate::device_state::DeferredFree;
use crate::error::{Error, Result};
use crate::handle::AccelStructHandle;
use crate::resource::Buffer;

/// Plans the builds or refits of what software traces.
type PlanSoftwareBuilds = fn(&CommandBuffer, &[Arc<AccelStruct>], &[bool]) -> Result<SoftwareBuilds>;

/// One build of a part of a bottom-level structure to record.
struct BlasPartBuild {
    target: Arc<AccelStruct>,
    /// The structure that is built, one of the target's.
    raw: vk::AccelerationStructureKHR,
    input: BuildInput,
    refit: bool,
    scratch_bytes: u64,
    read_buffers: Vec<Arc<Buffer>>,
}

impl CommandBuffer {
    /// Builds bottom-level structures again from their buffers, or refits them
    /// (`vkCmdBuildAccelerationStructuresKHR`). Contents may have changed, counts may not; for a refit neither may
    /// indices.
    ///
    /// Rays traced later in the same command buffer, or in later submissions, see the result. Where the bounds of a
    /// structure changed, top-level structures that show it need an update too; and where anything in it did that was made
    /// without [`BuildFlags::ALLOW_UPDATE`](crate::BuildFlags::ALLOW_UPDATE), as software may show it in parts.
    ///
    /// # Errors
    /// [`InvalidUsage`](Error::InvalidUsage) for a refit without
    /// [`BuildFlags::ALLOW_UPDATE`](crate::BuildFlags::ALLOW_UPDATE), a rebuild of a structure that was compacted, or
    /// compacted before it was saved, and a structure listed twice; [`WrongQueue`](Error::WrongQueue) on the transfer queue.
    /// Where there is no memory left for the scratch or tables of what software traces, the command buffer can no longer be
    /// submitted; for structures themselves it is taken before anything is recorded.
    pub fn build_blas(&mut self, structures: &[AccelStructHandle], mode: BuildMode) -> Result<()> {
        self.needs_compute(BUILD_ON_QUEUE)?;
        let found: Result<Vec<_>> =
            structures.iter().map(|handle| self.shared.store.accel_structs.get(*handle)).collect();
        let found = found?;
        let mut seen = HashSet::with_capacity(found.len());
        if let Some(twice) = found.iter().find(|target| !seen.insert(target.id.0)) {
            return Err(Error::usage(&twice.name, "the structure is listed twice in one build"));
        }
        self.build_blas_objects(&found, mode)
    }

    /// Builds structures for the first time. Those of the library's own come ready from the CPU.
    pub(crate) fn build_first_time(&mut self, structures: &[Arc<AccelStruct>]) -> Result<()> {
        self.first_builds = true;
        let built = self.build_with(structures, BuildMode::Rebuild, |cmd, structures, _| {
            cmd.plan_first_software_builds(structures)
        });
        self.first_builds = false;
        built
    }

    /// As [`build_blas`](Self::build_blas), by object.
    pub(crate) fn build_blas_objects(
        &mut self,
        structures: &[Arc<AccelStruct>],
        mode: BuildMode,
    ) -> Result<()> {
        self.shared.gpu.check_acceleration_structures()?;
        self.build_with(structures, mode, Self::plan_software_builds)
    }

    /// Builds what the device traces, and what software does as `plan_software_builds` says.
    fn build_with(
        &mut self,
        structures: &[Arc<AccelStruct>],
        mode: BuildMode,
        plan_software: PlanSoftwareBuilds,
    ) -> Result<()> {
        let mut open = Vec::with_capacity(structures.len());
        let mut builds = Vec::with_capacity(structures.len());
        let mut refits = Vec::with_capacity(structures.len());
        for target in structures {
            let (mut build, body) = OpenBuild::for_blas(target)?;
            let refit = resolve_refit(target, &body, mode, self.refit_count(target)?)?;
            (build.refit, build.bvh_update) = (refit, self.cpu_bvh_update(target, refit)?);
            open.push(build);
            self.plan_blas_builds(target, &body, refit, &mut builds)?;
            refits.push(refit);
        }
        let software = plan_software(self, structures, &refits)?;
        if self.shared.gpu.accel.is_some() {
            self.gather_inputs(structures, &refits)?;
            self.record_builds(&builds)?;
        }
        if let Err(error) = self.record_software_builds(software) {
            let name = structures.first().map_or("build_blas", |target| &target.name);
            return Err(self.poison(name, error));
        }
        for build in &open {
            let refits = if build.refit { self.refit_count(&build.target)?.saturating_add(1) } else { 0 };
            self.state.refits.insert(build.target.id.0, refits);
        }
        self.state.open_builds.extend(open);
        Ok(())
    }

    /// What the next build does to the tree that the CPU made.
    fn cpu_bvh_update(&self, target: &AccelStruct, refit: bool) -> Result<CpuBvhUpdate> {
        let software = target.blas()?.software.as_ref();
        let Some(software) = software.filter(|software| software.is_built_on_cpu() && !self.first_builds)
        else {
            return Ok(CpuBvhUpdate::None);
        };
        Ok(match (refit, self.moved_storage(target, software).is_some()) {
            (true, false) => CpuBvhUpdate::Refit,
            (true, true) => CpuBvhUpdate::None,
            (false, _) => CpuBvhUpdate::Replace,
        })
    }

    /// A command failed with a part of it recorded: the command buffer cannot be submitted any more.
    #[cold]
    pub(super) fn poison(&mut self, name: &str, error: Error) -> Error {
        self.state.poisoned.get_or_insert_with(|| name.to_owned());
        error
    }

    /// Fails if what was recorded is not whole, or no longer fits what was submitted since.
    pub(crate) fn check_submittable(&self) -> Result<()> {
        if let Some(name) = &self.state.poisoned {
            let message =
                "a command on it failed half recorded; give the command buffer up and record it anew";
            return Err(Error::usage(name, message));
        }
        self.state.open_builds.iter().try_for_each(OpenBuild::check_not_moved)?;
        self.state.placed_blas.values().try_for_each(|blas| check_unmoved(blas))?;
        self.state.tlas_trackers.as_ref().map_or(Ok(()), |updates| updates.check())
    }

    /// Refits since the last rebuild of a bottom-level structure, before the next command.
    fn refit_count(&self, target: &AccelStruct) -> Result<u32> {
        let submitted = target.blas()?.refit_count();
        Ok(self.state.refits.get(&target.id.0).copied().unwrap_or(submitted))
    }

    /// Adds a build for each part.
    fn plan_blas_builds(
        &self,
        target: &Arc<AccelStruct>,
        body: &BlasStructures,
        refit: bool,
        builds: &mut Vec<BlasPartBuild>,
    ) -> Result<()> {
        let blas = target.blas()?;
        let reads = self.build_input_buffers(blas)?;
        for (part, structure) in blas.parts.iter().zip(&body.structures) {
            let mut reads = reads.clone();
            reads.extend(part.map.as_ref().and_then(|map| map.gathered_inputs()));
            builds.push(BlasPartBuild {
                target: Arc::clone(target),
                raw: structure.raw,
                input: self.part_input(target, blas, part)?,
                refit,
                scratch_bytes: part_scratch_bytes(part, refit),
                read_buffers: reads,
            });
        }
        Ok(())
    }

    fn part_input(&self, target: &AccelStruct, blas: &Blas, part: &BlasPart) -> Result<BuildInput> {
        let find = |handle| self.shared.store.buffers.get(handle);
        let transforms = blas.transforms.as_ref().map(|buffer| buffer.address);
        let (gpu, name) = (&self.shared.gpu, &target.name);
        let whole =
            BuildInput::from_geometries(gpu, name, &blas.geometries, target.flags, &find, transforms)?;
        Ok(whole.into_part(part))
    }

    pub(super) fn build_input_buffers(&self, blas: &Blas) -> Result<Vec<Arc<Buffer>>> {
        let buffers = blas.geometries.iter().flat_map(|geometry| geometry.buffers());
        buffers.map(|handle| self.shared.store.buffers.get(handle)).collect()
    }

    /// Records builds in batches that share the scratch buffer.
    fn record_builds(&mut self, builds: &[BlasPartBuild]) -> Result<()> {
        let shared = Arc::clone(&self.shared);
        let alignment = shared.gpu.caps.limits.scratch_alignment.into();
        let sizes: Vec<_> = builds.iter().map(|build| build.scratch_bytes).collect();
        let own = &shared.scratch[self.recording.queue_index];
        let batches = plan_scratch(&sizes, alignment, own.tiers.batch_bytes());
        let most = batches.iter().map(|batch| batch.bytes).max().unwrap_or(0);
        let ext = shared.gpu.accel_functions()?;
        let (scratch, replaced) = own.get_or_grow(&shared.gpu, most)?;
        self.free_replaced_scratch(replaced);
        for batch in batches {
            self.state.accesses.add_id(own.id, Use::accel_build_write());
            let base = aligned_scratch_address(scratch.address, alignment);
            self.record_batch(ext, &builds[batch.builds.clone()], &batch, base);
        }
        Ok(())
    }

    /// Records builds that share the scratch buffer without overlapping in it.
    fn record_batch(&mut self, ext: &ExtDevice, builds: &[BlasPartBuild], batch: &ScratchBatch, base: u64) {
        builds.iter().for_each(|build| self.use_build_accesses(build));
        self.flush_barriers();
        let infos: Vec<_> = builds
            .iter()
            .zip(&batch.offsets)
            .map(|(build, offset)| build.input.build(build.raw, build.refit, base + offset))
            .collect();
        let ranges: Vec<&[vk::AccelerationStructureBuildRangeInfoKHR]> =
            builds.iter().map(|build| &build.input.ranges[..]).collect();
        // SAFETY: inputs, structures and scratch memory are alive, checked, aligned and large enough; barriers keep
        // them apart from other commands.
        unsafe { ext.cmd_build_acceleration_structures(self.raw(), &infos, &ranges) };
    }

    fn use_build_accesses(&mut self, build: &BlasPartBuild) {
        self.state.accesses.add_id(build.target.id, Use::accel_build_write());
        let group = self.built_group();
        self.state.accesses.add_accumulating(group, Use::accel_build_write());
        for buffer in &build.read_buffers {
            self.use_buffer(buffer, Use::accel_build_input());
        }
    }

    /// The next command reads bottom-level structures, whichever it may be.
    pub(super) fn use_all_blas(&mut self, read: Use) {
        self.state.accesses.add_id(self.shared.all_blas, read);
        self.state.accesses.add_id(self.shared.new_blas[self.recording.queue_index], read);
    }

    /// Keeps a scratch buffer that a larger one has replaced until the GPU is done with it.
    pub(super) fn free_replaced_scratch(&self, replaced: Option<Arc<Buffer>>) {
        if let Some(buffer) = replaced {
            self.shared.free_later(DeferredFree::Buffer(buffer));
        }
    }
}

/// Whether the build after so many refits is one too, or why it cannot be made.
fn resolve_refit(target: &AccelStruct, body: &BlasStructures, mode: BuildMode, refits: u32) -> Result<bool> {
    let possible = target.check_refit().is_ok();
    let refit = match mode {
        BuildMode::Auto { .. } if !body.rebuildable => possible,
        _ => mode.refits(possible, refits),
    };
    if refit {
        target.check_refit()?;
    } else if !body.rebuildable {
        let message =
            "a compacted or loaded structure has no memory for a rebuild: refit it, or create a new one";
        return Err(Error::usage(&target.name, message));
    }
    Ok(refit)
}

fn part_scratch_bytes(part: &BlasPart, refit: bool) -> u64 {
    if refit { part.sizes.update_scratch_bytes } else { part.sizes.build_scratch_bytes }
}
