//! Frames of primary rays.

use std::sync::Arc;

use vk_graph::Graph;
use vk_graph::driver::ash::vk;
use vk_graph::driver::buffer::{Buffer, BufferInfo};
use vk_graph::driver::compute::{ComputePipeline, ComputePipelineInfo};
use vk_graph::driver::ray_tracing::{RayTracingPipeline, RayTracingPipelineInfo, RayTracingShaderGroup};
use vk_graph::driver::sync::AccessType;

use lvk_bench::peers::{
    Failure, GlslStage, RAY_CLOSEST_HIT, RAY_GENERATION, RAY_MISS, RAY_QUERY, RayScene, RayView, RowRun,
    Sample, Workload, ray_result,
};

use super::device::{Gpu, shader, wait};
use super::scene::{SceneStructures, needs_acceleration_structures};

/// Primary rays by ray queries.
pub(super) struct RayQueryFrame {
    gpu: Gpu,
    pipeline: ComputePipeline,
    scene: SceneStructures,
    hits: Arc<Buffer>,
    view: RayView,
    size: [u32; 2],
}

impl RayQueryFrame {
    pub(super) fn new(mut gpu: Gpu, work: &Workload) -> Result<Self, Failure> {
        if !gpu.device.physical.vk_khr_ray_query {
            return Err("the device has no ray queries".into());
        }
        let shader = shader(GlslStage::Compute, RAY_QUERY)?;
        let pipeline = ComputePipeline::create(&gpu.device, ComputePipelineInfo::default(), shader)?;
        let scene = RayScene::new(work)?;
        let structures = SceneStructures::new(&mut gpu, &scene)?;
        let hits = hits(&gpu, work)?;
        Ok(Self { gpu, pipeline, scene: structures, hits, view: scene.view, size: work.image })
    }
}

impl RowRun for RayQueryFrame {
    fn sample(&mut self) -> Result<Sample, Failure> {
        let submit = || {
            let mut graph = Graph::default();
            let (blas, tlas) = (graph.bind_resource(&self.scene.blas), graph.bind_resource(&self.scene.tlas));
            let hits = graph.bind_resource(&self.hits);
            let (view, [x, y]) = (self.view, self.size.map(|side| side.div_ceil(8)));
            graph
                .begin_cmd()
                .bind_pipeline(&self.pipeline)
                .resource_access(blas, AccessType::AnyShaderReadOther)
                .shader_resource_access(0, tlas, AccessType::AnyShaderReadOther)
                .shader_resource_access(1, hits, AccessType::ComputeShaderWrite)
                .record_cmd(move |cmd| {
                    cmd.push_constants(0, bytemuck::bytes_of(&view)).dispatch(x, y, 1);
                });
            self.gpu.submit(graph)
        };
        Sample::take(submit, wait)
    }

    fn result(&mut self) -> Result<Option<f64>, Failure> {
        read(&mut self.gpu, &self.hits, self.size)
    }
}

/// Primary rays by a ray tracing pipeline.
pub(super) struct RayPipelineFrame {
    gpu: Gpu,
    pipeline: RayTracingPipeline,
    sbt: Arc<Buffer>,
    /// Ray generation, miss, hit and callable shaders.
    tables: [vk::StridedDeviceAddressRegionKHR; 4],
    scene: SceneStructures,
    hits: Arc<Buffer>,
    view: RayView,
    size: [u32; 2],
}

impl RayPipelineFrame {
    pub(super) fn new(mut gpu: Gpu, work: &Workload) -> Result<Self, Failure> {
        needs_acceleration_structures(&gpu)?;
        let shaders = [
            shader(GlslStage::RayGen, RAY_GENERATION)?,
            shader(GlslStage::Miss, RAY_MISS)?,
            shader(GlslStage::ClosestHit, RAY_CLOSEST_HIT)?,
        ];
        let groups = [
            RayTracingShaderGroup::new_general(0),
            RayTracingShaderGroup::new_general(1),
            RayTracingShaderGroup::new_triangles(2, None),
        ];
        let info = RayTracingPipelineInfo { max_ray_recursion_depth: 1, ..Default::default() };
        let pipeline = RayTracingPipeline::create(&gpu.device, info, shaders, groups)?;
        let (sbt, tables) = tables(&gpu, &pipeline)?;
        let scene = RayScene::new(work)?;
        let structures = SceneStructures::new(&mut gpu, &scene)?;
        let hits = hits(&gpu, work)?;
        Ok(Self { gpu, pipeline, sbt, tables, scene: structures, hits, view: scene.view, size: work.image })
    }
}

