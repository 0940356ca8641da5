//! What top-level structures show: instances from the host or from a buffer, and their builds.

use std::sync::Arc;

use ash::vk;

use super::CommandBuffer;
use super::open_build::OpenBuild;
use super::recording_state::RecordingState;
use super::write_instances::{KernelInstances, StagedInstances, VulkanInstances};
use crate::accel::AccelStruct;
use crate::accel::blas_refs::{AccelGeneration, BlasRefSet};
use crate::accel::build::TlasBuild;
use crate::accel::flags::BuildMode;
use crate::accel::instance::{DeviceInstances, TlasInstance};
use crate::accel::instance_plan::PlanMemory;
use crate::accel::scratch::aligned_scratch_address;
use crate::accel::tlas::{InstanceSource, Tlas};
use crate::accel::tlas_tracker::{RecordedTlasBuild, TlasChange, TlasEntry, TlasTracker, TlasTrackers};
use crate::barrier::{ResourceId, Stages, Use};
use crate::bindless::layout::TLAS_TABLE_ENTRY_BYTES;
use crate::error::{Error, Result, check_limit};
use crate::handle::AccelStructHandle;
use crate::resource::Buffer;
use crate::software_ray_query::tlas::SoftwareTlas;
use crate::submit::ownership::QueueAccess;

/// What is known of a structure before the next command.
struct PreviousState<'a> {
    /// Instances of the caller and of Vulkan, `None` before the first build.
    counts: Option<(u32, u32)>,
    refits: u32,
    /// Whether this command buffer has not updated it.
    is_first: bool,
    /// What it shows, or nothing where some of that is gone or has moved.
    blas_refs: &'a Arc<BlasRefSet>,
    /// Whether it shows that.
    is_current: bool,
    /// When that was looked at.
    generation: AccelGeneration,
}

/// Instances on their way into the build of one structure.
#[derive(Clone, Copy)]
struct TlasBuildRequest<'a> {
    target: &'a AccelStruct,
    tlas: &'a Tlas,
    previous: &'a PreviousState<'a>,
    mode: BuildMode,
}

impl CommandBuffer {
    /// Shows other instances in a top-level structure: at most its capacity, and for a refit as many as before
    /// (`vkCmdBuildAccelerationStructuresKHR`). The instances are copied at once.
    ///
    /// # Errors
    /// [`LimitExceeded`](Error::LimitExceeded) over the capacity; [`InvalidUsage`](Error::InvalidUsage) for numbers
    /// that do not fit their bits, transforms that are not finite, and refits that are not allowed;
    /// [`WrongQueue`](Error::WrongQueue) on the transfer queue. Where the device and software both trace, and there is no memory
    /// for software's half of the update, the command buffer can no longer be submitted.
    pub fn update_tlas(
        &mut self,
        tlas: AccelStructHandle,
        instances: &[TlasInstance],
        mode: BuildMode,
    ) -> Result<()> {
        self.needs_compute("an update of a top-level structure")?;
        self.with_tlas_trackers(|cmd, updates| {
            let index = updates.index_of_handle(&cmd.shared.store.accel_structs, tlas)?;
            cmd.update_entry(updates, index, instances, mode)
        })
    }

    /// As [`update_tlas`](Self::update_tlas), with instances that lie in a buffer: written by a compute shader, say,
    /// earlier in the same command buffer.
    ///
    /// Split meshes take the room of their parts for every record, since the host does not know who refers to them. From
    /// one refit to the next a record may come to name another structure of the list, but it may not begin or cease to
    /// name one that exists: Vulkan takes that for an instance that comes or goes.
    ///
    /// # Errors
    /// As [`update_tlas`](Self::update_tlas), but the records themselves are not checked; and
    /// [`InvalidUsage`](Error::InvalidUsage) for a buffer without the usage, or too small.
    pub fn update_tlas_from_buffer(
        &mut self,
        tlas: AccelStructHandle,
        instances: &DeviceInstances<'_>,
        mode: BuildMode,
    ) -> Result<()> {
        self.needs_compute("an update of a top-level structure")?;
        self.with_tlas_trackers(|cmd, updates| {
            let index = updates.index_of_handle(&cmd.shared.store.accel_structs, tlas)?;
            cmd.update_entry_from_buffer(updates, index, instances, mode)
        })
    }

