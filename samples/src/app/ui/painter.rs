//! Paints what egui has laid out: corners are pulled from a buffer by address, textures are named by number.

use std::ops::Range;

use bytemuck::{Pod, Zeroable};
use egui::epaint::{ClippedPrimitive, Primitive, Vertex};
use egui::{FullOutput, Rect};
use lvk::{
    Blend, BlockLayout, BufferDesc, BufferHandle, BufferUsage, ColorTarget, Context, CullMode, Format,
    Holder, IndexFormat, RenderPass, RenderPipelineDesc, RenderPipelineHandle, TextureHandle,
};

use super::atlas::Atlas;
use crate::pipelines::{SamplePipeline, SampleStage, shader};

/// Folder of the texts in `shaders/`.
const FOLDER: &str = "app";
const VERTEX: SampleStage = shader!("app", "ui.vert");
const FRAGMENT: SampleStage = shader!("app", "ui.frag");
/// Bytes that buffers have at first.
const LEAST_BYTES: u64 = 1 << 16;

/// Every pipeline of the user interface.
#[must_use]
pub fn pipelines() -> Vec<SamplePipeline> {
    vec![SamplePipeline::raster("app: user interface", &[VERTEX, FRAGMENT], &[Format::Rgba8Unorm], None)]
}

/// Paints a user interface.
pub struct Painter {
    ctx: Context,
    atlas: Atlas,
    /// For the format that was painted on last.
    pipeline: Option<(Format, Holder<RenderPipelineHandle>)>,
    vertices: Growing,
    indices: Growing,
    draws: Vec<Draw>,
    clip_per_point: [f32; 2],
    /// Textures that the latest draws show for the last time.
    given_up: Vec<egui::TextureId>,
}

/// A buffer that is replaced by a larger one when it is too small.
struct Growing {
    buffer: Holder<BufferHandle>,
    size_bytes: u64,
    usage: BufferUsage,
}

/// Triangles with one texture and one clip rectangle.
#[derive(Debug, Clone, PartialEq)]
struct Draw {
    scissor: Scissor,
    indices: Range<u32>,
    base_vertex: i32,
    /// Descriptor slots of the texture and its sampler.
    numbers: [u32; 2],
}

/// A rectangle in pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Scissor {
    offset: [u32; 2],
    extent: [u32; 2],
}

lvk::shader_struct! {
    /// `Push` in `shaders/app/ui.glsl`.
    #[derive(Debug, Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    struct Push {
        vertices: u64,
        clip_per_point: [f32; 2],
        tex: u32,
        smp: u32,
        linear_target: u32,
        _padding: u32,
    }
}

impl Painter {
    /// A painter that has nothing to paint.
    ///
    /// # Errors
    /// Errors of Vulkan.
    pub fn new(ctx: &Context) -> lvk::Result<Self> {
        Ok(Self {
            ctx: ctx.clone(),
            atlas: Atlas::new(ctx),
            pipeline: None,
            vertices: Growing::new(ctx, BufferUsage::STORAGE, LEAST_BYTES)?,
            indices: Growing::new(ctx, BufferUsage::INDEX, LEAST_BYTES)?,
            draws: Vec::new(),
            clip_per_point: [0.0; 2],
            given_up: Vec::new(),
        })
    }

    /// The egui id of `picture`, which holds encoded sRGB, so a format without decoding.
    #[must_use]
    pub fn texture_id(picture: &Holder<TextureHandle>) -> egui::TextureId {
        egui::TextureId::User(picture.index().into())
    }

    /// Uploads what `ui` has laid out, for a target of `extent` pixels. Uploads take place after the frames that are under
    /// way, before the next submission.
    ///
    /// # Errors
    /// Errors of Vulkan.
    pub fn upload(&mut self, ui: &egui::Context, output: FullOutput, extent: [u32; 2]) -> lvk::Result<()> {
        self.given_up.drain(..).for_each(|id| self.atlas.free(id));
        for (id, delta) in &output.textures_delta.set {
            self.atlas.set(*id, delta)?;
        }
        let per_point = output.pixels_per_point;
        let primitives = ui.tessellate(output.shapes, per_point);
        self.clip_per_point = extent.map(|side| 2.0 * per_point / side.max(1) as f32);
        self.given_up = output.textures_delta.free;
        self.upload_triangles(&primitives, per_point, extent)
    }

