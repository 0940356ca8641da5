//! Adapter, device and queue.

use std::future::Future;
use std::pin::pin;
use std::task::{Context, Poll, Waker};

use lvk_bench::peers::{Failure, PeerDevice};
use wgpu::util::DeviceExt as _;

/// The format of all textures.
pub(super) const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

/// A device with its queue.
pub(super) struct Gpu {
    pub(super) device: wgpu::Device,
    pub(super) queue: wgpu::Queue,
    has_ray_query: bool,
    info: wgpu::AdapterInfo,
}

impl Gpu {
    /// Opens a device with ray queries, if it has them.
    pub(super) fn new() -> Result<Self, Failure> {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
            backends: wgpu::Backends::VULKAN,
            flags: wgpu::InstanceFlags::empty(),
            ..wgpu::InstanceDescriptor::new_without_display_handle()
        });
        let adapter = ready(instance.request_adapter(&Default::default()))?;
        let (rays, constants) = (wgpu::Features::EXPERIMENTAL_RAY_QUERY, wgpu::Features::IMMEDIATES);
        let has_ray_query = adapter.features().contains(rays);
        let mut limits = wgpu::Limits { max_immediate_size: 64, ..wgpu::Limits::default() };
        if has_ray_query {
            limits = limits.using_acceleration_structure_values(adapter.limits());
        }
        let desc = wgpu::DeviceDescriptor {
            required_features: if has_ray_query { rays | constants } else { constants },
            required_limits: limits,
            // SAFETY: the rows use the feature as its documentation says.
            experimental_features: unsafe { wgpu::ExperimentalFeatures::enabled() },
            ..Default::default()
        };
        let (device, queue) = ready(adapter.request_device(&desc))?;
        Ok(Self { device, queue, has_ray_query, info: adapter.get_info() })
    }

    /// Returns the name of the device.
    pub(super) fn description(&self) -> PeerDevice {
        let is_cpu = self.info.device_type == wgpu::DeviceType::Cpu;
        PeerDevice { name: self.info.name.clone(), is_cpu }
    }

    /// Returns an error if the device has no ray queries, which wgpu wants for acceleration structures.
    pub(super) fn needs_ray_query(&self) -> Result<(), Failure> {
        if self.has_ray_query {
            return Ok(());
        }
        Err("the device has no ray queries, which wgpu wants for acceleration structures".into())
    }

    /// Waits for a submission.
    pub(super) fn wait(&self, submission: wgpu::SubmissionIndex) -> Result<(), Failure> {
        let wait = wgpu::PollType::Wait { submission_index: Some(submission), timeout: None };
        self.device.poll(wait)?;
        Ok(())
    }

    /// Compiles a shader.
    pub(super) fn shader(&self, text: &str) -> wgpu::ShaderModule {
        let source = wgpu::ShaderSource::Wgsl(text.into());
        self.device.create_shader_module(wgpu::ShaderModuleDescriptor { label: None, source })
    }

    /// Creates a layout with these bind groups and so many bytes of constants.
    pub(super) fn layout(
        &self,
        groups: &[Option<&wgpu::BindGroupLayout>],
        immediate_size: u32,
    ) -> wgpu::PipelineLayout {
        let desc = wgpu::PipelineLayoutDescriptor { label: None, bind_group_layouts: groups, immediate_size };
        self.device.create_pipeline_layout(&desc)
    }

    /// Creates a texture of `side` x `side` texels.
    pub(super) fn texture(&self, side: u32, usage: wgpu::TextureUsages) -> wgpu::Texture {
        self.device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d { width: side, height: side, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: FORMAT,
            usage,
            view_formats: &[],
        })
    }

    /// Creates a buffer with these bytes.
    pub(super) fn buffer(&self, contents: &[u8], usage: wgpu::BufferUsages) -> wgpu::Buffer {
        self.device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: None, contents, usage })
    }

    /// Creates a buffer that copies fill and shaders write.
    pub(super) fn storage(&self, size: u64) -> wgpu::Buffer {
        use wgpu::BufferUsages as Usage;
        let usage = Usage::STORAGE | Usage::COPY_SRC | Usage::COPY_DST;
        self.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size,
            usage,
            mapped_at_creation: false,
        })
    }

    /// Returns what `copy` records into a buffer of `size` bytes that the host reads.
    pub(super) fn read(
        &self,
        size: u64,
        copy: impl FnOnce(&mut wgpu::CommandEncoder, &wgpu::Buffer),
    ) -> Result<Vec<u8>, Failure> {
        let usage = wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ;
        let readback = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size,
            usage,
            mapped_at_creation: false,
        });
        let mut encoder = self.device.create_command_encoder(&Default::default());
        copy(&mut encoder, &readback);
        self.queue.submit([encoder.finish()]);
        readback.map_async(wgpu::MapMode::Read, .., |_| ());
        self.device.poll(wgpu::PollType::wait_indefinitely())?;
        Ok(readback.get_mapped_range(..)?.to_vec())
    }

    /// Returns the first `size` bytes of a buffer.
    pub(super) fn read_buffer(&self, buffer: &wgpu::Buffer, size: u64) -> Result<Vec<u8>, Failure> {
        self.read(size, |encoder, to| encoder.copy_buffer_to_buffer(buffer, 0, to, 0, size))
    }
}

/// Returns the output of a future that is ready at once, as wgpu's are without a browser.
fn ready<T, E: Into<Failure>>(future: impl Future<Output = Result<T, E>>) -> Result<T, Failure> {
    match pin!(future).poll(&mut Context::from_waker(Waker::noop())) {
        Poll::Ready(answer) => answer.map_err(Into::into),
        Poll::Pending => Err("wgpu is not ready at once".into()),
    }
}
