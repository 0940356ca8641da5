//! Builds and refits of acceleration structures.

use std::collections::HashSet;
use std::sync::Arc;

use ash::khr::acceleration_structure::Device as ExtDevice;
use ash::vk;

use super::CommandBuffer;
use super::queue_support::BUILD;
use super::software_ray_query::{SoftwareWork, check_placed};
use crate::accel::AccelStruct;
use crate::accel::accel_struct::AccelKind;
use crate::accel::blas::{Blas, BlasBody, PartShape};
use crate::accel::build::BuildInput;
use crate::accel::flags::BuildMode;
use crate::accel::scratch::{ScratchBatch, aligned_scratch_address, plan_scratch};
use crate::barrier::Use;
use crate::device_state::Garbage;
use crate::error::{Error, Result};
use crate::handle::AccelStructHandle;
use crate::resource::Buffer;

/// Plans the builds or refits of what software traces.
type PlanSoftware = fn(&CommandBuffer, &[Arc<AccelStruct>], &[bool]) -> Result<SoftwareWork>;

/// One build of a part of a bottom-level structure to record.
struct Build {
    target: Arc<AccelStruct>,
    /// The structure that is built, one of the target's.
    raw: vk::AccelerationStructureKHR,
    input: BuildInput,
    refit: bool,
    scratch_bytes: u64,
    reads: Vec<Arc<Buffer>>,
}

/// A build that is recorded; until it is submitted the body must not be replaced by a compacted one.
pub(crate) struct OpenBuild {
    target: Arc<AccelStruct>,
    refit: bool,
    tree: TreeUse,
    submitted: bool,
}

/// What a build does to the tree that the CPU made of a structure for software to trace.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum TreeUse {
    /// Nothing: there is none, or it was moved before.
    None,
    /// Refits it where it lies.
    Refits,
    /// Puts one of the GPU in its place, elsewhere.
    Moves,
}

impl OpenBuild {
    /// Keeps what stands for a bottom-level structure in place, and answers it.
    fn of_blas(target: &Arc<AccelStruct>) -> Result<(Self, Arc<BlasBody>)> {
        let body = target.blas()?.open_build();
        Ok((Self { target: Arc::clone(target), refit: false, tree: TreeUse::None, submitted: false }, body))
    }

    /// A top-level structure stays what it is.
    pub(super) fn of_tlas(target: Arc<AccelStruct>) -> Self {
        Self { target, refit: false, tree: TreeUse::None, submitted: false }
    }

    /// Fails if a submission since it was recorded has moved the tree that it refits.
    pub(super) fn check(&self) -> Result<()> {
        let software = self.target.blas().ok().and_then(|blas| blas.software.as_ref());
        if self.tree == TreeUse::Refits && software.is_some_and(|software| software.moved().is_some()) {
            let message =
                "a refit was recorded, but a submission since then has rebuilt the structure; record it anew";
            return Err(Error::usage(&self.target.name, message));
        }
        Ok(())
    }

    /// It went to the GPU with this timeline value.
    pub(crate) fn submit(mut self, value: u64) {
        self.target.submitted(value);
        self.submitted = true;
        if let (TreeUse::Moves, Ok(Blas { software: Some(software), .. })) = (self.tree, self.target.blas()) {
            software.set_moved();
        }
    }
}

