//! Targets of a render pass: their checks and their conversion to Vulkan attachments.

use arrayvec::ArrayVec;
use ash::vk;

use super::area::{PassArea, PassLayers};
use super::desc::{
    ColorAttachment, ColorLoadOp, DepthAttachment, DepthLoadOp, RenderPassDesc, Resolve, StencilLoadOp,
};
use super::input_attachments::PassInputAttachments;
use super::target::PassTarget;
use crate::barrier::{ResourceId, Subresources, Use};
use crate::command::CommandBuffer;
use crate::error::{Error, Result, check_limit};
use crate::format::{Format, NumericFormat};
use crate::handle::TextureHandle;
use crate::pipeline::rendering_formats::RenderingFormats;
use crate::resource::Texture;
use crate::resource::texture_desc::TextureUsage;
use crate::submit::emit_barriers::vulkan_layout;

/// Texels that a pass writes: those of its colour targets and of the textures they are resolved to.
type DrawnTexels = ArrayVec<(ResourceId, Subresources), { 2 * RenderingFormats::MAX_COLORS }>;

/// The checked targets of a pass.
pub(super) struct PassTargets {
    pub(super) extent: [u32; 2],
    pub(super) area: PassArea,
    pub(super) layers: PassLayers,
    pub(super) shape: RenderingFormats,
    pub(super) read_only_depth: bool,
    pub(super) inputs: PassInputAttachments,
    pub(super) rates: Option<vk::RenderingFragmentShadingRateAttachmentInfoKHR<'static>>,
    pub(super) colors: ArrayVec<vk::RenderingAttachmentInfo<'static>, { RenderingFormats::MAX_COLORS }>,
    pub(super) depth: Option<vk::RenderingAttachmentInfo<'static>>,
    pub(super) stencil: Option<vk::RenderingAttachmentInfo<'static>>,
}

impl CommandBuffer {
    /// Checks the targets of a pass and declares their uses.
    pub(super) fn use_targets(&mut self, desc: &RenderPassDesc<'_>) -> Result<PassTargets> {
        let gpu = &self.shared.gpu;
        let limit = gpu.caps.limits.max_color_targets;
        check_limit("begin_rendering", "colour target count", desc.color.len() as u64, limit.into())?;
        let layers = PassLayers::new(gpu, desc)?;
        let mut inputs = PassInputAttachments::new(gpu, desc)?;
        let mut size = None;
        // None overflows: the limit of colour targets is `MAX_COLORS` at most.
        let (mut colors, mut formats) =
            (ArrayVec::new(), ArrayVec::<_, { RenderingFormats::MAX_COLORS }>::new());
        let mut drawn = DrawnTexels::new();
        for attachment in desc.color {
            let ColorAttachment { texture, mip, layer, .. } = *attachment;
            let target = self.checked_target(texture, mip, layer, layers, &mut size)?;
            check_color(&target.texture, attachment.load)?;
            if attachment.store || attachment.load == ColorLoadOp::Load {
                target.texture.check_not_transient()?;
            }
            check_disjoint(&target, &mut drawn)?;
            let used = inputs.target_use(&target, Use::color_target(attachment.load == ColorLoadOp::Load));
            self.use_texture(&target.texture, target.subresources(), used)?;
            inputs.add_color(colors.len() as u32, &target)?;
            let mut info = color_info(&target, attachment, used)?;
            if let Some(Resolve { texture, mip, layer }) = attachment.resolve {
                let to = self.checked_target(texture, mip, layer, layers, &mut None)?;
                info = self.use_color_resolve(&target, &to, info)?;
                check_disjoint(&to, &mut drawn)?;
            }
            colors.push(info);
            formats.push(target.texture.format);
        }
        let mut targets = PassTargets {
            extent: [0, 0],
            area: PassArea::default(),
            layers,
            shape: RenderingFormats::default(),
            read_only_depth: false,
            inputs,
            rates: None,
            colors,
            depth: None,
            stencil: None,
        };
        let mut depth_format = None;
        if let Some(attachment) = &desc.depth {
            let target =
                self.checked_target(attachment.texture, attachment.mip, attachment.layer, layers, &mut size)?;
            depth_format = Some(target.texture.format);
            self.use_depth_target(&target, attachment, &mut targets)?;
        }
        let (extent, samples) =
            size.ok_or_else(|| Error::usage("begin_rendering", "give the pass a colour or a depth target"))?;
        targets.extent = extent;
        targets.shape = RenderingFormats::new(formats, depth_format, samples, desc.view_mask);
        targets.area = PassArea::new(desc.area, extent)?;
        targets.inputs.check_desc(desc)?;
        targets.rates = self.use_shading_rate_attachment(desc, targets.area)?;
        Ok(targets)
    }

