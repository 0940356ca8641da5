//! What top-level structures show: instances from the host or from a buffer, and their builds.

use std::sync::Arc;

use ash::vk;

use super::CommandBuffer;
use super::build_blas::OpenBuild;
use super::recording_state::Notes;
use super::write_instances::{GivenInstances, Staged, Written};
use crate::accel::AccelStruct;
use crate::accel::blas_refs::{Revision, ShownSet};
use crate::accel::build::TlasBuild;
use crate::accel::flags::BuildMode;
use crate::accel::instance::{DeviceInstances, TlasInstance};
use crate::accel::instance_plan::PlanMemory;
use crate::accel::scratch::aligned_scratch_address;
use crate::accel::tlas::{InstanceSource, Tlas};
use crate::accel::tlas_tracker::{Change, Recorded, Row, TlasUpdate, TlasUpdates};
use crate::barrier::{ResourceId, Stages, Use};
use crate::bindless::layout::TLAS_TABLE_ENTRY_BYTES;
use crate::error::{Error, Result, check_limit};
use crate::handle::AccelStructHandle;
use crate::resource::Buffer;
use crate::software_ray_query::tlas::SoftwareTlas;
use crate::submit::ownership::QueueAccess;

/// What is known of a structure before the next command.
struct Before<'a> {
    /// Instances of the caller and of Vulkan, `None` before the first build.
    counts: Option<(u32, u32)>,
    refits: u32,
    /// Whether this command buffer has not updated it.
    is_first: bool,
    /// What it shows, or nothing where some of that is gone or has moved.
    shown: &'a Arc<ShownSet>,
    /// Whether it shows that.
    stands: bool,
    /// When that was looked at.
    revision: Revision,
}

