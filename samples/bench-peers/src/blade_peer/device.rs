//! Context and command encoder.

use std::ptr::NonNull;

use blade_graphics as gpu;
use lvk_bench::peers::{Failure, PeerDevice};

/// A context with an encoder. Objects of a row are never destroyed, as the process ends after it.
pub(super) struct Gpu {
    pub(super) context: gpu::Context,
    pub(super) encoder: gpu::CommandEncoder,
}

impl Gpu {
    /// Opens a context, with acceleration structures and ray queries if the device has them.
    pub(super) fn new() -> Result<Self, Failure> {
        let desc = gpu::ContextDesc { ray_tracing: true, ..Default::default() };
        // SAFETY: this thread alone uses Vulkan.
        let context = unsafe { gpu::Context::init(desc) }?;
        let desc = gpu::CommandEncoderDesc { name: "peer", buffer_count: 2, manual_barriers: false };
        let encoder = context.create_command_encoder(desc);
        Ok(Self { context, encoder })
    }

    /// Returns the name of the device.
    pub(super) fn description(&self) -> PeerDevice {
        let info = self.context.device_information();
        PeerDevice { name: info.device_name.clone(), is_cpu: info.is_software_emulated }
    }

    /// Returns an error if the device has no ray queries in compute shaders.
    pub(super) fn needs_ray_query(&self) -> Result<(), Failure> {
        if self.context.capabilities().ray_query.contains(gpu::ShaderVisibility::COMPUTE) {
            return Ok(());
        }
        Err("the device has no ray queries, which blade wants for acceleration structures".into())
    }

    /// Submits what was encoded.
    pub(super) fn submit(&mut self) -> gpu::SyncPoint {
        self.context.submit(&mut self.encoder)
    }

    /// Waits for a submission.
    pub(super) fn wait(&self, point: &gpu::SyncPoint) -> Result<(), Failure> {
        if self.context.wait_for(point, !0)? {
            return Ok(());
        }
        Err("the submission did not end".into())
    }

    /// Creates a buffer.
    pub(super) fn buffer(&self, size: u64, memory: gpu::Memory) -> gpu::Buffer {
        self.context.create_buffer(gpu::BufferDesc { name: "", size, memory })
    }

    /// Creates a buffer that the host has written.
    pub(super) fn buffer_with(&self, bytes: &[u8], memory: gpu::Memory) -> Result<gpu::Buffer, Failure> {
        let buffer = self.buffer(bytes.len() as u64, memory);
        self.write(buffer, 0, bytes)?;
        Ok(buffer)
    }

    /// Writes into a buffer that the host sees and the GPU does not use.
    pub(super) fn write(&self, buffer: gpu::Buffer, offset: usize, bytes: &[u8]) -> Result<(), Failure> {
        let data = NonNull::new(buffer.data()).ok_or("memory that the host does not see")?;
        if (offset + bytes.len()) as u64 > buffer.size() {
            return Err("the buffer is too small".into());
        }
        // SAFETY: the bytes lie inside of the buffer, and only this thread uses it.
        unsafe { data.as_ptr().add(offset).copy_from_nonoverlapping(bytes.as_ptr(), bytes.len()) };
        Ok(())
    }

    /// Returns the first `size` bytes of a buffer.
    pub(super) fn read(&mut self, buffer: gpu::Buffer, size: u64) -> Result<Vec<u8>, Failure> {
        let copy = self.buffer(size, gpu::Memory::Shared);
        self.encoder.start();
        self.encoder.transfer("read").copy_buffer_to_buffer(buffer.into(), copy.into(), size);
        let point = self.submit();
        self.wait(&point)?;
        self.read_shared(copy, size)
    }

    /// Returns the first `size` bytes of a buffer that the host sees.
    pub(super) fn read_shared(&self, buffer: gpu::Buffer, size: u64) -> Result<Vec<u8>, Failure> {
        let data = NonNull::new(buffer.data()).ok_or("memory that the host does not see")?;
        // SAFETY: the buffer has as many bytes, and the GPU has finished with it.
        Ok(unsafe { std::slice::from_raw_parts(data.as_ptr(), size as usize) }.to_vec())
    }

    /// Creates a texture of `side` x `side` texels, and its view.
    pub(super) fn texture(&self, side: u32, usage: gpu::TextureUsage) -> (gpu::Texture, gpu::TextureView) {
        let format = gpu::TextureFormat::Rgba8Unorm;
        let texture = self.context.create_texture(gpu::TextureDesc {
            name: "",
            format,
            size: gpu::Extent { width: side, height: side, depth: 1 },
            array_layer_count: 1,
            mip_level_count: 1,
            sample_count: 1,
            dimension: gpu::TextureDimension::D2,
            usage,
            external: None,
        });
        let view = self.context.create_texture_view(
            texture,
            gpu::TextureViewDesc {
                name: "",
                format,
                dimension: gpu::ViewDimension::D2,
                subresources: &gpu::TextureSubresources::default(),
            },
        );
        (texture, view)
    }

    /// Compiles a shader.
    pub(super) fn shader(&self, source: &str) -> Result<gpu::Shader, Failure> {
        Ok(self.context.try_create_shader(gpu::ShaderDesc { source, naga_module: None })?)
    }
}