    fn use_depth_target(
        &mut self,
        target: &PassTarget,
        attachment: &DepthAttachment,
        targets: &mut PassTargets,
    ) -> Result<()> {
        let texture = &target.texture;
        check_depth(texture, attachment)?;
        if is_loaded_or_stored(texture, attachment) {
            texture.check_not_transient()?;
        }
        let plain = if attachment.read_only { Use::depth_read() } else { Use::depth_target() };
        let used = targets.inputs.target_use(target, plain);
        self.use_texture(texture, target.subresources(), used)?;
        targets.inputs.add_depth(target)?;
        let view = target.view()?;
        targets.depth = Some(depth_info(view, attachment).image_layout(vulkan_layout(used.layout)));
        let stencil = || stencil_info(view, attachment).image_layout(vulkan_layout(used.layout));
        targets.stencil = texture.format.has_stencil().then(stencil);
        targets.read_only_depth = attachment.read_only;
        let Some(resolve) = &attachment.resolve else { return Ok(()) };
        let to =
            self.checked_target(resolve.texture, resolve.mip, resolve.layer, target.layers, &mut None)?;
        self.use_depth_resolve(target, &to, resolve, [&mut targets.depth, &mut targets.stencil])
    }

    /// Returns a target. Fails unless all targets have the same extent and number of samples.
    fn checked_target(
        &self,
        handle: TextureHandle,
        mip: u32,
        layer: u32,
        layers: PassLayers,
        size: &mut Option<([u32; 2], u32)>,
    ) -> Result<PassTarget> {
        let texture = self.shared.store.textures.get(handle)?;
        texture.check_usage(TextureUsage::TARGET)?;
        texture.check_target(mip, layer, layers.layer_count())?;
        let own = (texture.mip_extent(mip), texture.image.samples);
        let first = *size.get_or_insert(own);
        if first != own {
            let message = format!(
                "the target has {:?} pixels of {} samples, another one of the pass {:?} of {}",
                own.0, own.1, first.0, first.1
            );
            return Err(Error::usage(&texture.name, message));
        }
        Ok(PassTarget { texture, mip, layer, layers })
    }
}

/// Fails if an earlier target has some of the target's texels.
fn check_disjoint(target: &PassTarget, drawn: &mut DrawnTexels) -> Result<()> {
    let (id, texels) = (target.texture.image.id, target.subresource_texels());
    if drawn.iter().any(|(other, part)| *other == id && part.intersection(texels).is_some()) {
        return Err(Error::usage(&target.texture.name, "the pass lists the colour target twice"));
    }
    drawn.push((id, texels));
    Ok(())
}

fn check_color(texture: &Texture, load: ColorLoadOp) -> Result<()> {
    if !texture.format.is_color() {
        return Err(Error::usage(&texture.name, "a depth format cannot be a colour target"));
    }
    let numbers = texture.format.numeric_format();
    let fits = match load {
        ColorLoadOp::Clear(_) => numbers == NumericFormat::Float,
        ColorLoadOp::ClearUint(_) => numbers == NumericFormat::Uint,
        ColorLoadOp::ClearSint(_) => numbers == NumericFormat::Sint,
        ColorLoadOp::Load | ColorLoadOp::DontCare => true,
    };
    if fits {
        return Ok(());
    }
    let message =
        format!("{:?} is cleared with ColorLoadOp::{}", texture.format, clear_op_name(texture.format));
    Err(Error::usage(&texture.name, message))
}

fn clear_op_name(format: Format) -> &'static str {
    match format.numeric_format() {
        NumericFormat::Float => "Clear",
        NumericFormat::Uint => "ClearUint",
        NumericFormat::Sint => "ClearSint",
    }
}

/// True if the pass loads the target's previous contents, or stores its contents at the end.
fn is_loaded_or_stored(texture: &Texture, attachment: &DepthAttachment) -> bool {
    let stencil = attachment.stencil_store || attachment.stencil == StencilLoadOp::Load;
    let depth = attachment.store || attachment.load == DepthLoadOp::Load;
    depth || attachment.read_only || (texture.format.has_stencil() && stencil)
}

