//! Instances on their way into the build of a top-level structure: written by the host where it knows the addresses,
//! by a kernel where structures have parts, maps, or may move.

use std::sync::{Arc, OnceLock};

use super::CommandBuffer;
use super::transfer::BufferCopy;
use crate::accel::AccelStruct;
use crate::accel::build::instance_bytes;
use crate::accel::flags::BuildFlags;
use crate::accel::instance::{DeviceInstances, TlasInstance};
use crate::accel::instance_plan::{Find, InstancePlan, starts_plain, write_addresses};
use crate::accel::tlas::{Entry, InstanceSource, InstanceTables, Shown, SourceBytes, Tlas};
use crate::barrier::{Stages, Use};
use crate::error::{Error, Result};
use crate::kernel::{InstancesPush, Kernel};
use crate::resource::Buffer;
use crate::resource::buffer::{BufferDesc, BufferUsage, InternalUsage};
use crate::shared::Garbage;

/// Addresses of instances must be a multiple of this.
const INSTANCE_ALIGNMENT: u64 = 16;

/// Bytes of `LvkTlasRow` in `shader/glsl/hit_numbers.glsl`.
pub(crate) const ROW_BYTES: u64 = 16;

/// Instances on their way into a build.
pub(super) struct Ready {
    /// Where Vulkan reads them.
    pub(super) address: u64,
    pub(super) built_count: u32,
    pub(super) shown: Vec<Shown>,
    pub(super) source: Option<InstanceSource>,
    pub(super) reads: Vec<Arc<Buffer>>,
}

/// Instances of the host, as far as they are prepared before the counts are checked.
pub(super) enum Planned {
    /// Vulkan can read them.
    Ready(Ready),
    /// A kernel has to write them.
    Kernel(InstancePlan),
}

impl Planned {
    /// Instances Vulkan will be given.
    pub(super) fn built_count(&self) -> u32 {
        match self {
            Self::Ready(ready) => ready.built_count,
            Self::Kernel(plan) => plan.built_count,
        }
    }
}

impl CommandBuffer {
    /// The instances, ready to be built.
    pub(super) fn host_instances(
        &mut self,
        target: &AccelStruct,
        instances: &[TlasInstance],
    ) -> Result<Planned> {
        let shared = Arc::clone(&self.shared);
        let find = |handle| shared.store.accel_structs.get(handle);
        if starts_plain(instances, &find)?
            && let Some(ready) = self.stage_instances(&target.name, instances, &find)?
        {
            return Ok(Planned::Ready(ready));
        }
        Ok(Planned::Kernel(InstancePlan::new(&target.name, instances, &find)?))
    }

    /// Instances whose addresses the host knows; nothing where a kernel is needed.
    fn stage_instances(
        &mut self,
        name: &str,
        instances: &[TlasInstance],
        find: Find<'_>,
    ) -> Result<Option<Ready>> {
        let built_count = instances.len() as u32;
        let bytes = instance_bytes(built_count.max(1));
        let mut shown = Ok(None);
        let staging = &self.shared.staging;
        let region = staging.write_with(bytes, INSTANCE_ALIGNMENT, self.recording.sequence, |out| {
            shown = write_addresses(name, instances, find, out);
        })?;
        let ready =
            |shown| Ready { address: region.address, built_count, shown, source: None, reads: Vec::new() };
        Ok(shown?.map(ready))
    }

    /// Instances for the kernel, and the owners of those for further parts.
    pub(super) fn host_source(
        &mut self,
        name: &str,
        instances: &[TlasInstance],
        plan: InstancePlan,
    ) -> Result<(InstanceSource, Vec<Shown>)> {
        let list = plan.entries();
        let keep = plan.shown.iter().any(Shown::may_move);
        let mut written = Ok(());
        let records = self.source_bytes(name, instance_bytes(plan.built_count), keep, |out| {
            written = plan.write_entries(name, instances, &list, out);
        })?;
        written?;
        let owners: &[u8] = bytemuck::cast_slice(&list.owners);
        let owners = match owners.len() as u64 {
            0 => None,
            bytes => {
                Some(self.source_bytes(name, bytes, keep, |out| out[..owners.len()].copy_from_slice(owners))?)
            }
        };
        let source = InstanceSource {
            instances: records,
            count: plan.built_count,
            owners,
            user_count: instances.len() as u32,
            copies: 1,
            entries: list.entries,
        };
        Ok((source, plan.shown))
    }

    /// Bytes for the kernel to read: in a buffer of their own if they are to be kept, else in staging memory.
    fn source_bytes(
        &mut self,
        name: &str,
        size_bytes: u64,
        keep: bool,
        fill: impl FnOnce(&mut [u8]),
    ) -> Result<SourceBytes> {
        if !keep {
            let staging = &self.shared.staging;
            let region = staging.write_with(size_bytes, INSTANCE_ALIGNMENT, self.recording.sequence, fill)?;
            return Ok(SourceBytes { address: region.address, buffer: None });
        }
        let size_bytes = size_bytes.max(INSTANCE_ALIGNMENT);
        let buffer = self.shared.instance_buffers.take(&self.shared.gpu, name, size_bytes)?;
        buffer.fill(fill);
        self.shared.retire(Garbage::Held(Arc::clone(&buffer)));
        Ok(SourceBytes { address: buffer.address, buffer: Some(buffer) })
    }

