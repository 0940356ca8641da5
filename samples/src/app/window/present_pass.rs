//! The pass that draws a sample's image and the panel to the swapchain.

use std::sync::Arc;

use egui::{Color32, LayerId, Rect, pos2};
use lvk::{
    ColorAttachment, ColorSpace, CommandBuffer, Context, Dependencies, Holder, PresentMode, RenderPassDesc,
    SwapchainDesc, SwapchainHandle, SwapchainImage, TextureHandle, TextureUsage, TextureViewDesc,
    WindowHandles,
};

use crate::app::ui::Painter;

/// A swapchain and what is painted on it.
pub(super) struct PresentPass {
    ctx: Context,
    swapchain: Holder<SwapchainHandle>,
    painter: Painter,
    ui: egui::Context,
    /// The picture as shaders read it, and the texture of the sample that it is.
    shown: Option<(TextureHandle, Holder<TextureHandle>)>,
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
        let (painter, ui) = (Painter::new(ctx)?, egui::Context::default());
        ui.options_mut(|options| options.zoom_with_keyboard = false);
        Ok(Self { ctx: ctx.clone(), swapchain, painter, ui, shown: None })
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

    /// The painter of the panel.
    pub(super) fn painter(&mut self) -> &mut Painter {
        &mut self.painter
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
    ) -> lvk::Result<()> {
        let texture = self.texture_of(picture)?;
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
        self.painter.prepare(image.format())?;
        self.painter.upload(&self.ui, output, image.extent())?;
        let mut pass = cmd.begin_rendering(&RenderPassDesc {
            color: &[ColorAttachment::clear(image.texture(), [0.0, 0.0, 0.0, 1.0])],
            dependencies: Dependencies { sampled_images: &[picture], ..Dependencies::default() },
            debug_name: "window",
            ..RenderPassDesc::default()
        })?;
        self.painter.record(&mut pass)
    }

    /// The egui id of the image. The view of the image keeps its bindless index while the image is displayed.
    fn texture_of(&mut self, picture: TextureHandle) -> lvk::Result<egui::TextureId> {
        let view = TextureViewDesc {
            texture: Some(picture),
            usage: Some(TextureUsage::SAMPLED),
            debug_name: "shown picture",
            ..TextureViewDesc::default()
        };
        let view = match self.shown.take() {
            Some((known, view)) if known == picture => view,
            _ => self.ctx.create_texture_view(&view)?,
        };
        let (_, view) = self.shown.insert((picture, view));
        Ok(Painter::texture_id(view))
    }
}
