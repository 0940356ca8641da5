//! A top-level structure and what it shows.

use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

use super::blas::BlasBody;
use super::flags::BuildFlags;
use super::raw_structure::RawStructure;
use super::structure::AccelStruct;
use crate::accel::software::tlas::SoftwareTlas;
use crate::error::{Result, check_limit};
use crate::resource::Buffer;

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
    contents: Mutex<TlasContents>,
}

/// The instances of the last build submitted.
#[derive(Default, Clone)]
pub(crate) struct TlasContents {
    /// Instances of the caller, `None` before the first build is submitted.
    pub(crate) instance_count: Option<u32>,
    /// Instances Vulkan was given.
    pub(crate) built_count: u32,
    /// What the instances refer to, kept alive as long as they do.
    pub(crate) shown: Vec<Shown>,
    /// From what the instances can be written again once a structure they refer to has moved.
    pub(crate) source: Option<InstanceSource>,
    /// Refits since the last rebuild.
    pub(crate) refits: u32,
}

/// A bottom-level structure that instances refer to, with the body they refer to.
#[derive(Clone)]
pub(crate) struct Shown {
    pub(crate) blas: Arc<AccelStruct>,
    pub(crate) body: Arc<BlasBody>,
}

/// Instances that name structures by number, for the kernel that puts addresses in.
#[derive(Clone)]
pub(crate) struct InstanceSource {
    /// `VkAccelerationStructureInstanceKHR` with an entry number in place of the address.
    pub(crate) instances: SourceBytes,
    /// How many there are.
    pub(crate) count: u32,
    /// Of further parts: the caller's instance each belongs to.
    pub(crate) owners: Option<SourceBytes>,
    /// Instances of the caller.
    pub(crate) user_count: u32,
    /// How often the whole list is written: once for each part that a structure may have.
    pub(crate) copies: u32,
    /// What entry numbers mean.
    pub(crate) entries: Vec<Entry>,
}

/// Bytes the kernel reads.
#[derive(Clone)]
pub(crate) struct SourceBytes {
    pub(crate) address: u64,
    /// What holds them; `None` for staging memory, which keeps them until the command buffer is done.
    pub(crate) buffer: Option<Arc<Buffer>>,
}

/// Parts `first..first + count` of the structure shown at `shown`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Entry {
    pub(crate) shown: u32,
    pub(crate) first: u32,
    pub(crate) count: u32,
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
            contents: Mutex::default(),
        }
    }

    pub(crate) fn contents(&self) -> MutexGuard<'_, TlasContents> {
        self.contents.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Bytes of the structure.
    pub(crate) fn memory_bytes(&self) -> u64 {
        let hardware = self.structure.as_ref().map_or(0, RawStructure::memory_bytes);
        hardware + self.software.as_ref().map_or(0, |software| software.body.memory_bytes())
    }

    /// Bytes of buffers the library keeps for it.
    pub(crate) fn table_bytes(&self) -> u64 {
        let kept = [self.rows.get(), self.records.get()];
        kept.into_iter().flatten().map(|buffer| buffer.size_bytes).sum()
    }
}

impl TlasContents {
    /// Instances of the caller and of Vulkan, `None` before the first build.
    pub(crate) fn counts(&self) -> Option<(u32, u32)> {
        self.instance_count.map(|count| (count, self.built_count))
    }

    /// Whether anything shown has moved since.
    pub(crate) fn is_outdated(&self) -> bool {
        self.shown.iter().any(Shown::is_outdated)
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

impl Shown {
    fn is_outdated(&self) -> bool {
        self.blas.blas().is_ok_and(|blas| !Arc::ptr_eq(&blas.body(), &self.body))
    }

    /// Whether it may yet be compacted, which gives it another address.
    pub(crate) fn may_move(&self) -> bool {
        self.blas.flags.contains(BuildFlags::ALLOW_COMPACTION) && self.body.compacted_from.is_none()
    }

    /// Whether its address does not do in an instance.
    pub(crate) fn needs_kernel(&self) -> bool {
        self.may_move() || self.has_rows()
    }

    /// Whether its hits need rows to become the caller's numbers.
    pub(crate) fn has_rows(&self) -> bool {
        let mapped = self.blas.blas().is_ok_and(|blas| blas.parts.iter().any(|part| part.map.is_some()));
        mapped || self.body.structures.len() > 1
    }
}

/// What the kernel looks entries up in.
pub(crate) struct InstanceTables {
    /// First part and number of parts, for each entry.
    pub(crate) entries: Vec<[u32; 2]>,
    /// Address of the structure and of its map, for each part.
    pub(crate) parts: Vec<[u64; 2]>,
}

impl InstanceTables {
    /// The tables for `entries` as everything shown stands now.
    pub(crate) fn new(shown: &[Shown], entries: &[Entry]) -> Self {
        let (mut firsts, mut parts) = (Vec::new(), Vec::new());
        for of in shown {
            firsts.push(parts.len() as u32);
            let shapes = of.blas.blas().map_or(&[][..], |blas| &blas.parts);
            let maps = shapes.iter().map(|part| part.map.as_ref().map_or(0, |map| map.table.address));
            let structures = of.body.structures.iter().map(|structure| structure.address);
            parts.extend(structures.zip(maps).map(|(structure, map)| [structure, map]));
        }
        let entry = |entry: &Entry| {
            let first = firsts.get(entry.shown as usize).copied().unwrap_or(0);
            [first + entry.first, entry.count]
        };
        Self { entries: entries.iter().map(entry).collect(), parts }
    }
}