    /// Compiles the pipeline for targets of `format`, if it is not there.
    ///
    /// # Errors
    /// Those of the shaders.
    pub fn prepare(&mut self, format: Format) -> lvk::Result<()> {
        if self.pipeline.as_ref().is_none_or(|(known, _)| *known != format) {
            self.pipeline = Some((format, pipeline(&self.ctx, format)?));
        }
        Ok(())
    }

    /// The pipeline compiled again, for [`take_over`](Self::take_over); none where there is none yet.
    ///
    /// # Errors
    /// Those of the shaders.
    pub fn recompiled(&self) -> lvk::Result<Option<Holder<RenderPipelineHandle>>> {
        self.pipeline.as_ref().map(|(format, _)| pipeline(&self.ctx, *format)).transpose()
    }

    /// Paints by a pipeline that was [compiled again](Self::recompiled) for the same format.
    pub fn take_over(&mut self, recompiled: Option<Holder<RenderPipelineHandle>>) {
        if let (Some((_, made)), Some(recompiled)) = (&mut self.pipeline, recompiled) {
            *made = recompiled;
        }
    }

    /// Paints what was uploaded, on a target with the format that [`prepare`](Self::prepare) was told. The pass must
    /// name the pictures of the interface among its dependencies.
    ///
    /// # Errors
    /// Errors of Vulkan.
    pub fn record(&self, pass: &mut RenderPass<'_>) -> lvk::Result<()> {
        let Some((format, pipeline)) = &self.pipeline else { return Ok(()) };
        let linear_target = matches!(format, Format::Rgba8Srgb | Format::Bgra8Srgb).into();
        let vertices = self.vertices.buffer.address()?;
        pass.bind_render_pipeline(**pipeline)?;
        pass.bind_index_buffer(*self.indices.buffer, 0, IndexFormat::U32)?;
        for draw in &self.draws {
            let ([tex, smp], clip_per_point) = (draw.numbers, self.clip_per_point);
            let push = Push { vertices, clip_per_point, tex, smp, linear_target, _padding: 0 };
            pass.push_constants(&push)?;
            pass.scissor(draw.scissor.offset, draw.scissor.extent)?;
            pass.draw_indexed(draw.indices.clone(), draw.base_vertex, 0..1)?;
        }
        Ok(())
    }

    fn upload_triangles(
        &mut self,
        primitives: &[ClippedPrimitive],
        per_point: f32,
        extent: [u32; 2],
    ) -> lvk::Result<()> {
        let (mut vertices, mut indices) = (Vec::<Vertex>::new(), Vec::<u32>::new());
        self.draws.clear();
        for ClippedPrimitive { clip_rect, primitive } in primitives {
            let (Primitive::Mesh(mesh), Some(scissor)) = (primitive, scissor(*clip_rect, per_point, extent))
            else {
                continue;
            };
            let first = indices.len() as u32;
            let base_vertex = vertices.len() as i32;
            indices.extend_from_slice(&mesh.indices);
            vertices.extend_from_slice(&mesh.vertices);
            let numbers = self.atlas.numbers(mesh.texture_id)?;
            self.draws.push(Draw { scissor, indices: first..indices.len() as u32, base_vertex, numbers });
        }
        self.vertices.fill(&self.ctx, bytemuck::cast_slice(&vertices))?;
        self.indices.fill(&self.ctx, bytemuck::cast_slice(&indices))
    }
}

impl Growing {
    fn new(ctx: &Context, usage: BufferUsage, size_bytes: u64) -> lvk::Result<Self> {
        let desc =
            BufferDesc { usage, size_bytes, debug_name: "interface triangles", ..BufferDesc::default() };
        Ok(Self { buffer: ctx.create_buffer(&desc)?, size_bytes, usage })
    }

