//! Renders the sample at a frame time.

use lvk::{Context, Dependencies, Holder, RenderPipelineHandle, TextureHandle};

use super::pipelines::TRIANGLE;
use crate::app::frame::Frame;
use crate::app::sample::{FrameTime, Sample};
use crate::raster::{Canvas, RasterError};

/// Draws the triangle.
pub struct HelloTriangle {
    ctx: Context,
    canvas: Canvas,
    pipeline: Holder<RenderPipelineHandle>,
    backdrop: [f32; 3],
    turn: f32,
}

impl HelloTriangle {
    /// Makes a picture of `extent` pixels and the pipeline that draws on it.
    ///
    /// # Errors
    /// [`RasterError`] when the picture is beyond the device, or the device fails.
    pub fn new(ctx: &Context, extent: [u32; 2]) -> Result<Self, RasterError> {
        Ok(Self {
            ctx: ctx.clone(),
            canvas: Canvas::flat(ctx, extent)?,
            pipeline: TRIANGLE.create(ctx)?,
            backdrop: [0.012, 0.014, 0.022],
            turn: 0.0,
        })
    }
}

impl Sample for HelloTriangle {
    type Error = RasterError;

    fn context(&self) -> &Context {
        &self.ctx
    }

    fn update(&mut self, time: FrameTime) -> Result<(), RasterError> {
        self.turn = time.phase();
        Ok(())
    }

    fn record(&mut self, frame: &mut Frame<'_>) -> Result<TextureHandle, RasterError> {
        let nothing = Dependencies::default();
        let mut pass = self.canvas.begin(&mut frame.cmd, "triangle", self.backdrop, &nothing)?;
        pass.bind_render_pipeline(*self.pipeline)?;
        pass.push_constants(&[self.turn, self.canvas.aspect()])?;
        pass.draw(0..3, 0..1)?;
        Ok(self.canvas.picture())
    }

    fn resize(&mut self, extent: [u32; 2]) -> Result<(), RasterError> {
        self.canvas = Canvas::flat(&self.ctx, extent)?;
        Ok(())
    }

    fn panel(&mut self, ui: &mut egui::Ui) {
        ui.label("backdrop");
        ui.color_edit_button_rgb(&mut self.backdrop);
    }

    fn reload(&mut self) -> Result<(), RasterError> {
        self.pipeline = TRIANGLE.create(&self.ctx)?;
        Ok(())
    }
}
