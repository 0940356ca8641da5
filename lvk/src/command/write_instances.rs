//! Instances on their way into the build of a top-level structure: written by the host where it knows the addresses,
//! by a kernel where structures have parts, maps, or may move.

use std::sync::{Arc, OnceLock};

use super::CommandBuffer;
use super::transfer::BufferCopy;
use crate::accel::AccelStruct;
use crate::accel::blas_refs::{BitSet, BlasRefSet};
use crate::accel::build::instance_bytes;
use crate::accel::flags::BuildFlags;
use crate::accel::instance::{DeviceInstances, INSTANCE_BYTES, TlasInstance};
use crate::accel::instance_plan::{
    InstancePlan, PlanMemory, WrittenRefs, first_needs_only_address, write_addresses, write_unchanged,
};
use crate::accel::tlas::{BlasIndexing, InstanceBytes, InstanceSource, Tlas};
use crate::accel::tlas_tracker::TlasChange;
use crate::barrier::{Stages, Use};
use crate::device_state::DeferredObject;
use crate::error::{Error, Result};
use crate::kernels::{InstancesPushConstants, Kernel};
use crate::resource::Buffer;
use crate::resource::buffer::{BufferDesc, BufferUsage, InternalUsage};
use crate::upload::staging::StagingChunk;

/// Addresses of instances must be a multiple of this.
const INSTANCE_ALIGNMENT: u64 = 16;

/// Bytes of `LvkTlasRow` in `shader/glsl/hit_numbers.glsl`.
pub(crate) const REMAP_ENTRY_BYTES: u64 = 16;

/// Instances that the host has written as Vulkan reads them.
pub(super) struct StagedInstances {
    pub(super) address: u64,
    /// What they refer to; `None` for what was known.
    pub(super) blas_refs: Option<Arc<BlasRefSet>>,
}

/// Instances that Vulkan is given.
#[derive(Clone, Copy)]
pub(super) struct VulkanInstances {
    pub(super) address: u64,
    pub(super) count: u32,
    /// Whether a kernel writes them, into the structure's own records.
    pub(super) is_from_kernel: bool,
}

/// Instances that a kernel writes.
pub(super) struct KernelInstances {
    address: u64,
    built_count: u32,
    blas_refs: Arc<BlasRefSet>,
    /// Kept where they may have to be written again.
    source: Option<Arc<InstanceSource>>,
}

impl KernelInstances {
    /// What Vulkan is given.
    pub(super) fn build_instances(&self) -> VulkanInstances {
        VulkanInstances { address: self.address, count: self.built_count, is_from_kernel: true }
    }

    /// What a structure shows with them.
    pub(super) fn into_change(self, count: u32, refit: bool) -> TlasChange {
        let Self { built_count, blas_refs, source, .. } = self;
        TlasChange { count, built_count, blas_refs: Some(blas_refs), source, refit }
    }
}

/// So many instances are written without a list of what they refer to.
const MAX_UNCHANGED_INSTANCES: usize = StagingChunk::MAX_BYTES as usize / INSTANCE_BYTES;

impl CommandBuffer {
    /// Writes a few instances of just what is `previous`, which still stands. Answers their address; `None` for any others, wrong
    /// ones among them.
    #[inline(always)]
    pub(super) fn try_stage_unchanged(
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

    /// Writes instances with addresses; `None` where a kernel is needed. `previous` is what was shown before, if that still stands.
    pub(super) fn stage_instances(
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

    /// What the instances refer to.
    pub(super) fn plan_instances(
        &self,
        name: &str,
        instances: &[TlasInstance],
        previous: &Arc<BlasRefSet>,
        memory: &mut PlanMemory,
    ) -> Result<InstancePlan> {
        let find = |handle| self.shared.blas_ref(handle);
        InstancePlan::new(name, instances, previous, memory, &find)
    }

    /// Instances for the kernel, and the owners of those for further parts.
    pub(super) fn host_source(
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

    /// Bytes for the kernel to read: in a buffer of their own if they are to be kept, else in staging memory.
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

    /// The caller's buffer as a source.
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

    /// Copies the caller's buffer where structures may move later, since it may have other contents by then.
    pub(super) fn keep_source_copy(
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

    /// Has the kernel write the instances and their rows.
    pub(super) fn record_instances(
        &mut self,
        target: &AccelStruct,
        tlas: &Tlas,
        blas_refs: Arc<BlasRefSet>,
        source: InstanceSource,
        built_count: u32,
    ) -> Result<KernelInstances> {
        let records = self.get_or_create_buffer(
            &tlas.records,
            target,
            u64::from(tlas.built_capacity) * instance_bytes(1),
        )?;
        let rows = match blas_refs.needs_hit_remap || tlas.hit_table.get().is_some() {
            true => Some(self.get_or_create_buffer(
                &tlas.hit_table,
                target,
                u64::from(tlas.built_capacity) * REMAP_ENTRY_BYTES,
            )?),
            false => None,
        };
        // A refit may neither add nor remove instances, but records may come to name meshes of other parts.
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

    /// The address of bytes that the GPU may read until the command buffer is done.
    fn stage_bytes(&mut self, bytes: u64, fill: impl FnOnce(&mut [u8])) -> Result<u64> {
        let sequence = self.recording.staging_key();
        let (address, ()) =
            self.shared.staging.write_in(&mut self.staged, bytes, INSTANCE_ALIGNMENT, sequence, fill)?;
        Ok(address)
    }

    /// A buffer that lives as long as the structure, made when it is first needed.
    fn get_or_create_buffer(
        &self,
        place: &OnceLock<Arc<Buffer>>,
        target: &AccelStruct,
        bytes: u64,
    ) -> Result<Arc<Buffer>> {
        if let Some(buffer) = place.get() {
            return Ok(Arc::clone(buffer));
        }
        let desc = BufferDesc {
            size_bytes: bytes.max(1),
            usage: BufferUsage::STORAGE | BufferUsage::ACCEL_INPUT,
            debug_name: &target.name,
            ..Default::default()
        };
        let buffer = Arc::new(Buffer::new(&self.shared.gpu, &desc, InternalUsage::NONE)?);
        Ok(Arc::clone(place.get_or_init(|| buffer)))
    }
}