impl RowRun for RayPipelineFrame {
    fn sample(&mut self) -> Result<Sample, Failure> {
        let submit = || {
            let mut graph = Graph::default();
            let (blas, tlas) = (graph.bind_resource(&self.scene.blas), graph.bind_resource(&self.scene.tlas));
            let (hits, sbt) = (graph.bind_resource(&self.hits), graph.bind_resource(&self.sbt));
            let (view, [width, height]) = (self.view, self.size);
            let [ray_gen, miss, hit, callable] = self.tables;
            let access = AccessType::RayTracingShaderReadAccelerationStructure;
            graph
                .begin_cmd()
                .bind_pipeline(&self.pipeline)
                .resource_access(blas, access)
                .resource_access(sbt, AccessType::RayTracingShaderReadOther)
                .shader_resource_access(0, tlas, access)
                .shader_resource_access(1, hits, AccessType::AnyShaderWrite)
                .record_cmd(move |cmd| {
                    cmd.push_constants(0, bytemuck::bytes_of(&view));
                    cmd.trace_rays(&ray_gen, &miss, &hit, &callable, width, height, 1);
                });
            self.gpu.submit(graph)
        };
        Sample::take(submit, wait)
    }

    fn result(&mut self) -> Result<Option<f64>, Failure> {
        read(&mut self.gpu, &self.hits, self.size)
    }
}

/// Creates the buffer of hits: eight bytes for each pixel.
fn hits(gpu: &Gpu, work: &Workload) -> Result<Arc<Buffer>, Failure> {
    let bytes = 8 * u64::from(work.image[0]) * u64::from(work.image[1]);
    gpu.buffer(bytes, vk::BufferUsageFlags::STORAGE_BUFFER | vk::BufferUsageFlags::TRANSFER_SRC)
}

fn read(gpu: &mut Gpu, hits: &Arc<Buffer>, [width, height]: [u32; 2]) -> Result<Option<f64>, Failure> {
    Ok(Some(ray_result(&gpu.read(hits, 8 * u64::from(width) * u64::from(height))?)))
}

/// Creates the shader binding table: each group at an address of the base alignment.
fn tables(
    gpu: &Gpu,
    pipeline: &RayTracingPipeline,
) -> Result<(Arc<Buffer>, [vk::StridedDeviceAddressRegionKHR; 4]), Failure> {
    const GROUPS: usize = 3;
    let limits = gpu.device.physical.vk_khr_ray_tracing_pipeline.as_ref();
    let limits = &limits.ok_or("the device has no ray tracing pipelines")?.properties;
    let base = limits.shader_group_base_alignment;
    let handle = limits.shader_group_handle_size;
    let step = handle.next_multiple_of(base) as usize;
    let usage = vk::BufferUsageFlags::SHADER_BINDING_TABLE_KHR | vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS;
    let info = BufferInfo::host_mem((GROUPS * step) as u64, usage).into_builder().alignment(base.into());
    let mut sbt = Buffer::create(&gpu.device, info)?;
    let mapped = Buffer::mapped_slice_mut(&mut sbt);
    for group in 0..GROUPS {
        let bytes = pipeline.group_handle(group);
        mapped[group * step..][..bytes.len()].copy_from_slice(bytes);
    }
    let first = sbt.device_address();
    let region = |group: usize| vk::StridedDeviceAddressRegionKHR {
        device_address: first + (group * step) as u64,
        stride: handle.into(),
        size: handle.into(),
    };
    let tables = [region(0), region(1), region(2), vk::StridedDeviceAddressRegionKHR::default()];
    Ok((Arc::new(sbt), tables))
}
