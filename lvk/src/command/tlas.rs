//! What top-level structures show: instances from the host or from a buffer, and their builds.

use std::sync::Arc;

use ash::vk;

use super::CommandBuffer;
use super::accel::OpenBuild;
use super::instances::{Planned, Ready};
use super::notes::Notes;
use crate::accel::AccelStruct;
use crate::accel::build::TlasBuild;
use crate::accel::flags::BuildMode;
use crate::accel::instance::{DeviceInstances, TlasInstance};
use crate::accel::scratch::aligned_scratch_address;
use crate::accel::shown::{Revision, ShownSet};
use crate::accel::tlas::{InstanceSource, Tlas, TlasContents};
use crate::accel::tlas_updates::TlasUpdate;
use crate::barrier::{ResourceId, Stages, Use};
use crate::bindless::layout::TLAS_TABLE_ENTRY_BYTES;
use crate::error::{Error, Result, check_limit};
use crate::handle::AccelStructHandle;
use crate::resource::Buffer;
use crate::submit::ownership::Access;

/// What is known of a structure before the next command.
#[derive(Clone, Copy)]
struct Before {
    /// Instances of the caller and of Vulkan, `None` before the first build.
    counts: Option<(u32, u32)>,
    refits: u32,
    /// Whether this command buffer has updated it.
    is_own: bool,
    /// When what is shown was looked at.
    revision: Revision,
}

/// What is recorded of a structure.
struct After {
    count: u32,
    built_count: u32,
    shown: Arc<ShownSet>,
    source: Option<Arc<InstanceSource>>,
    refit: bool,
}

