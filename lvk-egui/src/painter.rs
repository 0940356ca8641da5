//! Paints what egui has laid out.

use egui::epaint::{ClippedPrimitive, PaintCallbackInfo};
use egui::{TextureId, TexturesDelta};
use lvk::{
    BufferDesc, BufferHandle, BufferUsage, Context, Holder, IndexFormat, RenderPass, RenderPipelineHandle,
    TextureHandle,
};

use crate::callback::Callback;
use crate::error::{Error, Result};
use crate::meshes::{Content, FrameMeshes};
use crate::pipeline::{
    LINEAR_TARGET, LINEAR_TEXELS, Push, Target, TargetEncoding, create_pipeline, encoding,
};
use crate::textures::{ShownTexture, TexelEncoding, Textures, UserTexture};

/// Bytes of the smallest buffer.
const MIN_BYTES: u64 = 1 << 16;

/// The pixels that an interface covers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Screen {
    /// Width and height of the targets in pixels.
    pub size_px: [u32; 2],
    /// Pixels of a point of egui: `FullOutput::pixels_per_point` of the frame.
    pub pixels_per_point: f32,
}

/// Paints the interface of one egui context.
///
/// In each frame, [`update`](Self::update) takes what egui has laid out, and [`record`](Self::record) draws it in a render
/// pass of the application. Record it in the next command buffer that is submitted: uploads take place before the next
/// submission, and a second update replaces the meshes of the first.
pub struct Painter {
    ctx: Context,
    textures: Textures,
    target: Target,
    pipeline: Holder<RenderPipelineHandle>,
    vertices: GrowingBuffer,
    indices: GrowingBuffer,
    meshes: FrameMeshes,
    /// The texture of each of the draws; `None` for callbacks.
    shown: Vec<Option<ShownTexture>>,
    user_textures: Vec<TextureHandle>,
    screen: Screen,
    /// Textures that egui frees after the current frame.
    freed: Vec<TextureId>,
}

/// A buffer that is replaced by a larger one when it is too small.
struct GrowingBuffer {
    buffer: Holder<BufferHandle>,
    size_bytes: u64,
    usage: BufferUsage,
}

impl Painter {
    /// Creates a painter without an interface, for render passes with these targets.
    ///
    /// # Errors
    /// [`UnsupportedTarget`](Error::UnsupportedTarget); errors of the library.
    pub fn new(ctx: &Context, target: impl Into<Target>) -> Result<Self> {
        let target = target.into();
        Ok(Self {
            pipeline: create_pipeline(ctx, &target)?,
            target,
            textures: Textures::new(ctx),
            vertices: GrowingBuffer::new(ctx, BufferUsage::STORAGE, MIN_BYTES)?,
            indices: GrowingBuffer::new(ctx, BufferUsage::INDEX, MIN_BYTES)?,
            ctx: ctx.clone(),
            meshes: FrameMeshes::default(),
            shown: Vec::new(),
            user_textures: Vec::new(),
            screen: Screen { size_px: [0; 2], pixels_per_point: 1.0 },
            freed: Vec::new(),
        })
    }

    /// Changes the targets, for example when a window has a new swapchain. Compiles a pipeline only if they are others.
    ///
    /// # Errors
    /// Those of [`new`](Self::new), which leave the targets as they were.
    pub fn set_target(&mut self, target: impl Into<Target>) -> Result<()> {
        let target = target.into();
        if target != self.target {
            self.pipeline = create_pipeline(&self.ctx, &target)?;
            self.target = target;
        }
        Ok(())
    }

    /// Returns an id by which interfaces show a texture of the application: a single layer, with the usage
    /// [`SAMPLED`](lvk::TextureUsage::SAMPLED). Passes name it in their dependencies if the GPU has written it.
    ///
    /// # Errors
    /// Those of [`Context::create_texture_view`](lvk::Context::create_texture_view).
    pub fn register_texture(&mut self, texture: TextureHandle, user: &UserTexture) -> Result<TextureId> {
        self.textures.register(texture, user)
    }

    /// Removes a texture of the application. Command buffers that show it keep it alive.
    ///
    /// # Errors
    /// [`UnknownTexture`](Error::UnknownTexture).
    pub fn unregister_texture(&mut self, id: TextureId) -> Result<()> {
        match id {
            TextureId::User(_) => self.textures.remove(id),
            TextureId::Managed(_) => Err(Error::UnknownTexture { id }),
        }
    }

    /// Takes what egui has laid out: the result of [`egui::Context::tessellate`] and
    /// [`FullOutput::textures_delta`](egui::FullOutput::textures_delta).
    ///
    /// Textures and meshes are uploaded before the next submission. Textures that egui frees live until the next update.
    ///
    /// # Errors
    /// [`InvalidMesh`](Error::InvalidMesh), [`TooLarge`](Error::TooLarge), [`UnknownTexture`](Error::UnknownTexture),
    /// [`InvalidScale`](Error::InvalidScale), [`ForeignCallback`](Error::ForeignCallback), and errors of the library.
    /// There is nothing to record then.
    pub fn update(
        &mut self,
        primitives: &[ClippedPrimitive],
        textures: &TexturesDelta,
        screen: Screen,
    ) -> Result<()> {
        let updated = self.take_textures(textures).and_then(|()| self.take_meshes(primitives, screen));
        updated.inspect_err(|_| self.meshes.draws.clear())
    }

    /// Returns the textures of the application that the current interface shows, without duplicates: the pass lists
    /// those that the GPU has written in its [dependencies](lvk::RenderPassDesc::dependencies).
    pub fn user_textures(&self) -> &[TextureHandle] {
        &self.user_textures
    }