/// Instances on their way into the build of one structure.
#[derive(Clone, Copy)]
struct Update<'a> {
    target: &'a AccelStruct,
    tlas: &'a Tlas,
    before: &'a Before<'a>,
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
        self.with_updates(|cmd, updates| {
            let row = updates.find(&cmd.shared.store.accel_structs, tlas)?;
            cmd.update_row(updates, row, instances, mode)
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
        self.with_updates(|cmd, updates| {
            let row = updates.find(&cmd.shared.store.accel_structs, tlas)?;
            cmd.update_row_from(updates, row, instances, mode)
        })
    }

    /// As [`update_tlas`](Self::update_tlas), by object.
    pub(crate) fn update_tlas_object(
        &mut self,
        target: &Arc<AccelStruct>,
        instances: &[TlasInstance],
        mode: BuildMode,
    ) -> Result<()> {
        self.with_updates(|cmd, updates| {
            let row = updates.row(target);
            cmd.update_row(updates, row, instances, mode)
        })
    }

    /// Writes the instances of a structure again, as what it shows has moved, and builds it.
    pub(crate) fn rewrite_tlas(&mut self, target: &Arc<AccelStruct>) -> Result<()> {
        let tlas = target.tlas()?;
        let contents = tlas.contents().clone();
        let (Some(source), Some(count)) = (contents.source, contents.instance_count) else { return Ok(()) };
        let shown = Arc::new(contents.shown.renewed()?);
        let source = InstanceSource::clone(&source);
        self.with_updates(|cmd, updates| {
            let row = updates.row(target);
            let Row { target, update, nothing, .. } = updates.at(row);
            let before = cmd.before(tlas, update, nothing);
            let given = cmd.run_instances(target, tlas, shown, source, contents.built_count)?;
            cmd.build_written(target, tlas, &given, before.is_first, false)?;
            let (recorded, shown, source) = cmd.tell(tlas, &before, given.change(count, false));
            updates.record(row, &recorded, shown, source);
            Ok(())
        })
    }

    /// Has `record` keep what it updates.
    #[inline(always)]
    fn with_updates(&mut self, record: impl FnOnce(&mut Self, &mut TlasUpdates) -> Result<()>) -> Result<()> {
        let mut updates = self.notes.tlas_updates.take().unwrap_or_default();
        let recorded = record(self, &mut updates);
        self.notes.tlas_updates = Some(updates);
        recorded
    }

    /// Shows instances of the host in the structure of a row. Mostly few, and of the same structures as before.
    #[inline(always)]
    fn update_row(
        &mut self,
        updates: &mut TlasUpdates,
        row: usize,
        instances: &[TlasInstance],
        mode: BuildMode,
    ) -> Result<()> {
        let Row { target, update, nothing, .. } = updates.at(row);
        let tlas = target.tlas()?;
        if instances.len() > tlas.capacity as usize {
            return check_capacity(target, tlas, instances.len() as u64);
        }
        let before = self.before(tlas, update, nothing);
        if tlas.software.is_none()
            && let Some(address) = self.stage_alike(instances, before.shown)?
        {
            let update = Update { target, tlas, before: &before, mode };
            let recorded = self.build_staged(update, instances.len() as u32, address)?;
            updates.record_alike(row, &recorded);
            return Ok(());
        }
        self.update_otherwise(updates, row, instances, mode)
    }

    /// Builds from instances that Vulkan can read, of what was shown before.
    #[inline(always)]
    fn build_staged(&mut self, update: Update<'_>, count: u32, address: u64) -> Result<Recorded> {
        let Update { tlas, before, .. } = update;
        let refit = self.build_addressed(update, count, address)?;
        if before.is_first {
            self.refer_to(before.shown);
        }
        let named_rows = self.tell_rows(tlas, before, before.shown);
        Ok(Recorded { counts: (count, count), refit, named_rows, revision: before.revision })
    }

    /// Builds from instances that the host has written with addresses. Answers whether it is a refit.
    #[inline(always)]
    fn build_addressed(&mut self, update: Update<'_>, count: u32, address: u64) -> Result<bool> {
        let refit = update.check(count, count)?;
        let instances = GivenInstances { address, count, is_from_kernel: false };
        self.build_tlas(update.target, update.tlas, instances, update.before.is_first, refit)?;
        Ok(refit)
    }

    /// As [`update_row`](Self::update_row), of whatever structures.
    #[inline(never)]
    fn update_otherwise(
        &mut self,
        updates: &mut TlasUpdates,
        row: usize,
        instances: &[TlasInstance],
        mode: BuildMode,
    ) -> Result<()> {
        let Row { target, update, nothing, memory } = updates.at(row);
        let tlas = target.tlas()?;
        let before = self.before(tlas, update, nothing);
        let update = Update { target, tlas, before: &before, mode };
        let count = instances.len() as u32;
        let staged = match tlas.structure {
            Some(_) => self.stage_instances(&target.name, instances, before.shown, &mut memory.marks)?,
            None => None,
        };
        let change = match staged {
            Some(Staged { address, shown }) => {
                let refit = self.build_addressed(update, count, address)?;
                Change { count, built_count: count, shown, source: None, refit }
            }
            None => self.update_by_plan(update, instances, memory)?,
        };
        if let Some(software) = &tlas.software
            && let Err(error) = self.build_software_tlas(target, software, instances)
        {
            return Err(self.fail_beside_device(target, tlas, error));
        }
        let (recorded, shown, source) = self.tell(tlas, &before, change);
        updates.record(row, &recorded, shown, source);
        Ok(())
    }

    /// Builds from instances that a kernel writes; where the device has no structures of its own, only checks.
    #[inline(never)]
    fn update_by_plan(
        &mut self,
        update: Update<'_>,
        instances: &[TlasInstance],
        memory: &mut PlanMemory,
    ) -> Result<Change> {
        let Update { target, tlas, before, .. } = update;
        let count = instances.len() as u32;
        let plan = self.plan_instances(&target.name, instances, before.shown, memory)?;
        if tlas.structure.is_none() {
            let shown = Some(Arc::clone(&plan.shown));
            memory.refers = plan.into_refers();
            let refit = update.check(count, count)?;
            return Ok(Change { count, built_count: count, shown, source: None, refit });
        }
        let refit = update.check(count, plan.built_count)?;
        let (source, shown) = self.host_source(&target.name, instances, plan, memory)?;
        let built_count = source.built_count(&target.name)?;
        let given = self.run_instances(target, tlas, shown, source, built_count)?;
        self.build_written(target, tlas, &given, before.is_first, refit)?;
        Ok(given.change(count, refit))
    }

    /// Shows instances that lie in a buffer in the structure of a row.
    fn update_row_from(
        &mut self,
        updates: &mut TlasUpdates,
        row: usize,
        instances: &DeviceInstances<'_>,
        mode: BuildMode,
    ) -> Result<()> {
        let Row { target, update, nothing, .. } = updates.at(row);
        let tlas = target.tlas()?;
        let count = instances.count;
        check_capacity(target, tlas, count.into())?;
        let before = self.before(tlas, update, nothing);
        let update = Update { target, tlas, before: &before, mode };
        let (shown, source) = self.device_source(&target.name, instances, before.shown)?;
        let change = match tlas.structure {
            Some(_) => self.build_from(update, instances, Arc::clone(&shown), source)?,
            None => {
                let refit = update.check(count, count)?;
                Change { count, built_count: count, shown: Some(Arc::clone(&shown)), source: None, refit }
            }
        };
        if let Some(software) = &tlas.software
            && let Err(error) = self.build_software_tlas_from(target, software, instances, &shown)
        {
            return Err(self.fail_beside_device(target, tlas, error));
        }
        let (recorded, shown, source) = self.tell(tlas, &before, change);
        updates.record(row, &recorded, shown, source);
        Ok(())
    }

    /// Builds what the device traces from instances that lie in a buffer.
    fn build_from(
        &mut self,
        update: Update<'_>,
        instances: &DeviceInstances<'_>,
        shown: Arc<ShownSet>,
        mut source: InstanceSource,
    ) -> Result<Change> {
        let Update { target, tlas, before, .. } = update;
        let built_count = source.built_count(&target.name)?;
        let refit = update.check(instances.count, built_count)?;
        self.keep_source(&target.name, instances, &shown, &mut source)?;
        let given = self.run_instances(target, tlas, shown, source, built_count)?;
        self.build_written(target, tlas, &given, before.is_first, refit)?;
        Ok(given.change(instances.count, refit))
    }

    /// Takes the updates so far for submitted: for the command buffer that goes before every other one.
    pub(crate) fn apply_tlas_updates(&mut self) {
        let Notes { tlas_updates, build_run, open_builds, .. } = &mut **self.notes;
        build_run.stop();
        if let Some(updates) = tlas_updates {
            self.shared.show(updates, |target| open_builds.push(OpenBuild::of_tlas(Arc::clone(target))));
        }
    }

    /// What is known of a structure before the next command.
    #[inline(always)]
    fn before<'a>(&self, tlas: &Tlas, update: &'a mut TlasUpdate, nothing: &'a Arc<ShownSet>) -> Before<'a> {
        let revision = self.shared.accel_revision();
        let is_first = !update.is_recorded();
        let contents = update.look(tlas);
        let find = |handle| self.shared.store.accel_structs.get(handle);
        let stands = contents.revision == revision || contents.shown.stands(&find);
        let shown = if stands { &contents.shown } else { nothing };
        Before { counts: contents.counts(), refits: contents.refits, is_first, shown, stands, revision }
    }

    /// Builds from what a kernel writes, which is recorded.
    fn build_written(
        &mut self,
        target: &AccelStruct,
        tlas: &Tlas,
        given: &Written,
        is_first: bool,
        refit: bool,
    ) -> Result<()> {
        let built = self.build_tlas(target, tlas, given.instances(), is_first, refit);
        built.map_err(|error| self.tear(&target.name, error))
    }

    /// Software's half of an update failed. Where the device has one, that is recorded.
    #[cold]
    fn fail_beside_device(&mut self, target: &AccelStruct, tlas: &Tlas, error: Error) -> Error {
        if tlas.structure.is_some() { self.tear(&target.name, error) } else { error }
    }

    /// Records the build of what the device traces.
    #[inline(always)]
    fn build_tlas(
        &mut self,
        target: &AccelStruct,
        tlas: &Tlas,
        instances: GivenInstances,
        is_first: bool,
        refit: bool,
    ) -> Result<()> {
        let sizes = &target.sizes;
        let scratch_bytes = if refit { sizes.update_scratch_bytes } else { sizes.build_scratch_bytes };
        let records = if instances.is_from_kernel { tlas.records.get() } else { None };
        let scratch = self.join_builds(target.id, scratch_bytes, records.map(|records| &**records))?;
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
            self.refer(target.id, QueueAccess::Write);
        }
        Ok(())
    }

    /// Scratch memory for a build of a top-level structure, behind the barriers it needs. There are none where the commands
    /// before were such builds too, of other structures, and there is memory left beside theirs; then all may run at once.
    #[inline(always)]
    fn join_builds(&mut self, target: ResourceId, bytes: u64, records: Option<&Buffer>) -> Result<u64> {
        let alignment = self.shared.gpu.caps.limits.scratch_alignment.into();
        if records.is_none()
            && let Some(scratch) = self.notes.build_run.join(target, bytes, alignment)
        {
            return Ok(scratch);
        }
        self.begin_builds(target, bytes, alignment, records)
    }

    /// The same for a build that waits for those before.
    #[inline(never)]
    fn begin_builds(
        &mut self,
        target: ResourceId,
        bytes: u64,
        alignment: u64,
        records: Option<&Buffer>,
    ) -> Result<u64> {
        let shared = &self.shared;
        let own = &shared.scratch[self.recording.queue_index];
        let (buffer, replaced) = own.get(&shared.gpu, bytes)?;
        self.retire_replaced(replaced);
        self.notes.uses.id(own.id, Use::accel_build_write());
        self.notes.uses.accumulate(shared.all_tlas, Use::accel_build_write());
        self.use_shown(Use::accel_read(Stages::ACCEL_BUILD));
        if let Some(records) = records {
            self.use_buffer(records, Use::accel_build_input());
        }
        self.flush();
        let (start, end) =
            (aligned_scratch_address(buffer.address, alignment), buffer.address + buffer.size_bytes);
        self.notes.build_run.begin(target, start..end, bytes, alignment);
        Ok(start)
    }

    /// Tells queues and shaders what the structure shows from now on; `None` for what is shown the same as before.
    fn tell(
        &mut self,
        tlas: &Tlas,
        before: &Before<'_>,
        change: Change,
    ) -> (Recorded, Option<Arc<ShownSet>>, Option<Arc<InstanceSource>>) {
        let Change { count, built_count, shown: new, source, refit } = change;
        let new = new.or_else(|| (!before.stands).then(|| Arc::clone(before.shown)));
        let shown = new.as_ref().unwrap_or(before.shown);
        if before.is_first || new.is_some() {
            self.refer_to(shown);
        }
        let named_rows = self.tell_rows(tlas, before, shown);
        let counts = (count, built_count);
        (Recorded { counts, refit, named_rows, revision: before.revision }, new, source)
    }

    /// Has other queues be done with what is shown, which may come from them.
    fn refer_to(&mut self, shown: &ShownSet) {
        if self.shared.gpu.queues.has_several() {
            shown.list().iter().for_each(|shown| self.refer(shown.blas.id, QueueAccess::Read));
        }
    }

    /// Tells shaders where the rows of the structure lie, unless they know. Answers what it tells.
    #[inline(always)]
    fn tell_rows(&mut self, tlas: &Tlas, before: &Before<'_>, shown: &ShownSet) -> Option<u64> {
        // At first the entry is that of the slot's last owner.
        if before.counts.is_some() && tlas.rows.get().is_none() {
            return None;
        }
        let rows = tlas.rows.get().filter(|_| shown.has_rows).map_or(0, |rows| rows.address);
        self.write_tlas_table(tlas.slot, entry(tlas, rows));
        Some(rows)
    }

    /// Structures that this command buffer takes to have no rows, though a submission since it was recorded has given them some:
    /// their slots, with what the table has to say of them first.
    pub(crate) fn entries_without_rows(&self) -> Vec<(u32, [u64; 2])> {
        let Some(updates) = &self.notes.tlas_updates else { return Vec::new() };
        updates.with_unknown_rows().map(|tlas| (tlas.slot, entry(tlas, 0))).collect()
    }

    /// Tells shaders where the rows of a structure lie, and what software traces; 0 where there is nothing.
    pub(crate) fn write_tlas_table(&mut self, slot: u32, entry: [u64; 2]) {
        let shared = Arc::clone(&self.shared);
        let Some(table) = shared.tlas_table.as_ref() else { return };
        self.notes.uses.id(shared.tlas_tables, Use::transfer_write());
        self.flush();
        let offset = u64::from(slot) * TLAS_TABLE_ENTRY_BYTES;
        // SAFETY: the table has an entry for every slot.
        unsafe {
            shared.gpu.device.cmd_update_buffer(self.raw(), table.raw, offset, bytemuck::bytes_of(&entry));
        }
    }

    /// Has shaders see nothing in slots whose structures are gone.
    pub(crate) fn forget_tlas(&mut self, slots: &[u32]) {
        slots.iter().for_each(|slot| self.write_tlas_table(*slot, [0; 2]));
    }

    /// Empties the table that says where rows lie.
    pub(crate) fn clear_tlas_table(&mut self) {
        let shared = Arc::clone(&self.shared);
        let Some(table) = shared.tlas_table.as_ref() else { return };
        self.notes.uses.id(shared.tlas_tables, Use::transfer_write());
        self.flush();
        // SAFETY: the whole buffer is filled.
        unsafe { shared.gpu.device.cmd_fill_buffer(self.raw(), table.raw, 0, vk::WHOLE_SIZE, 0) };
    }
}

impl Update<'_> {
    /// Checks the counts; answers whether it is a refit.
    #[inline(always)]
    fn check(&self, count: u32, built: u32) -> Result<bool> {
        let Self { target, tlas, before, mode } = self;
        if built > tlas.room {
            return Err(no_room(target, tlas, count, built));
        }
        let same = before.counts == Some((count, built));
        let refit = mode.refits(same && target.allows_refit(), before.refits);
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
fn entry(tlas: &Tlas, rows: u64) -> [u64; 2] {
    [rows, tlas.software.as_ref().map_or(0, SoftwareTlas::address)]
}

/// Fails where there are more instances of the caller than the structure was made for.
fn check_capacity(target: &AccelStruct, tlas: &Tlas, count: u64) -> Result<()> {
    check_limit(&target.name, "instance count", count, tlas.capacity.into())
}

#[cold]
fn no_room(target: &AccelStruct, tlas: &Tlas, count: u32, built: u32) -> Error {
    let message = format!(
        "its {count} instances of split meshes stand for {built}, but there is room for {}; create it with a larger \
         capacity or more TlasDesc::parts_per_instance",
        tlas.room
    );
    Error::usage(&target.name, message)
}
