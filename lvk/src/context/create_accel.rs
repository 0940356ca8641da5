//! Creation of acceleration structures. Builds run before the next submission, or at once on a given queue.

use std::sync::Arc;

use ash::vk;

use super::Context;
use super::holder::Holder;
use super::plan_blas::{new_blas_object, part_limits};
use crate::accel::AccelStruct;
use crate::accel::accel_struct::AccelKind;
use crate::accel::blas::{BlasPart, BlasStructures};
use crate::accel::build::BuildInput;
use crate::accel::desc::BlasDesc;
use crate::accel::flags::{AccelStructSizes, BuildMode};
use crate::accel::instance::{InstancePlan, PlanMemory};
use crate::accel::raw_accel_struct::RawAccelStruct;
use crate::accel::split::PartLimits;
use crate::accel::tlas::Tlas;
use crate::accel::tlas_desc::TlasDesc;
use crate::command::queue_support::{BUILD_ON_QUEUE, needs_compute};
use crate::cpu_scope::cpu_scope;
use crate::device_state::DeviceState;
use crate::error::{Error, Result, check_limit};
use crate::handle::AccelStructHandle;
use crate::queue::Queue;
use crate::software_ray_query::create::software_tlas;
use crate::submit::SubmitHandle;

impl Context {
    /// Creates a BLAS from geometries and builds it before the next submission.
    ///
    /// See [`create_blas_batch`](Self::create_blas_batch).
    pub fn create_blas(&self, desc: &BlasDesc<'_>) -> Result<Holder<AccelStructHandle>> {
        let mut made = self.create_blas_batch(std::slice::from_ref(desc))?;
        made.pop().ok_or_else(|| Error::usage(desc.debug_name, "nothing was built"))
    }

