//! Builds of acceleration structures.

use lvk_bench::peers::{Failure, RowRun, Sample, Workload};

use super::device::Gpu;

/// A mesh that a BLAS is built from.
pub(super) struct Mesh {
    pub(super) positions: wgpu::Buffer,
    pub(super) indices: Option<wgpu::Buffer>,
    pub(super) size: wgpu::BlasTriangleGeometrySizeDescriptor,
}

impl Mesh {
    fn new(gpu: &Gpu, work: &Workload, number: u32) -> Self {
        let positions = work.mesh_positions(number);
        let size = geometry_size(positions.len() as u32, None);
        let positions = gpu.buffer(bytemuck::cast_slice(&positions), wgpu::BufferUsages::BLAS_INPUT);
        Self { positions, indices: None, size }
    }

    /// Creates a BLAS. Does not build it.
    pub(super) fn blas(&self, gpu: &Gpu) -> wgpu::Blas {
        let desc = wgpu::CreateBlasDescriptor {
            label: None,
            flags: wgpu::AccelerationStructureFlags::PREFER_FAST_TRACE,
            update_mode: wgpu::AccelerationStructureUpdateMode::Build,
        };
        let descriptors = vec![self.size.clone()];
        gpu.device.create_blas(&desc, wgpu::BlasGeometrySizeDescriptors::Triangles { descriptors })
    }

    /// Returns the build of a BLAS.
    pub(super) fn build<'a>(&'a self, blas: &'a wgpu::Blas) -> wgpu::BlasBuildEntry<'a> {
        let geometry = wgpu::BlasTriangleGeometry {
            size: &self.size,
            vertex_buffer: &self.positions,
            first_vertex: 0,
            vertex_stride: 12,
            index_buffer: self.indices.as_ref(),
            first_index: self.indices.as_ref().map(|_| 0),
            transform_buffer: None,
            transform_buffer_offset: None,
        };
        wgpu::BlasBuildEntry { blas, geometry: wgpu::BlasGeometries::TriangleGeometries(vec![geometry]) }
    }
}

/// Returns the size of a mesh.
pub(super) fn geometry_size(
    vertex_count: u32,
    index_count: Option<u32>,
) -> wgpu::BlasTriangleGeometrySizeDescriptor {
    wgpu::BlasTriangleGeometrySizeDescriptor {
        vertex_format: wgpu::VertexFormat::Float32x3,
        vertex_count,
        index_format: index_count.map(|_| wgpu::IndexFormat::Uint32),
        index_count,
        flags: wgpu::AccelerationStructureGeometryFlags::OPAQUE,
    }
}

/// Creates a TLAS for so many instances.
pub(super) fn tlas(gpu: &Gpu, max_instances: u32) -> wgpu::Tlas {
    gpu.device.create_tlas(&wgpu::CreateTlasDescriptor {
        label: None,
        max_instances,
        flags: wgpu::AccelerationStructureFlags::PREFER_FAST_TRACE,
        update_mode: wgpu::AccelerationStructureUpdateMode::Build,
    })
}

/// BLAS of many meshes.
pub(super) struct BlasBuilds {
    gpu: Gpu,
    meshes: Vec<Mesh>,
    built: Vec<wgpu::Blas>,
}

impl BlasBuilds {
    pub(super) fn new(gpu: Gpu, work: &Workload) -> Result<Self, Failure> {
        gpu.needs_ray_query()?;
        let meshes = (0..work.meshes).map(|number| Mesh::new(&gpu, work, number)).collect();
        let submission = gpu.queue.submit([]);
        gpu.wait(submission)?;
        Ok(Self { gpu, meshes, built: Vec::new() })
    }
}

impl RowRun for BlasBuilds {
    fn sample(&mut self) -> Result<Sample, Failure> {
        self.built.clear();
        self.gpu.device.poll(wgpu::PollType::wait_indefinitely())?;
        let submit = || {
            self.built.extend(self.meshes.iter().map(|mesh| mesh.blas(&self.gpu)));
            let builds: Vec<_> =
                self.meshes.iter().zip(&self.built).map(|(mesh, blas)| mesh.build(blas)).collect();
            let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
            encoder.build_acceleration_structures(&builds, []);
            Ok(self.gpu.queue.submit([encoder.finish()]))
        };
        Sample::take(submit, |submission| self.gpu.wait(submission))
    }
}

/// A TLAS whose instances the host writes anew for each build.
pub(super) struct TlasBuild {
    gpu: Gpu,
    blas: wgpu::Blas,
    tlas: wgpu::Tlas,
    count: u32,
    turn: u32,
}

impl TlasBuild {
    pub(super) fn new(gpu: Gpu, work: &Workload) -> Result<Self, Failure> {
        gpu.needs_ray_query()?;
        let mesh = Mesh::new(&gpu, work, 0);
        let (blas, tlas) = (mesh.blas(&gpu), tlas(&gpu, work.instances));
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        encoder.build_acceleration_structures(&[mesh.build(&blas)], []);
        let submission = gpu.queue.submit([encoder.finish()]);
        gpu.wait(submission)?;
        Ok(Self { gpu, blas, tlas, count: work.instances, turn: 0 })
    }
}

impl RowRun for TlasBuild {
    fn sample(&mut self) -> Result<Sample, Failure> {
        self.turn += 1;
        let submit = || {
            let all = 0..self.count as usize;
            let instances = self.tlas.get_mut_slice(all).ok_or("the TLAS has no such instances")?;
            for (number, instance) in (0..).zip(instances) {
                let transform = Workload::instance_transform(number, self.turn);
                *instance = Some(wgpu::TlasInstance::new(&self.blas, transform, 0, 0xff));
            }
            let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
            encoder.build_acceleration_structures([], [&self.tlas]);
            Ok(self.gpu.queue.submit([encoder.finish()]))
        };
        Sample::take(submit, |submission| self.gpu.wait(submission))
    }
}
