//! The part of wgpu: it draws the plane with the shadows of the texture that `lvk` writes.

use lvk::Context;
use lvk::ash::vk;
use wgpu::hal::api::Vulkan;

use crate::Error;

const SHADER: &str = "
    @group(0) @binding(0) var shadows: texture_2d<f32>;

    @vertex fn corner(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
        return vec4f(f32(i & 1u) * 4.0 - 1.0, f32(i >> 1u) * 4.0 - 1.0, 0.0, 1.0);
    }

    @fragment fn ground(@builtin(position) at: vec4f) -> @location(0) vec4f {
        let texel = vec2i(at.xy);
        let tile = f32((texel.x / 16 + texel.y / 16) & 1);
        let lit = textureLoad(shadows, texel, 0).r;
        return vec4f(mix(vec3f(0.2, 0.4, 0.6), vec3f(0.8, 0.8, 0.6), tile) * mix(0.25, 1.0, lit), 1.0);
    }";

const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

pub(crate) struct Picture {
    shadows: wgpu::Texture,
    target: wgpu::Texture,
    readback: wgpu::Buffer,
    bindings: wgpu::BindGroup,
    pipeline: wgpu::RenderPipeline,
    queue: wgpu::Queue,
    device: wgpu::Device,
}

impl Picture {
    pub(crate) fn new(device: wgpu::Device, queue: wgpu::Queue, side: u32) -> Self {
        use wgpu::TextureUsages as Usage;
        let texture = |usage| {
            device.create_texture(&wgpu::TextureDescriptor {
                label: None,
                size: wgpu::Extent3d { width: side, height: side, depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: FORMAT,
                usage,
                view_formats: &[],
            })
        };
        let shadows = texture(Usage::STORAGE_BINDING | Usage::TEXTURE_BINDING | Usage::COPY_DST);
        let target = texture(Usage::RENDER_ATTACHMENT | Usage::COPY_SRC);
        let readback = device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: u64::from(side * side) * 4,
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let source = wgpu::ShaderSource::Wgsl(SHADER.into());
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor { label: None, source });
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: None,
            layout: None,
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("corner"),
                compilation_options: Default::default(),
                buffers: &[],
            },
            primitive: Default::default(),
            depth_stencil: None,
            multisample: Default::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some("ground"),
                compilation_options: Default::default(),
                targets: &[Some(FORMAT.into())],
            }),
            multiview_mask: None,
            cache: None,
        });
        let view = shadows.create_view(&Default::default());
        let bindings = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &pipeline.get_bind_group_layout(0),
            entries: &[wgpu::BindGroupEntry {
                binding: 0,
                resource: wgpu::BindingResource::TextureView(&view),
            }],
        });
        Self { shadows, target, readback, bindings, pipeline, queue, device }
    }

    pub(crate) fn shadow_texture(&self) -> &wgpu::Texture {
        &self.shadows
    }

    /// Fills the texture, as wgpu clears textures at their first use that it has not written, and leaves it in the
    /// layout in which wgpu samples it. Signals `value`.
    pub(crate) fn prepare(&self, ctx: &Context, semaphore: vk::Semaphore, value: u64) -> Result<(), Error> {
        let size = self.shadows.size();
        let layout =
            wgpu::TexelCopyBufferLayout { bytes_per_row: Some(size.width * 4), ..Default::default() };
        let zeros = vec![0; (size.width * size.height * 4) as usize];
        self.queue.write_texture(self.shadows.as_image_copy(), &zeros, layout, size);
        let mut encoder = self.device.create_command_encoder(&Default::default());
        let state = wgpu::TextureUses::RESOURCE;
        let shadows = wgpu::TextureTransition { texture: &self.shadows, selector: None, state };
        encoder.transition_resources(std::iter::empty(), std::iter::once(shadows));
        self.submit(ctx, encoder, semaphore, None, value)
    }

    /// Waits for `traced`, draws, signals `drawn`, and returns the pixels.
    pub(crate) fn draw(
        &self,
        ctx: &Context,
        semaphore: vk::Semaphore,
        traced: u64,
        drawn: u64,
    ) -> Result<Vec<u8>, Error> {
        let mut encoder = self.device.create_command_encoder(&Default::default());
        let view = self.target.create_view(&Default::default());
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &view,
                depth_slice: None,
                resolve_target: None,
                ops: Default::default(),
            })],
            ..Default::default()
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.bindings, &[]);
        pass.draw(0..3, 0..1);
        drop(pass);
        let size = self.target.size();
        let layout =
            wgpu::TexelCopyBufferLayout { bytes_per_row: Some(size.width * 4), ..Default::default() };
        let copy = wgpu::TexelCopyBufferInfo { buffer: &self.readback, layout };
        encoder.copy_texture_to_buffer(self.target.as_image_copy(), copy, size);
        self.submit(ctx, encoder, semaphore, Some(traced), drawn)?;
        let (sender, receiver) = std::sync::mpsc::channel();
        self.readback.map_async(wgpu::MapMode::Read, .., move |answer| {
            let _ = sender.send(answer);
        });
        self.device.poll(wgpu::PollType::wait_indefinitely())?;
        receiver.recv()??;
        let pixels = self.readback.get_mapped_range(..)?.to_vec();
        self.readback.unmap();
        Ok(pixels)
    }

    /// Submits between semaphores. wgpu locks its queue against itself alone: `with_raw_queue` locks out `lvk`, whose
    /// uploads and builds may be submitted by other threads.
    fn submit(
        &self,
        ctx: &Context,
        encoder: wgpu::CommandEncoder,
        semaphore: vk::Semaphore,
        wait: Option<u64>,
        signal: u64,
    ) -> Result<(), Error> {
        ctx.with_raw_queue(|_| {
            // SAFETY: nothing of the queue is destroyed through the guard.
            let hal = unsafe { self.queue.as_hal::<Vulkan>() }.ok_or("the queue is not one of Vulkan")?;
            if let Some(value) = wait {
                hal.add_wait_semaphore(semaphore, Some(value), vk::PipelineStageFlags::ALL_COMMANDS);
            }
            hal.add_signal_semaphore(semaphore, Some(signal));
            drop(hal);
            self.queue.submit([encoder.finish()]);
            Ok(())
        })
    }
}
