//! Builds and refits of BLAS.

use std::collections::HashSet;
use std::sync::Arc;

use ash::vk;

use super::CommandBuffer;
use super::open_build::{CpuBvhUpdate, OpenBuild};
use super::queue_support::BUILD_ON_QUEUE;
use crate::accel::AccelStruct;
use crate::accel::blas::{Blas, BlasStructures};
use crate::accel::build::BuildInput;
use crate::accel::flags::BuildMode;
use crate::accel::scratch::{aligned_scratch_address, plan_scratch};
use crate::barrier::{ResourceId, Stages, Use};
use crate::cpu_scope::cpu_scope;
use crate::device_state::DeferredObject;
use crate::error::{Error, Result};
use crate::handle::AccelStructHandle;
use crate::resource::Buffer;
use crate::software_ray_query::record::{SoftwareBuilds, check_unmoved};

/// Builds and refits of BLAS, to be recorded together.
pub(crate) struct BlasBuildPlan {
    open: Vec<OpenBuild>,
    parts: Vec<BlasPartBuild>,
    software: SoftwareBuilds,
    is_first: bool,
}

/// Build or refit of one part of a BLAS.
struct BlasPartBuild {
    id: ResourceId,
    blas: Arc<Blas>,
    /// Index of the part in `blas`.
    part: usize,
    /// The Vulkan acceleration structure of the part.
    raw: vk::AccelerationStructureKHR,
    refit: bool,
    scratch_bytes: u64,
    read_buffers: Vec<Arc<Buffer>>,
}

impl BlasPartBuild {
    fn input(&self) -> &BuildInput {
        &self.blas.parts[self.part].input
    }
}

impl CommandBuffer {
    /// Rebuilds BLAS from their buffers, or refits them (`vkCmdBuildAccelerationStructuresKHR`). The contents of the
    /// buffers may have changed, the counts may not. For a refit, the indices may not have changed either.
    ///
    /// Rays traced later in the same command buffer, or in later submissions, see the result. If the bounds of a BLAS
    /// changed, the TLAS that reference it need an update too. If the BLAS was created without
    /// [`BuildFlags::ALLOW_UPDATE`](crate::BuildFlags::ALLOW_UPDATE), they need an update after any change, as a
    /// software TLAS may reference parts of the BLAS.
    ///
    /// # Errors
    /// [`InvalidUsage`](Error::InvalidUsage) for a refit without
    /// [`BuildFlags::ALLOW_UPDATE`](crate::BuildFlags::ALLOW_UPDATE), a rebuild of a BLAS that was compacted, or
    /// compacted before it was saved, and a BLAS listed twice; [`WrongQueue`](Error::WrongQueue) on the transfer queue.
    /// If memory for tables of software BVHs runs out, the command buffer can no longer be submitted. Memory for the BVHs
    /// themselves and for the scratch buffer is allocated before anything is recorded.
    pub fn build_blas(&mut self, structures: &[AccelStructHandle], mode: BuildMode) -> Result<()> {
        self.needs_compute(BUILD_ON_QUEUE)?;
        let found: Result<Vec<_>> =
            structures.iter().map(|handle| self.shared.store.accel_structs.get(*handle)).collect();
        let found = found?;
        let mut seen = HashSet::with_capacity(found.len());
        if let Some(twice) = found.iter().find(|target| !seen.insert(target.id.0)) {
            return Err(Error::usage(&twice.name, "the BLAS is listed twice in one build"));
        }
        self.shared.gpu.check_acceleration_structures()?;
        let plan = self.plan_blas_builds(&found, mode, false)?;
        self.record_blas_builds(plan)
    }

