//! Acceleration structures: build inputs, objects, commands, and those of the traced scene.

use gpu_allocator::MemoryLocation;
use lvk::ash::vk;

use super::commands::{Commands, memory_barrier};
use super::device::Device;
use super::memory::Buffer;
use crate::instance_record::InstanceRecord;
use crate::peers::peer::Failure;
use crate::peers::ray_scene::RayScene;

const FLAGS: vk::BuildAccelerationStructureFlagsKHR =
    vk::BuildAccelerationStructureFlagsKHR::PREFER_FAST_TRACE;

/// The input of a build with one geometry, and the sizes that it needs.
pub(super) struct BuildInput {
    ty: vk::AccelerationStructureTypeKHR,
    geometry: vk::AccelerationStructureGeometryKHR<'static>,
    count: u32,
    bytes: u64,
    /// Bytes of scratch memory, a multiple of its alignment.
    pub(super) scratch_bytes: u64,
}

/// An acceleration structure with its buffer.
pub(super) struct Structure {
    pub(super) raw: vk::AccelerationStructureKHR,
    pub(super) address: u64,
    storage: Buffer,
}

impl Structure {
    /// Creates a structure for an input. Does not build it.
    pub(super) fn new(device: &Device, input: &BuildInput) -> Result<Self, Failure> {
        let usage = vk::BufferUsageFlags::ACCELERATION_STRUCTURE_STORAGE_KHR;
        let storage = Buffer::new(device, input.bytes, usage, MemoryLocation::GpuOnly)?;
        let info = vk::AccelerationStructureCreateInfoKHR::default();
        let info = info.buffer(storage.raw).size(input.bytes).ty(input.ty);
        let accel = device.accel()?;
        // SAFETY: the buffer is as large as the structure needs.
        unsafe {
            let raw = accel.create_acceleration_structure(&info, None)?;
            let info = vk::AccelerationStructureDeviceAddressInfoKHR::default().acceleration_structure(raw);
            Ok(Self { raw, address: accel.get_acceleration_structure_device_address(&info), storage })
        }
    }

    /// Destroys the structure. The GPU has finished with it.
    pub(super) fn destroy(self, device: &Device) -> Result<(), Failure> {
        // SAFETY: the GPU has finished with the structure, and nothing else names it.
        unsafe { device.accel()?.destroy_acceleration_structure(self.raw, None) };
        self.storage.destroy(device)
    }
}

/// Returns the input of a mesh: packed positions, and the address of the indices if it has some. `corners` are three for
/// each triangle.
pub(super) fn triangles(
    device: &Device,
    positions: u64,
    indices: Option<(u64, u32)>,
    corners: u32,
) -> Result<BuildInput, Failure> {
    let mut triangles = vk::AccelerationStructureGeometryTrianglesDataKHR::default()
        .vertex_format(vk::Format::R32G32B32_SFLOAT)
        .vertex_data(vk::DeviceOrHostAddressConstKHR { device_address: positions })
        .vertex_stride(12)
        .max_vertex(corners.saturating_sub(1))
        .index_type(vk::IndexType::NONE_KHR);
    if let Some((device_address, vertex_count)) = indices {
        triangles = triangles
            .max_vertex(vertex_count.saturating_sub(1))
            .index_type(vk::IndexType::UINT32)
            .index_data(vk::DeviceOrHostAddressConstKHR { device_address });
    }
    let geometry = vk::AccelerationStructureGeometryKHR::default()
        .geometry_type(vk::GeometryTypeKHR::TRIANGLES)
        .geometry(vk::AccelerationStructureGeometryDataKHR { triangles })
        .flags(vk::GeometryFlagsKHR::OPAQUE);
    input(device, vk::AccelerationStructureTypeKHR::BOTTOM_LEVEL, geometry, corners / 3)
}

/// Returns the input of `count` instance records.
pub(super) fn instances(device: &Device, records: u64, count: u32) -> Result<BuildInput, Failure> {
    let instances = vk::AccelerationStructureGeometryInstancesDataKHR::default()
        .data(vk::DeviceOrHostAddressConstKHR { device_address: records });
    let geometry = vk::AccelerationStructureGeometryKHR::default()
        .geometry_type(vk::GeometryTypeKHR::INSTANCES)
        .geometry(vk::AccelerationStructureGeometryDataKHR { instances });
    input(device, vk::AccelerationStructureTypeKHR::TOP_LEVEL, geometry, count)
}

fn input(
    device: &Device,
    ty: vk::AccelerationStructureTypeKHR,
    geometry: vk::AccelerationStructureGeometryKHR<'static>,
    count: u32,
) -> Result<BuildInput, Failure> {
    let geometries = [geometry];
    let info =
        vk::AccelerationStructureBuildGeometryInfoKHR::default().ty(ty).flags(FLAGS).geometries(&geometries);
    let mut sizes = vk::AccelerationStructureBuildSizesInfoKHR::default();
    let on = vk::AccelerationStructureBuildTypeKHR::DEVICE;
    // SAFETY: one geometry, one count.
    unsafe { device.accel()?.get_acceleration_structure_build_sizes(on, &info, &[count], &mut sizes) };
    let scratch_bytes = sizes.build_scratch_size.next_multiple_of(device.scratch_alignment());
    Ok(BuildInput { ty, geometry, count, bytes: sizes.acceleration_structure_size, scratch_bytes })
}

