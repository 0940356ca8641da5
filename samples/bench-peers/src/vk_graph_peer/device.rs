//! Device and pool.

use std::sync::Arc;

use vk_graph::Graph;
use vk_graph::driver::ash::vk;
use vk_graph::driver::buffer::{Buffer, BufferInfo};
use vk_graph::driver::device::{Device, DeviceInfo};
use vk_graph::driver::fence::Fence;
use vk_graph::driver::image::{Image, ImageInfo};
use vk_graph::driver::shader::Shader;
use vk_graph::pool::hash::HashPool;

use lvk_bench::peers::{Failure, GlslStage, PeerDevice, compile};

/// A device with the pool of what graphs need.
pub(super) struct Gpu {
    pub(super) device: Device,
    pub(super) pool: HashPool,
}

impl Gpu {
    /// Opens the first device.
    pub(super) fn new() -> Result<Self, Failure> {
        let device = Device::create(DeviceInfo::default())?;
        Ok(Self { pool: HashPool::new(&device), device })
    }

    /// Returns the name of the device.
    pub(super) fn description(&self) -> PeerDevice {
        let properties = &self.device.physical.properties_v1_0;
        let is_cpu = properties.device_type == vk::PhysicalDeviceType::CPU;
        PeerDevice { name: properties.device_name.clone(), is_cpu }
    }

    /// Submits a graph.
    pub(super) fn submit(&mut self, graph: Graph) -> Result<Fence, Failure> {
        Ok(graph.finalize().queue_submit(&mut self.pool, 0, 0)?)
    }

    /// Submits a graph and waits for it.
    pub(super) fn run(&mut self, graph: Graph) -> Result<(), Failure> {
        wait(self.submit(graph)?)
    }

    /// Creates a buffer of the device.
    pub(super) fn buffer(&self, bytes: u64, usage: vk::BufferUsageFlags) -> Result<Arc<Buffer>, Failure> {
        let usage = usage | vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS;
        Ok(Arc::new(Buffer::create(&self.device, BufferInfo::device_mem(bytes, usage))?))
    }

    /// Creates a buffer that the host has written.
    pub(super) fn buffer_with(
        &self,
        bytes: &[u8],
        usage: vk::BufferUsageFlags,
    ) -> Result<Arc<Buffer>, Failure> {
        let usage = usage | vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS;
        Ok(Arc::new(Buffer::create_from_slice(&self.device, usage, bytes)?))
    }

    /// Returns the first `bytes` bytes of a buffer.
    pub(super) fn read(&mut self, buffer: &Arc<Buffer>, bytes: u64) -> Result<Vec<u8>, Failure> {
        let usage = vk::BufferUsageFlags::TRANSFER_DST;
        let copy = self.buffer_with(&vec![0; bytes as usize], usage)?;
        let mut graph = Graph::default();
        let (from, to) = (graph.bind_resource(buffer), graph.bind_resource(&copy));
        graph.copy_buffer(from, to);
        self.run(graph)?;
        Ok(copy.mapped_slice()[..bytes as usize].to_vec())
    }

    /// Creates an image of `side` x `side` texels.
    pub(super) fn image(&self, side: u32, usage: vk::ImageUsageFlags) -> Result<Arc<Image>, Failure> {
        let info = ImageInfo::image_2d(side, side, vk::Format::R8G8B8A8_UNORM, usage);
        Ok(Arc::new(Image::create(&self.device, info)?))
    }
}

/// Waits for a submission.
pub(super) fn wait(mut fence: Fence) -> Result<(), Failure> {
    fence.wait()?;
    Ok(())
}

/// Compiles a shader.
pub(super) fn shader(stage: GlslStage, text: &str) -> Result<Shader, Failure> {
    let words = compile(stage, text)?;
    let flags = match stage {
        GlslStage::Vertex => vk::ShaderStageFlags::VERTEX,
        GlslStage::Fragment => vk::ShaderStageFlags::FRAGMENT,
        GlslStage::Compute => vk::ShaderStageFlags::COMPUTE,
        GlslStage::RayGen => vk::ShaderStageFlags::RAYGEN_KHR,
        GlslStage::Miss => vk::ShaderStageFlags::MISS_KHR,
        GlslStage::ClosestHit => vk::ShaderStageFlags::CLOSEST_HIT_KHR,
    };
    Ok(Shader::new(flags, words.as_slice()).try_build()?)
}