    /// Creates several BLAS and builds them together, within the scratch budget
    /// ([`ContextDesc::scratch_budget_bytes`](crate::ContextDesc)).
    ///
    /// Usually does not wait. A batch that fills the scratch budget several times is sent as several submissions at
    /// once. The last of them runs before the caller's next submission, which may use the handles.
    /// [`build_progress`](Self::build_progress) returns how many builds are finished. Small BLAS share buffers.
    ///
    /// A mesh that would exceed the device's limits for scratch memory, structure size or primitives is split into
    /// spatially compact parts behind its one handle. For meshes that are reordered see
    /// [`PrimitiveOrder`](crate::PrimitiveOrder). Splitting and reordering first read back the inputs of the whole
    /// batch, which waits for the GPU. Both use the contents of the buffers at the time of the call; later contents may
    /// differ. For software ray queries the CPU builds the BVHs, except those with
    /// [`BuildFlags::FAST_BUILD`](crate::BuildFlags::FAST_BUILD). CPU builds read the inputs back too, and take about a
    /// second for 600,000 triangles on one core.
    ///
    /// # Errors
    /// Typed errors. A failed batch leaves no object behind. Reasons are formats, index types and counts that the
    /// device does not support, buffers that are too small or lack
    /// [`BufferUsage::ACCEL_INPUT`](crate::BufferUsage::ACCEL_INPUT), and an exhausted
    /// memory budget ([`ContextDesc::accel_budget_bytes`](crate::ContextDesc)).
    pub fn create_blas_batch(&self, descs: &[BlasDesc<'_>]) -> Result<Vec<Holder<AccelStructHandle>>> {
        cpu_scope!("create BLAS");
        let (holders, objects) = self.new_blas_batch(descs)?;
        for (batch, is_last) in self.scratch_batches(&objects)? {
            self.record_in_prologue(|cmd| {
                let plan = cmd.plan_blas_builds(batch, BuildMode::Rebuild, true)?;
                cmd.record_blas_builds(plan)
            })?;
            if !is_last {
                self.flush()?;
            }
        }
        Ok(holders)
    }

    /// Creates several BLAS like [`create_blas_batch`](Self::create_blas_batch), and builds them at once on a queue.
    ///
    /// On [`Queue::Compute`] the builds run beside other rendering and ray tracing, which does not wait for them. A
    /// later command that references the BLAS ([`update_tlas`](crate::CommandBuffer::update_tlas)) waits for the
    /// builds, on any queue. To keep a frame from waiting, check [`is_done`](Self::is_done) of the returned submission
    /// first. Inputs are read back and BVHs are built on the CPU as in `create_blas_batch`. The call is certain not to
    /// wait only with [`BuildFlags::FAST_BUILD`](crate::BuildFlags::FAST_BUILD). Frames do not wait for the builds, as
    /// for any submission [in the background](Self::submit_in_background).
    ///
    /// # Errors
    /// As [`create_blas_batch`](Self::create_blas_batch), and [`WrongQueue`](crate::Error::WrongQueue) for the transfer
    /// queue.
    pub fn create_blas_batch_on(
        &self,
        queue: Queue,
        descs: &[BlasDesc<'_>],
    ) -> Result<(Vec<Holder<AccelStructHandle>>, SubmitHandle)> {
        needs_compute(queue, BUILD_ON_QUEUE)?;
        let (holders, objects) = self.new_blas_batch(descs)?;
        let mut built = SubmitHandle::default();
        for (batch, _) in self.scratch_batches(&objects)? {
            let mut cmd = self.acquire_command_buffer_on(queue)?;
            let plan = cmd.plan_blas_builds(batch, BuildMode::Rebuild, true)?;
            cmd.record_blas_builds(plan)?;
            built = self.submit_in_background(cmd)?;
        }
        Ok((holders, built))
    }

    /// Creates the BLAS of a batch without building them.
    fn new_blas_batch(&self, descs: &[BlasDesc<'_>]) -> Result<NewBatch> {
        let shared = self.device_state();
        let inputs = self.plan_blas_inputs(descs)?;
        let blobs = self.software_blobs(descs)?;
        let mut holders = Vec::with_capacity(descs.len());
        let mut objects = Vec::with_capacity(descs.len());
        for ((desc, inputs), blob) in descs.iter().zip(inputs).zip(&blobs) {
            let software = self.software_blas(desc, blob.as_ref())?;
            let structure = |part: &BlasPart| {
                let (ty, bytes) =
                    (vk::AccelerationStructureTypeKHR::BOTTOM_LEVEL, part.sizes.structure_bytes);
                RawAccelStruct::new(&shared.gpu, &shared.accel_storage, desc.debug_name, ty, bytes)
            };
            let structures = inputs.parts.iter().map(structure).collect::<Result<Vec<_>>>()?;
            let body = BlasStructures { structures, compacted_from: None, rebuildable: true };
            let handle = shared.store.accel_structs.insert(new_blas_object(desc, inputs, body, software));
            holders.push(Holder::new(self, handle, 0));
            objects.push(shared.store.accel_structs.get(handle)?);
        }
        for (object, blob) in objects.iter().zip(blobs) {
            blob.map(|blob| self.upload_software_blob(object, &blob)).transpose()?;
        }
        Ok((holders, objects))
    }

    /// Splits BLAS into batches whose first builds fill the scratch budget. The flag is true for the last batch.
    fn scratch_batches<'a>(&self, objects: &'a [Arc<AccelStruct>]) -> Result<Vec<BlasBatch<'a>>> {
        let budget = self.device_state().scratch[0].tiers.batch_bytes();
        let (mut batches, mut first, mut scratch) = (Vec::new(), 0, 0_u64);
        for (index, object) in objects.iter().enumerate() {
            let next = object.blas()?.initial_scratch_bytes();
            if index > first && scratch.saturating_add(next) > budget {
                batches.push((&objects[first..index], false));
                (first, scratch) = (index, 0);
            }
            scratch = scratch.saturating_add(next);
        }
        batches.push((&objects[first..], true));
        Ok(batches)
    }

    /// Creates a TLAS and builds it before the next submission. [`Holder::index`] is its element of `kTLAS[]`.
    ///
    /// # Errors
    /// As [`CommandBuffer::update_tlas`](crate::CommandBuffer::update_tlas), and
    /// [`LimitExceeded`](Error::LimitExceeded) if the number of instances, the size of the TLAS or its scratch memory
    /// exceeds the device's limit.
    pub fn create_tlas(&self, desc: &TlasDesc<'_>) -> Result<Holder<AccelStructHandle>> {
        let shared = self.device_state();
        shared.gpu.check_acceleration_structures()?;
        let slot = shared.reserve_slot(|| shared.bindless.reserve_tlas(desc.debug_name))?;
        let limits = part_limits(&shared.gpu.caps.limits);
        let tlas = new_tlas_within_limits(shared, desc, slot, &limits)
            .inspect_err(|_| shared.bindless.free_tlas(slot))?;
        if let AccelKind::Tlas(object) = &tlas.kind {
            object.structure.iter().for_each(|structure| shared.bindless.set_tlas(slot, structure.raw));
        }
        let handle = shared.store.accel_structs.insert(tlas);
        let holder = Holder::new(self, handle, slot);
        self.record_in_prologue(|cmd| cmd.update_tlas(handle, desc.instances, BuildMode::Rebuild))?;
        Ok(holder)
    }
}

/// BLAS that are built together, and true for the last batch.
type BlasBatch<'a> = (&'a [Arc<AccelStruct>], bool);