fn check_depth(texture: &Texture, attachment: &DepthAttachment) -> Result<()> {
    if !texture.format.is_depth() {
        return Err(Error::usage(&texture.name, "the depth target needs a depth format"));
    }
    let stencil_loads = attachment.stencil == StencilLoadOp::Load || !texture.format.has_stencil();
    if attachment.read_only && !(attachment.load == DepthLoadOp::Load && stencil_loads) {
        let message = "a read-only depth target is loaded, depth and stencil; use DepthAttachment::read_only";
        return Err(Error::usage(&texture.name, message));
    }
    match attachment.load {
        DepthLoadOp::Clear(depth) if !(0.0..=1.0).contains(&depth) => {
            Err(Error::usage(&texture.name, format!("the clear depth {depth} is not between 0 and 1")))
        }
        _ => Ok(()),
    }
}

fn color_info(
    target: &PassTarget,
    attachment: &ColorAttachment,
    used: Use,
) -> Result<vk::RenderingAttachmentInfo<'static>> {
    let (op, color) = match attachment.load {
        ColorLoadOp::Load => (vk::AttachmentLoadOp::LOAD, vk::ClearColorValue::default()),
        ColorLoadOp::DontCare => (vk::AttachmentLoadOp::DONT_CARE, vk::ClearColorValue::default()),
        ColorLoadOp::Clear(float32) => (vk::AttachmentLoadOp::CLEAR, vk::ClearColorValue { float32 }),
        ColorLoadOp::ClearSint(int32) => (vk::AttachmentLoadOp::CLEAR, vk::ClearColorValue { int32 }),
        ColorLoadOp::ClearUint(uint32) => (vk::AttachmentLoadOp::CLEAR, vk::ClearColorValue { uint32 }),
    };
    Ok(vk::RenderingAttachmentInfo::default()
        .image_view(target.view()?)
        .image_layout(vulkan_layout(used.layout))
        .load_op(op)
        .store_op(store_op(attachment.store))
        .clear_value(vk::ClearValue { color }))
}

fn depth_info(view: vk::ImageView, attachment: &DepthAttachment) -> vk::RenderingAttachmentInfo<'static> {
    let (op, depth) = match attachment.load {
        DepthLoadOp::Load => (vk::AttachmentLoadOp::LOAD, 0.0),
        DepthLoadOp::DontCare => (vk::AttachmentLoadOp::DONT_CARE, 0.0),
        DepthLoadOp::Clear(depth) => (vk::AttachmentLoadOp::CLEAR, depth),
    };
    aspect_info(view, attachment, attachment.store)
        .load_op(op)
        .clear_value(vk::ClearValue { depth_stencil: vk::ClearDepthStencilValue { depth, stencil: 0 } })
}

fn stencil_info(view: vk::ImageView, attachment: &DepthAttachment) -> vk::RenderingAttachmentInfo<'static> {
    let (op, value) = match attachment.stencil {
        StencilLoadOp::Load => (vk::AttachmentLoadOp::LOAD, 0),
        StencilLoadOp::DontCare => (vk::AttachmentLoadOp::DONT_CARE, 0),
        StencilLoadOp::Clear(value) => (vk::AttachmentLoadOp::CLEAR, value),
    };
    let depth_stencil = vk::ClearDepthStencilValue { depth: 0.0, stencil: value.into() };
    aspect_info(view, attachment, attachment.stencil_store)
        .load_op(op)
        .clear_value(vk::ClearValue { depth_stencil })
}

/// Returns the attachment values that depth and stencil share. A read-only target is not stored either, since a store
/// would be a write.
fn aspect_info(
    view: vk::ImageView,
    attachment: &DepthAttachment,
    store: bool,
) -> vk::RenderingAttachmentInfo<'static> {
    let store = if attachment.read_only { vk::AttachmentStoreOp::NONE } else { store_op(store) };
    vk::RenderingAttachmentInfo::default().image_view(view).store_op(store)
}

fn store_op(store: bool) -> vk::AttachmentStoreOp {
    if store { vk::AttachmentStoreOp::STORE } else { vk::AttachmentStoreOp::DONT_CARE }
}
