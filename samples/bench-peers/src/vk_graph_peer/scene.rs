//! Inputs of acceleration structures, and those of the traced scene.

use std::sync::Arc;

use vk_graph::Graph;
use vk_graph::cmd::BuildAccelerationStructureInfo;
use vk_graph::driver::accel_struct::{
    AccelerationStructure, AccelerationStructureGeometry, AccelerationStructureGeometryData,
    AccelerationStructureGeometryInfo, AccelerationStructureInfo,
};
use vk_graph::driver::ash::vk;
use vk_graph::driver::buffer::{Buffer, BufferInfo};
use vk_graph::driver::sync::AccessType;

use lvk_bench::peers::{Failure, RayScene};

use super::device::Gpu;

/// Geometries with their numbers of primitives.
pub(super) type Geometry = AccelerationStructureGeometryInfo<(
    AccelerationStructureGeometry,
    vk::AccelerationStructureBuildRangeInfoKHR,
)>;

/// Usage of buffers that builds read.
pub(super) const INPUT: vk::BufferUsageFlags =
    vk::BufferUsageFlags::ACCELERATION_STRUCTURE_BUILD_INPUT_READ_ONLY_KHR;

/// Returns an error if the device has no acceleration structures.
pub(super) fn needs_acceleration_structures(gpu: &Gpu) -> Result<(), Failure> {
    if gpu.device.physical.vk_khr_acceleration_structure.is_some() {
        return Ok(());
    }
    Err("the device has no acceleration structures".into())
}

/// Returns the geometry of packed triangles.
pub(super) fn triangles(positions: &Buffer, indices: Option<&Buffer>, vertices: u32, count: u32) -> Geometry {
    let (index_address, index_type) = match indices {
        Some(indices) => (indices.device_address(), vk::IndexType::UINT32),
        None => (0, vk::IndexType::NONE_KHR),
    };
    let data = AccelerationStructureGeometryData::triangles(
        index_address,
        index_type,
        vertices - 1,
        None,
        positions.device_address(),
        vk::Format::R32G32B32_SFLOAT,
        12,
    );
    let range = vk::AccelerationStructureBuildRangeInfoKHR::default().primitive_count(count);
    AccelerationStructureGeometryInfo::blas([(AccelerationStructureGeometry::opaque(count, data), range)])
        .flags(vk::BuildAccelerationStructureFlagsKHR::PREFER_FAST_TRACE)
}

/// Returns the geometry of instance records.
pub(super) fn instances(records: &Buffer, count: u32) -> Geometry {
    let data = AccelerationStructureGeometryData::instances(records.device_address());
    let range = vk::AccelerationStructureBuildRangeInfoKHR::default().primitive_count(count);
    AccelerationStructureGeometryInfo::tlas([(AccelerationStructureGeometry::opaque(count, data), range)])
        .flags(vk::BuildAccelerationStructureFlagsKHR::PREFER_FAST_TRACE)
}

/// Returns an instance record.
pub(super) fn record(
    transform: [f32; 12],
    blas: &AccelerationStructure,
) -> vk::AccelerationStructureInstanceKHR {
    vk::AccelerationStructureInstanceKHR {
        transform: vk::TransformMatrixKHR { matrix: transform },
        instance_custom_index_and_mask: vk::Packed24_8::new(0, 0xff),
        instance_shader_binding_table_record_offset_and_flags: vk::Packed24_8::new(0, 0),
        acceleration_structure_reference: vk::AccelerationStructureReferenceKHR {
            device_handle: blas.device_address(),
        },
    }
}

/// Creates a structure for a geometry. Does not build it.
pub(super) fn structure(gpu: &Gpu, geometry: &Geometry) -> Result<Arc<AccelerationStructure>, Failure> {
    let bytes = AccelerationStructure::size_of(&gpu.device, geometry).create_size;
    let info = match geometry.acceleration_structure_type {
        vk::AccelerationStructureTypeKHR::TOP_LEVEL => AccelerationStructureInfo::tlas(bytes),
        _ => AccelerationStructureInfo::blas(bytes),
    };
    Ok(Arc::new(AccelerationStructure::create(&gpu.device, info)?))
}

/// Creates scratch memory of so many bytes.
pub(super) fn scratch(gpu: &Gpu, bytes: u64) -> Result<Arc<Buffer>, Failure> {
    let usage = vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS | vk::BufferUsageFlags::STORAGE_BUFFER;
    let info = BufferInfo::device_mem(bytes, usage).into_builder().alignment(256);
    Ok(Arc::new(Buffer::create(&gpu.device, info)?))
}

/// Returns the bytes of scratch memory for a geometry, a multiple of every device's alignment.
pub(super) fn scratch_bytes(gpu: &Gpu, geometry: &Geometry) -> u64 {
    AccelerationStructure::size_of(&gpu.device, geometry).build_size.next_multiple_of(256)
}

/// Adds the build of a structure to a graph.
pub(super) fn build(
    graph: &mut Graph,
    structure: &Arc<AccelerationStructure>,
    geometry: Geometry,
    scratch: &Arc<Buffer>,
    offset: u64,
) {
    let (node, scratch_node) = (graph.bind_resource(structure), graph.bind_resource(scratch));
    let address = scratch.device_address() + offset;
    graph
        .begin_cmd()
        .resource_access(scratch_node, AccessType::AccelerationStructureBufferWrite)
        .resource_access(node, AccessType::AccelerationStructureBuildWrite)
        .record_cmd(move |cmd| {
            cmd.build_accel_struct(&[BuildAccelerationStructureInfo::new(node, address, geometry)]);
        });
}

/// The structures of a traced scene.
pub(super) struct SceneStructures {
    pub(super) tlas: Arc<AccelerationStructure>,
    pub(super) blas: Arc<AccelerationStructure>,
    _inputs: [Arc<Buffer>; 3],
}

impl SceneStructures {
    /// Builds a BLAS of all triangles, and a TLAS with one instance.
    pub(super) fn new(gpu: &mut Gpu, scene: &RayScene) -> Result<Self, Failure> {
        let positions = gpu.buffer_with(bytemuck::cast_slice(&scene.positions), INPUT)?;
        let indices = gpu.buffer_with(bytemuck::cast_slice(&scene.triangles), INPUT)?;
        let [vertices, count] = [scene.positions.len() as u32, scene.triangles.len() as u32];
        let mesh = triangles(&positions, Some(&indices), vertices, count);
        let blas = structure(gpu, &mesh)?;
        let identity = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];
        let records =
            gpu.buffer_with(AccelerationStructure::instance_slice(&[record(identity, &blas)]), INPUT)?;
        let instance = instances(&records, 1);
        let tlas = structure(gpu, &instance)?;
        for (structure, geometry) in [(&blas, mesh), (&tlas, instance)] {
            let scratch = scratch(gpu, scratch_bytes(gpu, &geometry))?;
            let mut graph = Graph::default();
            build(&mut graph, structure, geometry, &scratch, 0);
            gpu.run(graph)?;
        }
        Ok(Self { tlas, blas, _inputs: [positions, indices, records] })
    }
}