    /// As [`update_tlas`](Self::update_tlas), by object.
    pub(crate) fn update_tlas_object(
        &mut self,
        target: &Arc<AccelStruct>,
        instances: &[TlasInstance],
        mode: BuildMode,
    ) -> Result<()> {
        self.with_tlas_trackers(|cmd, updates| {
            let index = updates.index_of(target);
            cmd.update_entry(updates, index, instances, mode)
        })
    }

    /// Writes the instances of a structure again, as what it shows has moved, and builds it.
    pub(crate) fn rewrite_tlas(&mut self, target: &Arc<AccelStruct>) -> Result<()> {
        let tlas = target.tlas()?;
        let contents = tlas.contents().clone();
        let (Some(source), Some(count)) = (contents.source, contents.instance_count) else { return Ok(()) };
        let blas_refs = Arc::new(contents.blas_refs.refreshed());
        let source = InstanceSource::clone(&source);
        self.with_tlas_trackers(|cmd, updates| {
            let index = updates.index_of(target);
            let TlasEntry { target, tracker: update, no_refs, .. } = updates.entry(index);
            let previous = cmd.previous_state(tlas, update, no_refs);
            let kernel_instances =
                cmd.record_instances(target, tlas, blas_refs, source, contents.built_count)?;
            cmd.build_from_kernel(target, tlas, &kernel_instances, previous.is_first, false)?;
            let (recorded, blas_refs, source) =
                cmd.publish(tlas, &previous, kernel_instances.into_change(count, false));
            updates.record_build(index, &recorded, blas_refs, source);
            Ok(())
        })
    }

    /// Has `record_build` keep what it updates.
    #[inline(always)]
    fn with_tlas_trackers(
        &mut self,
        record: impl FnOnce(&mut Self, &mut TlasTrackers) -> Result<()>,
    ) -> Result<()> {
        let mut updates = self.state.tlas_trackers.take().unwrap_or_default();
        let recorded = record(self, &mut updates);
        self.state.tlas_trackers = Some(updates);
        recorded
    }

    /// Shows instances of the host in the structure of a row. Mostly few, and of the same structures as before.
    #[inline(always)]
    fn update_entry(
        &mut self,
        updates: &mut TlasTrackers,
        index: usize,
        instances: &[TlasInstance],
        mode: BuildMode,
    ) -> Result<()> {
        let TlasEntry { target, tracker: update, no_refs, .. } = updates.entry(index);
        let tlas = target.tlas()?;
        if instances.len() > tlas.capacity as usize {
            return check_capacity(target, tlas, instances.len() as u64);
        }
        let previous = self.previous_state(tlas, update, no_refs);
        if tlas.software.is_none()
            && let Some(address) = self.try_stage_unchanged(instances, previous.blas_refs)?
        {
            let update = TlasBuildRequest { target, tlas, previous: &previous, mode };
            let recorded = self.build_unchanged(update, instances.len() as u32, address)?;
            updates.record_unchanged(index, &recorded);
            return Ok(());
        }
        self.update_changed(updates, index, instances, mode)
    }

    /// Builds from instances that Vulkan can read, of what was shown before.
    #[inline(always)]
    fn build_unchanged(
        &mut self,
        update: TlasBuildRequest<'_>,
        count: u32,
        address: u64,
    ) -> Result<RecordedTlasBuild> {
        let TlasBuildRequest { tlas, previous, .. } = update;
        let refit = self.build_from_addresses(update, count, address)?;
        if previous.is_first {
            self.reference_blas(previous.blas_refs);
        }
        let hit_table_address = self.write_hit_table_entry(tlas, previous, previous.blas_refs);
        Ok(RecordedTlasBuild {
            counts: (count, count),
            refit,
            hit_table_address,
            generation: previous.generation,
        })
    }

