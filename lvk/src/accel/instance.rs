//! Instances of a top-level structure, from the host.

use bitflags::bitflags;
use bytemuck::{Pod, Zeroable};

use crate::error::{Error, Result};
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

/// Fails unless every number of the instance fits. Quick where it does: there may be millions.
#[inline]
pub(crate) fn check_instance(name: &str, index: usize, instance: &TlasInstance) -> Result<()> {
    if is_valid(instance) { Ok(()) } else { Err(invalid_reason(name, index, instance)) }
}

/// Whether [`check_instance`] finds nothing wrong.
#[inline]
pub(crate) fn is_valid(instance: &TlasInstance) -> bool {
    const BOTH: InstanceFlags = InstanceFlags::FORCE_OPAQUE.union(InstanceFlags::FORCE_NO_OPAQUE);
    let fits = (instance.custom_index | instance.hit_group_offset) >> 24 == 0;
    fits && is_finite(&instance.transform) && !instance.flags.contains(BOTH)
}

/// Whether no exponent is all ones, without a branch for each number.
#[inline]
fn is_finite(transform: &[f32; 12]) -> bool {
    let all = transform.iter().fold(0, |all, number| all | ((number.to_bits() & 0x7fff_ffff) + 0x0080_0000));
    all >> 31 == 0
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
        let raw = to_raw(&instance, 0x1122_3344_5566_7788);
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
    fn a_transform_is_finite_only_if_all_its_numbers_are() {
        for number in [0.0, -0.0, 1.5, f32::MAX, -f32::MAX, f32::MIN_POSITIVE, 1e-45] {
            assert!(is_finite(&[number; 12]), "{number}");
        }
        for place in 0..12 {
            for number in [f32::NAN, -f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
                let mut transform = [f32::MAX; 12];
                transform[place] = number;
                assert!(!is_finite(&transform), "{number} at {place}");
            }
        }
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
