//! Builds and refits of a TLAS from instances that Vulkan can read.

use std::sync::Arc;

use ash::vk;

use super::CommandBuffer;
use crate::accel::AccelStruct;
use crate::accel::blas_refs::{AccelGeneration, BlasRefSet};
use crate::accel::build::TlasBuild;
use crate::accel::flags::BuildMode;
use crate::accel::instance::InstanceSource;
use crate::accel::scratch::aligned_scratch_address;
use crate::accel::tlas::Tlas;
use crate::accel::tlas_tracker::{RecordedTlasBuild, TlasChange, TlasTracker};
use crate::barrier::{ResourceId, Stages, Use};
use crate::error::limit_origin::LimitOrigin;
use crate::error::{Error, Result, check_limit_of};
use crate::resource::Buffer;
use crate::submit::last_access::QueueAccess;

/// State of a TLAS before the next command.
pub(super) struct PreviousState<'a> {
    /// Instance counts of the caller and of Vulkan; `None` before the first build.
    pub(super) counts: Option<(u32, u32)>,
    pub(super) refits: u32,
    /// True if this command buffer has not updated the TLAS yet.
    pub(super) is_first: bool,
    /// The BLAS that the TLAS references; empty if one of them was destroyed or has moved.
    pub(super) blas_refs: &'a Arc<BlasRefSet>,
    /// True if no BLAS that the TLAS references was destroyed or has moved.
    pub(super) is_current: bool,
    /// Generation at which that was checked.
    pub(super) generation: AccelGeneration,
}

/// A build of one TLAS, without its instances.
#[derive(Clone, Copy)]
pub(super) struct TlasBuildRequest<'a> {
    pub(super) target: &'a AccelStruct,
    pub(super) tlas: &'a Tlas,
    pub(super) previous: &'a PreviousState<'a>,
    pub(super) mode: BuildMode,
}

/// Instances of a Vulkan build.
#[derive(Clone, Copy)]
pub(super) struct VulkanInstances {
    pub(super) address: u64,
    pub(super) count: u32,
    /// True if a kernel writes them, to the records buffer of the TLAS.
    pub(super) is_from_kernel: bool,
}

impl CommandBuffer {
    /// State of a TLAS before the next command.
    #[inline(always)]
    pub(super) fn previous_state<'a>(
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

    /// Records the build of the Vulkan TLAS (`vkCmdBuildAccelerationStructuresKHR`).
    #[inline(always)]
    pub(super) fn build_tlas(
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
        // SAFETY: instances, TLAS and scratch memory are alive, checked, aligned and large enough; barriers keep them
        // apart from other commands.
        unsafe { build.record(self.shared.gpu.accel_functions()?, self.raw()) };
        if is_first {
            self.reference_resource(target.id, QueueAccess::Write);
        }
        Ok(())
    }

    /// Records the barriers for a build of a TLAS, and returns its scratch memory. A build needs no barriers if the
    /// commands before were builds of other TLAS and the scratch buffer has memory left for it. Then all of these
    /// builds may run concurrently.
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

    /// As [`join_build_run`](Self::join_build_run), for a build that waits for earlier ones.
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

    /// Publishes the new contents of a TLAS to other queues and to shaders. Returns the arguments of
    /// `TlasTrackers::record_build`; the BLAS references are `None` if they are unchanged.
    pub(super) fn publish(
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
        let hit_table_address = self.write_hit_table_entry(tlas, previous.counts.is_some(), blas_refs);
        let counts = (count, built_count);
        (RecordedTlasBuild { counts, refit, hit_table_address, generation: previous.generation }, new, source)
    }

    /// References the BLAS for queue synchronisation, as other queues may have built them.
    pub(super) fn reference_blas(&mut self, blas_refs: &BlasRefSet) {
        if self.shared.gpu.queues.has_several() {
            blas_refs
                .refs()
                .iter()
                .for_each(|blas_refs| self.reference_resource(blas_refs.id, QueueAccess::Read));
        }
    }
}

impl TlasBuildRequest<'_> {
    /// Checks the instance counts. Returns true for a refit.
    #[inline(always)]
    pub(super) fn check_counts(&self, count: u32, built: u32) -> Result<bool> {
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

/// Fails if the caller has more instances than the TLAS was created for.
pub(super) fn check_capacity(target: &AccelStruct, tlas: &Tlas, count: u64) -> Result<()> {
    check_limit_of(LimitOrigin::TlasCapacity, &target.name, "instance count", count, tlas.capacity.into())
}

#[cold]
fn capacity_error(target: &AccelStruct, tlas: &Tlas, count: u32, built: u32) -> Error {
    let message = format!(
        "its {count} instances of split meshes have {built} parts, but its capacity is {}; create it with a larger \
         capacity or more TlasDesc::parts_per_instance",
        tlas.built_capacity
    );
    Error::usage(&target.name, message)
}
