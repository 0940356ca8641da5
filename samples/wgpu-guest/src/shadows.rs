//! The part of `lvk`: ray queries that write into a texture of wgpu.

use lvk::ash::vk;
use lvk::*;
use wgpu::hal::api::Vulkan;

use crate::TRIANGLE;

const SHADER: &str = "
    #include <lvk/ray_query.glsl>
    layout(local_size_x = 8, local_size_y = 8) in;
    layout(push_constant, scalar) uniform Push { uint tlas, shadows; float side; vec3 light; };
    void main() {
        ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
        vec2 ground = (vec2(texel) + 0.5) / side * 2.0 - 1.0;
        uint flags = LVK_RAY_FLAG_OPAQUE | LVK_RAY_FLAG_TERMINATE_ON_FIRST_HIT;
        LvkRayQuery rq;
        lvkRayQueryInitialize(rq, tlas, flags, 0xFF, vec3(ground, 0.0), 1e-3, light, 10.0);
        while (lvkRayQueryProceed(rq)) {}
        bool hit = lvkRayQueryType(rq, LVK_COMMITTED) == LVK_COMMITTED_TRIANGLE;
        imageStore(kImages2D[shadows], texel, vec4(hit ? 0.0 : 1.0));
    }";

/// wgpu keeps colour textures in this layout between uses as a resource.
const RESTING: vk::ImageLayout = vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL;

pub(crate) struct Shadows {
    texture: Holder<TextureHandle>,
    pipeline: Holder<ComputePipelineHandle>,
    tlas: Holder<AccelStructHandle>,
    _blas: Holder<AccelStructHandle>,
    pub(crate) semaphore: vk::Semaphore,
    device: ash::Device,
}

impl Shadows {
    pub(crate) fn new(
        ctx: &Context,
        texture: &wgpu::Texture,
        side: u32,
    ) -> std::result::Result<Self, crate::Error> {
        // SAFETY: wgpu keeps the image, and nothing of it is destroyed through the guard.
        let image = unsafe { texture.as_hal::<Vulkan>().ok_or("not a texture of Vulkan")?.raw_handle() };
        let usage = TextureUsage::STORAGE | TextureUsage::SAMPLED;
        let desc = TextureDesc {
            format: Format::Rgba8Unorm,
            extent: [side; 2],
            usage,
            debug_name: "shadows in wgpu's texture",
            ..Default::default()
        };
        let import = ImportedTexture { image, desc, layout: RESTING, concurrent: false };
        // SAFETY: the image is as described, and `Guest` drops this handle before the image.
        let texture = unsafe { ctx.import_texture(&import) }?;
        let (usage, data) = (BufferUsage::ACCEL_INPUT, Some(bytemuck::bytes_of(&TRIANGLE)));
        let vertices = ctx.create_buffer(&BufferDesc { usage, data, ..Default::default() })?;
        let geometries = &[BlasGeometry::Triangles(Triangles::packed(*vertices, 3))];
        let blas = ctx.create_blas(&BlasDesc { geometries, ..Default::default() })?;
        let instances = &[TlasInstance::new(*blas)];
        let tlas = ctx.create_tlas(&TlasDesc { instances, ..Default::default() })?;
        let (stage, source) = (ShaderStage::Compute, ShaderSource::Glsl(SHADER));
        let module = ctx.create_shader_module(&ShaderModuleDesc { stage, source, ..Default::default() })?;
        let desc = ComputePipelineDesc { module: Some(*module), ..Default::default() };
        let pipeline = ctx.create_compute_pipeline(&desc)?;
        let mut kind = vk::SemaphoreTypeCreateInfo::default().semaphore_type(vk::SemaphoreType::TIMELINE);
        let info = vk::SemaphoreCreateInfo::default().push_next(&mut kind);
        let device = ctx.raw_device().clone();
        // SAFETY: the device is alive and has timeline semaphores, which `lvk` requires.
        let semaphore = unsafe { device.create_semaphore(&info, None) }?;
        Ok(Self { texture, pipeline, tlas, _blas: blas, semaphore, device })
    }

    /// Waits for `before`, writes the shadows, and signals `after`.
    pub(crate) fn trace(
        &self,
        ctx: &Context,
        side: u32,
        light: [f32; 3],
        before: u64,
        after: u64,
    ) -> Result<()> {
        // SAFETY: wgpu's submission leaves the texture so, and `before` is signalled behind it.
        unsafe { ctx.acquire_texture(*self.texture, RESTING) }?;
        let mut cmd = ctx.acquire_command_buffer()?;
        cmd.bind_compute_pipeline(*self.pipeline)?;
        let [x, y, z] = light.map(f32::to_bits);
        cmd.push_constants(&[self.tlas.index(), self.texture.index(), (side as f32).to_bits(), x, y, z])?;
        let writes = Dependencies { storage_images: &[*self.texture], ..Default::default() };
        cmd.dispatch([side / 8, side / 8, 1], &writes)?;
        cmd.release_texture(*self.texture, RESTING)?;
        let stages = vk::PipelineStageFlags2::ALL_COMMANDS;
        let wait = RawWait { semaphore: self.semaphore, value: before, stages };
        let signal = RawSignal { semaphore: self.semaphore, value: after };
        // SAFETY: wgpu has submitted the signal of `before`, and the values rise.
        unsafe { ctx.submit_with(cmd, &[wait], &[signal]) }?;
        Ok(())
    }
}

impl Drop for Shadows {
    fn drop(&mut self) {
        // SAFETY: the device is alive, and idle after the wait.
        unsafe {
            let _ = self.device.device_wait_idle();
            self.device.destroy_semaphore(self.semaphore, None);
        }
    }
}
