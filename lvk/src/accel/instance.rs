//! Instances of a TLAS: their description, the plan of a list, and its encoding as the records that Vulkan reads.

use std::sync::Arc;

use bitflags::bitflags;
use bytemuck::{Pod, Zeroable};

use super::blas_refs::{BitSet, BlasRefCollector, BlasRefSet, ResolveBlas};
use super::transform::{IDENTITY_ROWS, is_finite};
use crate::error::limit_origin::LimitOrigin;
use crate::error::{Error, Result, check_limit_of};
use crate::handle::{AccelStructHandle, BufferHandle};
use crate::resource::Buffer;

bitflags! {
    /// Ray behaviour of an instance.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
    pub struct InstanceFlags: u8 {
        /// Disables back and front face culling for the triangles of the instance.
        const NO_CULL = 1;
        /// Swaps front and back faces.
        const FLIP_FACING = 2;
        /// Treats every geometry as opaque.
        const FORCE_OPAQUE = 4;
        /// Treats no geometry as opaque: any-hit shaders run.
        const FORCE_NO_OPAQUE = 8;
    }
}

/// One instance of a BLAS.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TlasInstance {
    /// Object-to-world transform: 3 rows of 4 columns, row by row (`VkTransformMatrixKHR`).
    /// [`rows_from_columns`](crate::rows_from_columns) converts matrices that are stored by columns.
    pub transform: [f32; 12],
    /// The BLAS.
    pub blas: AccelStructHandle,
    /// Value that shaders read as `gl_InstanceCustomIndexEXT`; 24 bits.
    pub custom_index: u32,
    /// Rays hit the instance only if this mask and their cull mask have a bit in common.
    pub mask: u8,
    /// Added to the hit group index of a ray tracing pipeline; 24 bits. The library does not check that the pipeline
    /// has the hit group: reads beyond the shader binding table are undefined behaviour.
    pub hit_group_offset: u32,
    /// Ray behaviour of the instance.
    pub flags: InstanceFlags,
}

impl TlasInstance {
    /// Creates an instance with the identity transform that is visible to every ray.
    pub fn new(blas: AccelStructHandle) -> Self {
        Self {
            transform: IDENTITY_ROWS,
            blas,
            custom_index: 0,
            mask: 0xff,
            hit_group_offset: 0,
            flags: InstanceFlags::empty(),
        }
    }
}

/// The record that Vulkan reads (`VkAccelerationStructureInstanceKHR`).
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

/// Bytes of `count` instances.
#[inline]
pub(crate) fn instance_bytes(count: u32) -> u64 {
    u64::from(count) * INSTANCE_BYTES as u64
}

/// Instances in a buffer, for example written by the GPU.
#[derive(Debug, Clone, Copy)]
pub struct DeviceInstances<'a> {
    /// A buffer with [`BufferUsage::STORAGE`](crate::BufferUsage::STORAGE) that holds
    /// `VkAccelerationStructureInstanceKHR` records of 64 bytes each: 3 rows of 4 floats; 24 bits custom index and 8
    /// bits mask; 24 bits hit group offset and 8 bits flags; 64 bits BLAS index. The BLAS index is an index into
    /// `blas` in place of an address. Rays never hit an instance whose index is out of range.
    pub buffer: BufferHandle,
    /// Offset of the first record in bytes, a multiple of 16.
    pub offset: u64,
    /// Number of records.
    pub count: u32,
    /// The BLAS that records may reference.
    pub blas: &'a [AccelStructHandle],
}

/// Fails unless every field of the instance is in range. The valid case is fast, as there may be millions of
/// instances.
#[inline]
pub(crate) fn check_instance(name: &str, index: usize, instance: &TlasInstance) -> Result<()> {
    if is_valid(instance) { Ok(()) } else { Err(invalid_reason(name, index, instance)) }
}

/// True if [`check_instance`] finds no error.
#[inline]
pub(crate) fn is_valid(instance: &TlasInstance) -> bool {
    const BOTH: InstanceFlags = InstanceFlags::FORCE_OPAQUE.union(InstanceFlags::FORCE_NO_OPAQUE);
    let fits = (instance.custom_index | instance.hit_group_offset) >> 24 == 0;
    fits && is_finite(&instance.transform) && !instance.flags.contains(BOTH)
}

