//! Frames of primary rays by ray queries.

use blade_graphics as gpu;
use lvk_bench::peers::{Failure, RayScene, RowRun, Sample, Workload, ray_result};

use super::accel_structs::{build_blas, tlas};
use super::bindings::Rays;
use super::compute::compute_pipeline;
use super::device::Gpu;
use crate::wgsl;

const INPUTS: &str = "
    var<uniform> view: View;
    var scene: acceleration_structure;
    var<storage, read_write> hits: array<Hit>;";

/// A frame of primary rays.
pub(super) struct RayFrame {
    gpu: Gpu,
    pipeline: gpu::ComputePipeline,
    rays: Rays,
    size: [u32; 2],
}

impl RayFrame {
    pub(super) fn new(mut gpu: Gpu, work: &Workload) -> Result<Self, Failure> {
        gpu.needs_ray_query()?;
        let scene = RayScene::new(work)?;
        let tlas = build_scene(&mut gpu, &scene)?;
        let layout = <Rays as gpu::ShaderData>::layout();
        let text = [wgsl::RAY_TYPES, INPUTS, wgsl::RAYS].concat();
        let pipeline = compute_pipeline(&gpu, &layout, &text, "trace")?;
        let bytes = 8 * u64::from(work.image[0]) * u64::from(work.image[1]);
        let hits = gpu.buffer(bytes, gpu::Memory::Device);
        let rays = Rays { view: bytemuck::cast(scene.view), scene: tlas, hits: hits.into() };
        Ok(Self { gpu, pipeline, rays, size: work.image })
    }
}

impl RowRun for RayFrame {
    fn sample(&mut self) -> Result<Sample, Failure> {
        let gpu = &mut self.gpu;
        let submit = || {
            gpu.encoder.start();
            let mut pass = gpu.encoder.compute("rays");
            let mut pipeline = pass.with(&self.pipeline);
            pipeline.bind(0, &self.rays);
            pipeline.dispatch([self.size[0].div_ceil(8), self.size[1].div_ceil(8), 1]);
            drop(pass);
            let point = gpu.submit();
            Ok((gpu, point))
        };
        Sample::take(submit, |(gpu, point)| gpu.wait(&point))
    }

    fn result(&mut self) -> Result<Option<f64>, Failure> {
        let bytes = 8 * u64::from(self.size[0]) * u64::from(self.size[1]);
        Ok(Some(ray_result(&self.gpu.read(self.rays.hits.buffer, bytes)?)))
    }
}

/// Builds a BLAS of all triangles, and a TLAS with one instance.
fn build_scene(gpu: &mut Gpu, scene: &RayScene) -> Result<gpu::AccelerationStructure, Failure> {
    let positions = gpu.buffer_with(bytemuck::cast_slice(&scene.positions), gpu::Memory::Shared)?;
    let indices = gpu.buffer_with(bytemuck::cast_slice(&scene.triangles), gpu::Memory::Shared)?;
    let mesh = gpu::AccelerationStructureMesh {
        vertex_data: positions.into(),
        vertex_format: gpu::VertexFormat::F32Vec3,
        vertex_stride: 12,
        vertex_count: scene.positions.len() as u32,
        index_data: indices.into(),
        index_type: Some(gpu::IndexType::U32),
        triangle_count: scene.triangles.len() as u32,
        transform_data: gpu::Buffer::default().into(),
        is_opaque: true,
    };
    let blas = build_blas(gpu, &mesh)?;
    let (tlas, scratch) = tlas(gpu, 1);
    let instance = [gpu::AccelerationStructureInstance::default()];
    let records = gpu.context.create_acceleration_structure_instance_buffer(&instance, &[blas]);
    gpu.encoder.start();
    let mut pass = gpu.encoder.acceleration_structure("TLAS");
    pass.build_top_level(tlas, &[blas], 1, records.into(), scratch.into());
    drop(pass);
    let point = gpu.submit();
    gpu.wait(&point)?;
    Ok(tlas)
}