impl Drop for OpenBuild {
    fn drop(&mut self) {
        if let AccelKind::Blas(blas) = &self.target.kind {
            blas.close_build(self.submitted, self.refit);
        }
    }
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
        self.needs_compute(BUILD)?;
        let found: Result<Vec<_>> =
            structures.iter().map(|handle| self.shared.store.accel_structs.get(*handle)).collect();
        let found = found?;
        let mut seen = HashSet::with_capacity(found.len());
        if let Some(twice) = found.iter().find(|target| !seen.insert(target.id.0)) {
            return Err(Error::usage(&twice.name, "the structure is listed twice in one build"));
        }
        self.build_all(&found, mode)
    }

    /// Builds structures for the first time. Those of the library's own come ready from the CPU.
    pub(crate) fn build_first(&mut self, structures: &[Arc<AccelStruct>]) -> Result<()> {
        self.first_builds = true;
        let built = self.build_form(structures, BuildMode::Rebuild, |cmd, structures, _| {
            cmd.plan_software_first(structures)
        });
        self.first_builds = false;
        built
    }

    /// As [`build_blas`](Self::build_blas), by object.
    pub(crate) fn build_all(&mut self, structures: &[Arc<AccelStruct>], mode: BuildMode) -> Result<()> {
        self.shared.gpu.check_acceleration_structures()?;
        self.build_form(structures, mode, Self::plan_software)
    }

    /// Builds what the device traces, and what software does as `plan_software` says.
    fn build_form(
        &mut self,
        structures: &[Arc<AccelStruct>],
        mode: BuildMode,
        plan_software: PlanSoftware,
    ) -> Result<()> {
        let mut open = Vec::with_capacity(structures.len());
        let mut builds = Vec::with_capacity(structures.len());
        let mut refits = Vec::with_capacity(structures.len());
        for target in structures {
            let (mut build, body) = OpenBuild::of_blas(target)?;
            let refit = resolve_mode(target, &body, mode, self.refits_of(target)?)?;
            (build.refit, build.tree) = (refit, self.tree_use(target, refit)?);
            open.push(build);
            self.plan_blas(target, &body, refit, &mut builds)?;
            refits.push(refit);
        }
        let software = plan_software(self, structures, &refits)?;
        if self.shared.gpu.accel.is_some() {
            self.gather_inputs(structures, &refits)?;
            self.record_builds(&builds)?;
        }
        if let Err(error) = self.record_software(software) {
            let name = structures.first().map_or("build_blas", |target| &target.name);
            return Err(self.tear(name, error));
        }
        for build in &open {
            let refits = if build.refit { self.refits_of(&build.target)?.saturating_add(1) } else { 0 };
            self.notes.refits.insert(build.target.id.0, refits);
        }
        self.notes.open_builds.extend(open);
        Ok(())
    }

    /// What the next build does to the tree that the CPU made.
    fn tree_use(&self, target: &AccelStruct, refit: bool) -> Result<TreeUse> {
        let software = target.blas()?.software.as_ref();
        let Some(software) = software.filter(|software| software.is_of_cpu() && !self.first_builds) else {
            return Ok(TreeUse::None);
        };
        Ok(match (refit, self.moved_tree(target, software).is_some()) {
            (true, false) => TreeUse::Refits,
            (true, true) => TreeUse::None,
            (false, _) => TreeUse::Moves,
        })
    }

    /// A command failed with a part of it recorded: the command buffer cannot be submitted any more.
    #[cold]
    pub(super) fn tear(&mut self, name: &str, error: Error) -> Error {
        self.notes.torn.get_or_insert_with(|| name.to_owned());
        error
    }

    /// Fails if what was recorded is not whole, or no longer fits what was submitted since.
    pub(crate) fn check_recorded(&self) -> Result<()> {
        if let Some(name) = &self.notes.torn {
            let message =
                "a command on it failed half recorded; give the command buffer up and record it anew";
            return Err(Error::usage(name, message));
        }
        self.notes.open_builds.iter().try_for_each(OpenBuild::check)?;
        self.notes.placed.values().try_for_each(|blas| check_placed(blas))?;
        self.notes.tlas_updates.as_ref().map_or(Ok(()), |updates| updates.check())
    }

    /// Refits since the last rebuild of a bottom-level structure, before the next command.
    fn refits_of(&self, target: &AccelStruct) -> Result<u32> {
        let submitted = target.blas()?.refits();
        Ok(self.notes.refits.get(&target.id.0).copied().unwrap_or(submitted))
    }

    /// Adds a build for each part.
    fn plan_blas(
        &self,
        target: &Arc<AccelStruct>,
        body: &BlasBody,
        refit: bool,
        builds: &mut Vec<Build>,
    ) -> Result<()> {
        let blas = target.blas()?;
        let reads = self.reads(blas)?;
        for (part, structure) in blas.parts.iter().zip(&body.structures) {
            let mut reads = reads.clone();
            reads.extend(part.map.as_ref().and_then(|map| map.inputs()));
            builds.push(Build {
                target: Arc::clone(target),
                raw: structure.raw,
                input: self.part_input(target, blas, part)?,
                refit,
                scratch_bytes: scratch_bytes(part, refit),
                reads,
            });
        }
        Ok(())
    }

    fn part_input(&self, target: &AccelStruct, blas: &Blas, part: &PartShape) -> Result<BuildInput> {
        let find = |handle| self.shared.store.buffers.get(handle);
        let transforms = blas.transforms.as_ref().map(|buffer| buffer.address);
        let (gpu, name) = (&self.shared.gpu, &target.name);
        let whole = BuildInput::blas(gpu, name, &blas.geometries, target.flags, &find, transforms)?;
        Ok(whole.into_part(part))
    }

    pub(super) fn reads(&self, blas: &Blas) -> Result<Vec<Arc<Buffer>>> {
        let buffers = blas.geometries.iter().flat_map(|geometry| geometry.buffers());
        buffers.map(|handle| self.shared.store.buffers.get(handle)).collect()
    }

    /// Records builds in batches that share the scratch buffer.
    fn record_builds(&mut self, builds: &[Build]) -> Result<()> {
        let shared = Arc::clone(&self.shared);
        let alignment = shared.gpu.caps.limits.scratch_alignment.into();
        let sizes: Vec<_> = builds.iter().map(|build| build.scratch_bytes).collect();
        let own = &shared.scratch[self.recording.queue_index];
        let batches = plan_scratch(&sizes, alignment, own.tiers.batch_bytes());
        let most = batches.iter().map(|batch| batch.bytes).max().unwrap_or(0);
        let ext = shared.gpu.accel_functions()?;
        let (scratch, replaced) = own.get(&shared.gpu, most)?;
        self.retire_replaced(replaced);
        for batch in batches {
            self.notes.uses.id(own.id, Use::accel_build_write());
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
            .map(|(build, offset)| build.input.build(build.raw, build.refit, base + offset))
            .collect();
        let ranges: Vec<&[vk::AccelerationStructureBuildRangeInfoKHR]> =
            builds.iter().map(|build| &build.input.ranges[..]).collect();
        // SAFETY: inputs, structures and scratch memory are alive, checked, aligned and large enough; barriers keep
        // them apart from other commands.
        unsafe { ext.cmd_build_acceleration_structures(self.raw(), &infos, &ranges) };
    }

    fn use_build(&mut self, build: &Build) {
        self.notes.uses.id(build.target.id, Use::accel_build_write());
        let group = self.built_group();
        self.notes.uses.accumulate(group, Use::accel_build_write());
        for buffer in &build.reads {
            self.use_buffer(buffer, Use::accel_build_input());
        }
    }

    /// The next command reads bottom-level structures, whichever it may be.
    pub(super) fn use_shown(&mut self, read: Use) {
        self.notes.uses.id(self.shared.all_blas, read);
        self.notes.uses.id(self.shared.new_blas[self.recording.queue_index], read);
    }

    /// Keeps a scratch buffer that a larger one has replaced until the GPU is done with it.
    pub(super) fn retire_replaced(&self, replaced: Option<Arc<Buffer>>) {
        if let Some(buffer) = replaced {
            self.shared.retire(Garbage::Buffer(buffer));
        }
    }
}

/// Whether the build after so many refits is one too, or why it cannot be made.
fn resolve_mode(target: &AccelStruct, body: &BlasBody, mode: BuildMode, refits: u32) -> Result<bool> {
    let possible = target.check_refit().is_ok();
    let refit = match mode {
        BuildMode::Auto { .. } if !body.rebuildable => possible,
        _ => mode.refits(possible, refits),
    };
    if refit {
        target.check_refit()?;
    } else if !body.rebuildable {
        let message =
            "a compacted or loaded structure has no room for a rebuild: refit it, or create a new one";
        return Err(Error::usage(&target.name, message));
    }
    Ok(refit)
}

fn scratch_bytes(part: &PartShape, refit: bool) -> u64 {
    if refit { part.sizes.update_scratch_bytes } else { part.sizes.build_scratch_bytes }
}
