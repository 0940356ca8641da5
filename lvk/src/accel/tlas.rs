//! A top-level structure and what it shows.

use std::sync::{Arc, OnceLock};

use super::blas_refs::{Revision, ShownSet};
use super::raw_accel_struct::RawStructure;
use crate::error::{Result, check_limit};
use crate::lock_order::{Guard, Mutex, Rank};
use crate::resource::Buffer;
use crate::software_ray_query::tlas::SoftwareTlas;

/// A top-level structure.
pub(crate) struct Tlas {
    /// Its element of `kTLAS[]`.
    pub(crate) slot: u32,
    /// Instances the caller may show.
    pub(crate) capacity: u32,
    /// Instances Vulkan may be given, those for further parts of split meshes included.
    pub(crate) room: u32,
    /// What the device traces, where it does.
    pub(crate) structure: Option<RawStructure>,
    /// What software traces, where it does.
    pub(crate) software: Option<SoftwareTlas>,
    /// From hits to the caller's numbers: a row for each instance Vulkan is given. Made when first needed.
    pub(crate) rows: OnceLock<Arc<Buffer>>,
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
    pub(crate) shown: Arc<ShownSet>,
    /// When that was last known to stand as it is.
    pub(crate) revision: Revision,
    /// The address of the rows that the table of structures names for it; 0 for none.
    pub(crate) named_rows: u64,
    /// From what the instances can be written again once a structure they refer to has moved.
    pub(crate) source: Option<Arc<InstanceSource>>,
}

/// Instances that name structures by number, for the kernel that puts addresses in.
#[derive(Clone)]
pub(crate) struct InstanceSource {
    /// `VkAccelerationStructureInstanceKHR` with a number in place of the address.
    pub(crate) instances: SourceBytes,
    /// How many there are.
    pub(crate) count: u32,
    /// Of further parts: the caller's instance each belongs to.
    pub(crate) owners: Option<SourceBytes>,
    /// Instances of the caller.
    pub(crate) user_count: u32,
    /// How often the whole list is written: once for each part that a structure may have.
    pub(crate) copies: u32,
    pub(crate) numbers: Numbers,
}

/// What the numbers of an [`InstanceSource`] count.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Numbers {
    /// Parts of everything shown.
    Parts,
    /// Structures shown, with all their parts.
    Structures,
}

/// Bytes the kernel reads.
#[derive(Clone)]
pub(crate) struct SourceBytes {
    pub(crate) address: u64,
    /// What holds them; `None` for staging memory, which keeps them until the command buffer is done.
    pub(crate) buffer: Option<Arc<Buffer>>,
}

impl Tlas {
    pub(crate) fn new(
        slot: u32,
        capacity: u32,
        room: u32,
        structure: Option<RawStructure>,
        software: Option<SoftwareTlas>,
    ) -> Self {
        Self {
            slot,
            capacity,
            room,
            structure,
            software,
            rows: OnceLock::new(),
            records: OnceLock::new(),
            contents: Mutex::new(Rank::TlasContents, TlasContents::default()),
        }
    }

    #[inline]
    pub(crate) fn contents(&self) -> Guard<'_, TlasContents> {
        self.contents.lock()
    }

    /// Bytes of the structure.
    pub(crate) fn memory_bytes(&self) -> u64 {
        let hardware = self.structure.as_ref().map_or(0, RawStructure::memory_bytes);
        hardware + self.software.as_ref().map_or(0, SoftwareTlas::memory_bytes)
    }

    /// Bytes of buffers the library keeps for it.
    pub(crate) fn table_bytes(&self) -> u64 {
        let kept = [self.rows.get(), self.records.get()];
        kept.into_iter().flatten().map(|buffer| buffer.size_bytes).sum()
    }
}

impl TlasContents {
    /// The same, but for what the instances can be written from.
    #[inline]
    pub(crate) fn without_source(&self) -> Self {
        Self { shown: Arc::clone(&self.shown), source: None, ..*self }
    }

    /// Instances of the caller and of Vulkan, `None` before the first build.
    #[inline]
    pub(crate) fn counts(&self) -> Option<(u32, u32)> {
        self.instance_count.map(|count| (count, self.built_count))
    }
}

impl InstanceSource {
    /// Instances Vulkan is given for it.
    pub(crate) fn built_count(&self, name: &str) -> Result<u32> {
        let count = u64::from(self.count) * u64::from(self.copies);
        check_limit(name, "number of instances, parts of split meshes included", count, u32::MAX.into())?;
        Ok(count as u32)
    }
}

impl Numbers {
    /// How many numbers mean something.
    pub(crate) fn count(self, shown: &ShownSet) -> usize {
        match self {
            Self::Parts => shown.parts().len(),
            Self::Structures => shown.spans().len(),
        }
    }

    /// Writes what they mean: first part and number of parts for each.
    pub(crate) fn write(self, shown: &ShownSet, out: &mut [u8]) {
        match self {
            Self::Structures => out.copy_from_slice(bytemuck::cast_slice(shown.spans())),
            Self::Parts => {
                for (part, out) in (0_u32..).zip(out.chunks_exact_mut(size_of::<[u32; 2]>())) {
                    out.copy_from_slice(bytemuck::bytes_of(&[part, 1]));
                }
            }
        }
    }
}