impl CommandBuffer {
    /// Shows other instances in a top-level structure: at most its capacity, and for a refit as many as before
    /// (`vkCmdBuildAccelerationStructuresKHR`). The instances are copied at once.
    ///
    /// # Errors
    /// [`LimitExceeded`](Error::LimitExceeded) over the capacity; [`InvalidUsage`](Error::InvalidUsage) for numbers
    /// that do not fit their bits, transforms that are not finite, and refits that are not allowed;
    /// [`WrongQueue`](Error::WrongQueue) on the transfer queue.
    pub fn update_tlas(
        &mut self,
        tlas: AccelStructHandle,
        instances: &[TlasInstance],
        mode: BuildMode,
    ) -> Result<()> {
        self.needs_compute("an update of a top-level structure")?;
        let target = self.shared.store.accel_structs.get(tlas)?;
        self.update_tlas_object(target, instances, mode)
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
    pub fn update_tlas_from(
        &mut self,
        tlas: AccelStructHandle,
        instances: &DeviceInstances<'_>,
        mode: BuildMode,
    ) -> Result<()> {
        self.needs_compute("an update of a top-level structure")?;
        let target = self.shared.store.accel_structs.get(tlas)?;
        let object = target.tlas()?;
        check_limit(&target.name, "instance count", instances.count.into(), object.capacity.into())?;
        let (before, known) = self.before(&target, object);
        let (shown, mut source) = self.device_source(&target.name, instances, known)?;
        let count = instances.count;
        if object.structure.is_none() {
            let refit = self.check_update(&target, object, count, count, mode, before)?;
            if let Some(software) = &object.software {
                self.build_software_tlas_from(&target, software, instances, &shown)?;
            }
            let after = After { count, built_count: count, shown, source: None, refit };
            return self.note_contents(Arc::clone(&target), before, after);
        }
        let built_count = source.built_count(&target.name)?;
        let refit = self.check_update(&target, object, count, built_count, mode, before)?;
        self.keep_source(&target.name, instances, &shown, &mut source)?;
        let ready = self.run_instances(&target, object, shown, source, built_count)?;
        let shown = object.software.as_ref().map(|software| (software, Arc::clone(&ready.shown)));
        self.record_tlas(Arc::clone(&target), before, ready, count, refit)?;
        match shown {
            Some((software, shown)) => self.build_software_tlas_from(&target, software, instances, &shown),
            None => Ok(()),
        }
    }

    /// As [`update_tlas`](Self::update_tlas), by object.
    pub(crate) fn update_tlas_object(
        &mut self,
        target: Arc<AccelStruct>,
        instances: &[TlasInstance],
        mode: BuildMode,
    ) -> Result<()> {
        let tlas = target.tlas()?;
        let count = instances.len() as u64;
        check_limit(&target.name, "instance count", count, tlas.capacity.into())?;
        let count = count as u32;
        let (before, known) = self.before(&target, tlas);
        if tlas.structure.is_none() {
            return self.update_software_tlas(&target, instances, mode, before, known);
        }
        let planned = self.host_instances(&target.name, instances, known)?;
        let refit = self.check_update(&target, tlas, count, planned.built_count(), mode, before)?;
        let ready = match planned {
            Planned::Ready(ready) => ready,
            Planned::Kernel(plan) => {
                let (source, shown) = self.host_source(&target.name, instances, plan)?;
                let built_count = source.built_count(&target.name)?;
                self.run_instances(&target, tlas, shown, source, built_count)?
            }
        };
        if tlas.software.is_none() {
            return self.record_tlas(target, before, ready, count, refit);
        }
        self.record_tlas(Arc::clone(&target), before, ready, count, refit)?;
        match &target.tlas()?.software {
            Some(software) => self.build_software_tlas(&target, software, instances),
            None => Ok(()),
        }
    }

    /// As [`update_tlas`](Self::update_tlas), where the device has no structures of its own.
    fn update_software_tlas(
        &mut self,
        target: &Arc<AccelStruct>,
        instances: &[TlasInstance],
        mode: BuildMode,
        before: Before,
        known: Arc<ShownSet>,
    ) -> Result<()> {
        let tlas = target.tlas()?;
        let plan = self.plan_instances(&target.name, instances, known)?;
        let shown = Arc::clone(&plan.shown);
        self.notes.tlas_updates.refers = plan.into_refers();
        let count = instances.len() as u32;
        let refit = self.check_update(target, tlas, count, count, mode, before)?;
        if let Some(software) = &tlas.software {
            self.build_software_tlas(target, software, instances)?;
        }
        let after = After { count, built_count: count, shown, source: None, refit };
        self.note_contents(Arc::clone(target), before, after)
    }

    /// Writes the instances of a structure again, as what it shows has moved, and builds it.
    pub(crate) fn rewrite_tlas(&mut self, target: &Arc<AccelStruct>) -> Result<()> {
        let tlas = target.tlas()?;
        let contents = tlas.contents().clone();
        let (Some(source), Some(count)) = (contents.source, contents.instance_count) else { return Ok(()) };
        let (before, _) = self.before(target, tlas);
        let shown = Arc::new(contents.shown.renewed()?);
        let source = InstanceSource::clone(&source);
        let ready = self.run_instances(target, tlas, shown, source, contents.built_count)?;
        self.record_tlas(Arc::clone(target), before, ready, count, false)
    }

    /// Takes the updates so far for submitted: for the command buffer that goes before every other one.
    pub(crate) fn apply_tlas_updates(&mut self) {
        let Notes { tlas_updates, open_builds, .. } = &mut **self.notes;
        let shown = tlas_updates.drain().map(|update| self.shared.show(update));
        open_builds.extend(shown.map(OpenBuild::of_tlas));
    }

    /// Fails if what was recorded no longer fits what was submitted since.
    pub(crate) fn check_tlas_updates(&self) -> Result<()> {
        self.notes.tlas_updates.check()
    }

    /// Checks the counts; answers whether the update is a refit.
    #[inline(always)]
    fn check_update(
        &self,
        target: &AccelStruct,
        tlas: &Tlas,
        count: u32,
        built: u32,
        mode: BuildMode,
        before: Before,
    ) -> Result<bool> {
        if built > tlas.room {
            let message = format!(
                "its {count} instances of split meshes stand for {built}, but there is room for {}; create it with a \
                 larger capacity or more TlasDesc::parts_per_instance",
                tlas.room
            );
            return Err(Error::usage(&target.name, message));
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

    /// What is known of the structure before the next command; and what it shows, or nothing where some of that is gone or
    /// has moved.
    #[inline(always)]
    fn before(&mut self, target: &AccelStruct, tlas: &Tlas) -> (Before, Arc<ShownSet>) {
        let revision = self.shared.accel_revision();
        let of = |contents: &TlasContents, is_own| {
            let before = Before { counts: contents.counts(), refits: contents.refits, is_own, revision };
            (before, Arc::clone(&contents.shown), contents.revision == revision)
        };
        let (before, shown, stands) = match self.notes.tlas_updates.last_of(target) {
            Some(update) => of(&update.contents, true),
            None => of(&tlas.contents(), false),
        };
        if stands || shown.stands(&|handle| self.shared.store.accel_structs.get(handle)) {
            return (before, shown);
        }
        (before, Arc::default())
    }

    /// Records the build, and remembers what it shows.
    #[inline(always)]
    fn record_tlas(
        &mut self,
        target: Arc<AccelStruct>,
        before: Before,
        ready: Ready,
        count: u32,
        refit: bool,
    ) -> Result<()> {
        let tlas = target.tlas()?;
        let sizes = &target.sizes;
        let scratch_bytes = if refit { sizes.update_scratch_bytes } else { sizes.build_scratch_bytes };
        let records = tlas.records.get().filter(|_| ready.is_from_kernel);
        let scratch = self.join_builds(target.id, scratch_bytes, records.map(|records| &**records))?;
        let build = TlasBuild {
            flags: target.flags,
            instances: ready.address,
            count: ready.built_count,
            refit,
            target: tlas.structure.as_ref().map_or(vk::AccelerationStructureKHR::null(), |of| of.raw),
            scratch,
        };
        // SAFETY: instances, structure and scratch memory are alive, checked, aligned and large enough; barriers keep them
        // apart from other commands.
        unsafe { build.record(self.shared.gpu.accel()?, self.raw()) };
        self.refer(target.id, Access::Write);
        let Ready { built_count, shown, source, .. } = ready;
        self.note_contents(target, before, After { count, built_count, shown, source, refit })
    }

    /// Scratch memory for a build of a top-level structure, behind the barriers it needs. There are none where the commands
    /// before were such builds too, of other structures, and there is memory left beside theirs; then all may run at once.
    #[inline]
    fn join_builds(&mut self, target: ResourceId, bytes: u64, records: Option<&Buffer>) -> Result<u64> {
        let alignment = self.shared.gpu.caps.limits.scratch_alignment.into();
        if records.is_none()
            && let Some(scratch) = self.notes.tlas_updates.run.join(target, bytes, alignment)
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
        let own = &shared.scratch[self.recording.lane];
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
        self.notes.tlas_updates.run.begin(target, start..end, bytes, alignment);
        Ok(start)
    }

    /// Tells shaders what is known of the structure, and remembers what it shows.
    #[inline(always)]
    fn note_contents(&mut self, target: Arc<AccelStruct>, before: Before, after: After) -> Result<()> {
        let After { count, built_count, shown, source, refit } = after;
        if self.shared.gpu.queues.several_lanes() {
            // New ones may come from another queue.
            shown.list().iter().for_each(|shown| self.refer(shown.blas.id, Access::Read));
        }
        let tlas = target.tlas()?;
        // At first the entry is that of the slot's last owner.
        if before.counts.is_none() || tlas.rows.get().is_some() {
            let rows = tlas.rows.get().filter(|_| shown.has_rows).map_or(0, |rows| rows.address);
            let software = tlas.software.as_ref().map_or(0, |software| software.body.address);
            self.write_tlas_table(tlas.slot, [rows, software]);
        }
        let refits = if refit { before.refits.saturating_add(1) } else { 0 };
        let refits_submitted = refit && !before.is_own;
        let revision = before.revision;
        let contents =
            TlasContents { instance_count: Some(count), built_count, refits, shown, revision, source };
        self.notes.tlas_updates.push(TlasUpdate { target, contents, refits_submitted });
        Ok(())
    }

    /// Tells shaders where the rows of a structure lie, and what software traces; 0 where there is nothing.
    fn write_tlas_table(&mut self, slot: u32, entry: [u64; 2]) {
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