    /// Builds from instances that the host has written with addresses. Answers whether it is a refit.
    #[inline(always)]
    fn build_from_addresses(
        &mut self,
        update: TlasBuildRequest<'_>,
        count: u32,
        address: u64,
    ) -> Result<bool> {
        let refit = update.check_counts(count, count)?;
        let instances = VulkanInstances { address, count, is_from_kernel: false };
        self.build_tlas(update.target, update.tlas, instances, update.previous.is_first, refit)?;
        Ok(refit)
    }

    /// As [`update_entry`](Self::update_entry), of whatever structures.
    #[inline(never)]
    fn update_changed(
        &mut self,
        updates: &mut TlasTrackers,
        index: usize,
        instances: &[TlasInstance],
        mode: BuildMode,
    ) -> Result<()> {
        let TlasEntry { target, tracker: update, no_refs, plan_memory: memory } = updates.entry(index);
        let tlas = target.tlas()?;
        let previous = self.previous_state(tlas, update, no_refs);
        let update = TlasBuildRequest { target, tlas, previous: &previous, mode };
        let count = instances.len() as u32;
        let staged = match tlas.structure {
            Some(_) => self.stage_instances(&target.name, instances, previous.blas_refs, &mut memory.seen)?,
            None => None,
        };
        let change = match staged {
            Some(StagedInstances { address, blas_refs }) => {
                let refit = self.build_from_addresses(update, count, address)?;
                TlasChange { count, built_count: count, blas_refs, source: None, refit }
            }
            None => self.update_with_kernel(update, instances, memory)?,
        };
        if let Some(software) = &tlas.software
            && let Err(error) = self.build_software_tlas(target, software, instances)
        {
            return Err(self.fail_after_device_build(target, tlas, error));
        }
        let (recorded, blas_refs, source) = self.publish(tlas, &previous, change);
        updates.record_build(index, &recorded, blas_refs, source);
        Ok(())
    }

    /// Builds from instances that a kernel writes; where the device has no structures of its own, only checks.
    #[inline(never)]
    fn update_with_kernel(
        &mut self,
        update: TlasBuildRequest<'_>,
        instances: &[TlasInstance],
        memory: &mut PlanMemory,
    ) -> Result<TlasChange> {
        let TlasBuildRequest { target, tlas, previous, .. } = update;
        let count = instances.len() as u32;
        let plan = self.plan_instances(&target.name, instances, previous.blas_refs, memory)?;
        if tlas.structure.is_none() {
            let blas_refs = Some(Arc::clone(&plan.blas_refs));
            memory.ref_indices = plan.into_ref_indices();
            let refit = update.check_counts(count, count)?;
            return Ok(TlasChange { count, built_count: count, blas_refs, source: None, refit });
        }
        let refit = update.check_counts(count, plan.built_count)?;
        let (source, blas_refs) = self.host_source(&target.name, instances, plan, memory)?;
        let built_count = source.built_count(&target.name)?;
        let kernel_instances = self.record_instances(target, tlas, blas_refs, source, built_count)?;
        self.build_from_kernel(target, tlas, &kernel_instances, previous.is_first, refit)?;
        Ok(kernel_instances.into_change(count, refit))
    }

