//! A top-level structure and what it shows.

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

/// Bytes of `LvkTlasRow` in `shader/glsl/hit_numbers.glsl`.
const REMAP_ENTRY_BYTES: u64 = 16;

/// A top-level structure.
pub(crate) struct Tlas {
    /// Its element of `kTLAS[]`.
    pub(crate) slot: u32,
    /// Instances the caller may show.
    pub(crate) capacity: u32,
    /// Instances Vulkan may be given, those for further parts of split meshes included.
    pub(crate) built_capacity: u32,
    /// What the device traces, where it does.
    pub(crate) structure: Option<RawAccelStruct>,
    /// What software traces, where it does.
    pub(crate) software: Option<SoftwareTlas>,
    /// From hits to the caller's numbers: a row for each instance Vulkan is given. Made when first needed.
    pub(crate) hit_table: OnceLock<Arc<Buffer>>,
    /// The instances Vulkan is given, where a kernel writes them. Made when first needed.
    pub(crate) records: OnceLock<Arc<Buffer>>,
    /// Of the last build submitted.
    contents: Mutex<TlasContents>,
}

/// The instances of a build.
#[derive(Default, Clone)]
pub(crate) struct TlasContents {
    /// Instances of the caller, `None` before the first build is submitted.
    pub(crate) instance_count: Option<u32>,
    /// Instances Vulkan was given.
    pub(crate) built_count: u32,
    /// Refits since the last rebuild.
    pub(crate) refits: u32,
    /// What the instances refer to, kept alive as long as they do.
    pub(crate) blas_refs: Arc<BlasRefSet>,
    /// When that was last known to stand as it is.
    pub(crate) generation: AccelGeneration,
    /// The address of the rows that the table of structures names for it; 0 for none.
    pub(crate) hit_table_address: u64,
    /// From what the instances can be written again once a structure they refer to has moved.
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

    /// Returns the buffer for instances that a kernel writes; makes it the first time.
    pub(crate) fn records_buffer(&self, gpu: &Arc<Gpu>, name: &str) -> Result<Arc<Buffer>> {
        get_or_create(&self.records, gpu, name, u64::from(self.built_capacity) * instance_bytes(1))
    }

    /// Returns the buffer of the hit remap table; makes it the first time.
    pub(crate) fn hit_table_buffer(&self, gpu: &Arc<Gpu>, name: &str) -> Result<Arc<Buffer>> {
        get_or_create(&self.hit_table, gpu, name, u64::from(self.built_capacity) * REMAP_ENTRY_BYTES)
    }

    /// Bytes of the structure.
    pub(crate) fn memory_bytes(&self) -> u64 {
        let hardware = self.structure.as_ref().map_or(0, RawAccelStruct::memory_bytes);
        hardware + self.software.as_ref().map_or(0, SoftwareTlas::memory_bytes)
    }

    /// Bytes of buffers the library keeps for it.
    pub(crate) fn table_bytes(&self) -> u64 {
        let kept = [self.hit_table.get(), self.records.get()];
        kept.into_iter().flatten().map(|buffer| buffer.size_bytes).sum()
    }
}

impl TlasContents {
    /// The same, but for what the instances can be written from.
    #[inline]
    pub(crate) fn clone_without_source(&self) -> Self {
        Self { blas_refs: Arc::clone(&self.blas_refs), source: None, ..*self }
    }

    /// Instances of the caller and of Vulkan, `None` before the first build.
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
