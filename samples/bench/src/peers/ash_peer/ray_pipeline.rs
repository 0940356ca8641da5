//! Primary rays by a ray tracing pipeline.

use lvk::ash::vk;

use super::commands::Commands;
use super::device::Device;
use super::memory::Buffer;
use super::pipelines::{Layout, Pipeline, module, write_buffer};
use super::ray_query::{DESCRIPTORS, hits};
use super::ray_structures::{SceneStructures, write_tlas};
use crate::peers::glsl::{GlslStage, RAY_CLOSEST_HIT, RAY_GENERATION, RAY_MISS};
use crate::peers::peer::{Failure, RowRun, Sample};
use crate::peers::ray_scene::{RayScene, RayView, ray_result};
use crate::peers::workload::Workload;

/// A frame of primary rays.
pub(super) struct RayPipelineFrame {
    device: Device,
    commands: Commands,
    pipeline: Pipeline,
    /// Ray generation, miss, hit and callable shaders.
    tables: [vk::StridedDeviceAddressRegionKHR; 4],
    hits: Buffer,
    view: RayView,
    size: [u32; 2],
    _sbt: Buffer,
    _scene: SceneStructures,
}

impl RayPipelineFrame {
    pub(super) fn new(device: Device, work: &Workload) -> Result<Self, Failure> {
        device.tracing()?;
        let layout = Layout::new(&device, size_of::<RayView>() as u32, &DESCRIPTORS)?;
        let pipeline = pipeline(&device, layout)?;
        let (sbt, tables) = tables(&device, pipeline.raw)?;
        let mut commands = Commands::new(&device)?;
        let scene = RayScene::new(work)?;
        let structures = SceneStructures::new(&device, &mut commands, &scene)?;
        let hits = hits(&device, work)?;
        let set = pipeline.set.ok_or("no descriptor set")?;
        write_tlas(&device, set, structures.tlas.raw);
        write_buffer(&device, set, 1, hits.raw);
        Ok(Self {
            device,
            commands,
            pipeline,
            tables,
            hits,
            view: scene.view,
            size: work.image,
            _sbt: sbt,
            _scene: structures,
        })
    }
}

impl RowRun for RayPipelineFrame {
    fn sample(&mut self) -> Result<Sample, Failure> {
        let (device, commands) = (&self.device, &mut self.commands);
        let submit = || {
            let list = commands.begin(device)?;
            let point = vk::PipelineBindPoint::RAY_TRACING_KHR;
            self.pipeline.bind(device, list, point, bytemuck::bytes_of(&self.view));
            let ([ray_gen, miss, hit, callable], [width, height]) = (&self.tables, self.size);
            let tracing = device.tracing()?;
            // SAFETY: pipeline and set are bound, and the tables are those of the pipeline.
            unsafe { tracing.cmd_trace_rays(list, ray_gen, miss, hit, callable, width, height, 1) };
            commands.submit(device)?;
            Ok(commands)
        };
        Sample::take(submit, |commands| commands.wait(device))
    }

    fn result(&mut self) -> Result<Option<f64>, Failure> {
        let bytes = 8 * self.size[0] as usize * self.size[1] as usize;
        Ok(Some(ray_result(&self.hits.read(&self.device, &mut self.commands, bytes)?)))
    }
}

/// Creates the pipeline. Its groups are ray generation, miss and hit.
fn pipeline(device: &Device, layout: Layout) -> Result<Pipeline, Failure> {
    let stage = |stage, module| {
        vk::PipelineShaderStageCreateInfo::default().stage(stage).module(module).name(c"main")
    };
    let stages = [
        stage(vk::ShaderStageFlags::RAYGEN_KHR, module(device, GlslStage::RayGen, RAY_GENERATION)?),
        stage(vk::ShaderStageFlags::MISS_KHR, module(device, GlslStage::Miss, RAY_MISS)?),
        stage(vk::ShaderStageFlags::CLOSEST_HIT_KHR, module(device, GlslStage::ClosestHit, RAY_CLOSEST_HIT)?),
    ];
    let unused = vk::SHADER_UNUSED_KHR;
    let general = |shader| {
        let group = vk::RayTracingShaderGroupCreateInfoKHR::default();
        let group = group.ty(vk::RayTracingShaderGroupTypeKHR::GENERAL).general_shader(shader);
        group.closest_hit_shader(unused).any_hit_shader(unused).intersection_shader(unused)
    };
    let hit = general(unused).ty(vk::RayTracingShaderGroupTypeKHR::TRIANGLES_HIT_GROUP).closest_hit_shader(2);
    let groups = [general(0), general(1), hit];
    let info = [vk::RayTracingPipelineCreateInfoKHR::default()
        .stages(&stages)
        .groups(&groups)
        .max_pipeline_ray_recursion_depth(1)
        .layout(layout.raw)];
    let (operation, cache) = (vk::DeferredOperationKHR::null(), vk::PipelineCache::null());
    // SAFETY: modules and layout fit each other.
    let made = unsafe { device.tracing()?.create_ray_tracing_pipelines(operation, cache, &info, None) };
    let raw = made.map_err(|(_, result)| result)?[0];
    Ok(Pipeline { raw, layout: layout.raw, set: layout.set })
}

/// Creates the shader binding table: each group at an address of the base alignment.
fn tables(
    device: &Device,
    pipeline: vk::Pipeline,
) -> Result<(Buffer, [vk::StridedDeviceAddressRegionKHR; 4]), Failure> {
    const GROUPS: usize = 3;
    let [handle, alignment, base] = device.sbt_limits();
    let stride = handle.next_multiple_of(alignment.max(1));
    let step = stride.next_multiple_of(base.max(1));
    // SAFETY: the pipeline has three groups.
    let handles = unsafe {
        let tracing = device.tracing()?;
        tracing.get_ray_tracing_shader_group_handles(pipeline, 0, GROUPS as u32, GROUPS * handle)
    }?;
    let usage = vk::BufferUsageFlags::SHADER_BINDING_TABLE_KHR;
    let mut sbt = Buffer::with_bytes(device, &vec![0; (GROUPS + 1) * step], usage)?;
    let first = sbt.address.next_multiple_of(step as u64);
    let skipped = (first - sbt.address) as usize;
    let mapped = sbt.mapped()?;
    for (group, bytes) in handles.chunks(handle).enumerate() {
        mapped[skipped + group * step..][..handle].copy_from_slice(bytes);
    }
    let region = |group: usize| vk::StridedDeviceAddressRegionKHR {
        device_address: first + (group * step) as u64,
        stride: stride as u64,
        size: stride as u64,
    };
    Ok((sbt, [region(0), region(1), region(2), vk::StridedDeviceAddressRegionKHR::default()]))
}