    /// Shows instances that lie in a buffer in the structure of a row.
    fn update_entry_from_buffer(
        &mut self,
        updates: &mut TlasTrackers,
        index: usize,
        instances: &DeviceInstances<'_>,
        mode: BuildMode,
    ) -> Result<()> {
        let TlasEntry { target, tracker: update, no_refs, .. } = updates.entry(index);
        let tlas = target.tlas()?;
        let count = instances.count;
        check_capacity(target, tlas, count.into())?;
        let previous = self.previous_state(tlas, update, no_refs);
        let update = TlasBuildRequest { target, tlas, previous: &previous, mode };
        let (blas_refs, source) = self.device_source(&target.name, instances, previous.blas_refs)?;
        let change = match tlas.structure {
            Some(_) => self.build_from_buffer(update, instances, Arc::clone(&blas_refs), source)?,
            None => {
                let refit = update.check_counts(count, count)?;
                TlasChange {
                    count,
                    built_count: count,
                    blas_refs: Some(Arc::clone(&blas_refs)),
                    source: None,
                    refit,
                }
            }
        };
        if let Some(software) = &tlas.software
            && let Err(error) = self.build_software_tlas_from_buffer(target, software, instances, &blas_refs)
        {
            return Err(self.fail_after_device_build(target, tlas, error));
        }
        let (recorded, blas_refs, source) = self.publish(tlas, &previous, change);
        updates.record_build(index, &recorded, blas_refs, source);
        Ok(())
    }

    /// Builds what the device traces from instances that lie in a buffer.
    fn build_from_buffer(
        &mut self,
        update: TlasBuildRequest<'_>,
        instances: &DeviceInstances<'_>,
        blas_refs: Arc<BlasRefSet>,
        mut source: InstanceSource,
    ) -> Result<TlasChange> {
        let TlasBuildRequest { target, tlas, previous, .. } = update;
        let built_count = source.built_count(&target.name)?;
        let refit = update.check_counts(instances.count, built_count)?;
        self.keep_source_copy(&target.name, instances, &blas_refs, &mut source)?;
        let kernel_instances = self.record_instances(target, tlas, blas_refs, source, built_count)?;
        self.build_from_kernel(target, tlas, &kernel_instances, previous.is_first, refit)?;
        Ok(kernel_instances.into_change(instances.count, refit))
    }

    /// Takes the updates so far for submitted: for the command buffer that goes before every other one.
    pub(crate) fn apply_tlas_updates(&mut self) {
        let RecordingState { tlas_trackers, build_run, open_builds, .. } = &mut **self.state;
        build_run.stop();
        if let Some(updates) = tlas_trackers {
            self.shared.apply_tlas_updates(updates, |target| {
                open_builds.push(OpenBuild::for_tlas(Arc::clone(target)))
            });
        }
    }

