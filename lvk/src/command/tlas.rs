//! What top-level structures show: instances from the host or from a buffer, and their builds.

use std::sync::Arc;

use ash::vk;

use super::CommandBuffer;
use super::accel::{Build, OpenBuild};
use super::instances::{Planned, Ready};
use crate::accel::AccelStruct;
use crate::accel::build::BuildInput;
use crate::accel::flags::BuildMode;
use crate::accel::instance::{DeviceInstances, TlasInstance};
use crate::accel::instance_plan::InstancePlan;
use crate::accel::tlas::{InstanceSource, Shown, Tlas, TlasContents};
use crate::barrier::Use;
use crate::bindless::layout::TLAS_TABLE_ENTRY_BYTES;
use crate::error::{Error, Result, check_limit};
use crate::handle::AccelStructHandle;
use crate::shared::{Garbage, Shared};
use crate::submit::ownership::Access;

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
        let tlas = self.target.tlas()?;
        if !self.refits_submitted || tlas.contents().counts() == self.contents.counts() {
            return Ok(());
        }
        let message =
            "a refit was recorded, but a submission since then changed the number of instances; rebuild";
        Err(Error::usage(&self.target.name, message))
    }

    /// Makes it so. What was shown before may go once the GPU is done with it.
    pub(crate) fn apply(self, shared: &Shared) {
        let Ok(tlas) = self.target.tlas() else { return };
        if self.contents.is_outdated() {
            shared.note_outdated_tlas();
        }
        let before = std::mem::replace(&mut *tlas.contents(), self.contents);
        shared.retire(Garbage::Contents(Box::new(before)));
    }
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
        self.update_tlas_object(&target, instances, mode)
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
        let (shown, mut source) = self.device_source(&target.name, instances)?;
        if object.structure.is_none() {
            let refit = self.check_update(&target, instances.count, instances.count, mode)?;
            if let Some(software) = &object.software {
                self.build_software_tlas_from(&target, software, instances, &shown)?;
            }
            self.open_builds.push(OpenBuild::of_tlas(&target));
            return self.note_contents(&target, instances.count, instances.count, shown, None, refit);
        }
        let built_count = source.built_count(&target.name)?;
        let refit = self.check_update(&target, instances.count, built_count, mode)?;
        self.keep_source(&target.name, instances, &shown, &mut source)?;
        let software_shown = object.software.as_ref().map(|_| shown.clone()).unwrap_or_default();
        let ready = self.run_instances(&target, object, shown, source, built_count)?;
        self.record_tlas(&target, ready, instances.count, refit)?;
        match &object.software {
            Some(software) => self.build_software_tlas_from(&target, software, instances, &software_shown),
            None => Ok(()),
        }
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
        if tlas.structure.is_none() {
            return self.update_software_tlas(target, instances, mode);
        }
        let planned = self.host_instances(target, instances)?;
        let refit = self.check_update(target, count, planned.built_count(), mode)?;
        let ready = match planned {
            Planned::Ready(ready) => ready,
            Planned::Kernel(plan) => {
                let (source, shown) = self.host_source(&target.name, instances, plan)?;
                let built_count = source.built_count(&target.name)?;
                self.run_instances(target, tlas, shown, source, built_count)?
            }
        };
        self.record_tlas(target, ready, count, refit)?;
        match &tlas.software {
            Some(software) => self.build_software_tlas(target, software, instances),
            None => Ok(()),
        }
    }

    /// As [`update_tlas`](Self::update_tlas), where the device has no structures of its own.
    fn update_software_tlas(
        &mut self,
        target: &Arc<AccelStruct>,
        instances: &[TlasInstance],
        mode: BuildMode,
    ) -> Result<()> {
        let tlas = target.tlas()?;
        let shared = Arc::clone(&self.shared);
        let find = |handle| shared.store.accel_structs.get(handle);
        let plan = InstancePlan::new(&target.name, instances, &find)?;
        let count = instances.len() as u32;
        let refit = self.check_update(target, count, count, mode)?;
        if let Some(software) = &tlas.software {
            self.build_software_tlas(target, software, instances)?;
        }
        self.open_builds.push(OpenBuild::of_tlas(target));
        self.note_contents(target, count, count, plan.shown, None, refit)
    }

    /// Writes the instances of a structure again, as what it shows has moved, and builds it.
    pub(crate) fn rewrite_tlas(&mut self, target: &Arc<AccelStruct>) -> Result<()> {
        let tlas = target.tlas()?;
        let contents = tlas.contents().clone();
        let (Some(source), Some(count)) = (contents.source, contents.instance_count) else { return Ok(()) };
        let now = |shown: Shown| {
            let body = shown.blas.blas()?.body();
            Ok(Shown { body, ..shown })
        };
        let shown: Result<Vec<_>> = contents.shown.into_iter().map(now).collect();
        let ready = self.run_instances(target, tlas, shown?, source, contents.built_count)?;
        self.record_tlas(target, ready, count, false)
    }

    /// Takes the updates so far for submitted: for the command buffer that goes before every other one.
    pub(crate) fn apply_tlas_updates(&mut self) {
        let shared = Arc::clone(&self.shared);
        std::mem::take(&mut self.tlas_updates).into_iter().for_each(|update| update.apply(&shared));
    }

    /// Fails if what was recorded no longer fits what was submitted since.
    pub(crate) fn check_tlas_updates(&self) -> Result<()> {
        self.tlas_updates.iter().try_for_each(TlasUpdate::check)
    }

    /// Checks the counts; answers whether the update is a refit.
    fn check_update(&self, target: &AccelStruct, count: u32, built: u32, mode: BuildMode) -> Result<bool> {
        let tlas = target.tlas()?;
        if built > tlas.room {
            let message = format!(
                "its {count} instances of split meshes stand for {built}, but there is room for {}; create it with a \
                 larger capacity or more TlasDesc::parts_per_instance",
                tlas.room
            );
            return Err(Error::usage(&target.name, message));
        }
        let (counts, refits) = self.last_update(target, tlas);
        let same = counts == Some((count, built));
        let refit = mode.refits(same && target.check_refit().is_ok(), refits);
        if refit {
            target.check_refit()?;
        }
        if refit && !same {
            let message = format!("a refit keeps the number of instances; {count} are new, so rebuild");
            return Err(Error::usage(&target.name, message));
        }
        Ok(refit)
    }

    /// Counts and refits of the last build before the next command.
    fn last_update(&self, target: &AccelStruct, tlas: &Tlas) -> (Option<(u32, u32)>, u32) {
        let of = |contents: &TlasContents| (contents.counts(), contents.refits);
        self.own_update(target).map_or_else(|| of(&tlas.contents()), |update| of(&update.contents))
    }

    /// The last update recorded in this command buffer.
    fn own_update(&self, target: &AccelStruct) -> Option<&TlasUpdate> {
        self.tlas_updates.iter().rev().find(|update| update.target.id == target.id)
    }

    /// Records the build, and remembers what it shows.
    fn record_tlas(
        &mut self,
        target: &Arc<AccelStruct>,
        ready: Ready,
        count: u32,
        refit: bool,
    ) -> Result<()> {
        let tlas = target.tlas()?;
        let scratch = &target.sizes;
        let build = Build {
            target: Arc::clone(target),
            raw: tlas.structure.as_ref().map_or(vk::AccelerationStructureKHR::null(), |of| of.raw),
            input: BuildInput::tlas(target.flags, ready.address, ready.built_count),
            refit,
            scratch_bytes: if refit { scratch.update_scratch_bytes } else { scratch.build_scratch_bytes },
            reads: ready.reads,
        };
        self.record_builds(&[build])?;
        self.open_builds.push(OpenBuild::of_tlas(target));
        let Ready { built_count, shown, source, .. } = ready;
        self.note_contents(target, count, built_count, shown, source, refit)
    }

    /// Tells shaders what is known of the structure, and remembers what it shows.
    fn note_contents(
        &mut self,
        target: &Arc<AccelStruct>,
        count: u32,
        built_count: u32,
        shown: Vec<Shown>,
        source: Option<InstanceSource>,
        refit: bool,
    ) -> Result<()> {
        // New ones may come from another queue.
        shown.iter().for_each(|shown| self.refer(shown.blas.id, Access::Read));
        let tlas = target.tlas()?;
        // At first the entry is that of the slot's last owner.
        let is_first = self.last_update(target, tlas).0.is_none();
        if is_first || tlas.rows.get().is_some() {
            let mapped = shown.iter().any(Shown::has_rows);
            let rows = tlas.rows.get().filter(|_| mapped).map_or(0, |rows| rows.address);
            let software = tlas.software.as_ref().map_or(0, |software| software.body.address);
            self.write_tlas_table(tlas.slot, [rows, software]);
        }
        let refits = if refit { self.last_update(target, tlas).1.saturating_add(1) } else { 0 };
        let refits_submitted = refit && self.own_update(target).is_none();
        let contents = TlasContents { instance_count: Some(count), built_count, shown, source, refits };
        self.tlas_updates.push(TlasUpdate { target: Arc::clone(target), contents, refits_submitted });
        Ok(())
    }

    /// Tells shaders where the rows of a structure lie, and what software traces; 0 where there is nothing.
    fn write_tlas_table(&mut self, slot: u32, entry: [u64; 2]) {
        let shared = Arc::clone(&self.shared);
        let Some(table) = shared.tlas_table.as_ref() else { return };
        self.uses.id(shared.tlas_tables, Use::transfer_write());
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
        self.uses.id(shared.tlas_tables, Use::transfer_write());
        self.flush();
        // SAFETY: the whole buffer is filled.
        unsafe { shared.gpu.device.cmd_fill_buffer(self.raw(), table.raw, 0, vk::WHOLE_SIZE, 0) };
    }
}
