//! The input of an acceleration structure build in Vulkan's form. The same value serves the size query and every
//! build.

use std::sync::Arc;

use ash::khr::acceleration_structure::Device as ExtDevice;
use ash::vk;

use super::flags::{AccelStructSizes, BuildFlags};
use super::geometry::{BlasGeometry, VulkanGeometry, check_geometries, host_or_device_address};
use super::micromap::{Micromap, OpacityAttachment};
use super::primitive_map::PrimitiveMap;
use super::transform::IDENTITY_ROWS;
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::handle::BufferHandle;
use crate::resource::Buffer;

/// The input of one build, converted once.
#[derive(Clone)]
pub(crate) struct BuildInput {
    ty: vk::AccelerationStructureTypeKHR,
    flags: BuildFlags,
    geometries: Vec<vk::AccelerationStructureGeometryKHR<'static>>,
    pub(crate) ranges: Vec<vk::AccelerationStructureBuildRangeInfoKHR>,
    /// The micromaps that `geometries` point to.
    opacity: Vec<Arc<OpacityAttachment>>,
}

impl BuildInput {
    /// Checks and converts the geometries of a BLAS. `transforms` is the address of the transform matrices given by
    /// value, 48 bytes for each geometry, or `None` if there are none.
    pub(crate) fn from_geometries(
        gpu: &Gpu,
        name: &str,
        geometries: &[BlasGeometry],
        flags: BuildFlags,
        find: &dyn Fn(BufferHandle) -> Result<Arc<Buffer>>,
        transforms: Option<u64>,
    ) -> Result<Self> {
        check_geometries(name, geometries, &gpu.caps.limits)?;
        let mut converted = Vec::with_capacity(geometries.len());
        for (index, geometry) in geometries.iter().enumerate() {
            let matrix = match (geometry.transform_rows(), transforms) {
                (Some(_), Some(start)) => start + index as u64 * TRANSFORM_BYTES,
                _ => 0,
            };
            converted.push(geometry.convert(gpu, name, find, matrix)?);
        }
        Ok(Self::new(vk::AccelerationStructureTypeKHR::BOTTOM_LEVEL, flags, &converted))
    }

    /// Gives the triangles of a geometry their opacity. Fails for AABBs, and unless the micromap has an entry for each
    /// triangle.
    pub(crate) fn attach_opacity(
        &mut self,
        name: &str,
        index: usize,
        micromap: &Arc<Micromap>,
    ) -> Result<()> {
        let geometries = self.geometries.len();
        let (Some(geometry), Some(range)) = (self.geometries.get_mut(index), self.ranges.get(index)) else {
            let message = format!("opacity is given for geometry {index}, but there are {geometries}");
            return Err(Error::usage(name, message));
        };
        if geometry.geometry_type != vk::GeometryTypeKHR::TRIANGLES {
            return Err(Error::usage(
                name,
                format!("geometry {index} has boxes; only triangles have an opacity"),
            ));
        }
        if micromap.triangle_count != range.primitive_count {
            let message = format!(
                "geometry {index} has {} triangles, its micromap '{}' has {}",
                range.primitive_count, micromap.name, micromap.triangle_count
            );
            return Err(Error::usage(name, message));
        }
        let attachment = OpacityAttachment::new(micromap);
        // SAFETY: the type says which field of the union is in use.
        attachment.attach(unsafe { &mut geometry.geometry.triangles });
        self.opacity.push(attachment);
        Ok(())
    }

    /// Returns the micromaps of the triangles.
    pub(crate) fn micromaps(&self) -> impl Iterator<Item = &Micromap> {
        self.opacity.iter().map(|attachment| &*attachment.micromap)
    }

    /// Returns the input of a part of the mesh: `counts` primitives of each geometry, read from the inputs gathered for
    /// the part.
    pub(crate) fn for_part(&self, map: &PrimitiveMap, counts: &[u32]) -> Self {
        let mut part = self.clone();
        for (index, geometry) in part.geometries.iter_mut().enumerate() {
            use_gathered_inputs(geometry, map.input_address(index));
        }
        part.set_counts(counts);
        part
    }