    /// What is known of a structure before the next command.
    #[inline(always)]
    fn previous_state<'a>(
        &self,
        tlas: &Tlas,
        update: &'a mut TlasTracker,
        no_refs: &'a Arc<BlasRefSet>,
    ) -> PreviousState<'a> {
        let generation = self.shared.accel_generation();
        let is_first = !update.is_recorded();
        let contents = update.current(tlas);
        let find = |handle| self.shared.blas_ref(handle);
        let is_current = contents.generation == generation || contents.blas_refs.is_current(&find);
        let blas_refs = if is_current { &contents.blas_refs } else { no_refs };
        PreviousState {
            counts: contents.counts(),
            refits: contents.refits,
            is_first,
            blas_refs,
            is_current,
            generation,
        }
    }

    /// Builds from what a kernel writes, which is recorded.
    fn build_from_kernel(
        &mut self,
        target: &AccelStruct,
        tlas: &Tlas,
        kernel_instances: &KernelInstances,
        is_first: bool,
        refit: bool,
    ) -> Result<()> {
        let built = self.build_tlas(target, tlas, kernel_instances.build_instances(), is_first, refit);
        built.map_err(|error| self.poison(&target.name, error))
    }

    /// Software's half of an update failed. Where the device has one, that is recorded.
    #[cold]
    fn fail_after_device_build(&mut self, target: &AccelStruct, tlas: &Tlas, error: Error) -> Error {
        if tlas.structure.is_some() { self.poison(&target.name, error) } else { error }
    }

    /// Records the build of what the device traces.
    #[inline(always)]
    fn build_tlas(
        &mut self,
        target: &AccelStruct,
        tlas: &Tlas,
        instances: VulkanInstances,
        is_first: bool,
        refit: bool,
    ) -> Result<()> {
        let sizes = &target.sizes;
        let scratch_bytes = if refit { sizes.update_scratch_bytes } else { sizes.build_scratch_bytes };
        let records = if instances.is_from_kernel { tlas.records.get() } else { None };
        let scratch = self.join_build_run(target.id, scratch_bytes, records.map(|records| &**records))?;
        let build = TlasBuild {
            flags: target.flags,
            instances: instances.address,
            count: instances.count,
            refit,
            target: tlas.structure.as_ref().map_or(vk::AccelerationStructureKHR::null(), |of| of.raw),
            scratch,
        };
        // SAFETY: instances, structure and scratch memory are alive, checked, aligned and large enough; barriers keep them
        // apart from other commands.
        unsafe { build.record(self.shared.gpu.accel_functions()?, self.raw()) };
        if is_first {
            self.reference_resource(target.id, QueueAccess::Write);
        }
        Ok(())
    }

    /// Scratch memory for a build of a top-level structure, behind the barriers it needs. There are none where the commands
    /// before were such builds too, of other structures, and there is memory left beside theirs; then all may run at once.
    #[inline(always)]
    fn join_build_run(&mut self, target: ResourceId, bytes: u64, records: Option<&Buffer>) -> Result<u64> {
        let alignment = self.shared.gpu.caps.limits.scratch_alignment.into();
        if records.is_none()
            && let Some(scratch) = self.state.build_run.try_add(target, bytes, alignment)
        {
            return Ok(scratch);
        }
        self.begin_build_run(target, bytes, alignment, records)
    }

    /// The same for a build that waits for those before.
    #[inline(never)]
    fn begin_build_run(
        &mut self,
        target: ResourceId,
        bytes: u64,
        alignment: u64,
        records: Option<&Buffer>,
    ) -> Result<u64> {
        let shared = &self.shared;
        let own = &shared.scratch[self.recording.queue_index];
        let (buffer, replaced) = own.get_or_grow(&shared.gpu, bytes)?;
        self.free_replaced_scratch(replaced);
        self.state.accesses.add_id(own.id, Use::accel_build_write());
        self.state.accesses.add_accumulating(shared.all_tlas, Use::accel_build_write());
        self.use_all_blas(Use::accel_read(Stages::ACCEL_BUILD));
        if let Some(records) = records {
            self.use_buffer(records, Use::accel_build_input());
        }
        self.flush_barriers();
        let (start, end) =
            (aligned_scratch_address(buffer.address, alignment), buffer.address + buffer.size_bytes);
        self.state.build_run.start(target, start..end, bytes, alignment);
        Ok(start)
    }

    /// Tells queues and shaders what the structure shows from now on; `None` for what is shown the same as before.
    fn publish(
        &mut self,
        tlas: &Tlas,
        previous: &PreviousState<'_>,
        change: TlasChange,
    ) -> (RecordedTlasBuild, Option<Arc<BlasRefSet>>, Option<Arc<InstanceSource>>) {
        let TlasChange { count, built_count, blas_refs: new, source, refit } = change;
        let new = new.or_else(|| (!previous.is_current).then(|| Arc::clone(previous.blas_refs)));
        let blas_refs = new.as_ref().unwrap_or(previous.blas_refs);
        if previous.is_first || new.is_some() {
            self.reference_blas(blas_refs);
        }
        let hit_table_address = self.write_hit_table_entry(tlas, previous, blas_refs);
        let counts = (count, built_count);
        (RecordedTlasBuild { counts, refit, hit_table_address, generation: previous.generation }, new, source)
    }

    /// Has other queues be done with what is shown, which may come from them.
    fn reference_blas(&mut self, blas_refs: &BlasRefSet) {
        if self.shared.gpu.queues.has_several() {
            blas_refs
                .refs()
                .iter()
                .for_each(|blas_refs| self.reference_resource(blas_refs.id, QueueAccess::Read));
        }
    }

    /// Tells shaders where the rows of the structure lie, unless they know. Answers what it tells.
    #[inline(always)]
    fn write_hit_table_entry(
        &mut self,
        tlas: &Tlas,
        previous: &PreviousState<'_>,
        blas_refs: &BlasRefSet,
    ) -> Option<u64> {
        // At first the entry is that of the slot's last owner.
        if previous.counts.is_some() && tlas.hit_table.get().is_none() {
            return None;
        }
        let rows = tlas.hit_table.get().filter(|_| blas_refs.needs_hit_remap).map_or(0, |rows| rows.address);
        self.write_tlas_table(tlas.slot, tlas_table_entry(tlas, rows));
        Some(rows)
    }

    /// Structures that this command buffer takes to have no rows, though a submission since it was recorded has given them some:
    /// their slots, with what the table has to say of them first.
    pub(crate) fn entries_without_hit_table(&self) -> Vec<(u32, [u64; 2])> {
        let Some(updates) = &self.state.tlas_trackers else { return Vec::new() };
        updates.with_unexpected_hit_table().map(|tlas| (tlas.slot, tlas_table_entry(tlas, 0))).collect()
    }

    /// Tells shaders where the rows of a structure lie, and what software traces; 0 where there is nothing.
    pub(crate) fn write_tlas_table(&mut self, slot: u32, entry: [u64; 2]) {
        let shared = Arc::clone(&self.shared);
        let Some(table) = shared.tlas_table.as_ref() else { return };
        self.state.accesses.add_id(shared.hit_tables_id, Use::transfer_write());
        self.flush_barriers();
        let offset = u64::from(slot) * TLAS_TABLE_ENTRY_BYTES;
        // SAFETY: the table has an entry for every slot.
        unsafe {
            shared.gpu.device.cmd_update_buffer(self.raw(), table.raw, offset, bytemuck::bytes_of(&entry));
        }
    }

    /// Has shaders see nothing in slots whose structures are gone.
    pub(crate) fn clear_tlas_entries(&mut self, slots: &[u32]) {
        slots.iter().for_each(|slot| self.write_tlas_table(*slot, [0; 2]));
    }

    /// Empties the table that says where rows lie.
    pub(crate) fn clear_tlas_table(&mut self) {
        let shared = Arc::clone(&self.shared);
        let Some(table) = shared.tlas_table.as_ref() else { return };
        self.state.accesses.add_id(shared.hit_tables_id, Use::transfer_write());
        self.flush_barriers();
        // SAFETY: the whole buffer is filled.
        unsafe { shared.gpu.device.cmd_fill_buffer(self.raw(), table.raw, 0, vk::WHOLE_SIZE, 0) };
    }
}

