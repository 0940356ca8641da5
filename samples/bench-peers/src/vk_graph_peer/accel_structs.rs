//! Builds of acceleration structures.

use std::sync::Arc;

use vk_graph::Graph;
use vk_graph::cmd::BuildAccelerationStructureInfo;
use vk_graph::driver::accel_struct::AccelerationStructure;
use vk_graph::driver::ash::vk;
use vk_graph::driver::buffer::{Buffer, BufferInfo};
use vk_graph::driver::sync::AccessType;
use vk_graph::pool::Pool as _;

use lvk_bench::peers::{Failure, RowRun, Sample, Workload};

use super::device::{Gpu, wait};
use super::scene::{
    Geometry, INPUT, build, instances, needs_acceleration_structures, record, scratch, scratch_bytes,
    structure, triangles,
};

/// BLAS of many meshes, built by one command of the graph.
pub(super) struct BlasBuilds {
    gpu: Gpu,
    meshes: Vec<Geometry>,
    built: Vec<Arc<AccelerationStructure>>,
    scratch: Arc<Buffer>,
    _positions: Vec<Arc<Buffer>>,
}

impl BlasBuilds {
    pub(super) fn new(gpu: Gpu, work: &Workload) -> Result<Self, Failure> {
        needs_acceleration_structures(&gpu)?;
        let positions =
            (0..work.meshes).map(|number| positions(&gpu, work, number)).collect::<Result<Vec<_>, _>>()?;
        let mesh =
            |buffer: &Arc<Buffer>| triangles(buffer, None, 3 * work.mesh_triangles, work.mesh_triangles);
        let meshes: Vec<_> = positions.iter().map(mesh).collect();
        let bytes = meshes.iter().map(|mesh| scratch_bytes(&gpu, mesh)).sum();
        Ok(Self { scratch: scratch(&gpu, bytes)?, gpu, meshes, built: Vec::new(), _positions: positions })
    }
}

impl RowRun for BlasBuilds {
    fn sample(&mut self) -> Result<Sample, Failure> {
        self.built.clear();
        let submit = || {
            let mut graph = Graph::default();
            let scratch = graph.bind_resource(&self.scratch);
            let mut address = self.scratch.device_address();
            let mut builds = Vec::with_capacity(self.meshes.len());
            for mesh in &self.meshes {
                let blas = structure(&self.gpu, mesh)?;
                builds.push((graph.bind_resource(&blas), address, mesh.clone()));
                address += scratch_bytes(&self.gpu, mesh);
                self.built.push(blas);
            }
            let mut cmd =
                graph.begin_cmd().resource_access(scratch, AccessType::AccelerationStructureBufferWrite);
            for (node, ..) in &builds {
                cmd.set_resource_access(*node, AccessType::AccelerationStructureBuildWrite);
            }
            cmd.record_cmd(move |cmd| {
                let info = |(node, address, mesh)| BuildAccelerationStructureInfo::new(node, address, mesh);
                let infos: Vec<_> = builds.into_iter().map(info).collect();
                cmd.build_accel_struct(&infos);
            });
            self.gpu.submit(graph)
        };
        Sample::take(submit, wait)
    }
}

/// A TLAS whose instances the host writes anew for each build, into a buffer of the pool.
pub(super) struct TlasBuild {
    gpu: Gpu,
    blas: Arc<AccelerationStructure>,
    tlas: Arc<AccelerationStructure>,
    scratch: Arc<Buffer>,
    count: u32,
    turn: u32,
    _positions: Arc<Buffer>,
}

impl TlasBuild {
    pub(super) fn new(mut gpu: Gpu, work: &Workload) -> Result<Self, Failure> {
        needs_acceleration_structures(&gpu)?;
        let positions = positions(&gpu, work, 0)?;
        let mesh = triangles(&positions, None, 3 * work.mesh_triangles, work.mesh_triangles);
        let blas = structure(&gpu, &mesh)?;
        let records = gpu.buffer(64, INPUT)?;
        let all = instances(&records, work.instances);
        let tlas = structure(&gpu, &all)?;
        let scratch = scratch(&gpu, scratch_bytes(&gpu, &all).max(scratch_bytes(&gpu, &mesh)))?;
        let mut graph = Graph::default();
        build(&mut graph, &blas, mesh, &scratch, 0);
        gpu.run(graph)?;
        Ok(Self { gpu, blas, tlas, scratch, count: work.instances, turn: 0, _positions: positions })
    }
}

impl RowRun for TlasBuild {
    fn sample(&mut self) -> Result<Sample, Failure> {
        self.turn += 1;
        let submit = || {
            let usage = INPUT | vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS;
            let info = BufferInfo::host_mem(64 * u64::from(self.count), usage);
            let mut records = self.gpu.pool.resource(info)?;
            let (bytes, _) = Buffer::mapped_slice_mut(&mut records).as_chunks_mut::<64>();
            for (number, bytes) in (0..self.count).zip(bytes) {
                let transform = Workload::instance_transform(number, self.turn);
                let record = record(transform, &self.blas);
                bytes.copy_from_slice(AccelerationStructure::instance_slice(&[record]));
            }
            let all = instances(&records, self.count);
            let mut graph = Graph::default();
            let records = graph.bind_resource(records);
            let (scratch, tlas) = (graph.bind_resource(&self.scratch), graph.bind_resource(&self.tlas));
            let blas = graph.bind_resource(&self.blas);
            let address = self.scratch.device_address();
            graph
                .begin_cmd()
                .resource_access(records, AccessType::AccelerationStructureBuildRead)
                .resource_access(blas, AccessType::AccelerationStructureBuildRead)
                .resource_access(scratch, AccessType::AccelerationStructureBufferWrite)
                .resource_access(tlas, AccessType::AccelerationStructureBuildWrite)
                .record_cmd(move |cmd| {
                    cmd.build_accel_struct(&[BuildAccelerationStructureInfo::new(tlas, address, all)]);
                });
            self.gpu.submit(graph)
        };
        Sample::take(submit, wait)
    }
}

fn positions(gpu: &Gpu, work: &Workload, number: u32) -> Result<Arc<Buffer>, Failure> {
    gpu.buffer_with(bytemuck::cast_slice(&work.mesh_positions(number)), INPUT)
}
