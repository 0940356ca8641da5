//! Primary rays by ray queries.

use gpu_allocator::MemoryLocation;
use lvk::ash::vk;

use super::commands::Commands;
use super::device::Device;
use super::memory::Buffer;
use super::pipelines::{Layout, Pipeline, write_buffer};
use super::ray_structures::{SceneStructures, write_tlas};
use crate::peers::glsl::RAY_QUERY;
use crate::peers::peer::{Failure, RowRun, Sample};
use crate::peers::ray_scene::{RayScene, RayView, ray_result};
use crate::peers::workload::Workload;

/// Descriptors of both frames of rays: the TLAS and the hits.
pub(super) const DESCRIPTORS: [(vk::DescriptorType, u32); 2] =
    [(vk::DescriptorType::ACCELERATION_STRUCTURE_KHR, 1), (vk::DescriptorType::STORAGE_BUFFER, 1)];

/// A frame of primary rays.
pub(super) struct RayQueryFrame {
    device: Device,
    commands: Commands,
    pipeline: Pipeline,
    hits: Buffer,
    view: RayView,
    size: [u32; 2],
    _scene: SceneStructures,
}

impl RayQueryFrame {
    pub(super) fn new(device: Device, work: &Workload) -> Result<Self, Failure> {
        if !device.has_ray_query {
            return Err("the device has no ray queries".into());
        }
        let layout = Layout::new(&device, size_of::<RayView>() as u32, &DESCRIPTORS)?;
        let pipeline = Pipeline::compute(&device, layout, RAY_QUERY)?;
        let mut commands = Commands::new(&device)?;
        let scene = RayScene::new(work)?;
        let structures = SceneStructures::new(&device, &mut commands, &scene)?;
        let hits = hits(&device, work)?;
        let set = pipeline.set.ok_or("no descriptor set")?;
        write_tlas(&device, set, structures.tlas.raw);
        write_buffer(&device, set, 1, hits.raw);
        let size = work.image;
        Ok(Self { device, commands, pipeline, hits, view: scene.view, size, _scene: structures })
    }
}

impl RowRun for RayQueryFrame {
    fn sample(&mut self) -> Result<Sample, Failure> {
        let (device, commands) = (&self.device, &mut self.commands);
        let submit = || {
            let list = commands.begin(device)?;
            let point = vk::PipelineBindPoint::COMPUTE;
            self.pipeline.bind(device, list, point, bytemuck::bytes_of(&self.view));
            let [x, y] = self.size.map(|side| side.div_ceil(8));
            // SAFETY: pipeline and set are bound.
            unsafe { device.raw.cmd_dispatch(list, x, y, 1) };
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

/// Creates the buffer of hits: eight bytes for each pixel.
pub(super) fn hits(device: &Device, work: &Workload) -> Result<Buffer, Failure> {
    let bytes = 8 * u64::from(work.image[0]) * u64::from(work.image[1]);
    let usage = vk::BufferUsageFlags::STORAGE_BUFFER | vk::BufferUsageFlags::TRANSFER_SRC;
    Buffer::new(device, bytes, usage, MemoryLocation::GpuOnly)
}