    /// As [`for_part`](Self::for_part), for a part that is only planned. The result is valid for size queries alone.
    pub(crate) fn with_gathered_inputs(mut self) -> Self {
        const NO_ADDRESS: u64 = 0;
        self.geometries.iter_mut().for_each(|geometry| use_gathered_inputs(geometry, NO_ADDRESS));
        self
    }

    /// Sets the number of primitives of each geometry.
    pub(crate) fn set_counts(&mut self, counts: &[u32]) {
        for (range, count) in self.ranges.iter_mut().zip(counts) {
            range.primitive_count = *count;
        }
    }

    /// Returns the input of a TLAS: `count` instances at `instances`, an address that is a multiple of 16.
    pub(crate) fn from_instances(flags: BuildFlags, instances: u64, count: u32) -> Self {
        let converted = [VulkanGeometry { raw: instances_geometry(instances), primitive_count: count }];
        Self::new(vk::AccelerationStructureTypeKHR::TOP_LEVEL, flags, &converted)
    }

    fn new(ty: vk::AccelerationStructureTypeKHR, flags: BuildFlags, converted: &[VulkanGeometry]) -> Self {
        let range = |geometry: &VulkanGeometry| vk::AccelerationStructureBuildRangeInfoKHR {
            primitive_count: geometry.primitive_count,
            ..Default::default()
        };
        Self {
            ty,
            flags,
            geometries: converted.iter().map(|geometry| geometry.raw).collect(),
            ranges: converted.iter().map(range).collect(),
            opacity: Vec::new(),
        }
    }

    /// Queries the sizes of the acceleration structure and its scratch memory
    /// (`vkGetAccelerationStructureBuildSizesKHR`).
    pub(crate) fn query_sizes(&self, gpu: &Gpu) -> Result<AccelStructSizes> {
        let counts: Vec<_> = self.ranges.iter().map(|range| range.primitive_count).collect();
        let mut sizes = vk::AccelerationStructureBuildSizesInfoKHR::default();
        // SAFETY: one count for each geometry; addresses are not read by a size query.
        unsafe {
            gpu.accel_functions()?.get_acceleration_structure_build_sizes(
                vk::AccelerationStructureBuildTypeKHR::DEVICE,
                &self.info(false),
                &counts,
                &mut sizes,
            );
        }
        let updates = self.flags.contains(BuildFlags::ALLOW_UPDATE);
        let sizes = AccelStructSizes {
            structure_bytes: sizes.acceleration_structure_size,
            build_scratch_bytes: sizes.build_scratch_size,
            update_scratch_bytes: if updates { sizes.update_scratch_size } else { 0 },
        };
        let bottom = self.ty == vk::AccelerationStructureTypeKHR::BOTTOM_LEVEL;
        let primitives = counts.iter().map(|count| u64::from(*count)).sum();
        Ok(if bottom { gpu.profile.query_build_sizes(sizes, primitives) } else { sizes })
    }

    /// Returns the build of `target` with scratch memory at the address `scratch`.
    pub(crate) fn build(
        &self,
        target: vk::AccelerationStructureKHR,
        refit: bool,
        scratch: u64,
    ) -> vk::AccelerationStructureBuildGeometryInfoKHR<'_> {
        build_command(self.info(refit), target, refit, scratch)
    }

    fn info(&self, refit: bool) -> vk::AccelerationStructureBuildGeometryInfoKHR<'_> {
        build_info(self.ty, self.flags, &self.geometries, refit)
    }
}

/// The build of a TLAS, as [`BuildInput`] describes it, without heap allocations.
pub(crate) struct TlasBuild {
    pub(crate) flags: BuildFlags,
    /// Address of the instances, a multiple of 16.
    pub(crate) instances: u64,
    pub(crate) count: u32,
    pub(crate) refit: bool,
    pub(crate) target: vk::AccelerationStructureKHR,
    /// Address of the scratch memory.
    pub(crate) scratch: u64,
}

