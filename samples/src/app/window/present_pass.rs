//! The pass that draws a sample's image and the panel to the swapchain.

use std::sync::Arc;

use egui::{Color32, LayerId, Rect, TextureId, pos2};
use lvk::{
    ColorAttachment, ColorSpace, CommandBuffer, Context, Dependencies, Holder, PresentMode, RenderPassDesc,
    SwapchainDesc, SwapchainHandle, SwapchainImage, TextureHandle, WindowHandles,
};
use lvk_egui::{Painter, Screen, UserTexture};

/// A swapchain and what is painted on it.
pub(super) struct PresentPass {
    ctx: Context,
    swapchain: Holder<SwapchainHandle>,
    /// `None` until the format of the first image is known.
    painter: Option<Painter>,
    ui: egui::Context,
    /// The texture of the sample that is shown, and its id for egui.
    shown: Option<(TextureHandle, TextureId)>,
}

impl PresentPass {
    /// Creates the swapchain of the context's window, `extent` pixels large.
    pub(super) fn new(ctx: &Context, extent: [u32; 2]) -> lvk::Result<Self> {
        let swapchain = ctx.create_swapchain(&SwapchainDesc {
            extent,
            present_modes: &[PresentMode::Fifo],
            color_spaces: &[ColorSpace::SrgbEncoded, ColorSpace::Srgb],
            ..SwapchainDesc::default()
        })?;
        let ui = egui::Context::default();
        ui.options_mut(|options| options.zoom_with_keyboard = false);
        Ok(Self { ctx: ctx.clone(), swapchain, painter: None, ui, shown: None })
    }

    /// The egui context.
    pub(super) fn ui(&self) -> &egui::Context {
        &self.ui
    }

    /// The present mode, and those that the device supports.
    pub(super) fn present_modes(&self) -> lvk::Result<(PresentMode, Vec<PresentMode>)> {
        let info = self.ctx.swapchain_info(*self.swapchain)?;
        Ok((info.present_mode, info.present_modes))
    }

    pub(super) fn set_present_mode(&self, mode: PresentMode) -> lvk::Result<()> {
        self.ctx.set_present_mode(*self.swapchain, &[mode])
    }

    pub(super) fn resize(&self, extent: [u32; 2]) -> lvk::Result<()> {
        self.ctx.resize_swapchain(*self.swapchain, extent)
    }

    /// Gives the window up, which may go afterwards.
    pub(super) fn suspend(&self) -> lvk::Result<()> {
        self.ctx.suspend_swapchain(*self.swapchain)
    }

    /// Goes on in `window`, `extent` pixels large.
    pub(super) fn resume(&self, window: &Arc<dyn WindowHandles>, extent: [u32; 2]) -> lvk::Result<()> {
        self.ctx.resume_swapchain(*self.swapchain, window, extent)
    }

    /// Acquires the next swapchain image; `None` while nothing can be presented.
    pub(super) fn next_image(&self) -> lvk::Result<Option<SwapchainImage>> {
        self.ctx.next_image(*self.swapchain)
    }

    /// Records `picture` over the whole of `image`, and over it what `panel` lays out.
    pub(super) fn record(
        &mut self,
        cmd: &mut CommandBuffer,
        image: &SwapchainImage,
        picture: TextureHandle,
        input: egui::RawInput,
        mut panel: impl FnMut(&egui::Context),
    ) -> lvk_egui::Result<()> {
        let painter = match &mut self.painter {
            Some(painter) => painter,
            none => none.insert(Painter::new(&self.ctx, image.format())?),
        };
        painter.set_target(image.format())?;
        let texture = texture_of(&mut self.shown, painter, picture)?;
        let output = self.ui.run(input, |ui| {
            let corners = Rect { min: pos2(0.0, 0.0), max: pos2(1.0, 1.0) };
            ui.layer_painter(LayerId::background()).image(
                texture,
                ui.content_rect(),
                corners,
                Color32::WHITE,
            );
            panel(ui);
        });
        let pixels_per_point = output.pixels_per_point;
        let primitives = self.ui.tessellate(output.shapes, pixels_per_point);
        let screen = Screen { size_px: image.extent(), pixels_per_point };
        painter.update(&primitives, &output.textures_delta, screen)?;
        let mut pass = cmd.begin_rendering(&RenderPassDesc {
            color: &[ColorAttachment::clear(image.texture(), [0.0, 0.0, 0.0, 1.0])],
            dependencies: Dependencies { sampled_images: &[picture], ..Dependencies::default() },
            debug_name: "window",
            ..RenderPassDesc::default()
        })?;
        painter.record(&mut pass)
    }
}

/// Returns the egui id of the picture, which keeps it while it is displayed.
fn texture_of(
    shown: &mut Option<(TextureHandle, TextureId)>,
    painter: &mut Painter,
    picture: TextureHandle,
) -> lvk_egui::Result<TextureId> {
    match *shown {
        Some((known, id)) if known == picture => return Ok(id),
        Some((_, id)) => painter.unregister_texture(id)?,
        None => {}
    }
    *shown = None;
    let id = painter.register_texture(picture, &UserTexture::default())?;
    *shown = Some((picture, id));
    Ok(id)
}
