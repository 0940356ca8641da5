//! Begins a render pass: targets, what they are loaded with, and the barriers in front.

use std::sync::Arc;

use ash::vk;

use super::CommandBuffer;
use super::dependencies::Dependencies;
use super::render::RenderPass;
use crate::barrier::{Stages, Use};
use crate::error::{Error, Result, check_limit};
use crate::format::Format;
use crate::handle::TextureHandle;
use crate::resource::Texture;
use crate::resource::texture::{TextureUsage, one};
use crate::submit::emit::layout;

/// What a colour target holds when the pass begins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ColorLoad {
    /// What was in it.
    Load,
    /// This colour.
    Clear([f32; 4]),
    /// These integers, for targets of an integer format.
    ClearUint([u32; 4]),
    /// Anything; every pixel is drawn.
    DontCare,
}

/// What a depth target holds when the pass begins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DepthLoad {
    /// What was in it.
    Load,
    /// This depth, 0 to 1.
    Clear(f32),
    /// Anything.
    DontCare,
}

/// A colour target of a render pass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ColorAttachment {
    /// A texture with [`TextureUsage::TARGET`].
    pub texture: TextureHandle,
    /// Mip level drawn to.
    pub mip: u32,
    /// Layer or cube face drawn to.
    pub layer: u32,
    /// What it holds when the pass begins.
    pub load: ColorLoad,
    /// Whether what was drawn is kept.
    pub store: bool,
}

impl ColorAttachment {
    /// The first mip and layer, cleared to a colour and kept.
    pub fn clear(texture: TextureHandle, color: [f32; 4]) -> Self {
        Self { texture, mip: 0, layer: 0, load: ColorLoad::Clear(color), store: true }
    }
}

/// The depth target of a render pass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DepthAttachment {
    /// A texture of a depth format with [`TextureUsage::TARGET`].
    pub texture: TextureHandle,
    /// Mip level drawn to.
    pub mip: u32,
    /// Layer or cube face drawn to.
    pub layer: u32,
    /// What it holds when the pass begins.
    pub load: DepthLoad,
    /// Whether the depth is kept.
    pub store: bool,
}

impl DepthAttachment {
    /// The first mip and layer, cleared to a depth and kept.
    pub fn clear(texture: TextureHandle, depth: f32) -> Self {
        Self { texture, mip: 0, layer: 0, load: DepthLoad::Clear(depth), store: true }
    }
}

/// Describes a render pass.
#[derive(Debug, Clone, Copy, Default)]
pub struct RenderPassDesc<'a> {
    /// Colour targets, in the order of the shaders' outputs.
    pub color: &'a [ColorAttachment],
    /// Depth target.
    pub depth: Option<DepthAttachment>,
    /// What the pass's shaders reach bindlessly, and what its draws read that was written earlier in the same command
    /// buffer: no barrier can be placed inside a pass.
    pub dependencies: Dependencies<'a>,
    /// Name of the pass in debuggers; empty for none.
    pub debug_name: &'a str,
}

/// The targets of a pass, found and checked.
pub(super) struct Targets {
    pub(super) extent: [u32; 2],
    pub(super) color_formats: Vec<Format>,
    pub(super) depth_format: Option<Format>,
    colors: Vec<vk::RenderingAttachmentInfo<'static>>,
    depth: Option<vk::RenderingAttachmentInfo<'static>>,
    stencil: bool,
}

