//! What Vulkan is told about a build: the same values for the size query and for the build.

use std::sync::Arc;

use ash::vk;

use super::geometry::{BlasGeometry, Converted, address, check_list};
use super::instance::INSTANCE_BYTES;
use super::structure::{AccelStruct, AccelStructSizes, BuildFlags, BuildMode};
use crate::error::Result;
use crate::gpu::Gpu;
use crate::handle::BufferHandle;
use crate::resource::Buffer;

/// The inputs of one build, converted.
pub(crate) struct BuildInput {
    ty: vk::AccelerationStructureTypeKHR,
    flags: BuildFlags,
    geometries: Vec<vk::AccelerationStructureGeometryKHR<'static>>,
    pub(crate) ranges: Vec<vk::AccelerationStructureBuildRangeInfoKHR>,
}

impl BuildInput {
    /// Checks and converts the geometries of a bottom-level structure. `transforms` is the address of their matrices,
    /// 48 bytes for each geometry, or 0 while only sizes are asked.
    pub(crate) fn blas(
        gpu: &Gpu,
        name: &str,
        geometries: &[BlasGeometry],
        flags: BuildFlags,
        find: &dyn Fn(BufferHandle) -> Result<Arc<Buffer>>,
        transforms: Option<u64>,
    ) -> Result<Self> {
        check_list(name, geometries, &gpu.caps.limits)?;
        let mut converted = Vec::with_capacity(geometries.len());
        for (index, geometry) in geometries.iter().enumerate() {
            let matrix = match (geometry.transform(), transforms) {
                (Some(_), Some(start)) => start + index as u64 * TRANSFORM_BYTES,
                _ => 0,
            };
            converted.push(geometry.convert(gpu, name, find, matrix)?);
        }
        Ok(Self::new(vk::AccelerationStructureTypeKHR::BOTTOM_LEVEL, flags, &converted))
    }

    /// The input of a top-level structure: `count` instances at `instances`, an address that is a multiple of 16.
    pub(crate) fn tlas(flags: BuildFlags, instances: u64, count: u32) -> Self {
        debug_assert!(instances.is_multiple_of(16));
        let data = vk::AccelerationStructureGeometryInstancesDataKHR::default().data(address(instances));
        let raw = vk::AccelerationStructureGeometryKHR::default()
            .geometry_type(vk::GeometryTypeKHR::INSTANCES)
            .geometry(vk::AccelerationStructureGeometryDataKHR { instances: data });
        let converted = [Converted { raw, primitive_count: count }];
        Self::new(vk::AccelerationStructureTypeKHR::TOP_LEVEL, flags, &converted)
    }

    fn new(ty: vk::AccelerationStructureTypeKHR, flags: BuildFlags, converted: &[Converted]) -> Self {
        let range = |geometry: &Converted| vk::AccelerationStructureBuildRangeInfoKHR {
            primitive_count: geometry.primitive_count,
            ..Default::default()
        };
        Self {
            ty,
            flags,
            geometries: converted.iter().map(|geometry| geometry.raw).collect(),
            ranges: converted.iter().map(range).collect(),
        }
    }

    /// Asks how large the structure and its scratch memory are (`vkGetAccelerationStructureBuildSizesKHR`).
    pub(crate) fn sizes(&self, gpu: &Gpu) -> Result<AccelStructSizes> {
        let counts: Vec<_> = self.ranges.iter().map(|range| range.primitive_count).collect();
        let mut sizes = vk::AccelerationStructureBuildSizesInfoKHR::default();
        // SAFETY: one count for each geometry; addresses are not read by a size query.
        unsafe {
            gpu.accel()?.get_acceleration_structure_build_sizes(
                vk::AccelerationStructureBuildTypeKHR::DEVICE,
                &self.info(BuildMode::Rebuild),
                &counts,
                &mut sizes,
            );
        }
        let updates = self.flags.contains(BuildFlags::ALLOW_UPDATE);
        Ok(AccelStructSizes {
            structure_bytes: sizes.acceleration_structure_size,
            build_scratch_bytes: sizes.build_scratch_size,
            update_scratch_bytes: if updates { sizes.update_scratch_size } else { 0 },
        })
    }

    /// The build of `target` with scratch memory at this address.
    pub(crate) fn build(
        &self,
        target: &AccelStruct,
        mode: BuildMode,
        scratch: u64,
    ) -> vk::AccelerationStructureBuildGeometryInfoKHR<'_> {
        let info = self
            .info(mode)
            .dst_acceleration_structure(target.raw)
            .scratch_data(vk::DeviceOrHostAddressKHR { device_address: scratch });
        match mode {
            BuildMode::Rebuild => info,
            BuildMode::Refit => info.src_acceleration_structure(target.raw),
        }
    }

    fn info(&self, mode: BuildMode) -> vk::AccelerationStructureBuildGeometryInfoKHR<'_> {
        let mode = match mode {
            BuildMode::Rebuild => vk::BuildAccelerationStructureModeKHR::BUILD,
            BuildMode::Refit => vk::BuildAccelerationStructureModeKHR::UPDATE,
        };
        vk::AccelerationStructureBuildGeometryInfoKHR::default()
            .ty(self.ty)
            .flags(self.flags.raw())
            .mode(mode)
            .geometries(&self.geometries)
    }
}

/// Bytes of a 3 x 4 matrix.
pub(crate) const TRANSFORM_BYTES: u64 = 48;

/// The matrices of all geometries, identity where one has none; `None` if none has one.
pub(crate) fn transforms(geometries: &[BlasGeometry]) -> Option<Vec<f32>> {
    const IDENTITY: [f32; 12] = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let any = geometries.iter().any(|geometry| geometry.transform().is_some());
    any.then(|| geometries.iter().flat_map(|geometry| geometry.transform().unwrap_or(IDENTITY)).collect())
}

/// Bytes of `count` instances.
pub(crate) fn instance_bytes(count: u32) -> u64 {
    u64::from(count) * INSTANCE_BYTES as u64
}
