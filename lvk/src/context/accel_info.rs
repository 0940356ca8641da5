//! Memory use and build progress of acceleration structures.

use super::Context;
use crate::accel::AccelStruct;
use crate::accel::accel_struct::AccelKind;
use crate::accel::blas::CompactionState;
use crate::accel::flags::AccelStructSizes;
use crate::accel::scratch_buffer::ScratchBuffer;
use crate::error::Result;
use crate::handle::AccelStructHandle;

/// Compaction state of a BLAS.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Compaction {
    /// Not requested.
    None,
    /// Requested with [`Context::compact`], and not carried out yet.
    Pending,
    /// Done.
    Done {
        /// Bytes of memory before the compaction. Counts the same memory as [`AccelStructInfo::structure_bytes`].
        before_bytes: u64,
        /// Bytes of memory after the compaction.
        after_bytes: u64,
    },
    /// Not possible. Usually the budget or the device had no memory for the copy beside the original. A warning in the
    /// log gives the reason. The BLAS is unchanged. [`Context::compact`] tries again.
    Failed,
}

/// Type, memory use and compaction state of an acceleration structure.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AccelStructInfo {
    /// Debug name.
    pub name: String,
    /// True for a TLAS, false for a BLAS.
    pub is_top_level: bool,
    /// Number of Vulkan acceleration structures behind the handle. More than 1 if the mesh was split.
    pub parts: u32,
    /// True if the primitives were reordered or split. Shaders must then use `lvkPrimitiveIndex` for hits.
    pub is_remapped: bool,
    /// Bytes of memory of the acceleration structure: of the device's, and of the BVHs for software ray queries.
    pub structure_bytes: u64,
    /// Bytes of buffers that the library keeps for the acceleration structure: primitive maps, gathered inputs,
    /// instances. Compaction frees the gathered inputs of a BLAS without
    /// [`BuildFlags::ALLOW_UPDATE`](crate::BuildFlags::ALLOW_UPDATE), because that BLAS is never built again.
    pub table_bytes: u64,
    /// Refits that were submitted since the last build. With [`BuildMode::Auto`](crate::BuildMode::Auto) they become 0 at its
    /// rebuilds.
    pub refits: u32,
    /// Compaction state.
    pub compaction: Compaction,
}

/// Memory of acceleration structures.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AccelMemory {
    /// All acceleration structures that have a handle.
    pub structures: Vec<AccelStructInfo>,
    /// Bytes of all acceleration structures, including destroyed ones that the GPU may still use.
    pub structure_bytes: u64,
    /// Unused bytes of shared buffers.
    pub free_bytes: u64,
    /// Bytes of the scratch buffers.
    pub scratch_bytes: u64,
}

/// Number of acceleration structures of a list that are built.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BuildProgress {
    /// Acceleration structures whose first build the GPU has finished.
    pub built: usize,
    /// All acceleration structures of the list.
    pub total: usize,
}

impl Context {
    /// Returns the bytes that an acceleration structure took when it was created, and the scratch bytes of its builds.
    pub fn accel_struct_sizes(&self, handle: AccelStructHandle) -> Result<AccelStructSizes> {
        Ok(self.device_state().store.accel_structs.get(handle)?.sizes)
    }

    /// Returns the current type, memory use and compaction state of an acceleration structure.
    pub fn accel_struct_info(&self, handle: AccelStructHandle) -> Result<AccelStructInfo> {
        Ok(accel_struct_info_of(&*self.device_state().store.accel_structs.get(handle)?))
    }

    /// Returns the memory of all acceleration structures, one by one and in total.
    pub fn accel_memory(&self) -> AccelMemory {
        let shared = self.device_state();
        AccelMemory {
            structures: shared
                .store
                .accel_structs
                .all_objects()
                .iter()
                .map(|object| accel_struct_info_of(object))
                .collect(),
            structure_bytes: shared.accel_storage.used_bytes(),
            free_bytes: shared.accel_storage.free_bytes(),
            scratch_bytes: shared.scratch.iter().map(ScratchBuffer::bytes).sum(),
        }
    }

    /// Returns how many of these acceleration structures the GPU has built for the first time. Does not wait.
    pub fn build_progress(&self, structures: &[AccelStructHandle]) -> Result<BuildProgress> {
        let submitter = &self.device_state().submitter;
        let mut built = 0;
        for handle in structures {
            let object = self.device_state().store.accel_structs.get(*handle)?;
            if let Some(value) = object.last_build_value() {
                built += usize::from(submitter.is_done(value)?);
            }
        }
        Ok(BuildProgress { built, total: structures.len() })
    }
}

fn accel_struct_info_of(object: &AccelStruct) -> AccelStructInfo {
    let name = object.name.clone();
    match &object.kind {
        AccelKind::Tlas(tlas) => AccelStructInfo {
            name,
            is_top_level: true,
            parts: 1,
            is_remapped: false,
            structure_bytes: tlas.memory_bytes(),
            table_bytes: tlas.table_bytes(),
            refits: tlas.contents().refits,
            compaction: Compaction::None,
        },
        AccelKind::Blas(blas) => {
            let (body, kept_bytes) = (blas.structures(), blas.software_bytes());
            let after_bytes = body.memory_bytes() + kept_bytes;
            let compaction = match body.compacted_from {
                Some(bytes) => Compaction::Done { before_bytes: bytes + kept_bytes, after_bytes },
                None => match blas.compaction_state() {
                    CompactionState::None => Compaction::None,
                    CompactionState::Open => Compaction::Pending,
                    CompactionState::Failed => Compaction::Failed,
                    CompactionState::Idle => Compaction::Done { before_bytes: after_bytes, after_bytes },
                },
            };
            AccelStructInfo {
                name,
                is_top_level: false,
                parts: blas.parts.len().max(1) as u32,
                is_remapped: blas.parts.iter().any(|part| part.map.is_some()),
                structure_bytes: after_bytes,
                table_bytes: blas.table_bytes(),
                refits: blas.refit_count(),
                compaction,
            }
        }
    }
}
