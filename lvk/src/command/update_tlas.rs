//! Updates of a TLAS. The host writes the list of instances if it knows the addresses. A kernel writes it if BLAS have
//! parts or maps, or may move.

use std::sync::Arc;

use super::CommandBuffer;
use super::build_tlas::{TlasBuildRequest, VulkanInstances, check_capacity};
use super::instance_kernel::INSTANCE_ALIGNMENT;
use super::open_build::OpenBuild;
use super::recording_state::RecordingState;
use crate::accel::AccelStruct;
use crate::accel::blas_refs::{BitSet, BlasRefSet};
use crate::accel::flags::BuildMode;
use crate::accel::instance::{DeviceInstances, INSTANCE_BYTES, InstanceSource, TlasInstance, instance_bytes};
use crate::accel::instance_writing::{
    WrittenRefs, first_needs_only_address, write_addresses, write_unchanged,
};
use crate::accel::tlas::Tlas;
use crate::accel::tlas_tracker::{RecordedTlasBuild, TlasChange, TlasEntry, TlasTrackers};
use crate::error::{Error, Result};
use crate::handle::AccelStructHandle;
use crate::upload::staging::StagingChunk;

/// Instances that the host has written in Vulkan's format.
struct StagedInstances {
    address: u64,
    /// The BLAS that they reference; `None` if the set is unchanged.
    blas_refs: Option<Arc<BlasRefSet>>,
}

/// Largest number of instances that are written without collecting the BLAS they reference.
const MAX_UNCHANGED_INSTANCES: usize = StagingChunk::MAX_BYTES as usize / INSTANCE_BYTES;

impl CommandBuffer {
    /// Replaces the instances of a TLAS: at most its capacity, and for a refit as many as before
    /// (`vkCmdBuildAccelerationStructuresKHR`). The call copies the instances.
    ///
    /// # Errors
    /// [`LimitExceeded`](Error::LimitExceeded) over the capacity; [`InvalidUsage`](Error::InvalidUsage) for numbers
    /// that do not fit their bits, transforms that are not finite, and refits that are not allowed;
    /// [`WrongQueue`](Error::WrongQueue) on the transfer queue. If both the device and software trace, and memory for
    /// the software part of the update runs out, the command buffer can no longer be submitted.
    pub fn update_tlas(
        &mut self,
        tlas: AccelStructHandle,
        instances: &[TlasInstance],
        mode: BuildMode,
    ) -> Result<()> {
        self.with_tlas_entry(tlas, |cmd, updates, index| cmd.update_entry(updates, index, instances, mode))
    }

    /// As [`update_tlas`](Self::update_tlas), with instances in a buffer, for example written by a compute shader
    /// earlier in the same command buffer.
    ///
    /// If the list of BLAS has split meshes, every record takes as many Vulkan instances as the mesh with the most
    /// parts. The host does not know which BLAS a record references. From one refit to the next a record may change to
    /// another BLAS of the list. It may not change between an existing BLAS and none: Vulkan treats that as an instance
    /// that is added or removed.
    ///
    /// # Errors
    /// As [`update_tlas`](Self::update_tlas), except that the records themselves are not checked. Also
    /// [`InvalidUsage`](Error::InvalidUsage) for a buffer without
    /// [`BufferUsage::STORAGE`](crate::BufferUsage::STORAGE), or too small.
    pub fn update_tlas_from_buffer(
        &mut self,
        tlas: AccelStructHandle,
        instances: &DeviceInstances<'_>,
        mode: BuildMode,
    ) -> Result<()> {
        self.with_tlas_entry(tlas, |cmd, updates, index| {
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

    /// Writes the instances of a TLAS again, as BLAS that it references have moved, and rebuilds it.
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
            let is_current = blas_refs.is_current(&|handle| cmd.shared.blas_ref(handle));
            let kernel_instances =
                cmd.record_instances(target, tlas, blas_refs, source, contents.built_count)?;
            cmd.build_from_kernel(target, tlas, &kernel_instances, previous.is_first, false)?;
            let (mut recorded, blas_refs, source) =
                cmd.publish(tlas, &previous, kernel_instances.into_change(count, false));
            if !is_current {
                // The set keeps destroyed BLAS. The next update must look up its handles, and find those stale.
                recorded.generation = contents.generation;
            }
            updates.record_build(index, &recorded, blas_refs, source);
            Ok(())
        })
    }

