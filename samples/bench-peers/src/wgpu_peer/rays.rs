//! Frames of primary rays by ray queries.

use lvk_bench::peers::{Failure, RayScene, RayView, RowRun, Sample, Workload, ray_result};

use super::accel_structs::{Mesh, geometry_size, tlas};
use super::compute::compute_pipeline;
use super::device::Gpu;
use crate::wgsl;

const INPUTS: &str = "
    var<immediate> view: View;
    @group(0) @binding(0) var scene: acceleration_structure;
    @group(0) @binding(1) var<storage, read_write> hits: array<Hit>;";

/// A frame of primary rays.
pub(super) struct RayFrame {
    gpu: Gpu,
    pipeline: wgpu::ComputePipeline,
    group: wgpu::BindGroup,
    hits: wgpu::Buffer,
    view: RayView,
    size: [u32; 2],
    _tlas: wgpu::Tlas,
}

impl RayFrame {
    pub(super) fn new(gpu: Gpu, work: &Workload) -> Result<Self, Failure> {
        gpu.needs_ray_query()?;
        let scene = RayScene::new(work)?;
        let tlas = build_scene(&gpu, &scene)?;
        let hits = gpu.storage(8 * u64::from(work.image[0]) * u64::from(work.image[1]));
        let group_layout = group_layout(&gpu);
        let layout = gpu.layout(&[Some(&group_layout)], size_of::<RayView>() as u32);
        let text = [wgsl::RAY_TYPES, INPUTS, wgsl::RAYS].concat();
        let pipeline = compute_pipeline(&gpu, Some(&layout), &text, "trace");
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &group_layout,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: tlas.as_binding() },
                wgpu::BindGroupEntry { binding: 1, resource: hits.as_entire_binding() },
            ],
        });
        Ok(Self { gpu, pipeline, group, hits, view: scene.view, size: work.image, _tlas: tlas })
    }
}

impl RowRun for RayFrame {
    fn sample(&mut self) -> Result<Sample, Failure> {
        let submit = || {
            let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, &self.group, &[]);
            pass.set_immediates(0, bytemuck::bytes_of(&self.view));
            pass.dispatch_workgroups(self.size[0].div_ceil(8), self.size[1].div_ceil(8), 1);
            drop(pass);
            Ok(self.gpu.queue.submit([encoder.finish()]))
        };
        Sample::take(submit, |submission| self.gpu.wait(submission))
    }

    fn result(&mut self) -> Result<Option<f64>, Failure> {
        Ok(Some(ray_result(&self.gpu.read_buffer(&self.hits, self.hits.size())?)))
    }
}

fn group_layout(gpu: &Gpu) -> wgpu::BindGroupLayout {
    let entry = |binding, ty| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::COMPUTE,
        ty,
        count: None,
    };
    let storage = wgpu::BindingType::Buffer {
        ty: wgpu::BufferBindingType::Storage { read_only: false },
        has_dynamic_offset: false,
        min_binding_size: None,
    };
    gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: None,
        entries: &[
            entry(0, wgpu::BindingType::AccelerationStructure { vertex_return: false }),
            entry(1, storage),
        ],
    })
}

/// Builds a BLAS of all triangles, and a TLAS with one instance.
fn build_scene(gpu: &Gpu, scene: &RayScene) -> Result<wgpu::Tlas, Failure> {
    let input = |bytes| gpu.buffer(bytes, wgpu::BufferUsages::BLAS_INPUT);
    let mesh = Mesh {
        positions: input(bytemuck::cast_slice(&scene.positions)),
        indices: Some(input(bytemuck::cast_slice(&scene.triangles))),
        size: geometry_size(scene.positions.len() as u32, Some(3 * scene.triangles.len() as u32)),
    };
    let (blas, mut tlas) = (mesh.blas(gpu), tlas(gpu, 1));
    let identity = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let instance = tlas.get_mut_single(0).ok_or("the TLAS has no instance")?;
    *instance = Some(wgpu::TlasInstance::new(&blas, identity, 0, 0xff));
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    encoder.build_acceleration_structures(&[mesh.build(&blas)], [&tlas]);
    let submission = gpu.queue.submit([encoder.finish()]);
    gpu.wait(submission)?;
    Ok(tlas)
}