/// Records the builds of all structures by one command, and a barrier for what reads them.
pub(super) fn record_builds(
    device: &Device,
    list: vk::CommandBuffer,
    structures: &[Structure],
    inputs: &[BuildInput],
    scratch: u64,
) -> Result<(), Failure> {
    let mut scratch = scratch.next_multiple_of(device.scratch_alignment());
    let mut infos = Vec::with_capacity(inputs.len());
    let mut ranges = Vec::with_capacity(inputs.len());
    for (structure, input) in structures.iter().zip(inputs) {
        let info = vk::AccelerationStructureBuildGeometryInfoKHR::default()
            .ty(input.ty)
            .flags(FLAGS)
            .dst_acceleration_structure(structure.raw)
            .geometries(std::slice::from_ref(&input.geometry))
            .scratch_data(vk::DeviceOrHostAddressKHR { device_address: scratch });
        infos.push(info);
        ranges.push([vk::AccelerationStructureBuildRangeInfoKHR::default().primitive_count(input.count)]);
        scratch += input.scratch_bytes;
    }
    let ranges: Vec<_> = ranges.iter().map(|range| &range[..]).collect();
    // SAFETY: structures, inputs and scratch memory are alive, large enough, and used by no other command.
    unsafe { device.accel()?.cmd_build_acceleration_structures(list, &infos, &ranges) };
    let stage = vk::PipelineStageFlags2::ACCELERATION_STRUCTURE_BUILD_KHR;
    let read = (vk::PipelineStageFlags2::ALL_COMMANDS, vk::AccessFlags2::ACCELERATION_STRUCTURE_READ_KHR);
    memory_barrier(device, list, (stage, vk::AccessFlags2::ACCELERATION_STRUCTURE_WRITE_KHR), read);
    Ok(())
}

/// The structures of a traced scene.
pub(super) struct SceneStructures {
    pub(super) tlas: Structure,
    _blas: Structure,
    _inputs: [Buffer; 3],
}

impl SceneStructures {
    /// Builds a BLAS of all triangles, and a TLAS with one instance.
    pub(super) fn new(device: &Device, commands: &mut Commands, scene: &RayScene) -> Result<Self, Failure> {
        let usage = vk::BufferUsageFlags::ACCELERATION_STRUCTURE_BUILD_INPUT_READ_ONLY_KHR;
        let positions = Buffer::with_bytes(device, bytemuck::cast_slice(&scene.positions), usage)?;
        let indices = Buffer::with_bytes(device, bytemuck::cast_slice(&scene.triangles), usage)?;
        let corners = 3 * scene.triangles.len() as u32;
        let indexed = Some((indices.address, scene.positions.len() as u32));
        let mesh = triangles(device, positions.address, indexed, corners)?;
        let blas = Structure::new(device, &mesh)?;
        let identity = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];
        let record = InstanceRecord::new(identity, blas.address);
        let records = Buffer::with_bytes(device, bytemuck::bytes_of(&record), usage)?;
        let instance = instances(device, records.address, 1)?;
        let tlas = Structure::new(device, &instance)?;
        let bytes = mesh.scratch_bytes.max(instance.scratch_bytes) + device.scratch_alignment();
        let storage = vk::BufferUsageFlags::STORAGE_BUFFER;
        let scratch = Buffer::new(device, bytes, storage, MemoryLocation::GpuOnly)?;
        for (structure, input) in [(&blas, &mesh), (&tlas, &instance)] {
            let list = commands.begin(device)?;
            let (structures, inputs) = (std::slice::from_ref(structure), std::slice::from_ref(input));
            record_builds(device, list, structures, inputs, scratch.address)?;
            commands.submit(device)?;
            commands.wait(device)?;
        }
        scratch.destroy(device)?;
        Ok(Self { tlas, _blas: blas, _inputs: [positions, indices, records] })
    }
}

/// Writes a TLAS into binding 0 of a descriptor set.
pub(super) fn write_tlas(device: &Device, set: vk::DescriptorSet, tlas: vk::AccelerationStructureKHR) {
    let structures = [tlas];
    let mut info =
        vk::WriteDescriptorSetAccelerationStructureKHR::default().acceleration_structures(&structures);
    let mut write = vk::WriteDescriptorSet::default()
        .dst_set(set)
        .descriptor_type(vk::DescriptorType::ACCELERATION_STRUCTURE_KHR)
        .push_next(&mut info);
    write.descriptor_count = 1;
    // SAFETY: the set has the binding, and no command uses it yet.
    unsafe { device.raw.update_descriptor_sets(&[write], &[]) };
}