impl TlasBuild {
    /// Records the build (`vkCmdBuildAccelerationStructuresKHR`).
    ///
    /// # Safety
    /// The command buffer is in the recording state. Instances, acceleration structure and scratch memory are alive,
    /// checked, aligned and large enough. Barriers separate them from other commands.
    #[inline(always)]
    pub(crate) unsafe fn record(&self, ext: &ExtDevice, commands: vk::CommandBuffer) {
        let geometry = [instances_geometry(self.instances)];
        let info = build_info(vk::AccelerationStructureTypeKHR::TOP_LEVEL, self.flags, &geometry, self.refit);
        let info = build_command(info, self.target, self.refit, self.scratch);
        let range =
            vk::AccelerationStructureBuildRangeInfoKHR { primitive_count: self.count, ..Default::default() };
        let build = ext.fp().cmd_build_acceleration_structures_khr;
        // SAFETY: the caller ensures the conditions; one acceleration structure with one geometry and its range.
        unsafe { build(commands, 1, &info, &std::ptr::from_ref(&range)) };
    }
}

#[inline]
fn build_info<'a>(
    ty: vk::AccelerationStructureTypeKHR,
    flags: BuildFlags,
    geometries: &'a [vk::AccelerationStructureGeometryKHR<'a>],
    refit: bool,
) -> vk::AccelerationStructureBuildGeometryInfoKHR<'a> {
    let mode = match refit {
        false => vk::BuildAccelerationStructureModeKHR::BUILD,
        true => vk::BuildAccelerationStructureModeKHR::UPDATE,
    };
    vk::AccelerationStructureBuildGeometryInfoKHR::default()
        .ty(ty)
        .flags(flags.raw())
        .mode(mode)
        .geometries(geometries)
}

#[inline]
fn build_command(
    info: vk::AccelerationStructureBuildGeometryInfoKHR<'_>,
    target: vk::AccelerationStructureKHR,
    refit: bool,
    scratch: u64,
) -> vk::AccelerationStructureBuildGeometryInfoKHR<'_> {
    let info = info
        .dst_acceleration_structure(target)
        .scratch_data(vk::DeviceOrHostAddressKHR { device_address: scratch });
    if refit { info.src_acceleration_structure(target) } else { info }
}

/// The geometry of instances at an address that is a multiple of 16.
#[inline]
fn instances_geometry(instances: u64) -> vk::AccelerationStructureGeometryKHR<'static> {
    debug_assert!(instances.is_multiple_of(16));
    let data =
        vk::AccelerationStructureGeometryInstancesDataKHR::default().data(host_or_device_address(instances));
    vk::AccelerationStructureGeometryKHR::default()
        .geometry_type(vk::GeometryTypeKHR::INSTANCES)
        .geometry(vk::AccelerationStructureGeometryDataKHR { instances: data })
}

/// Makes a geometry read its indices or AABBs from the gathered inputs.
fn use_gathered_inputs(geometry: &mut vk::AccelerationStructureGeometryKHR<'_>, inputs: u64) {
    const BOX_BYTES: u64 = 24;
    match geometry.geometry_type {
        vk::GeometryTypeKHR::TRIANGLES => {
            // SAFETY: the type says which field of the union is in use.
            let triangles = unsafe { &mut geometry.geometry.triangles };
            triangles.index_type = vk::IndexType::UINT32;
            triangles.index_data = host_or_device_address(inputs);
        }
        _ => {
            // SAFETY: as above; a BLAS holds triangles or AABBs.
            let boxes = unsafe { &mut geometry.geometry.aabbs };
            boxes.data = host_or_device_address(inputs);
            boxes.stride = BOX_BYTES;
        }
    }
}

/// Bytes of a 3 x 4 matrix.
pub(crate) const TRANSFORM_BYTES: u64 = 48;

/// The transform matrices given by value, identity for other geometries; `None` if no geometry has one.
pub(crate) fn transform_matrices(geometries: &[BlasGeometry]) -> Option<Vec<f32>> {
    let any = geometries.iter().any(|geometry| geometry.transform_rows().is_some());
    any.then(|| {
        geometries.iter().flat_map(|geometry| geometry.transform_rows().unwrap_or(IDENTITY_ROWS)).collect()
    })
}