#[cold]
fn invalid_reason(name: &str, index: usize, instance: &TlasInstance) -> Error {
    const LARGEST: u32 = (1 << 24) - 1;
    if instance.custom_index > LARGEST || instance.hit_group_offset > LARGEST {
        return Error::usage(
            name,
            format!("instance {index}: custom index and hit-group offset have 24 bits"),
        );
    }
    if !is_finite(&instance.transform) {
        return Error::usage(name, format!("instance {index}: its transform is not finite"));
    }
    Error::usage(name, format!("instance {index}: choose either FORCE_OPAQUE or FORCE_NO_OPAQUE"))
}

#[inline]
pub(crate) fn to_raw(instance: &TlasInstance, blas_address: u64) -> RawInstance {
    RawInstance {
        transform: instance.transform,
        custom_index_and_mask: instance.custom_index | u32::from(instance.mask) << 24,
        hit_group_offset_and_flags: instance.hit_group_offset | u32::from(known_bits(instance.flags)) << 24,
        blas_address,
    }
}

/// Returns the flags without bits that [`InstanceFlags`] does not name, which may mean something to the device.
#[inline]
fn known_bits(flags: InstanceFlags) -> u8 {
    flags.intersection(InstanceFlags::all()).bits()
}

/// Reused memory of instance plans.
#[derive(Default)]
pub(crate) struct PlanMemory {
    pub(crate) seen: BitSet,
    /// Index of the BLAS that each instance references.
    pub(crate) ref_indices: Vec<u32>,
}

/// The BLAS that a list of instances references, and the number of instances for Vulkan.
pub(crate) struct InstancePlan {
    pub(crate) blas_refs: Arc<BlasRefSet>,
    /// For each instance, the index of its BLAS in `blas_refs`.
    ref_indices: Vec<u32>,
    /// Number of instances for Vulkan, including those for the extra parts of split meshes.
    pub(crate) built_count: u32,
}

impl InstancePlan {
    /// Plans `instances` for the TLAS `name`. `previous` is the BLAS set of the TLAS so far, or empty if that is no
    /// longer current.
    pub(crate) fn new(
        name: &str,
        instances: &[TlasInstance],
        previous: &Arc<BlasRefSet>,
        memory: &mut PlanMemory,
        resolve: ResolveBlas<'_>,
    ) -> Result<Self> {
        let mut refers = std::mem::take(&mut memory.ref_indices);
        let mut collector = BlasRefCollector::new(previous, &mut memory.seen, resolve);
        refers.clear();
        refers.reserve(instances.len());
        let mut last = None;
        for instance in instances {
            let place = match last {
                Some((handle, place)) if handle == instance.blas => place,
                _ => collector.add(instance.blas)? as u32,
            };
            last = Some((instance.blas, place));
            refers.push(place);
        }
        let blas_refs = if collector.is_unchanged() {
            Arc::clone(previous)
        } else {
            let (blas_refs, moved) = collector.finish();
            refers.iter_mut().for_each(|place| *place = moved[*place as usize]);
            Arc::new(blas_refs)
        };
        let spans = blas_refs.part_spans();
        let built: u64 = if spans.iter().all(|[_, parts]| *parts == 1) {
            refers.len() as u64
        } else {
            refers.iter().map(|place| u64::from(spans[*place as usize][1])).sum()
        };
        check_built_count(name, built)?;
        Ok(Self { blas_refs, ref_indices: refers, built_count: built as u32 })
    }

    /// Returns the memory of the plan for reuse.
    pub(crate) fn into_ref_indices(self) -> Vec<u32> {
        self.ref_indices
    }

    /// The extra instances that follow the caller's: for each the caller's instance that owns it, and its part.
    fn extra_parts(&self) -> impl Iterator<Item = (u32, u32)> + '_ {
        let owners = (0..).zip(&self.ref_indices);
        owners.flat_map(|(owner, place)| {
            let [first, parts] = self.blas_refs.part_spans()[*place as usize];
            (1..parts).map(move |part| (owner, first + part))
        })
    }

    /// Number of extra instances that follow the caller's.
    pub(crate) fn extra_part_count(&self) -> u32 {
        self.built_count.saturating_sub(self.ref_indices.len() as u32)
    }

    /// Writes the index of the owner of each extra instance.
    pub(crate) fn write_extra_part_owners(&self, out: &mut [u8]) {
        for ((owner, _), out) in self.extra_parts().zip(out.chunks_exact_mut(size_of::<u32>())) {
            out.copy_from_slice(bytemuck::bytes_of(&owner));
        }
    }

    /// Checks the instances and writes them with indices of [parts](BlasRefSet::part_addresses). Instances of extra
    /// parts follow the caller's.
    pub(crate) fn write_part_indices(
        &self,
        name: &str,
        instances: &[TlasInstance],
        out: &mut [u8],
    ) -> Result<()> {
        let (own, further) = out.split_at_mut(instances.len() * INSTANCE_BYTES);
        let spans = self.blas_refs.part_spans();
        let records = instances.iter().zip(&self.ref_indices).zip(own.chunks_exact_mut(INSTANCE_BYTES));
        for (index, ((instance, place), out)) in records.enumerate() {
            check_instance(name, index, instance)?;
            let [first, _] = spans[*place as usize];
            out.copy_from_slice(bytemuck::bytes_of(&to_raw(instance, first.into())));
        }
        if self.extra_part_count() == 0 {
            return Ok(());
        }
        for ((owner, part), out) in self.extra_parts().zip(further.chunks_exact_mut(INSTANCE_BYTES)) {
            let raw = to_raw(&instances[owner as usize], part.into());
            out.copy_from_slice(bytemuck::bytes_of(&raw));
        }
        Ok(())
    }
}