    /// Runs `record` with the TLAS trackers of the command buffer, and the index of the TLAS in them.
    #[inline(always)]
    fn with_tlas_entry(
        &mut self,
        tlas: AccelStructHandle,
        record: impl FnOnce(&mut Self, &mut TlasTrackers, usize) -> Result<()>,
    ) -> Result<()> {
        self.needs_compute("an update of a TLAS")?;
        self.with_tlas_trackers(|cmd, updates| {
            let index = updates.index_of_handle(&cmd.shared.store.accel_structs, tlas)?;
            record(cmd, updates, index)
        })
    }

    /// Runs `record` with the TLAS trackers of the command buffer.
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

    /// Updates the TLAS of an entry with instances of the host. Most updates have few instances, of the same BLAS as
    /// before.
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

    /// Builds from instances in Vulkan's format that reference the same BLAS as before.
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
        let hit_table_address =
            self.write_hit_table_entry(tlas, previous.counts.is_some(), previous.blas_refs);
        Ok(RecordedTlasBuild {
            counts: (count, count),
            refit,
            hit_table_address,
            generation: previous.generation,
        })
    }

    /// Builds from instances that the host has written with addresses. Returns true for a refit.
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

    /// As [`update_entry`](Self::update_entry), for instances of any BLAS.
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

    /// Updates the TLAS of an entry with instances in a buffer.
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

    /// Applies the updates recorded so far as if they were submitted. Only for the command buffer that is submitted
    /// before every other one.
    pub(crate) fn apply_tlas_updates(&mut self) {
        let RecordingState { tlas_trackers, build_run, open_builds, .. } = &mut **self.state;
        build_run.stop();
        if let Some(updates) = tlas_trackers {
            self.shared.apply_tlas_updates(updates, |target| {
                open_builds.push(OpenBuild::for_tlas(Arc::clone(target)))
            });
        }
    }

    /// Returns the error of the software part of an update. Poisons the command buffer if the device part is already
    /// recorded.
    #[cold]
    fn fail_after_device_build(&mut self, target: &AccelStruct, tlas: &Tlas, error: Error) -> Error {
        if tlas.structure.is_some() { self.poison(&target.name, error) } else { error }
    }

    /// Writes a few instances that reference exactly the BLAS of `previous`, which is current. Returns their address,
    /// or `None` for any other instances, including invalid ones.
    #[inline(always)]
    fn try_stage_unchanged(
        &mut self,
        instances: &[TlasInstance],
        previous: &BlasRefSet,
    ) -> Result<Option<u64>> {
        if previous.needs_kernel || instances.is_empty() || instances.len() > MAX_UNCHANGED_INSTANCES {
            return Ok(None);
        }
        let sequence = self.recording.staging_key();
        let bytes = (instances.len() * INSTANCE_BYTES) as u64;
        let (address, alike) =
            self.shared.staging.write_in(&mut self.staged, bytes, INSTANCE_ALIGNMENT, sequence, |out| {
                write_unchanged(instances, previous, out)
            })?;
        Ok(alike.then_some(address))
    }

    /// Writes instances with addresses; returns `None` if a kernel is needed. `previous` has the BLAS referenced before
    /// if they are all current, else none.
    fn stage_instances(
        &mut self,
        name: &str,
        instances: &[TlasInstance],
        previous: &BlasRefSet,
        seen_refs: &mut BitSet,
    ) -> Result<Option<StagedInstances>> {
        let (shared, sequence) = (&self.shared, self.recording.staging_key());
        let find = |handle| shared.blas_ref(handle);
        if previous.needs_kernel
            || (previous.refs().is_empty() && !first_needs_only_address(instances, &find)?)
        {
            return Ok(None);
        }
        let bytes = instance_bytes(instances.len().max(1) as u32);
        let (address, written) =
            shared.staging.write_in(&mut self.staged, bytes, INSTANCE_ALIGNMENT, sequence, |out| {
                write_addresses(name, instances, previous, seen_refs, &find, out)
            })?;
        Ok(match written? {
            WrittenRefs::Unchanged => Some(StagedInstances { address, blas_refs: None }),
            WrittenRefs::Changed(blas_refs) => Some(StagedInstances { address, blas_refs: Some(blas_refs) }),
            WrittenRefs::NeedsKernel => None,
        })
    }
}
