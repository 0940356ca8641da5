//! What acceleration structures take, and how far their builds are.

use super::Context;
use crate::accel::AccelStruct;
use crate::accel::accel_struct::AccelKind;
use crate::accel::blas::CompactionState;
use crate::accel::flags::AccelStructSizes;
use crate::accel::scratch_buffer::ScratchBuffer;
use crate::error::Result;
use crate::handle::AccelStructHandle;

/// How far the compaction of a structure is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Compaction {
    /// Not asked for.
    None,
    /// Asked for by [`Context::compact`].
    Pending,
    /// Done.
    Done {
        /// Bytes of memory before, of all that [`AccelStructInfo::structure_bytes`] counts.
        before_bytes: u64,
        /// Bytes of memory since.
        after_bytes: u64,
    },
    /// It was not possible, mostly because the copy had no room beside the structure, within the budget or on the
    /// device; a warning says more. The structure is as it was. [`Context::compact`] tries again.
    Failed,
}

/// What is known of an acceleration structure.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AccelStructInfo {
    /// Its debug name.
    pub name: String,
    /// Whether it is a top-level structure.
    pub is_top_level: bool,
    /// Structures that stand for it: more than 1 if the mesh was split.
    pub parts: u32,
    /// Whether the primitives were put into another order, or split: hits need `lvkPrimitiveIndex` then.
    pub is_remapped: bool,
    /// Bytes of memory of its structures: the device's, and those that software traces.
    pub structure_bytes: u64,
    /// Bytes of buffers that the library keeps for it: maps of primitives, gathered inputs, instances. Gathered inputs
    /// go with the compaction of a structure without [`BuildFlags::ALLOW_UPDATE`](crate::BuildFlags::ALLOW_UPDATE),
    /// which nothing builds again.
    pub table_bytes: u64,
    /// Its compaction.
    pub compaction: Compaction,
}

/// Memory of acceleration structures.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AccelMemory {
    /// Every structure that has a handle.
    pub structures: Vec<AccelStructInfo>,
    /// Bytes of all structures, those included that wait for the GPU to be done with them.
    pub structure_bytes: u64,
    /// Bytes of shared buffers that are not in use.
    pub spare_bytes: u64,
    /// Bytes of the scratch buffer.
    pub scratch_bytes: u64,
}

/// How many of some structures are built.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BuildProgress {
    /// Structures whose first build the GPU has done.
    pub built: usize,
    /// All structures asked about.
    pub total: usize,
}

impl Context {
    /// Bytes an acceleration structure took when it was created, and takes to build.
    pub fn accel_struct_sizes(&self, handle: AccelStructHandle) -> Result<AccelStructSizes> {
        Ok(self.device_state().store.accel_structs.get(handle)?.sizes)
    }

    /// What is known of an acceleration structure now.
    pub fn accel_struct_info(&self, handle: AccelStructHandle) -> Result<AccelStructInfo> {
        Ok(accel_struct_info_of(&*self.device_state().store.accel_structs.get(handle)?))
    }

    /// Memory of all acceleration structures, one by one and together.
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
            spare_bytes: shared.accel_storage.free_bytes(),
            scratch_bytes: shared.scratch.iter().map(ScratchBuffer::bytes).sum(),
        }
    }

    /// How many of these structures the GPU has built for the first time. Does not wait.
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
                compaction,
            }
        }
    }
}