    /// Plans builds or refits of BLAS. `is_first` means that nothing is built yet, except the software BVHs that the
    /// CPU builds, and that no TLAS references the BLAS.
    pub(crate) fn plan_blas_builds(
        &self,
        targets: &[Arc<AccelStruct>],
        mode: BuildMode,
        is_first: bool,
    ) -> Result<BlasBuildPlan> {
        let mut open = Vec::with_capacity(targets.len());
        let mut parts = Vec::with_capacity(targets.len());
        let mut refits = Vec::with_capacity(targets.len());
        for target in targets {
            let blas = target.blas()?;
            let (mut build, body) = OpenBuild::for_blas(target)?;
            let refit = resolve_refit(target, &body, mode, self.refit_count(target)?)?;
            build.refit = refit;
            if !is_first {
                build.bvh_update = self.cpu_bvh_update(target, blas, refit);
            }
            open.push(build);
            refits.push(refit);
            let inputs = self.build_input_buffers(blas)?;
            for (index, (part, structure)) in blas.parts.iter().zip(&body.structures).enumerate() {
                let mut read_buffers = inputs.clone();
                read_buffers.extend(part.map.as_ref().and_then(|map| map.gathered_inputs()));
                let sizes = &part.sizes;
                parts.push(BlasPartBuild {
                    id: target.id,
                    blas: Arc::clone(blas),
                    part: index,
                    raw: structure.raw,
                    refit,
                    scratch_bytes: if refit { sizes.update_scratch_bytes } else { sizes.build_scratch_bytes },
                    read_buffers,
                });
            }
        }
        let software = match is_first {
            true => self.plan_first_software_builds(targets)?,
            false => self.plan_software_builds(targets, &refits)?,
        };
        Ok(BlasBuildPlan { open, parts, software, is_first })
    }

    /// Records builds of parts in batches that share the scratch buffer (`vkCmdBuildAccelerationStructuresKHR`), and
    /// then the builds of the software BVHs.
    pub(crate) fn record_blas_builds(&mut self, plan: BlasBuildPlan) -> Result<()> {
        cpu_scope!("record BLAS builds");
        let BlasBuildPlan { open, parts, software, is_first } = plan;
        let shared = Arc::clone(&self.shared);
        if shared.gpu.accel.is_some() {
            let alignment = shared.gpu.caps.limits.scratch_alignment.into();
            let sizes: Vec<_> = parts.iter().map(|build| build.scratch_bytes).collect();
            let own = &shared.scratch[self.recording.queue_index];
            let batches = plan_scratch(&sizes, alignment, own.tiers.batch_bytes());
            let most = batches.iter().map(|batch| batch.bytes).max().unwrap_or(0);
            let ext = shared.gpu.accel_functions()?;
            let (scratch, replaced) = own.get_or_grow(&shared.gpu, most)?;
            self.free_replaced_scratch(replaced);
            self.gather_inputs(open.iter().map(|build| (&*build.target, build.refit)))?;
            let base = aligned_scratch_address(scratch.address, alignment);
            for batch in batches {
                let builds = &parts[batch.builds];
                self.state.accesses.add_id(own.id, Use::accel_build_write());
                builds.iter().for_each(|build| self.use_build_accesses(build, is_first));
                self.flush_barriers();
                let infos: Vec<_> = (builds.iter().zip(&batch.offsets))
                    .map(|(build, offset)| build.input().build(build.raw, build.refit, base + offset))
                    .collect();
                let ranges: Vec<_> = builds.iter().map(|build| &build.input().ranges[..]).collect();
                // SAFETY: inputs, acceleration structures and scratch memory are alive, checked, aligned and large
                // enough; barriers keep them apart from other commands.
                unsafe { ext.cmd_build_acceleration_structures(self.raw(), &infos, &ranges) };
            }
        }
        if let Err(error) = self.record_software_builds(software, is_first) {
            let name = open.first().map_or("build_blas", |build| &build.target.name);
            return Err(self.poison(name, error));
        }
        for build in &open {
            let refits = if build.refit { self.refit_count(&build.target)?.saturating_add(1) } else { 0 };
            self.state.refits.insert(build.target.id.0, refits);
        }
        self.state.open_builds.extend(open);
        Ok(())
    }

