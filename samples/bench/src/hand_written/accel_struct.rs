//! Acceleration structures with one geometry.

use std::rc::Rc;

use lvk::ash::vk;

use super::RawDevice;
use super::buffer::RawBuffer;
use crate::error::BenchError;
use crate::mesh::MeshBuffers;

/// An acceleration structure with one geometry and its own scratch buffer.
pub(crate) struct RawAccelStruct {
    pub(crate) raw: vk::AccelerationStructureKHR,
    /// Address for instance records.
    pub(crate) address: u64,
    pub(crate) bytes: u64,
    ty: vk::AccelerationStructureTypeKHR,
    flags: vk::BuildAccelerationStructureFlagsKHR,
    geometry: vk::AccelerationStructureGeometryKHR<'static>,
    count: u32,
    scratch_address: u64,
    _scratch: RawBuffer,
    _storage: RawBuffer,
    device: Rc<RawDevice>,
}

/// Returns the opaque geometry of a mesh in buffers of `lvk`.
pub(crate) fn triangle_geometry(
    device: &RawDevice,
    mesh: &MeshBuffers,
) -> lvk::Result<vk::AccelerationStructureGeometryKHR<'static>> {
    let triangles = vk::AccelerationStructureGeometryTrianglesDataKHR::default()
        .vertex_format(vk::Format::R32G32B32_SFLOAT)
        .vertex_data(device_address(device.ctx.buffer_address(*mesh.positions)?))
        .vertex_stride(12)
        .max_vertex(mesh.vertex_count.saturating_sub(1))
        .index_type(vk::IndexType::UINT32)
        .index_data(device_address(device.ctx.buffer_address(*mesh.indices)?));
    Ok(vk::AccelerationStructureGeometryKHR::default()
        .geometry_type(vk::GeometryTypeKHR::TRIANGLES)
        .geometry(vk::AccelerationStructureGeometryDataKHR { triangles })
        .flags(vk::GeometryFlagsKHR::OPAQUE))
}

/// Returns the geometry of instance records at an address that is a multiple of 16.
pub(crate) fn instance_geometry(address: u64) -> vk::AccelerationStructureGeometryKHR<'static> {
    let instances =
        vk::AccelerationStructureGeometryInstancesDataKHR::default().data(device_address(address));
    vk::AccelerationStructureGeometryKHR::default()
        .geometry_type(vk::GeometryTypeKHR::INSTANCES)
        .geometry(vk::AccelerationStructureGeometryDataKHR { instances })
}

fn device_address(device_address: u64) -> vk::DeviceOrHostAddressConstKHR {
    vk::DeviceOrHostAddressConstKHR { device_address }
}

impl RawAccelStruct {
    /// Creates an acceleration structure for `count` primitives or instances. Does not build it.
    pub(crate) fn new(
        device: &Rc<RawDevice>,
        geometry: vk::AccelerationStructureGeometryKHR<'static>,
        count: u32,
        flags: vk::BuildAccelerationStructureFlagsKHR,
    ) -> Result<Self, BenchError> {
        let ty = match geometry.geometry_type {
            vk::GeometryTypeKHR::INSTANCES => vk::AccelerationStructureTypeKHR::TOP_LEVEL,
            _ => vk::AccelerationStructureTypeKHR::BOTTOM_LEVEL,
        };
        let sizes = sizes(device, ty, flags, &geometry, count);
        let usage = vk::BufferUsageFlags::ACCELERATION_STRUCTURE_STORAGE_KHR;
        let storage = RawBuffer::new(device, sizes.acceleration_structure_size, usage)?;
        let alignment = u64::from(device.ctx.capabilities().limits.scratch_alignment).max(1);
        let scratch_bytes = sizes.build_scratch_size.max(sizes.update_scratch_size) + alignment;
        let scratch = RawBuffer::new(device, scratch_bytes, vk::BufferUsageFlags::STORAGE_BUFFER)?;
        let bytes = sizes.acceleration_structure_size;
        let raw = create(device, ty, &storage, bytes)?;
        let info = vk::AccelerationStructureDeviceAddressInfoKHR::default().acceleration_structure(raw);
        // SAFETY: the structure was just made.
        let address = unsafe { device.accel.get_acceleration_structure_device_address(&info) };
        let scratch_address = scratch.address.next_multiple_of(alignment);
        Ok(Self {
            raw,
            address,
            bytes,
            ty,
            flags,
            geometry,
            count,
            scratch_address,
            _scratch: scratch,
            _storage: storage,
            device: Rc::clone(device),
        })
    }

    /// Records a build and a barrier after it.
    pub(crate) fn build(&self, commands: vk::CommandBuffer) {
        self.record(commands, vk::BuildAccelerationStructureModeKHR::BUILD);
    }

    /// Records a refit and a barrier after it. The structure must be built with `ALLOW_UPDATE`.
    pub(crate) fn refit(&self, commands: vk::CommandBuffer) {
        self.record(commands, vk::BuildAccelerationStructureModeKHR::UPDATE);
    }

