//! Draws of the application inside of an interface.

use std::fmt;
use std::sync::Arc;

use egui::{PaintCallback, PaintCallbackInfo, Rect};
use lvk::RenderPass;

type Draw = dyn Fn(&PaintCallbackInfo, &mut RenderPass<'_>) -> lvk::Result<()> + Send + Sync;

/// Draws of the application inside of an interface, for example a scene in a window of egui.
///
/// The painter sets the viewport to the rectangle of the callback and the scissor to its visible part, and calls the
/// function inside its render pass. The function may bind pipelines and buffers, push constants and draw; the painter
/// restores its own state afterwards. Resources that the draws read and the same command buffer wrote are dependencies
/// of the pass.
pub struct Callback(Box<Draw>);

impl Callback {
    /// Returns a callback that calls `draw` in each frame that shows it.
    pub fn new(
        draw: impl Fn(&PaintCallbackInfo, &mut RenderPass<'_>) -> lvk::Result<()> + Send + Sync + 'static,
    ) -> Self {
        Self(Box::new(draw))
    }

    /// Returns a shape that covers `rect`, in points, for [`egui::Painter::add`].
    pub fn shape(
        rect: Rect,
        draw: impl Fn(&PaintCallbackInfo, &mut RenderPass<'_>) -> lvk::Result<()> + Send + Sync + 'static,
    ) -> PaintCallback {
        PaintCallback { rect, callback: Arc::new(Self::new(draw)) }
    }

    pub(crate) fn call(&self, info: &PaintCallbackInfo, pass: &mut RenderPass<'_>) -> lvk::Result<()> {
        (self.0)(info, pass)
    }
}

impl fmt::Debug for Callback {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str("Callback")
    }
}