    /// The caller's buffer as a source.
    pub(super) fn device_source(
        &self,
        name: &str,
        instances: &DeviceInstances<'_>,
    ) -> Result<(Vec<Shown>, InstanceSource)> {
        let shared = Arc::clone(&self.shared);
        let buffer = shared.store.buffers.get(instances.buffer)?;
        buffer.check_usage(BufferUsage::STORAGE)?;
        if !instances.offset.is_multiple_of(INSTANCE_ALIGNMENT) {
            let message = format!("instances start at a multiple of 16 bytes, not at {}", instances.offset);
            return Err(Error::usage(name, message));
        }
        let bytes = instance_bytes(instances.count);
        buffer.check_range(instances.offset, bytes)?;
        let mut shown = Vec::with_capacity(instances.blas.len());
        for handle in instances.blas {
            let blas = shared.store.accel_structs.get(*handle)?;
            let body = blas.blas()?.body();
            shown.push(Shown { blas, body });
        }
        let parts = |shown: &Shown| shown.body.structures.len() as u32;
        let entry = |(place, of): (u32, &Shown)| Entry { shown: place, first: 0, count: parts(of) };
        let own =
            SourceBytes { address: buffer.address + instances.offset, buffer: Some(Arc::clone(&buffer)) };
        let source = InstanceSource {
            instances: own,
            count: instances.count,
            owners: None,
            user_count: instances.count,
            copies: shown.iter().map(parts).max().unwrap_or(1),
            entries: (0..).zip(&shown).map(entry).collect(),
        };
        Ok((shown, source))
    }

    /// Copies the caller's buffer where structures may move later, since it may have other contents by then.
    pub(super) fn keep_source(
        &mut self,
        name: &str,
        instances: &DeviceInstances<'_>,
        shown: &[Shown],
        source: &mut InstanceSource,
    ) -> Result<()> {
        let bytes = instance_bytes(instances.count);
        if bytes == 0 || !shown.iter().any(Shown::may_move) {
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
        shared.retire(Garbage::Held(Arc::clone(&copy)));
        source.instances = SourceBytes { address: copy.address, buffer: Some(copy) };
        Ok(())
    }

    /// Has the kernel write the instances and their rows.
    pub(super) fn run_instances(
        &mut self,
        target: &AccelStruct,
        tlas: &Tlas,
        shown: Vec<Shown>,
        source: InstanceSource,
        built_count: u32,
    ) -> Result<Ready> {
        let records = self.kept_buffer(&tlas.records, target, u64::from(tlas.room) * instance_bytes(1))?;
        let mapped = shown.iter().any(Shown::has_rows);
        let rows = match mapped || tlas.rows.get().is_some() {
            true => Some(self.kept_buffer(&tlas.rows, target, u64::from(tlas.room) * ROW_BYTES)?),
            false => None,
        };
        // A refit may neither add nor remove instances, but records may come to name meshes of other parts.
        let keep_active = source.copies > 1 && target.flags.contains(BuildFlags::ALLOW_UPDATE);
        self.record_instances(&source, &shown, &records, rows.as_deref(), keep_active)?;
        let source = shown.iter().any(Shown::may_move).then_some(source);
        Ok(Ready { address: records.address, built_count, shown, source, reads: vec![records] })
    }

    fn record_instances(
        &mut self,
        source: &InstanceSource,
        shown: &[Shown],
        records: &Buffer,
        rows: Option<&Buffer>,
        keep_active: bool,
    ) -> Result<()> {
        let tables = InstanceTables::new(shown, &source.entries);
        let entries = self.stage(bytemuck::cast_slice(&tables.entries))?;
        let parts = self.stage(bytemuck::cast_slice(&tables.parts))?;
        let push = InstancesPush {
            source: source.instances.address,
            target: records.address,
            rows: rows.map_or(0, |rows| rows.address),
            entries,
            parts,
            owners: source.owners.as_ref().map_or(0, |owners| owners.address),
            count: source.count,
            copies: source.copies,
            entry_count: tables.entries.len() as u32,
            user_count: source.user_count,
            keep_active: keep_active.into(),
            unused: 0,
        };
        if let Some(buffer) = &source.instances.buffer {
            self.use_buffer(buffer, Use::shader_read(Stages::COMPUTE));
        }
        self.use_buffer(records, Use::shader_write(Stages::COMPUTE));
        if rows.is_some() {
            self.uses.id(self.shared.tlas_tables, Use::shader_write(Stages::COMPUTE));
        }
        self.flush();
        let invocations = source.count.saturating_mul(source.copies);
        if invocations == 0 {
            return Ok(());
        }
        self.run_kernel(Kernel::Instances, std::iter::once((bytemuck::bytes_of(&push), invocations)))
    }

    /// The address of bytes that the GPU may read until the command buffer is done.
    fn stage(&mut self, bytes: &[u8]) -> Result<u64> {
        let region = self.shared.staging.write(bytes, INSTANCE_ALIGNMENT, self.recording.sequence)?;
        Ok(region.address)
    }

    /// A buffer that lives as long as the structure, made when it is first needed.
    fn kept_buffer(
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
