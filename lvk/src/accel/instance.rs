//! Instances of a top-level structure, from the host.

use std::collections::HashMap;
use std::hash::BuildHasherDefault;
use std::sync::Arc;

use bitflags::bitflags;
use bytemuck::{Pod, Zeroable};

use super::structure::AccelStruct;
use super::tlas::{Entry, Shown};
use crate::barrier::IdHasher;
use crate::error::{Error, Result, check_limit};
use crate::handle::{AccelStructHandle, BufferHandle};

bitflags! {
    /// How rays treat an instance.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
    pub struct InstanceFlags: u8 {
        /// Rays that cull back or front faces do not cull this instance's triangles.
        const NO_CULL = 1;
        /// The other winding is the front.
        const FLIP_FACING = 2;
        /// Every geometry counts as opaque.
        const FORCE_OPAQUE = 4;
        /// No geometry counts as opaque: any-hit shaders run.
        const FORCE_NO_OPAQUE = 8;
    }
}

/// One instance of a bottom-level structure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TlasInstance {
    /// Object to world: 3 rows of 4 columns, row by row. See [`transform_rows`].
    pub transform: [f32; 12],
    /// The bottom-level structure.
    pub blas: AccelStructHandle,
    /// What shaders read as `gl_InstanceCustomIndexEXT`; 24 bits.
    pub custom_index: u32,
    /// Rays see the instance if this and their cull mask have a bit in common.
    pub mask: u8,
    /// Added to the hit-group index of a ray tracing pipeline; 24 bits.
    pub hit_group_offset: u32,
    /// How rays treat the instance.
    pub flags: InstanceFlags,
}

impl TlasInstance {
    /// An untransformed instance that every ray sees.
    pub fn new(blas: AccelStructHandle) -> Self {
        Self {
            transform: transform_rows(&glam::Affine3A::IDENTITY),
            blas,
            custom_index: 0,
            mask: 0xff,
            hit_group_offset: 0,
            flags: InstanceFlags::empty(),
        }
    }
}

/// The rows of an affine transform as Vulkan takes them (`VkTransformMatrixKHR`).
pub fn transform_rows(transform: &glam::Affine3A) -> [f32; 12] {
    let columns = transform.matrix3;
    let (x, y, z, t) = (columns.x_axis, columns.y_axis, columns.z_axis, transform.translation);
    [x.x, y.x, z.x, t.x, x.y, y.y, z.y, t.y, x.z, y.z, z.z, t.z]
}

/// The bytes Vulkan reads (`VkAccelerationStructureInstanceKHR`).
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub(crate) struct RawInstance {
    transform: [f32; 12],
    custom_index_and_mask: u32,
    hit_group_offset_and_flags: u32,
    blas_address: u64,
}

/// Bytes of one instance.
pub(crate) const INSTANCE_BYTES: usize = size_of::<RawInstance>();

/// Fewer instances than this are converted on the calling thread alone.
const PARALLEL_COUNT: usize = 1 << 14;

/// Instances that the GPU wrote, or that lie in a buffer for another reason.
#[derive(Debug, Clone, Copy)]
pub struct DeviceInstances<'a> {
    /// A buffer with [`BufferUsage::STORAGE`](crate::BufferUsage::STORAGE) that holds
    /// `VkAccelerationStructureInstanceKHR` records of 64 bytes each: 3 rows of 4 floats; 24 bits custom index and 8
    /// bits mask; 24 bits hit-group offset and 8 bits flags; and, in place of an address, the place of the structure in
    /// `blas` as 64 bits. A place that does not exist makes an instance that no ray meets.
    pub buffer: BufferHandle,
    /// Where the first record lies, in bytes; a multiple of 16.
    pub offset: u64,
    /// Number of records.
    pub count: u32,
    /// The bottom-level structures that records may refer to.
    pub blas: &'a [AccelStructHandle],
}

/// What a list of instances refers to, and how many Vulkan is given.
pub(crate) struct InstancePlan {
    /// Each structure once.
    pub(crate) shown: Vec<Shown>,
    /// For each instance its place in `shown`.
    refers: Vec<u32>,
    /// Instances with those for further parts of split meshes.
    pub(crate) built_count: u32,
    /// Whether addresses are put in by the kernel: parts have maps, there are several, or they may move.
    pub(crate) needs_kernel: bool,
}

