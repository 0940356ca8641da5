//! Resolves at the end of a render pass.

use ash::vk;

use super::desc::DepthResolve;
use super::target::PassTarget;
use crate::barrier::{Layout, Use};
use crate::command::CommandBuffer;
use crate::error::{Error, Result};
use crate::format::{Format, NumericFormat};
use crate::gpu::caps::resolve_modes::ResolveMode;
use crate::submit::emit_barriers::vulkan_layout;

impl CommandBuffer {
    /// Declares that the pass uses a multisampled colour target and its resolve target. Returns the attachment with
    /// both.
    pub(super) fn use_color_resolve(
        &mut self,
        source: &PassTarget,
        to: &PassTarget,
        info: vk::RenderingAttachmentInfo<'static>,
    ) -> Result<vk::RenderingAttachmentInfo<'static>> {
        check_resolve(source, to)?;
        if to.texture.kind.is_3d() && !self.shared.gpu.caps.resolves_to_volumes {
            let reason =
                "NVIDIA's driver leaves some slices as they are; resolve to a 2D texture and copy it";
            return Err(Error::unsupported(format!("a resolve to a slice of '{}'", to.texture.name), reason));
        }
        self.use_texture(&source.texture, source.subresources(), Use::resolve_source())?;
        self.use_texture(&to.texture, to.subresources(), Use::resolve_target())?;
        let mode = color_resolve_mode(source.texture.format);
        Ok(info
            .resolve_mode(mode)
            .resolve_image_view(to.view()?)
            .resolve_image_layout(vulkan_layout(Use::resolve_target().layout)))
    }

    /// As [`use_color_resolve`](Self::use_color_resolve), for a depth target, whose depth and stencil are resolved each
    /// by its mode.
    pub(super) fn use_depth_resolve(
        &mut self,
        source: &PassTarget,
        to: &PassTarget,
        resolve: &DepthResolve,
        [depth, stencil]: [&mut Option<vk::RenderingAttachmentInfo<'static>>; 2],
    ) -> Result<()> {
        check_resolve(source, to)?;
        let stencil_mode = resolve.stencil.filter(|_| source.texture.format.has_stencil());
        self.check_resolve_modes(source, resolve.depth, stencil_mode)?;
        self.use_texture(&source.texture, source.subresources(), Use::resolve_source())?;
        let written = Use::resolve_target().with_layout(Layout::DepthTarget);
        self.use_texture(&to.texture, to.subresources(), written)?;
        let view = to.view()?;
        for (info, mode) in [(depth, resolve.depth), (stencil, stencil_mode)] {
            if let (Some(info), Some(mode)) = (info, mode) {
                info.resolve_mode = vk::ResolveModeFlags::from_raw(mode.bit().bits());
                info.resolve_image_view = view;
                info.resolve_image_layout = vulkan_layout(written.layout);
            }
        }
        Ok(())
    }

    fn check_resolve_modes(
        &self,
        source: &PassTarget,
        depth: Option<ResolveMode>,
        stencil: Option<ResolveMode>,
    ) -> Result<()> {
        let limits = &self.shared.gpu.caps.limits.depth_resolve;
        let (name, format) = (&source.texture.name, source.texture.format);
        if depth.is_none() && stencil.is_none() {
            return Err(Error::usage(name, "give the depth resolve a mode of depth or of stencil"));
        }
        // Without stencil, the mode of depth need not match another mode.
        let allowed = match format.has_stencil() {
            true => limits.supports(depth, stencil),
            false => depth.is_none_or(|mode| limits.depth.contains(mode.bit())),
        };
        if allowed {
            return Ok(());
        }
        let what = format!("resolving depth of '{name}' by {depth:?} and stencil by {stencil:?}");
        Err(Error::unsupported(what, format!("the device has {limits:?}")))
    }
}

fn check_resolve(source: &PassTarget, to: &PassTarget) -> Result<()> {
    to.texture.check_not_transient()?;
    let name = &to.texture.name;
    let from = &source.texture;
    if from.image.samples == 1 || to.texture.image.samples != 1 {
        let message = format!(
            "a resolve goes from several samples a pixel to one, not from {} ('{}') to {}",
            from.image.samples, from.name, to.texture.image.samples
        );
        return Err(Error::usage(name, message));
    }
    if source.extent() != to.extent() {
        let message = format!("it has {:?} pixels, '{}' has {:?}", to.extent(), from.name, source.extent());
        return Err(Error::usage(name, message));
    }
    if from.format != to.texture.format {
        let message = format!("'{}' has the format {:?}, and a resolve keeps it", from.name, from.format);
        return Err(Error::usage(name, message));
    }
    Ok(())
}

/// Returns the only resolve mode that Vulkan allows for a colour format.
fn color_resolve_mode(format: Format) -> vk::ResolveModeFlags {
    if format.numeric_format() != NumericFormat::Float {
        vk::ResolveModeFlags::SAMPLE_ZERO
    } else {
        vk::ResolveModeFlags::AVERAGE
    }
}
