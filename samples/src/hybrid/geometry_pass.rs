//! The geometry pass as the paper has it: every triangle once through the rasteriser into a G-buffer (algorithms 4
//! and 5). It is the reference that the visibility pass is measured against.

use super::pipelines;
use lvk::{
    BufferDesc, BufferHandle, BufferUsage, ColorAttachment, ColorLoadOp, ColorTarget, CommandBuffer,
    CompareOp, Context, CullMode, DepthAttachment, DepthTest, Format, Holder, IndexFormat, RenderPassDesc,
    RenderPipelineDesc, RenderPipelineHandle, TextureDesc, TextureHandle, TextureUsage,
};

use super::frame::{Indices, LAYOUTS, Push};
use super::gpu_scene::GpuScene;
use super::shader_module::module;

/// Triangle number of pixels that show the sky (`kNoTriangle` in `shaders/hybrid/hit.glsl`).
pub(super) const NO_TRIANGLE: u32 = u32::MAX;

/// The output of the geometry pass, a texel a pixel.
pub(super) struct GBuffer {
    /// Position in scene units, and distance from the eye.
    position: Holder<TextureHandle>,
    /// Shading normal (octahedral, bits of two floats), geometric normal (octahedral, 16 bits a coordinate) and
    /// number of the triangle, which leads to its material.
    surface: Holder<TextureHandle>,
    /// Albedo, linear.
    albedo: Holder<TextureHandle>,
    depth: Holder<TextureHandle>,
}

/// The pass: its pipeline, its targets and the one indirect draw.
pub(super) struct GeometryPass {
    pub(super) targets: GBuffer,
    pipeline: Holder<RenderPipelineHandle>,
    draw: Holder<BufferHandle>,
    triangles: BufferHandle,
}

impl GBuffer {
    const POSITION: Format = Format::Rgba32Float;
    const SURFACE: Format = Format::Rgba32Uint;
    const ALBEDO: Format = Format::Rgba16Float;
    /// Formats of the colour targets, in the order of the shader's outputs.
    pub(super) const COLOR: [Format; 3] = [Self::POSITION, Self::SURFACE, Self::ALBEDO];
    pub(super) const DEPTH: Format = Format::D32Float;

    fn new(ctx: &Context, extent: [u32; 2]) -> lvk::Result<Self> {
        let target = |format, debug_name| {
            let usage = TextureUsage::SAMPLED | TextureUsage::TARGET;
            ctx.create_texture(&TextureDesc { format, extent, usage, debug_name, ..TextureDesc::default() })
        };
        Ok(Self {
            position: target(Self::POSITION, "g-buffer position")?,
            surface: target(Self::SURFACE, "g-buffer surface")?,
            albedo: target(Self::ALBEDO, "g-buffer albedo")?,
            depth: target(Self::DEPTH, "g-buffer depth")?,
        })
    }

    /// Resources that the ray pass reads.
    pub(super) fn textures(&self) -> [TextureHandle; 3] {
        [&self.position, &self.surface, &self.albedo].map(Holder::handle)
    }

    /// Tells the shaders where the targets are.
    pub(super) fn name_in(&self, indices: &mut Indices) {
        indices.gbuffer_position = self.position.index();
        indices.gbuffer_surface = self.surface.index();
        indices.gbuffer_albedo = self.albedo.index();
    }

    fn attachments(&self) -> [ColorAttachment; 3] {
        let target = |texture: &Holder<TextureHandle>, load| ColorAttachment {
            texture: texture.handle(),
            mip: 0,
            layer: 0,
            load,
            store: true,
            resolve: None,
        };
        [
            target(&self.position, ColorLoadOp::DontCare),
            target(&self.surface, ColorLoadOp::ClearUint([NO_TRIANGLE; 4])),
            target(&self.albedo, ColorLoadOp::DontCare),
        ]
    }
}

impl GeometryPass {
    /// The pass over `scene` for a picture of `extent` pixels.
    pub(super) fn new(ctx: &Context, scene: &GpuScene, extent: [u32; 2]) -> lvk::Result<Self> {
        let vertex = module(ctx, &pipelines::GEOMETRY_VERT, &[])?;
        let fragment = module(ctx, &pipelines::GEOMETRY_FRAG, &[])?;
        let color = GBuffer::COLOR.map(ColorTarget::from);
        let pipeline = ctx.create_render_pipeline(&RenderPipelineDesc {
            vertex: Some(*vertex),
            fragment: Some(*fragment),
            cull: CullMode::None,
            color: &color,
            depth: Some(DepthTest { format: GBuffer::DEPTH, compare: CompareOp::Greater, write: true }),
            layouts: LAYOUTS,
            debug_name: "geometry pass",
            ..RenderPipelineDesc::default()
        })?;
        // index count, instance count, first index, vertex offset, first instance
        let arguments = [3 * scene.triangle_count, 1, 0, 0, 0];
        let draw = ctx.create_buffer(&BufferDesc {
            usage: BufferUsage::INDIRECT,
            data: Some(bytemuck::cast_slice(&arguments)),
            debug_name: "geometry pass draw",
            ..BufferDesc::default()
        })?;
        Ok(Self { targets: GBuffer::new(ctx, extent)?, pipeline, draw, triangles: scene.triangles() })
    }

    /// Records the pass.
    pub(super) fn record(&self, cmd: &mut CommandBuffer, push: &Push) -> lvk::Result<()> {
        let mut pass = cmd.begin_rendering(&RenderPassDesc {
            color: &self.targets.attachments(),
            depth: Some(DepthAttachment { store: false, ..DepthAttachment::clear(*self.targets.depth, 0.0) }),
            debug_name: "geometry pass",
            ..RenderPassDesc::default()
        })?;
        pass.bind_render_pipeline(*self.pipeline)?;
        pass.bind_index_buffer(self.triangles, 0, IndexFormat::U32)?;
        pass.push_constants(push)?;
        pass.draw_indexed_indirect(*self.draw, 0, 1, size_of::<[u32; 5]>() as u32)
    }
}
