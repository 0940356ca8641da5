//! Sizes, compaction and serialisation of BLAS.

use std::sync::Arc;

use ash::vk;

use super::CommandBuffer;
use super::open_build::OpenBuild;
use crate::accel::AccelStruct;
use crate::accel::blas::BlasStructures;
use crate::accel::compaction::CompactedSizeQuery;
use crate::accel::primitive_map::PrimitiveMap;
use crate::accel::raw_accel_struct::RawAccelStruct;
use crate::barrier::{Stages, Use};
use crate::device_state::DeferredObject;
use crate::error::Result;
use crate::resource::{Buffer, QueryPool};

impl CommandBuffer {
    /// Records queries of the compacted size of each target. The results go to the query's pool.
    pub(crate) fn query_compacted_sizes(&mut self, query: &Arc<CompactedSizeQuery>) -> Result<()> {
        for (target, first) in &query.targets {
            let body = target.blas()?.structures();
            let ty = vk::QueryType::ACCELERATION_STRUCTURE_COMPACTED_SIZE_KHR;
            self.write_size_properties(target, &body, &query.pool, *first, ty)?;
        }
        self.state.size_queries.push(Arc::clone(query));
        Ok(())
    }

    /// Writes a property of each part into the pool (`vkCmdWriteAccelerationStructuresPropertiesKHR`).
    pub(crate) fn write_size_properties(
        &mut self,
        target: &AccelStruct,
        body: &BlasStructures,
        pool: &QueryPool,
        first: u32,
        ty: vk::QueryType,
    ) -> Result<()> {
        let shared = Arc::clone(&self.shared);
        let ext = shared.gpu.accel_functions()?;
        pool.check_range(first, body.structures.len() as u32)?;
        let structures: Vec<_> = body.structures.iter().map(|part| part.raw).collect();
        self.state.accesses.add_id(target.id, Use::accel_read(Stages::ACCEL_BUILD));
        self.flush_barriers();
        // SAFETY: the acceleration structures are alive and built; the queries exist and were reset when the pool was
        // created.
        unsafe {
            ext.cmd_write_acceleration_structures_properties(self.raw(), &structures, ty, pool.raw, first);
        }
        Ok(())
    }

    /// Copies every part into a smaller acceleration structure (`vkCmdCopyAccelerationStructureKHR`).
    pub(crate) fn copy_compacted(
        &mut self,
        target: &AccelStruct,
        from: &BlasStructures,
        to: &BlasStructures,
    ) -> Result<()> {
        self.copy_structures(target, from, to, vk::CopyAccelerationStructureModeKHR::COMPACT)?;
        if !may_be_rebuilt(target, to) {
            self.free_build_inputs(target)?;
        }
        Ok(())
    }

    /// Copies every part as it is (`vkCmdCopyAccelerationStructureKHR`).
    pub(crate) fn clone_structures(
        &mut self,
        target: &AccelStruct,
        from: &BlasStructures,
        to: &BlasStructures,
    ) -> Result<()> {
        self.copy_structures(target, from, to, vk::CopyAccelerationStructureModeKHR::CLONE)
    }

    fn copy_structures(
        &mut self,
        target: &AccelStruct,
        from: &BlasStructures,
        to: &BlasStructures,
        mode: vk::CopyAccelerationStructureModeKHR,
    ) -> Result<()> {
        let shared = Arc::clone(&self.shared);
        let ext = shared.gpu.accel_functions()?;
        self.use_copied_accel_struct(target);
        self.flush_barriers();
        for (source, copy) in from.structures.iter().zip(&to.structures) {
            let info =
                vk::CopyAccelerationStructureInfoKHR::default().src(source.raw).dst(copy.raw).mode(mode);
            // SAFETY: the source is built. To compact it, it was built so that it may be, and the copy has the size that the GPU returned;
            // a clone has the size of the source.
            unsafe { ext.cmd_copy_acceleration_structure(self.raw(), &info) };
        }
        Ok(())
    }