impl CommandBuffer {
    /// Begins a render pass (`vkCmdBeginRendering`), which ends when the value is dropped. Viewport and scissor cover
    /// the targets.
    pub fn begin_rendering(&mut self, desc: &RenderPassDesc<'_>) -> Result<RenderPass<'_>> {
        let mut targets = None;
        self.flush_after(|cmd| {
            targets = Some(cmd.use_targets(desc)?);
            cmd.use_dependencies(&desc.dependencies, Stages::PRE_RASTER | Stages::FRAGMENT)?;
            cmd.use_draw_inputs(&desc.dependencies)
        })?;
        let Some(targets) = targets else {
            return Err(Error::usage("begin_rendering", "the pass has no targets"));
        };
        if !desc.debug_name.is_empty() {
            self.push_label(desc.debug_name);
        }
        self.record_begin(&targets);
        Ok(RenderPass::new(self, targets, !desc.debug_name.is_empty()))
    }

    fn record_begin(&mut self, targets: &Targets) {
        let [width, height] = targets.extent;
        let area = vk::Rect2D { offset: vk::Offset2D::default(), extent: vk::Extent2D { width, height } };
        let depth = targets.depth.unwrap_or_default();
        let mut info =
            vk::RenderingInfo::default().render_area(area).layer_count(1).color_attachments(&targets.colors);
        if targets.depth.is_some() {
            info = info.depth_attachment(&depth);
        }
        if targets.stencil {
            info = info.stencil_attachment(&depth);
        }
        // SAFETY: the views are alive and in the layouts named; no other pass is open, as passes borrow `self`.
        unsafe { self.shared.gpu.device.cmd_begin_rendering(self.raw(), &info) };
        self.rendering = true;
    }

    /// Ends the pass that is open, if any: everything but draws happens outside of passes.
    pub(super) fn end_rendering(&mut self) {
        if std::mem::take(&mut self.rendering) {
            // SAFETY: a pass was begun and has not been ended.
            unsafe { self.shared.gpu.device.cmd_end_rendering(self.raw()) };
        }
    }

    /// Buffers the pass depends on may also be its indices, vertices and indirect arguments.
    fn use_draw_inputs(&mut self, deps: &Dependencies<'_>) -> Result<()> {
        let shared = Arc::clone(&self.shared);
        for handle in deps.buffers.iter().chain(deps.read_buffers) {
            let buffer = shared.store.buffers.get(*handle)?;
            for (usage, next) in super::render::DRAW_INPUTS {
                if buffer.usage.contains(usage) {
                    self.use_buffer(&buffer, next());
                }
            }
        }
        Ok(())
    }

    fn use_targets(&mut self, desc: &RenderPassDesc<'_>) -> Result<Targets> {
        let limit = self.shared.gpu.caps.limits.max_color_targets;
        check_limit("begin_rendering", "colour target count", desc.color.len() as u64, limit.into())?;
        let mut targets = Targets {
            extent: [0, 0],
            color_formats: Vec::new(),
            depth_format: None,
            colors: Vec::new(),
            depth: None,
            stencil: false,
        };
        let mut extent = None;
        for (index, attachment) in desc.color.iter().enumerate() {
            let place = |other: &ColorAttachment| (other.texture, other.mip, other.layer);
            let texture = self.target(attachment.texture, attachment.mip, attachment.layer, &mut extent)?;
            check_color(&texture, attachment.load)?;
            if desc.color[..index].iter().any(|other| place(other) == place(attachment)) {
                return Err(Error::usage(&texture.name, "the pass lists the colour target twice"));
            }
            let next = Use::color_target(attachment.load == ColorLoad::Load);
            self.use_texture(&texture, one(attachment.mip, attachment.layer), next)?;
            targets.colors.push(color_info(&texture, attachment)?);
            targets.color_formats.push(texture.format);
        }
        if let Some(attachment) = &desc.depth {
            let texture = self.target(attachment.texture, attachment.mip, attachment.layer, &mut extent)?;
            check_depth(&texture, attachment.load)?;
            self.use_texture(&texture, one(attachment.mip, attachment.layer), Use::depth_target())?;
            targets.depth = Some(depth_info(&texture, attachment)?);
            targets.depth_format = Some(texture.format);
            targets.stencil = texture.format.has_stencil();
        }
        targets.extent = extent
            .ok_or_else(|| Error::usage("begin_rendering", "give the pass a colour or a depth target"))?;
        Ok(targets)
    }

    /// Finds a target and checks that all targets are equally large.
    fn target(
        &self,
        handle: TextureHandle,
        mip: u32,
        layer: u32,
        extent: &mut Option<[u32; 2]>,
    ) -> Result<Arc<Texture>> {
        let texture = self.shared.store.textures.get(handle)?;
        texture.check_usage(TextureUsage::TARGET)?;
        texture.check_subresource(mip, layer)?;
        let own = texture.mip_extent(mip);
        if *extent.get_or_insert(own) != own {
            let message =
                format!("the target has {own:?} pixels, another one of the pass {:?}", extent.unwrap_or(own));
            return Err(Error::usage(&texture.name, message));
        }
        Ok(texture)
    }
}

fn check_color(texture: &Texture, load: ColorLoad) -> Result<()> {
    if texture.format.is_depth() {
        return Err(Error::usage(&texture.name, "a depth format cannot be a colour target"));
    }
    let fits = match load {
        ColorLoad::Clear(_) => !texture.format.is_uint(),
        ColorLoad::ClearUint(_) => texture.format.is_uint(),
        ColorLoad::Load | ColorLoad::DontCare => true,
    };
    if fits {
        return Ok(());
    }
    let message = format!("{:?} is cleared with ColorLoad::{}", texture.format, clear_name(texture.format));
    Err(Error::usage(&texture.name, message))
}

fn clear_name(format: Format) -> &'static str {
    if format.is_uint() { "ClearUint" } else { "Clear" }
}