/// Handles of the new BLAS, and the objects behind them.
type NewBatch = (Vec<Holder<AccelStructHandle>>, Vec<Arc<AccelStruct>>);

/// Creates a TLAS of any size for a slot that the caller has reserved, without building it.
pub(super) fn new_tlas(shared: &DeviceState, desc: &TlasDesc<'_>, slot: u32) -> Result<AccelStruct> {
    let limits = PartLimits { structure_bytes: u64::MAX, scratch_bytes: u64::MAX, primitives: u64::MAX };
    new_tlas_within_limits(shared, desc, slot, &limits)
}

fn new_tlas_within_limits(
    shared: &DeviceState,
    desc: &TlasDesc<'_>,
    slot: u32,
    limits: &PartLimits,
) -> Result<AccelStruct> {
    let name = desc.debug_name;
    desc.flags.check_tlas(name)?;
    let count = u32::try_from(desc.instances.len()).unwrap_or(u32::MAX);
    let capacity = desc.capacity.max(count);
    let average = u64::from(built_count(shared, desc)?).div_ceil(u64::from(count.max(1)));
    let built_capacity = u64::from(capacity) * average.max(desc.parts_per_instance.into());
    check_limit(name, "instance capacity", built_capacity, shared.gpu.caps.limits.max_tlas_instances)?;
    let built_capacity = u32::try_from(built_capacity).unwrap_or(u32::MAX);
    let (structure, sizes) = match shared.gpu.accel {
        Some(_) => {
            let (structure, sizes) = hardware_tlas(shared, desc, built_capacity, limits)?;
            (Some(structure), sizes)
        }
        None => (None, AccelStructSizes::default()),
    };
    let software = software_tlas(shared, name, capacity)?;
    let sizes = software.as_ref().map_or(sizes, |software| sizes.max_with(software.sizes()));
    let tlas = Tlas::new(slot, capacity, built_capacity, structure, software);
    Ok(AccelStruct::new(name, desc.flags, sizes, AccelKind::Tlas(tlas)))
}

/// Returns the number of instances in the Vulkan build, with an instance for each part of a split BLAS.
fn built_count(shared: &DeviceState, desc: &TlasDesc<'_>) -> Result<u32> {
    let find = |handle| shared.blas_ref(handle);
    let (known, mut memory) = (Arc::default(), PlanMemory::default());
    let plan = InstancePlan::new(desc.debug_name, desc.instances, &known, &mut memory, &find)?;
    Ok(plan.built_count)
}

/// Creates the acceleration structure that the hardware traces, for `built_capacity` instances.
fn hardware_tlas(
    shared: &DeviceState,
    desc: &TlasDesc<'_>,
    built_capacity: u32,
    limits: &PartLimits,
) -> Result<(RawAccelStruct, AccelStructSizes)> {
    let name = desc.debug_name;
    let sizes = BuildInput::from_instances(desc.flags, 0, built_capacity).query_sizes(&shared.gpu)?;
    check_limit(name, "size of the TLAS in bytes", sizes.structure_bytes, limits.structure_bytes)?;
    check_limit(name, "scratch of a build in bytes", sizes.scratch_bytes(), limits.scratch_bytes)?;
    let ty = vk::AccelerationStructureTypeKHR::TOP_LEVEL;
    let bytes = sizes.structure_bytes;
    let structure = RawAccelStruct::new(&shared.gpu, &shared.accel_storage, name, ty, bytes)?;
    Ok((structure, sizes))
}
