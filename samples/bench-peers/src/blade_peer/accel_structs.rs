//! Builds of acceleration structures.

use blade_graphics as gpu;
use lvk_bench::peers::{Failure, RowRun, Sample, Workload};

use super::device::Gpu;

/// BLAS of many meshes.
pub(super) struct BlasBuilds {
    gpu: Gpu,
    meshes: Vec<gpu::AccelerationStructureMesh>,
    built: Vec<gpu::AccelerationStructure>,
    scratch: gpu::Buffer,
}

impl BlasBuilds {
    pub(super) fn new(gpu: Gpu, work: &Workload) -> Result<Self, Failure> {
        gpu.needs_ray_query()?;
        let meshes =
            (0..work.meshes).map(|number| mesh(&gpu, work, number)).collect::<Result<Vec<_>, _>>()?;
        let bytes = meshes.iter().map(|mesh| sizes(&gpu, mesh).scratch).sum();
        let scratch = gpu.buffer(bytes, gpu::Memory::Device);
        Ok(Self { gpu, meshes, built: Vec::new(), scratch })
    }
}

impl RowRun for BlasBuilds {
    fn sample(&mut self) -> Result<Sample, Failure> {
        let gpu = &mut self.gpu;
        self.built.drain(..).for_each(|blas| gpu.context.destroy_acceleration_structure(blas));
        let submit = || {
            let sizes: Vec<_> = self.meshes.iter().map(|mesh| sizes(gpu, mesh)).collect();
            self.built.extend(sizes.iter().map(|sizes| blas(gpu, sizes)));
            gpu.encoder.start();
            let mut pass = gpu.encoder.acceleration_structure("BLAS");
            let mut offset = 0;
            for ((mesh, blas), sizes) in self.meshes.iter().zip(&self.built).zip(&sizes) {
                pass.build_bottom_level(*blas, std::slice::from_ref(mesh), self.scratch.at(offset));
                offset += sizes.scratch;
            }
            drop(pass);
            let point = gpu.submit();
            Ok((gpu, point))
        };
        Sample::take(submit, |(gpu, point)| gpu.wait(&point))
    }
}

/// A TLAS whose instances the host writes anew for each build, into the buffer that blade creates for them.
pub(super) struct TlasBuild {
    gpu: Gpu,
    blas: gpu::AccelerationStructure,
    tlas: gpu::AccelerationStructure,
    scratch: gpu::Buffer,
    instances: Vec<gpu::AccelerationStructureInstance>,
    records: Option<gpu::Buffer>,
    turn: u32,
}

impl TlasBuild {
    pub(super) fn new(mut gpu: Gpu, work: &Workload) -> Result<Self, Failure> {
        gpu.needs_ray_query()?;
        let mesh = mesh(&gpu, work, 0)?;
        let blas = build_blas(&mut gpu, &mesh)?;
        let (tlas, scratch) = tlas(&gpu, work.instances);
        let instances = vec![gpu::AccelerationStructureInstance::default(); work.instances as usize];
        Ok(Self { gpu, blas, tlas, scratch, instances, records: None, turn: 0 })
    }
}

impl RowRun for TlasBuild {
    fn sample(&mut self) -> Result<Sample, Failure> {
        self.turn += 1;
        let gpu = &mut self.gpu;
        if let Some(records) = self.records.take() {
            gpu.context.destroy_buffer(records);
        }
        let submit = || {
            for (number, instance) in (0..).zip(&mut self.instances) {
                let rows = Workload::instance_transform(number, self.turn);
                let row =
                    |first: usize| [rows[first], rows[first + 1], rows[first + 2], rows[first + 3]].into();
                instance.transform = gpu::Transform { x: row(0), y: row(4), z: row(8) };
            }
            let blas = [self.blas];
            let records = gpu.context.create_acceleration_structure_instance_buffer(&self.instances, &blas);
            self.records = Some(records);
            gpu.encoder.start();
            let mut pass = gpu.encoder.acceleration_structure("TLAS");
            let count = self.instances.len() as u32;
            pass.build_top_level(self.tlas, &blas, count, records.into(), self.scratch.into());
            drop(pass);
            let point = gpu.submit();
            Ok((gpu, point))
        };
        Sample::take(submit, |(gpu, point)| gpu.wait(&point))
    }
}

fn mesh(gpu: &Gpu, work: &Workload, number: u32) -> Result<gpu::AccelerationStructureMesh, Failure> {
    let positions = work.mesh_positions(number);
    let vertices = gpu.buffer_with(bytemuck::cast_slice(&positions), gpu::Memory::Shared)?;
    // Without indices, blade 0.9 passes a null index buffer of 16-bit indices.
    let indices = gpu.buffer_with(bytemuck::cast_slice(&work.mesh_indices()), gpu::Memory::Shared)?;
    Ok(gpu::AccelerationStructureMesh {
        vertex_data: vertices.into(),
        vertex_format: gpu::VertexFormat::F32Vec3,
        vertex_stride: 12,
        vertex_count: positions.len() as u32,
        index_data: indices.into(),
        index_type: Some(gpu::IndexType::U32),
        triangle_count: work.mesh_triangles,
        transform_data: gpu::Buffer::default().into(),
        is_opaque: true,
    })
}

/// Returns the sizes of a BLAS. That of scratch memory is a multiple of its alignment.
fn sizes(gpu: &Gpu, mesh: &gpu::AccelerationStructureMesh) -> gpu::AccelerationStructureSizes {
    let sizes = gpu.context.get_bottom_level_acceleration_structure_sizes(std::slice::from_ref(mesh));
    gpu::AccelerationStructureSizes {
        scratch: sizes.scratch.next_multiple_of(gpu::limits::ACCELERATION_STRUCTURE_SCRATCH_ALIGNMENT),
        ..sizes
    }
}

fn blas(gpu: &Gpu, sizes: &gpu::AccelerationStructureSizes) -> gpu::AccelerationStructure {
    let ty = gpu::AccelerationStructureType::BottomLevel;
    let desc = gpu::AccelerationStructureDesc { name: "", ty, size: sizes.data, updatable: false };
    gpu.context.create_acceleration_structure(desc)
}

/// Builds the BLAS of a mesh.
pub(super) fn build_blas(
    gpu: &mut Gpu,
    mesh: &gpu::AccelerationStructureMesh,
) -> Result<gpu::AccelerationStructure, Failure> {
    let sizes = sizes(gpu, mesh);
    let blas = blas(gpu, &sizes);
    let scratch = gpu.buffer(sizes.scratch, gpu::Memory::Device);
    gpu.encoder.start();
    let mut pass = gpu.encoder.acceleration_structure("BLAS");
    pass.build_bottom_level(blas, std::slice::from_ref(mesh), scratch.into());
    drop(pass);
    let point = gpu.submit();
    gpu.wait(&point)?;
    Ok(blas)
}

/// Creates a TLAS for so many instances, and its scratch memory.
pub(super) fn tlas(gpu: &Gpu, count: u32) -> (gpu::AccelerationStructure, gpu::Buffer) {
    let sizes = gpu.context.get_top_level_acceleration_structure_sizes(count);
    let ty = gpu::AccelerationStructureType::TopLevel;
    let desc = gpu::AccelerationStructureDesc { name: "", ty, size: sizes.data, updatable: false };
    let tlas = gpu.context.create_acceleration_structure(desc);
    (tlas, gpu.buffer(sizes.scratch, gpu::Memory::Device))
}