/// Instances with BLAS indices, for the kernel that writes the addresses.
#[derive(Clone)]
pub(crate) struct InstanceSource {
    /// `VkAccelerationStructureInstanceKHR` records with an index in place of the address.
    pub(crate) instances: InstanceBytes,
    /// Number of instances.
    pub(crate) count: u32,
    /// For each instance of an extra part, the index of the caller's instance that owns it.
    pub(crate) owners: Option<InstanceBytes>,
    /// Number of instances of the caller.
    pub(crate) user_count: u32,
    /// Number of times that the whole list is written: once for each part that a BLAS may have.
    pub(crate) copies: u32,
    pub(crate) indexing: BlasIndexing,
}

/// Meaning of the BLAS indices of an [`InstanceSource`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum BlasIndexing {
    /// Indices of the parts of all referenced BLAS.
    ByPart,
    /// Indices of referenced BLAS, each with all its parts.
    ByBlas,
}

/// Bytes that the kernel reads.
#[derive(Clone)]
pub(crate) struct InstanceBytes {
    pub(crate) address: u64,
    /// The buffer of the bytes; `None` for staging memory, which stays alive until the command buffer is complete.
    pub(crate) buffer: Option<Arc<Buffer>>,
}

impl InstanceSource {
    /// Number of instances for Vulkan.
    pub(crate) fn built_count(&self, name: &str) -> Result<u32> {
        let count = u64::from(self.count) * u64::from(self.copies);
        check_built_count(name, count)?;
        Ok(count as u32)
    }
}

impl BlasIndexing {
    /// Number of valid indices.
    pub(crate) fn entry_count(self, blas_refs: &BlasRefSet) -> usize {
        match self {
            Self::ByPart => blas_refs.part_addresses().len(),
            Self::ByBlas => blas_refs.part_spans().len(),
        }
    }

    /// Writes the first part and the number of parts for each index.
    pub(crate) fn write_entries(self, blas_refs: &BlasRefSet, out: &mut [u8]) {
        match self {
            Self::ByBlas => out.copy_from_slice(bytemuck::cast_slice(blas_refs.part_spans())),
            Self::ByPart => {
                for (part, out) in (0_u32..).zip(out.chunks_exact_mut(size_of::<[u32; 2]>())) {
                    out.copy_from_slice(bytemuck::bytes_of(&[part, 1]));
                }
            }
        }
    }
}

/// Fails if Vulkan cannot count the instances, with one for each further part of a split mesh.
fn check_built_count(name: &str, count: u64) -> Result<()> {
    let what = "number of instances, parts of split meshes included";
    check_limit_of(LimitOrigin::Vulkan, name, what, count, u32::MAX.into())
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
        let raw = to_raw(&instance, 0x1122_3344_5566_7788);
        let bytes = bytemuck::bytes_of(&raw);
        assert_eq!(bytes.len(), 64);
        assert_eq!(bytes[48..52], 0xab12_3456_u32.to_le_bytes());
        assert_eq!(bytes[52..56], 0x0265_4321_u32.to_le_bytes());
        assert_eq!(bytes[56..64], 0x1122_3344_5566_7788_u64.to_le_bytes());
    }

    #[test]
    fn bits_without_a_name_do_not_get_to_the_device() {
        let flags = InstanceFlags::from_bits_retain(0xf0) | InstanceFlags::NO_CULL;
        let instance = TlasInstance { flags, ..TlasInstance::new(AccelStructHandle::from_bits(1)) };
        assert_eq!(to_raw(&instance, 0).hit_group_offset_and_flags, 1 << 24);
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
        assert!(check_instance("tlas", 0, &good).is_ok());
        assert!(bad.iter().all(|instance| check_instance("tlas", 0, instance).is_err()));
    }
}