    fn fill(&mut self, ctx: &Context, bytes: &[u8]) -> lvk::Result<()> {
        let needed = bytes.len() as u64;
        if needed > self.size_bytes {
            *self = Self::new(ctx, self.usage, needed.next_power_of_two())?;
        }
        ctx.upload_buffer(*self.buffer, 0, bytes)
    }
}

/// The pixels of a clip rectangle in points that are on a target of `extent` pixels; `None` where there are none.
fn scissor(clip: Rect, per_point: f32, extent: [u32; 2]) -> Option<Scissor> {
    // Casts saturate, and make 0 of what is no number.
    let edge = |at: f32, side: u32| ((at * per_point).round() as u32).min(side);
    let low = [edge(clip.min.x, extent[0]), edge(clip.min.y, extent[1])];
    let high = [edge(clip.max.x, extent[0]), edge(clip.max.y, extent[1])];
    let is_seen = low[0] < high[0] && low[1] < high[1];
    is_seen.then(|| Scissor { offset: low, extent: [high[0] - low[0], high[1] - low[1]] })
}

fn pipeline(ctx: &Context, format: Format) -> lvk::Result<Holder<RenderPipelineHandle>> {
    let (vertex, fragment) = (VERTEX.create(ctx, FOLDER)?, FRAGMENT.create(ctx, FOLDER)?);
    ctx.create_render_pipeline(&RenderPipelineDesc {
        vertex: Some(*vertex),
        fragment: Some(*fragment),
        cull: CullMode::None,
        color: &[ColorTarget { blend: Some(Blend::PREMULTIPLIED_ALPHA), ..ColorTarget::from(format) }],
        layouts: &[BlockLayout::push_constants::<Push>()],
        debug_name: "user interface",
        ..RenderPipelineDesc::default()
    })
}

#[cfg(test)]
mod tests {
    use egui::pos2;
    use proptest::prelude::*;

    use super::*;

    fn rect(low: [f32; 2], high: [f32; 2]) -> Rect {
        Rect { min: low.into(), max: high.into() }
    }

    #[test]
    fn clip_rectangles_become_pixels() {
        let found = scissor(rect([1.0, 2.0], [5.5, 4.0]), 2.0, [100, 50]);
        assert_eq!(found, Some(Scissor { offset: [2, 4], extent: [9, 4] }));
        let whole = Some(Scissor { offset: [0, 0], extent: [100, 50] });
        assert_eq!(scissor(Rect::EVERYTHING, 1.5, [100, 50]), whole);
        for nothing in
            [Rect::NOTHING, Rect::NAN, rect([7.0, 7.0], [7.2, 9.0]), rect([200.0, 0.0], [300.0, 9.0])]
        {
            assert_eq!(scissor(nothing, 1.0, [100, 50]), None, "{nothing}");
        }
        assert_eq!(scissor(Rect::EVERYTHING, 1.0, [0, 50]), None);
    }

    proptest! {
        #[test]
        fn no_scissor_leaves_its_target(
            corners in [-1e4_f32..1e4, -1e4_f32..1e4, -1e4_f32..1e4, -1e4_f32..1e4],
            per_point in 0.1_f32..4.0,
            extent in [0_u32..4000, 0_u32..4000],
        ) {
            let clip = Rect::from_two_pos(pos2(corners[0], corners[1]), pos2(corners[2], corners[3]));
            if let Some(Scissor { offset, extent: found }) = scissor(clip, per_point, extent) {
                prop_assert!((0..2).all(|axis| found[axis] > 0 && offset[axis] + found[axis] <= extent[axis]));
            }
        }
    }

    #[test]
    fn the_layout_is_the_shaders() {
        use std::mem::offset_of;
        assert_eq!((offset_of!(Vertex, uv), offset_of!(Vertex, color)), (8, 16));
        assert_eq!((size_of::<Vertex>(), size_of::<Push>()), (20, 32));
    }
}