impl TlasBuildRequest<'_> {
    /// Checks the counts; answers whether it is a refit.
    #[inline(always)]
    fn check_counts(&self, count: u32, built: u32) -> Result<bool> {
        let Self { target, tlas, previous, mode } = self;
        if built > tlas.built_capacity {
            return Err(capacity_error(target, tlas, count, built));
        }
        let same = previous.counts == Some((count, built));
        let refit = mode.refits(same && target.allows_refit(), previous.refits);
        if refit {
            target.check_refit()?;
        }
        if refit && !same {
            let message = format!("a refit keeps the number of instances; {count} are new, so rebuild");
            return Err(Error::usage(&target.name, message));
        }
        Ok(refit)
    }
}

/// What the table says of a structure with these rows.
fn tlas_table_entry(tlas: &Tlas, rows: u64) -> [u64; 2] {
    [rows, tlas.software.as_ref().map_or(0, SoftwareTlas::address)]
}

/// Fails where there are more instances of the caller than the structure was made for.
fn check_capacity(target: &AccelStruct, tlas: &Tlas, count: u64) -> Result<()> {
    check_limit(&target.name, "instance count", count, tlas.capacity.into())
}

#[cold]
fn capacity_error(target: &AccelStruct, tlas: &Tlas, count: u32, built: u32) -> Error {
    let message = format!(
        "its {count} instances of split meshes stand for {built}, but there is room for {}; create it with a larger \
         capacity or more TlasDesc::parts_per_instance",
        tlas.built_capacity
    );
    Error::usage(&target.name, message)
}