    fn record(&self, commands: vk::CommandBuffer, mode: vk::BuildAccelerationStructureModeKHR) {
        let geometries = [self.geometry];
        let source = match mode {
            vk::BuildAccelerationStructureModeKHR::UPDATE => self.raw,
            _ => vk::AccelerationStructureKHR::null(),
        };
        let info = vk::AccelerationStructureBuildGeometryInfoKHR::default()
            .ty(self.ty)
            .flags(self.flags)
            .mode(mode)
            .src_acceleration_structure(source)
            .dst_acceleration_structure(self.raw)
            .geometries(&geometries)
            .scratch_data(vk::DeviceOrHostAddressKHR { device_address: self.scratch_address });
        let range = [vk::AccelerationStructureBuildRangeInfoKHR::default().primitive_count(self.count)];
        let barrier = [vk::MemoryBarrier2::default()
            .src_stage_mask(vk::PipelineStageFlags2::ACCELERATION_STRUCTURE_BUILD_KHR)
            .src_access_mask(vk::AccessFlags2::ACCELERATION_STRUCTURE_WRITE_KHR)
            .dst_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
            .dst_access_mask(vk::AccessFlags2::ACCELERATION_STRUCTURE_READ_KHR)];
        let barrier = vk::DependencyInfo::default().memory_barriers(&barrier);
        // SAFETY: structure, scratch memory and inputs are alive and large enough, and no other command uses them.
        unsafe {
            self.device.accel.cmd_build_acceleration_structures(commands, &[info], &[&range]);
            self.device.device.cmd_pipeline_barrier2(commands, &barrier);
        }
    }

    /// Queries the compacted size in bytes of a structure that was built with `ALLOW_COMPACTION`. Waits for the query.
    pub(crate) fn compacted_bytes(&self, commands: &super::RawCommands) -> Result<u64, BenchError> {
        let ty = vk::QueryType::ACCELERATION_STRUCTURE_COMPACTED_SIZE_KHR;
        let info = vk::QueryPoolCreateInfo::default().query_type(ty).query_count(1);
        // SAFETY: the description is valid.
        let pool = unsafe { self.device.device.create_query_pool(&info, None) }
            .map_err(BenchError::hand_written("vkCreateQueryPool"))?;
        let answer = self.run_size_query(commands, ty, pool);
        // SAFETY: the submission was waited for.
        unsafe { self.device.device.destroy_query_pool(pool, None) };
        answer
    }

    fn run_size_query(
        &self,
        commands: &super::RawCommands,
        ty: vk::QueryType,
        pool: vk::QueryPool,
    ) -> Result<u64, BenchError> {
        let (device, accel) = (&self.device.device, &self.device.accel);
        // SAFETY: the structure is built, by a submission that was waited for, and the query exists.
        commands.time(|commands| unsafe {
            device.cmd_reset_query_pool(commands, pool, 0, 1);
            accel.cmd_write_acceleration_structures_properties(commands, &[self.raw], ty, pool, 0);
        })?;
        let mut bytes = [0_u64];
        let flags = vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WAIT;
        // SAFETY: the query was written.
        unsafe { device.get_query_pool_results(pool, 0, &mut bytes, flags) }
            .map_err(BenchError::hand_written("vkGetQueryPoolResults"))?;
        Ok(bytes[0])
    }
}

impl Drop for RawAccelStruct {
    fn drop(&mut self) {
        // SAFETY: every submission of the benchmarks is waited for, so the GPU is done with it.
        unsafe { self.device.accel.destroy_acceleration_structure(self.raw, None) };
    }
}

fn sizes(
    device: &RawDevice,
    ty: vk::AccelerationStructureTypeKHR,
    flags: vk::BuildAccelerationStructureFlagsKHR,
    geometry: &vk::AccelerationStructureGeometryKHR<'static>,
    count: u32,
) -> vk::AccelerationStructureBuildSizesInfoKHR<'static> {
    let geometries = [*geometry];
    let info =
        vk::AccelerationStructureBuildGeometryInfoKHR::default().ty(ty).flags(flags).geometries(&geometries);
    let mut sizes = vk::AccelerationStructureBuildSizesInfoKHR::default();
    let on = vk::AccelerationStructureBuildTypeKHR::DEVICE;
    // SAFETY: one geometry, one count.
    unsafe { device.accel.get_acceleration_structure_build_sizes(on, &info, &[count], &mut sizes) };
    sizes
}

fn create(
    device: &RawDevice,
    ty: vk::AccelerationStructureTypeKHR,
    storage: &RawBuffer,
    bytes: u64,
) -> Result<vk::AccelerationStructureKHR, BenchError> {
    let info = vk::AccelerationStructureCreateInfoKHR::default().buffer(storage.raw).size(bytes).ty(ty);
    // SAFETY: the buffer is large enough and has the usage.
    unsafe { device.accel.create_acceleration_structure(&info, None) }
        .map_err(BenchError::hand_written("vkCreateAccelerationStructureKHR"))
}