fn check_depth(texture: &Texture, load: DepthLoad) -> Result<()> {
    if !texture.format.is_depth() {
        return Err(Error::usage(&texture.name, "the depth target needs a depth format"));
    }
    match load {
        DepthLoad::Clear(depth) if !(0.0..=1.0).contains(&depth) => {
            Err(Error::usage(&texture.name, format!("the clear depth {depth} is not between 0 and 1")))
        }
        _ => Ok(()),
    }
}

fn color_info(
    texture: &Texture,
    attachment: &ColorAttachment,
) -> Result<vk::RenderingAttachmentInfo<'static>> {
    let (op, color) = match attachment.load {
        ColorLoad::Load => (vk::AttachmentLoadOp::LOAD, vk::ClearColorValue::default()),
        ColorLoad::DontCare => (vk::AttachmentLoadOp::DONT_CARE, vk::ClearColorValue::default()),
        ColorLoad::Clear(float32) => (vk::AttachmentLoadOp::CLEAR, vk::ClearColorValue { float32 }),
        ColorLoad::ClearUint(uint32) => (vk::AttachmentLoadOp::CLEAR, vk::ClearColorValue { uint32 }),
    };
    Ok(vk::RenderingAttachmentInfo::default()
        .image_view(texture.target_view(attachment.mip, attachment.layer)?)
        .image_layout(layout(Use::color_target(false).layout))
        .load_op(op)
        .store_op(store_op(attachment.store))
        .clear_value(vk::ClearValue { color }))
}

fn depth_info(
    texture: &Texture,
    attachment: &DepthAttachment,
) -> Result<vk::RenderingAttachmentInfo<'static>> {
    let (op, depth) = match attachment.load {
        DepthLoad::Load => (vk::AttachmentLoadOp::LOAD, 0.0),
        DepthLoad::DontCare => (vk::AttachmentLoadOp::DONT_CARE, 0.0),
        DepthLoad::Clear(depth) => (vk::AttachmentLoadOp::CLEAR, depth),
    };
    let depth_stencil = vk::ClearDepthStencilValue { depth, stencil: 0 };
    Ok(vk::RenderingAttachmentInfo::default()
        .image_view(texture.target_view(attachment.mip, attachment.layer)?)
        .image_layout(layout(Use::depth_target().layout))
        .load_op(op)
        .store_op(store_op(attachment.store))
        .clear_value(vk::ClearValue { depth_stencil }))
}

fn store_op(store: bool) -> vk::AttachmentStoreOp {
    if store { vk::AttachmentStoreOp::STORE } else { vk::AttachmentStoreOp::DONT_CARE }
}