/// Instances that name entries, see [`InstanceSource`](super::tlas::InstanceSource).
pub(crate) struct EntryList {
    /// One for each part of each structure.
    pub(crate) entries: Vec<Entry>,
    /// Of the instances behind the caller's: whose further parts they are.
    pub(crate) owners: Vec<u32>,
    /// Of the same: the entry.
    further: Vec<u32>,
    /// First entry of each structure.
    firsts: Vec<u32>,
}

impl InstancePlan {
    /// Finds the structures of `instances`, which are to be shown by the structure `name`.
    pub(crate) fn new(
        name: &str,
        instances: &[TlasInstance],
        find: impl Fn(AccelStructHandle) -> Result<Arc<AccelStruct>>,
    ) -> Result<Self> {
        let mut known: HashMap<AccelStructHandle, u32, BuildHasherDefault<IdHasher>> = HashMap::default();
        let mut shown: Vec<Shown> = Vec::new();
        let mut refers = Vec::with_capacity(instances.len());
        let mut last = None;
        for instance in instances {
            let place = match last {
                Some((handle, place)) if handle == instance.blas => place,
                _ => match known.get(&instance.blas) {
                    Some(place) => *place,
                    None => {
                        let blas = find(instance.blas)?;
                        let body = blas.blas()?.body();
                        shown.push(Shown { blas, body });
                        known.insert(instance.blas, shown.len() as u32 - 1);
                        shown.len() as u32 - 1
                    }
                },
            };
            last = Some((instance.blas, place));
            refers.push(place);
        }
        let parts: Vec<u64> = shown.iter().map(|shown| shown.body.structures.len() as u64).collect();
        let built: u64 = if parts.iter().all(|count| *count == 1) {
            refers.len() as u64
        } else {
            refers.iter().map(|place| parts[*place as usize]).sum()
        };
        check_limit(name, "number of instances, parts of split meshes included", built, u32::MAX.into())?;
        let needs_kernel = shown.iter().any(|shown| shown.may_move() || shown.has_rows());
        Ok(Self { shown, refers, built_count: built as u32, needs_kernel })
    }

    /// Checks the instances and writes them with addresses. Good only if no kernel is needed.
    pub(crate) fn write_addresses(
        &self,
        name: &str,
        instances: &[TlasInstance],
        out: &mut [u8],
    ) -> Result<()> {
        let addresses: Vec<u64> = self.shown.iter().map(|shown| shown.body.structures[0].address).collect();
        write_all(name, instances, &self.refers, &addresses, out)
    }

    /// Numbers the parts of everything shown, and the instances behind the caller's own.
    pub(crate) fn entries(&self) -> EntryList {
        let mut list =
            EntryList { entries: Vec::new(), owners: Vec::new(), further: Vec::new(), firsts: Vec::new() };
        for (shown, of) in (0..).zip(&self.shown) {
            list.firsts.push(list.entries.len() as u32);
            let parts = 0..of.body.structures.len() as u32;
            list.entries.extend(parts.map(|first| Entry { shown, first, count: 1 }));
        }
        for (owner, place) in (0..).zip(&self.refers) {
            let first = list.firsts[*place as usize];
            let parts = self.shown[*place as usize].body.structures.len() as u32;
            for part in 1..parts {
                list.owners.push(owner);
                list.further.push(first + part);
            }
        }
        list
    }

    /// Checks the instances and writes them with entry numbers, those of further parts behind the caller's.
    pub(crate) fn write_entries(
        &self,
        name: &str,
        instances: &[TlasInstance],
        list: &EntryList,
        out: &mut [u8],
    ) -> Result<()> {
        let firsts: Vec<u64> = list.firsts.iter().map(|first| u64::from(*first)).collect();
        let (own, further) = out.split_at_mut(instances.len() * INSTANCE_BYTES);
        write_all(name, instances, &self.refers, &firsts, own)?;
        let places = list.owners.iter().zip(&list.further);
        for ((owner, entry), out) in places.zip(further.chunks_exact_mut(INSTANCE_BYTES)) {
            let raw = pack(&instances[*owner as usize], u64::from(*entry));
            out.copy_from_slice(bytemuck::bytes_of(&raw));
        }
        Ok(())
    }
}

