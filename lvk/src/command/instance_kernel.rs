//! Instances of a TLAS that the kernel [`Kernel::Instances`] writes: its input, its dispatch, and the build from its output.

use std::sync::Arc;

use super::CommandBuffer;
use super::build_tlas::{TlasBuildRequest, VulkanInstances};
use super::transfer::BufferCopy;
use crate::accel::AccelStruct;
use crate::accel::blas_refs::BlasRefSet;
use crate::accel::flags::BuildFlags;
use crate::accel::instance::{
    BlasIndexing, DeviceInstances, InstanceBytes, InstancePlan, InstanceSource, PlanMemory, TlasInstance,
    instance_bytes,
};
use crate::accel::tlas::Tlas;
use crate::accel::tlas_tracker::TlasChange;
use crate::barrier::{Stages, Use};
use crate::device_state::DeferredObject;
use crate::error::{Error, Result};
use crate::kernels::{InstancesPushConstants, Kernel};
use crate::resource::Buffer;
use crate::resource::buffer::{BufferDesc, BufferUsage, InternalUsage};

/// Alignment of instance addresses, in bytes.
pub(super) const INSTANCE_ALIGNMENT: u64 = 16;

/// Instances that a kernel writes.
pub(super) struct KernelInstances {
    address: u64,
    built_count: u32,
    blas_refs: Arc<BlasRefSet>,
    /// Kept if the instances may have to be written again.
    source: Option<Arc<InstanceSource>>,
}

impl KernelInstances {
    /// Returns the instances for the Vulkan build.
    pub(super) fn build_instances(&self) -> VulkanInstances {
        VulkanInstances { address: self.address, count: self.built_count, is_from_kernel: true }
    }

    /// Returns the change of the TLAS contents that these instances cause.
    pub(super) fn into_change(self, count: u32, refit: bool) -> TlasChange {
        let Self { built_count, blas_refs, source, .. } = self;
        TlasChange { count, built_count, blas_refs: Some(blas_refs), source, refit }
    }
}

