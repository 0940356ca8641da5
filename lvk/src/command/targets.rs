//! Targets of a render pass: found, checked, and turned into what Vulkan takes.

use std::sync::Arc;

use ash::vk;

use super::CommandBuffer;
use super::attachment::{ColorAttachment, ColorLoad, DepthAttachment, DepthLoad};
use crate::barrier::Use;
use crate::error::{Error, Result, check_limit};
use crate::format::{Format, Numbers};
use crate::handle::TextureHandle;
use crate::resource::Texture;
use crate::resource::texture_desc::TextureUsage;
use crate::submit::emit::layout;

/// The targets of a pass, found and checked.
pub(super) struct Targets {
    pub(super) extent: [u32; 2],
    pub(super) color_formats: Vec<Format>,
    pub(super) depth_format: Option<Format>,
    pub(super) colors: Vec<vk::RenderingAttachmentInfo<'static>>,
    pub(super) depth: Option<vk::RenderingAttachmentInfo<'static>>,
    pub(super) stencil: bool,
    /// Samples a pixel, the same in all targets.
    pub(super) samples: u32,
}

impl CommandBuffer {
    /// Finds and checks the targets of a pass; the pass uses them.
    pub(super) fn use_targets(
        &mut self,
        color: &[ColorAttachment],
        depth: Option<&DepthAttachment>,
    ) -> Result<Targets> {
        let limit = self.shared.gpu.caps.limits.max_color_targets;
        check_limit("begin_rendering", "colour target count", color.len() as u64, limit.into())?;
        let mut targets = Targets {
            extent: [0, 0],
            color_formats: Vec::new(),
            depth_format: None,
            colors: Vec::new(),
            depth: None,
            stencil: false,
            samples: 1,
        };
        let mut shape = None;
        let mut drawn = Vec::with_capacity(color.len());
        for attachment in color {
            let texture = self.target(attachment.texture, attachment.mip, attachment.layer, &mut shape)?;
            check_color(&texture, attachment.load)?;
            let part = texture.part(attachment.mip, attachment.layer);
            if drawn.contains(&(texture.image.id, part)) {
                return Err(Error::usage(&texture.name, "the pass lists the colour target twice"));
            }
            drawn.push((texture.image.id, part));
            let part = texture.drawn_part(attachment.mip, attachment.layer);
            self.use_texture(&texture, part, Use::color_target(attachment.load == ColorLoad::Load))?;
            targets.colors.push(color_info(&texture, attachment)?);
            targets.color_formats.push(texture.format);
        }
        if let Some(attachment) = depth {
            let texture = self.target(attachment.texture, attachment.mip, attachment.layer, &mut shape)?;
            check_depth(&texture, attachment.load)?;
            let part = texture.drawn_part(attachment.mip, attachment.layer);
            self.use_texture(&texture, part, Use::depth_target())?;
            targets.depth = Some(depth_info(&texture, attachment)?);
            targets.depth_format = Some(texture.format);
            targets.stencil = texture.format.has_stencil();
        }
        (targets.extent, targets.samples) = shape
            .ok_or_else(|| Error::usage("begin_rendering", "give the pass a colour or a depth target"))?;
        Ok(targets)
    }

    /// Finds a target and checks that all targets are equally large, with equally many samples.
    fn target(
        &self,
        handle: TextureHandle,
        mip: u32,
        layer: u32,
        shape: &mut Option<([u32; 2], u32)>,
    ) -> Result<Arc<Texture>> {
        let texture = self.shared.store.textures.get(handle)?;
        texture.check_usage(TextureUsage::TARGET)?;
        texture.check_target(mip, layer)?;
        let own = (texture.mip_extent(mip), texture.image.samples);
        let first = *shape.get_or_insert(own);
        if first != own {
            let message = format!(
                "the target has {:?} pixels of {} samples, another one of the pass {:?} of {}",
                own.0, own.1, first.0, first.1
            );
            return Err(Error::usage(&texture.name, message));
        }
        Ok(texture)
    }
}

fn check_color(texture: &Texture, load: ColorLoad) -> Result<()> {
    if !texture.format.is_color() {
        return Err(Error::usage(&texture.name, "a depth format cannot be a colour target"));
    }
    let numbers = texture.format.numbers();
    let fits = match load {
        ColorLoad::Clear(_) => numbers == Numbers::Float,
        ColorLoad::ClearUint(_) => numbers == Numbers::Uint,
        ColorLoad::ClearSint(_) => numbers == Numbers::Sint,
        ColorLoad::Load | ColorLoad::DontCare => true,
    };
    if fits {
        return Ok(());
    }
    let message = format!("{:?} is cleared with ColorLoad::{}", texture.format, clear_name(texture.format));
    Err(Error::usage(&texture.name, message))
}

fn clear_name(format: Format) -> &'static str {
    match format.numbers() {
        Numbers::Float => "Clear",
        Numbers::Uint => "ClearUint",
        Numbers::Sint => "ClearSint",
    }
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
        ColorLoad::ClearSint(int32) => (vk::AttachmentLoadOp::CLEAR, vk::ClearColorValue { int32 }),
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