/// Checks and writes `instances`, each with what `references` holds for the structure it refers to.
fn write_all(
    name: &str,
    instances: &[TlasInstance],
    refers: &[u32],
    references: &[u64],
    out: &mut [u8],
) -> Result<()> {
    if instances.len() < PARALLEL_COUNT {
        return write_chunk(name, 0, instances, refers, references, out);
    }
    let threads = std::thread::available_parallelism().map_or(1, usize::from).min(8);
    let count = instances.len().div_ceil(threads);
    std::thread::scope(|scope| {
        let chunks = instances.chunks(count).zip(refers.chunks(count));
        let workers: Vec<_> = chunks
            .zip(out.chunks_mut(count * INSTANCE_BYTES))
            .enumerate()
            .map(|(index, ((instances, refers), out))| {
                let first = index * count;
                scope.spawn(move || write_chunk(name, first, instances, refers, references, out))
            })
            .collect();
        let joined = workers.into_iter().map(|worker| worker.join().unwrap_or_else(|_| Err(lost(name))));
        joined.collect::<Vec<_>>().into_iter().collect()
    })
}

fn lost(name: &str) -> Error {
    Error::usage(name, "a thread that converted instances ended early")
}

fn write_chunk(
    name: &str,
    first: usize,
    instances: &[TlasInstance],
    refers: &[u32],
    references: &[u64],
    out: &mut [u8],
) -> Result<()> {
    let records = instances.iter().zip(refers).zip(out.chunks_exact_mut(INSTANCE_BYTES));
    for (index, ((instance, place), out)) in records.enumerate() {
        check(name, first + index, instance)?;
        let raw = pack(instance, references[*place as usize]);
        out.copy_from_slice(bytemuck::bytes_of(&raw));
    }
    Ok(())
}

fn check(name: &str, index: usize, instance: &TlasInstance) -> Result<()> {
    const LARGEST: u32 = (1 << 24) - 1;
    if instance.custom_index > LARGEST || instance.hit_group_offset > LARGEST {
        let message = format!("instance {index}: custom index and hit-group offset have 24 bits");
        return Err(Error::usage(name, message));
    }
    if instance.transform.iter().any(|number| !number.is_finite()) {
        return Err(Error::usage(name, format!("instance {index}: its transform is not finite")));
    }
    if instance.flags.contains(InstanceFlags::FORCE_OPAQUE | InstanceFlags::FORCE_NO_OPAQUE) {
        let message = format!("instance {index}: choose either FORCE_OPAQUE or FORCE_NO_OPAQUE");
        return Err(Error::usage(name, message));
    }
    Ok(())
}

fn pack(instance: &TlasInstance, blas_address: u64) -> RawInstance {
    RawInstance {
        transform: instance.transform,
        custom_index_and_mask: instance.custom_index | u32::from(instance.mask) << 24,
        hit_group_offset_and_flags: instance.hit_group_offset | u32::from(instance.flags.bits()) << 24,
        blas_address,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::handle::Handle;

    #[test]
    fn an_instance_has_the_bytes_vulkan_reads() {
        let instance = TlasInstance {
            custom_index: 0x12_3456,
            mask: 0xab,
            hit_group_offset: 0x65_4321,
            flags: InstanceFlags::FLIP_FACING,
            ..TlasInstance::new(AccelStructHandle::from_bits(1))
        };
        let raw = pack(&instance, 0x1122_3344_5566_7788);
        let bytes = bytemuck::bytes_of(&raw);
        assert_eq!(bytes.len(), 64);
        assert_eq!(bytes[48..52], 0xab12_3456_u32.to_le_bytes());
        assert_eq!(bytes[52..56], 0x0265_4321_u32.to_le_bytes());
        assert_eq!(bytes[56..64], 0x1122_3344_5566_7788_u64.to_le_bytes());
    }

    #[test]
    fn a_transform_is_three_rows() {
        let transform = glam::Affine3A::from_translation(glam::Vec3::new(1.0, 2.0, 3.0));
        let rows = transform_rows(&transform);
        assert_eq!(rows, [1.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 2.0, 0.0, 0.0, 1.0, 3.0]);
    }

    #[test]
    fn numbers_that_do_not_fit_are_refused() {
        let good = TlasInstance::new(AccelStructHandle::from_bits(1));
        let bad = [
            TlasInstance { custom_index: 1 << 24, ..good },
            TlasInstance { hit_group_offset: 1 << 24, ..good },
            TlasInstance { transform: [f32::NAN; 12], ..good },
            TlasInstance { flags: InstanceFlags::FORCE_OPAQUE | InstanceFlags::FORCE_NO_OPAQUE, ..good },
        ];
        assert!(check("tlas", 0, &good).is_ok());
        assert!(bad.iter().all(|instance| check("tlas", 0, instance).is_err()));
    }
}