    fn use_build_accesses(&mut self, build: &BlasPartBuild, is_first: bool) {
        let write = Use::accel_build_write();
        let group = self.built_group(is_first);
        self.state.accesses.add_id(build.id, write);
        self.state.accesses.add_accumulating(group, write);
        for micromap in build.input().micromaps() {
            self.use_buffer(&micromap.storage, Use::accel_read(Stages::ACCEL_BUILD));
        }
        build.read_buffers.iter().for_each(|buffer| self.use_buffer(buffer, Use::accel_build_input()));
    }

    /// Returns the effect of the next build on the BVH that the CPU built.
    fn cpu_bvh_update(&self, target: &AccelStruct, blas: &Blas, refit: bool) -> CpuBvhUpdate {
        let Some(software) = blas.software.as_ref().filter(|software| software.is_built_on_cpu()) else {
            return CpuBvhUpdate::None;
        };
        match (refit, self.moved_storage(target, software).is_some()) {
            (true, false) => CpuBvhUpdate::Refit,
            (true, true) => CpuBvhUpdate::None,
            (false, _) => CpuBvhUpdate::Replace,
        }
    }

    /// Poisons the command buffer, which cannot be submitted any more: a command failed with a part of it recorded. The
    /// prologue of the next submission is submitted all the same, as it has the work of other calls: its failed command
    /// writes only memory of objects whose creation fails too, or which a later submission writes again.
    #[cold]
    pub(super) fn poison(&mut self, name: &str, error: Error) -> Error {
        self.state.poisoned.get_or_insert_with(|| name.to_owned());
        error
    }

    /// Fails if the recording is incomplete, or no longer fits the submissions since.
    pub(crate) fn check_submittable(&self) -> Result<()> {
        if let Some(name) = &self.state.poisoned {
            let message = "a command on it failed with only a part recorded; drop the command buffer and record a new one";
            return Err(Error::usage(name, message));
        }
        self.state.open_builds.iter().try_for_each(OpenBuild::check_not_moved)?;
        self.state.placed_blas.values().try_for_each(|blas| check_unmoved(blas))?;
        self.state.tlas_trackers.as_ref().map_or(Ok(()), |updates| updates.check())
    }

    /// Returns the refits since the last rebuild of a BLAS, before the next command.
    fn refit_count(&self, target: &AccelStruct) -> Result<u32> {
        let submitted = target.blas()?.refit_count();
        Ok(self.state.refits.get(&target.id.0).copied().unwrap_or(submitted))
    }

    /// Returns the buffers that builds of the BLAS read.
    pub(crate) fn build_input_buffers(&self, blas: &Blas) -> Result<Vec<Arc<Buffer>>> {
        let buffers = blas.geometries.iter().flat_map(|geometry| geometry.buffers());
        buffers.map(|handle| self.shared.store.buffers.get(handle)).collect()
    }

    /// Declares that the next command may read any BLAS.
    pub(crate) fn use_all_blas(&mut self, read: Use) {
        self.state.accesses.add_id(self.shared.all_blas, read);
        self.state.accesses.add_id(self.shared.new_blas[self.recording.queue_index], read);
    }

    /// Frees a scratch buffer that a larger one has replaced, once the GPU is done with it.
    pub(crate) fn free_replaced_scratch(&self, replaced: Option<Arc<Buffer>>) {
        if let Some(buffer) = replaced {
            self.shared.free_later(DeferredObject::Buffer(buffer));
        }
    }
}

/// Returns true if the next build is a refit, after `refits` refits. Fails if the BLAS does not allow that build.
fn resolve_refit(target: &AccelStruct, body: &BlasStructures, mode: BuildMode, refits: u32) -> Result<bool> {
    let possible = target.check_refit().is_ok();
    let refit = match mode {
        BuildMode::Auto { .. } if !body.rebuildable => possible,
        _ => mode.refits(possible, refits),
    };
    if refit {
        target.check_refit()?;
    } else if !body.rebuildable {
        let message = "a compacted or loaded BLAS has no memory for a rebuild: refit it, or create a new one";
        return Err(Error::usage(&target.name, message));
    }
    Ok(refit)
}
