//! Instances of a top-level structure, from the host.

use std::collections::HashMap;
use std::sync::Arc;

use bitflags::bitflags;
use bytemuck::{Pod, Zeroable};

use super::structure::AccelStruct;
use crate::error::{Error, Result};
use crate::handle::AccelStructHandle;

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

/// Instances as Vulkan reads them, with the structures they refer to.
pub(crate) struct Instances {
    pub(crate) raw: Vec<RawInstance>,
    pub(crate) blas: Vec<Arc<AccelStruct>>,
}

impl Instances {
    /// Checks and converts `instances` for the structure `name`.
    pub(crate) fn convert(
        name: &str,
        instances: &[TlasInstance],
        find: impl Fn(AccelStructHandle) -> Result<Arc<AccelStruct>>,
    ) -> Result<Self> {
        let mut found: HashMap<AccelStructHandle, u64> = HashMap::new();
        let mut blas = Vec::new();
        let mut raw = Vec::with_capacity(instances.len());
        for (index, instance) in instances.iter().enumerate() {
            check(name, index, instance)?;
            let address = match found.get(&instance.blas) {
                Some(address) => *address,
                None => {
                    let object = find(instance.blas)?;
                    object.blas()?;
                    found.insert(instance.blas, object.address);
                    blas.push(object);
                    blas[blas.len() - 1].address
                }
            };
            raw.push(pack(instance, address));
        }
        Ok(Self { raw, blas })
    }
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
