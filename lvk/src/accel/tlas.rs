//! A top-level acceleration structure (TLAS) and its contents.

use std::sync::{Arc, OnceLock};

use super::blas_refs::{AccelGeneration, BlasRefSet};
use super::instance::{InstanceSource, instance_bytes};
use super::raw_accel_struct::RawAccelStruct;
use crate::error::Result;
use crate::gpu::Gpu;
use crate::lock_order::{Guard, Mutex, Rank};
use crate::resource::Buffer;
use crate::resource::buffer::{BufferDesc, BufferUsage, InternalUsage};
use crate::software_ray_query::tlas::SoftwareTlas;

/// Bytes of `LvkTlasRow` in `shader/glsl/hit_remap.glsl`.
const REMAP_ENTRY_BYTES: u64 = 16;

/// A top-level acceleration structure.
pub(crate) struct Tlas {
    /// Index in `kTLAS[]`.
    pub(crate) slot: u32,
    /// Maximum number of instances of the caller.
    pub(crate) capacity: u32,
    /// Maximum number of instances for Vulkan, including those for extra parts of split meshes.
    pub(crate) built_capacity: u32,
    /// The hardware acceleration structure; `None` if the device has none.
    pub(crate) structure: Option<RawAccelStruct>,
    /// The BVH that software ray queries traverse; `None` if no ray queries run in software.
    pub(crate) software: Option<SoftwareTlas>,
    /// The hit remap table: maps each of Vulkan's instances to the caller's ids. Created on first use.
    pub(crate) hit_table: OnceLock<Arc<Buffer>>,
    /// The instance records for Vulkan that a kernel writes. Created on first use.
    pub(crate) records: OnceLock<Arc<Buffer>>,
    /// Contents of the last submitted build.
    contents: Mutex<TlasContents>,
}

/// The instances of a build.
#[derive(Default, Clone)]
pub(crate) struct TlasContents {
    /// Number of instances of the caller; `None` before the first build is submitted.
    pub(crate) instance_count: Option<u32>,
    /// Number of instances for Vulkan.
    pub(crate) built_count: u32,
    /// Refits since the last rebuild.
    pub(crate) refits: u32,
    /// The BLAS that the instances reference, kept alive as long as the instances use them.
    pub(crate) blas_refs: Arc<BlasRefSet>,
    /// The generation at which `blas_refs` was last known to be current.
    pub(crate) generation: AccelGeneration,
    /// Address of the hit remap table in the TLAS's entry of the table of all TLAS; 0 for none.
    pub(crate) hit_table_address: u64,
    /// Data from which the instances are written again after a referenced BLAS has moved.
    pub(crate) source: Option<Arc<InstanceSource>>,
}

impl Tlas {
    pub(crate) fn new(
        slot: u32,
        capacity: u32,
        room: u32,
        structure: Option<RawAccelStruct>,
        software: Option<SoftwareTlas>,
    ) -> Self {
        Self {
            slot,
            capacity,
            built_capacity: room,
            structure,
            software,
            hit_table: OnceLock::new(),
            records: OnceLock::new(),
            contents: Mutex::new(Rank::TlasContents, TlasContents::default()),
        }
    }

    #[inline]
    pub(crate) fn contents(&self) -> Guard<'_, TlasContents> {
        self.contents.lock()
    }

    /// Returns the buffer for instance records that a kernel writes; creates it the first time.
    pub(crate) fn records_buffer(&self, gpu: &Arc<Gpu>, name: &str) -> Result<Arc<Buffer>> {
        get_or_create(&self.records, gpu, name, u64::from(self.built_capacity) * instance_bytes(1))
    }

    /// Returns the buffer of the hit remap table; creates it the first time.
    pub(crate) fn hit_table_buffer(&self, gpu: &Arc<Gpu>, name: &str) -> Result<Arc<Buffer>> {
        get_or_create(&self.hit_table, gpu, name, u64::from(self.built_capacity) * REMAP_ENTRY_BYTES)
    }

    /// Bytes of the acceleration structures.
    pub(crate) fn memory_bytes(&self) -> u64 {
        let hardware = self.structure.as_ref().map_or(0, RawAccelStruct::memory_bytes);
        hardware + self.software.as_ref().map_or(0, SoftwareTlas::memory_bytes)
    }

    /// Bytes of the buffers that the library keeps for the TLAS.
    pub(crate) fn table_bytes(&self) -> u64 {
        let kept = [self.hit_table.get(), self.records.get()];
        kept.into_iter().flatten().map(|buffer| buffer.size_bytes).sum()
    }
}

impl TlasContents {
    /// Returns a clone without `source`.
    #[inline]
    pub(crate) fn clone_without_source(&self) -> Self {
        Self { blas_refs: Arc::clone(&self.blas_refs), source: None, ..*self }
    }

    /// Number of instances of the caller and of Vulkan; `None` before the first build.
    #[inline]
    pub(crate) fn counts(&self) -> Option<(u32, u32)> {
        self.instance_count.map(|count| (count, self.built_count))
    }
}

fn get_or_create(
    place: &OnceLock<Arc<Buffer>>,
    gpu: &Arc<Gpu>,
    name: &str,
    bytes: u64,
) -> Result<Arc<Buffer>> {
    if let Some(buffer) = place.get() {
        return Ok(Arc::clone(buffer));
    }
    let desc = BufferDesc {
        size_bytes: bytes.max(1),
        usage: BufferUsage::STORAGE | BufferUsage::ACCEL_INPUT,
        debug_name: name,
        ..Default::default()
    };
    let buffer = Arc::new(Buffer::new(gpu, &desc, InternalUsage::NONE)?);
    Ok(Arc::clone(place.get_or_init(|| buffer)))
}