    /// Draws the current interface over the contents of a pass. Changes the pipeline, the index buffer, the push
    /// constants and the scissor of the pass; leaves its viewport as a new pass has it, if a callback was drawn.
    ///
    /// # Errors
    /// [`WrongExtent`](Error::WrongExtent); errors of the library, such as
    /// [`InvalidUsage`](lvk::Error::InvalidUsage) for a pass with other targets than [`set_target`](Self::set_target)
    /// was told; errors of callbacks.
    pub fn record(&self, pass: &mut RenderPass<'_>) -> Result<()> {
        if self.meshes.draws.is_empty() {
            return Ok(());
        }
        let (size_px, extent) = (self.screen.size_px, pass.extent());
        if size_px != extent {
            return Err(Error::WrongExtent { size_px, extent });
        }
        let mut push = self.push_constants()?;
        let mut is_bound = false;
        for (draw, shown) in self.meshes.draws.iter().zip(&self.shown) {
            if let Content::Callback { callback, info } = &draw.content {
                self.record_callback(pass, callback, info, draw.scissor.offset, draw.scissor.extent)?;
                is_bound = false;
            }
            let (Content::Triangles { indices, base_vertex, .. }, Some(shown)) = (&draw.content, shown)
            else {
                continue;
            };
            if !std::mem::replace(&mut is_bound, true) {
                pass.bind_render_pipeline(*self.pipeline)?;
                pass.bind_index_buffer(*self.indices.buffer, 0, IndexFormat::U32)?;
            }
            push.show(shown);
            pass.push_constants(&push)?;
            pass.scissor(draw.scissor.offset, draw.scissor.extent)?;
            pass.draw_indexed(indices.clone(), *base_vertex, 0..1)?;
        }
        Ok(())
    }

    fn record_callback(
        &self,
        pass: &mut RenderPass<'_>,
        callback: &Callback,
        info: &PaintCallbackInfo,
        offset: [u32; 2],
        extent: [u32; 2],
    ) -> Result<()> {
        let place = info.viewport_in_pixels();
        if place.width_px <= 0 || place.height_px <= 0 {
            return Ok(());
        }
        let corner = [place.left_px as f32, place.top_px as f32];
        pass.viewport([corner[0], corner[1], place.width_px as f32, place.height_px as f32], [0.0, 1.0])?;
        pass.scissor(offset, extent)?;
        callback.call(info, pass)?;
        let [width, height] = self.screen.size_px.map(|side| side as f32);
        pass.viewport([0.0, 0.0, width, height], [0.0, 1.0])?;
        Ok(())
    }

    fn push_constants(&self) -> Result<Push> {
        let Screen { size_px, pixels_per_point } = self.screen;
        let is_linear = encoding(self.target.color) == Some(TargetEncoding::Linear);
        Ok(Push {
            vertices: self.vertices.buffer.address()?,
            clip_per_point: size_px.map(|side| 2.0 * pixels_per_point / side.max(1) as f32),
            tex: 0,
            smp: 0,
            flags: if is_linear { LINEAR_TARGET } else { 0 },
            _padding: 0,
        })
    }

    fn take_textures(&mut self, textures: &TexturesDelta) -> Result<()> {
        for id in self.freed.drain(..) {
            // A texture whose creation has failed was never there.
            let _ = self.textures.remove(id);
        }
        self.freed.extend_from_slice(&textures.free);
        textures.set.iter().try_for_each(|(id, delta)| self.textures.set(*id, delta))
    }

    fn take_meshes(&mut self, primitives: &[ClippedPrimitive], screen: Screen) -> Result<()> {
        let per_point = screen.pixels_per_point;
        if !(per_point.is_finite() && per_point > 0.0) {
            return Err(Error::InvalidScale { pixels_per_point: per_point });
        }
        self.screen = screen;
        self.meshes.fill(primitives, per_point, screen.size_px)?;
        self.shown.clear();
        self.user_textures.clear();
        for draw in &self.meshes.draws {
            let shown = match draw.content {
                Content::Triangles { texture, .. } => Some(self.textures.shown(texture)?),
                Content::Callback { .. } => None,
            };
            let user = shown.and_then(|shown| shown.handle);
            self.user_textures.extend(user.filter(|handle| !self.user_textures.contains(handle)));
            self.shown.push(shown);
        }
        self.vertices.fill(&self.ctx, bytemuck::cast_slice(&self.meshes.vertices))?;
        self.indices.fill(&self.ctx, bytemuck::cast_slice(&self.meshes.indices))
    }
}

impl Push {
    fn show(&mut self, shown: &ShownTexture) {
        (self.tex, self.smp) = (shown.texture, shown.sampler);
        self.flags &= LINEAR_TARGET;
        self.flags |= if shown.encoding == TexelEncoding::Linear { LINEAR_TEXELS } else { 0 };
    }
}

impl GrowingBuffer {
    fn new(ctx: &Context, usage: BufferUsage, size_bytes: u64) -> Result<Self> {
        let desc = BufferDesc { usage, size_bytes, debug_name: "egui meshes", ..BufferDesc::default() };
        Ok(Self { buffer: ctx.create_buffer(&desc)?, size_bytes, usage })
    }

    fn fill(&mut self, ctx: &Context, bytes: &[u8]) -> Result<()> {
        let needed = bytes.len() as u64;
        if needed == 0 {
            return Ok(());
        }
        if needed > self.size_bytes {
            *self = Self::new(ctx, self.usage, needed.checked_next_power_of_two().unwrap_or(needed))?;
        }
        Ok(ctx.upload_buffer(*self.buffer, 0, bytes)?)
    }
}