impl CommandBuffer {
    /// Builds from instances that a kernel writes. On a device without acceleration structures, only checks the
    /// instances.
    #[inline(never)]
    pub(super) fn update_with_kernel(
        &mut self,
        update: TlasBuildRequest<'_>,
        instances: &[TlasInstance],
        memory: &mut PlanMemory,
    ) -> Result<TlasChange> {
        let TlasBuildRequest { target, tlas, previous, .. } = update;
        let count = instances.len() as u32;
        let find = |handle| self.shared.blas_ref(handle);
        let plan = InstancePlan::new(&target.name, instances, previous.blas_refs, memory, &find)?;
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

    /// Builds the Vulkan TLAS from instances in a buffer.
    pub(super) fn build_from_buffer(
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

    /// Builds from the instances of a kernel that is already recorded.
    pub(super) fn build_from_kernel(
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

    /// Returns the kernel's input: the instances, and the owners of the instances for extra parts.
    fn host_source(
        &mut self,
        name: &str,
        instances: &[TlasInstance],
        plan: InstancePlan,
        memory: &mut PlanMemory,
    ) -> Result<(InstanceSource, Arc<BlasRefSet>)> {
        let keep = plan.blas_refs.may_move;
        let mut written = Ok(());
        let records = self.source_bytes(name, instance_bytes(plan.built_count), keep, |out| {
            written = plan.write_part_indices(name, instances, out);
        })?;
        written?;
        let owners = match plan.extra_part_count() {
            0 => None,
            count => {
                let bytes = u64::from(count) * size_of::<u32>() as u64;
                Some(self.source_bytes(name, bytes, keep, |out| plan.write_extra_part_owners(out))?)
            }
        };
        let source = InstanceSource {
            instances: records,
            count: plan.built_count,
            owners,
            user_count: instances.len() as u32,
            copies: 1,
            indexing: BlasIndexing::ByPart,
        };
        let blas_refs = Arc::clone(&plan.blas_refs);
        memory.ref_indices = plan.into_ref_indices();
        Ok((source, blas_refs))
    }

    /// Writes bytes for the kernel to read: to a buffer of their own if they are to be kept, else to staging memory.
    fn source_bytes(
        &mut self,
        name: &str,
        size_bytes: u64,
        keep: bool,
        fill: impl FnOnce(&mut [u8]),
    ) -> Result<InstanceBytes> {
        if !keep {
            return Ok(InstanceBytes { address: self.stage_bytes(size_bytes, fill)?, buffer: None });
        }
        let size_bytes = size_bytes.max(INSTANCE_ALIGNMENT);
        let buffer = self.shared.instance_buffers.acquire(&self.shared.gpu, name, size_bytes)?;
        buffer.fill_with(fill);
        self.shared.free_later(DeferredObject::BufferRef(Arc::clone(&buffer)));
        Ok(InstanceBytes { address: buffer.address, buffer: Some(buffer) })
    }

    /// Returns the caller's buffer as the kernel's input.
    pub(super) fn device_source(
        &self,
        name: &str,
        instances: &DeviceInstances<'_>,
        previous: &Arc<BlasRefSet>,
    ) -> Result<(Arc<BlasRefSet>, InstanceSource)> {
        let buffer = self.shared.store.buffers.get(instances.buffer)?;
        buffer.check_usage(BufferUsage::STORAGE)?;
        if !instances.offset.is_multiple_of(INSTANCE_ALIGNMENT) {
            let message = format!("instances start at a multiple of 16 bytes, not at {}", instances.offset);
            return Err(Error::usage(name, message));
        }
        let bytes = instance_bytes(instances.count);
        buffer.check_range(instances.offset, bytes)?;
        let blas_refs = if previous.has_handles(instances.blas) {
            Arc::clone(previous)
        } else {
            let find = |handle: &_| self.shared.blas_ref(*handle);
            Arc::new(BlasRefSet::new(instances.blas.iter().map(find).collect::<Result<_>>()?))
        };
        let own = InstanceBytes { address: buffer.address + instances.offset, buffer: Some(buffer) };
        let source = InstanceSource {
            instances: own,
            count: instances.count,
            owners: None,
            user_count: instances.count,
            copies: blas_refs.part_spans().iter().map(|[_, parts]| *parts).max().unwrap_or(1),
            indexing: BlasIndexing::ByBlas,
        };
        Ok((blas_refs, source))
    }

    /// Copies the caller's buffer if BLAS may move later, since its contents may have changed by then.
    fn keep_source_copy(
        &mut self,
        name: &str,
        instances: &DeviceInstances<'_>,
        blas_refs: &BlasRefSet,
        source: &mut InstanceSource,
    ) -> Result<()> {
        let bytes = instance_bytes(instances.count);
        if bytes == 0 || !blas_refs.may_move {
            return Ok(());
        }
        let shared = Arc::clone(&self.shared);
        let buffer = shared.store.buffers.get(instances.buffer)?;
        let desc = BufferDesc { size_bytes: bytes, debug_name: name, ..Default::default() };
        let copy = Arc::new(Buffer::new(&shared.gpu, &desc, InternalUsage::NONE)?);
        self.copy_buffer_objects(
            &buffer,
            &copy,
            &[BufferCopy { source_offset: instances.offset, target_offset: 0, size: bytes }],
        )?;
        shared.free_later(DeferredObject::BufferRef(Arc::clone(&copy)));
        source.instances = InstanceBytes { address: copy.address, buffer: Some(copy) };
        Ok(())
    }

    /// Records the kernel that writes the instances and their hit remap entries.
    pub(super) fn record_instances(
        &mut self,
        target: &AccelStruct,
        tlas: &Tlas,
        blas_refs: Arc<BlasRefSet>,
        source: InstanceSource,
        built_count: u32,
    ) -> Result<KernelInstances> {
        let (gpu, name) = (&self.shared.gpu, &target.name);
        let records = tlas.records_buffer(gpu, name)?;
        let rows = match blas_refs.needs_hit_remap || tlas.hit_table.get().is_some() {
            true => Some(tlas.hit_table_buffer(gpu, name)?),
            false => None,
        };
        // A refit may neither add nor remove instances, but records may change to BLAS with another number of parts.
        let keep_active = source.copies > 1 && target.flags.contains(BuildFlags::ALLOW_UPDATE);
        self.record_instance_kernel(&source, &blas_refs, &records, rows.as_deref(), keep_active)?;
        let source = blas_refs.may_move.then(|| Arc::new(source));
        Ok(KernelInstances { address: records.address, built_count, blas_refs, source })
    }

    fn record_instance_kernel(
        &mut self,
        source: &InstanceSource,
        blas_refs: &BlasRefSet,
        records: &Buffer,
        rows: Option<&Buffer>,
        keep_active: bool,
    ) -> Result<()> {
        let numbers = source.indexing;
        let entry_count = numbers.entry_count(blas_refs);
        let entries = self.stage_bytes((entry_count * size_of::<[u32; 2]>()) as u64, |out| {
            numbers.write_entries(blas_refs, out)
        })?;
        let parts: &[u8] = bytemuck::cast_slice(blas_refs.part_addresses());
        let parts = self.stage_bytes(parts.len() as u64, |out| out.copy_from_slice(parts))?;
        let push = InstancesPushConstants {
            source: source.instances.address,
            target: records.address,
            rows: rows.map_or(0, |rows| rows.address),
            entries,
            parts,
            owners: source.owners.as_ref().map_or(0, |owners| owners.address),
            count: source.count,
            copies: source.copies,
            entry_count: entry_count as u32,
            user_count: source.user_count,
            keep_active: keep_active.into(),
            unused: 0,
        };
        if let Some(buffer) = &source.instances.buffer {
            self.use_buffer(buffer, Use::shader_read(Stages::COMPUTE));
        }
        self.use_buffer(records, Use::shader_write(Stages::COMPUTE));
        if rows.is_some() {
            self.state.accesses.add_id(self.shared.hit_tables_id, Use::shader_write(Stages::COMPUTE));
        }
        self.flush_barriers();
        let invocations = source.count.saturating_mul(source.copies);
        if invocations == 0 {
            return Ok(());
        }
        self.dispatch_kernel_runs(
            Kernel::Instances,
            std::iter::once((bytemuck::bytes_of(&push), invocations)),
        )
    }

    /// Writes bytes to staging memory, where the GPU may read them until the command buffer is done. Returns their
    /// address.
    fn stage_bytes(&mut self, bytes: u64, fill: impl FnOnce(&mut [u8])) -> Result<u64> {
        let sequence = self.recording.staging_key();
        let (address, ()) =
            self.shared.staging.write_in(&mut self.staged, bytes, INSTANCE_ALIGNMENT, sequence, fill)?;
        Ok(address)
    }
}