    /// Serializes each of `structures`, parts of `target`, to its address, a multiple of 256 in `buffer`
    /// (`vkCmdCopyAccelerationStructureToMemoryKHR`).
    pub(crate) fn serialize_parts(
        &mut self,
        target: &AccelStruct,
        structures: &[RawAccelStruct],
        buffer: &Buffer,
        addresses: &[u64],
    ) -> Result<()> {
        let shared = Arc::clone(&self.shared);
        let ext = shared.gpu.accel_functions()?;
        self.state.accesses.add_id(target.id, Use::accel_read(Stages::ACCEL_BUILD));
        self.use_buffer(buffer, Use::accel_to_memory());
        self.flush_barriers();
        for (part, address) in structures.iter().zip(addresses) {
            let info = vk::CopyAccelerationStructureToMemoryInfoKHR::default()
                .src(part.raw)
                .dst(vk::DeviceOrHostAddressKHR { device_address: *address })
                .mode(vk::CopyAccelerationStructureModeKHR::SERIALIZE);
            // SAFETY: the acceleration structure is built, and the buffer has the size that the GPU returned for it.
            unsafe { ext.cmd_copy_acceleration_structure_to_memory(self.raw(), &info) };
        }
        Ok(())
    }

    /// Deserializes the parts from `first` on, each from its address, a multiple of 256 in `buffer`
    /// (`vkCmdCopyMemoryToAccelerationStructureKHR`).
    ///
    /// # Safety
    /// The driver wrote the bytes, and each acceleration structure has the size stored in its bytes.
    pub(crate) unsafe fn deserialize_parts(
        &mut self,
        target: &Arc<AccelStruct>,
        first: usize,
        buffer: &Buffer,
        addresses: &[u64],
    ) -> Result<()> {
        let shared = Arc::clone(&self.shared);
        let ext = shared.gpu.accel_functions()?;
        let body = target.blas()?.structures();
        self.use_copied_accel_struct(target);
        self.use_buffer(buffer, Use::accel_from_memory());
        self.flush_barriers();
        for (part, address) in body.structures.iter().skip(first).zip(addresses) {
            let info = vk::CopyMemoryToAccelerationStructureInfoKHR::default()
                .src(vk::DeviceOrHostAddressConstKHR { device_address: *address })
                .dst(part.raw)
                .mode(vk::CopyAccelerationStructureModeKHR::DESERIALIZE);
            // SAFETY: the caller guarantees the contents, and the driver reported that it can read the bytes.
            unsafe { ext.cmd_copy_memory_to_acceleration_structure(self.raw(), &info) };
        }
        Ok(())
    }

    /// Prepares a BLAS whose parts were all deserialized for rebuilds and refits. Frees the inputs of builds if the
    /// BLAS allows neither. The BLAS counts as built once this is submitted.
    pub(crate) fn prepare_deserialized(&mut self, target: &Arc<AccelStruct>) -> Result<()> {
        let (build, body) = OpenBuild::for_blas(target)?;
        self.state.open_builds.push(build);
        if may_be_rebuilt(target, &body) {
            // A refit reads the same indices as the build did.
            return self.gather_inputs(std::iter::once((&**target, false)));
        }
        self.free_build_inputs(target)
    }

    /// Frees the inputs that only builds read.
    fn free_build_inputs(&self, target: &AccelStruct) -> Result<()> {
        let maps = target.blas()?.parts.iter().filter_map(|part| part.map.as_ref());
        maps.filter_map(PrimitiveMap::take_gathered_inputs)
            .for_each(|inputs| self.shared.free_later(DeferredObject::Buffer(inputs)));
        Ok(())
    }

    fn use_copied_accel_struct(&mut self, target: &AccelStruct) {
        self.state.accesses.add_id(target.id, Use::accel_build_write());
        self.state.accesses.add_accumulating(self.shared.all_blas, Use::accel_build_write());
    }
}

/// True if the BLAS can be rebuilt or refitted later.
fn may_be_rebuilt(target: &AccelStruct, body: &BlasStructures) -> bool {
    body.rebuildable || target.check_refit().is_ok()
}
