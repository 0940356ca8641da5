//! Renders the sample at a frame time.

use crate::app::render_target::RenderTarget;
use crate::app::run_error::RunError;
use crate::app::sample_error::SampleError;
use crate::pipelines::shader;
use crate::raster::RasterPipeline;
use bytemuck::{Pod, Zeroable};
use lvk::{
    BlockLayout, Context, Dependencies, Holder, RenderPipelineDesc, RenderPipelineHandle, TextureHandle,
};

use crate::app::frame::Frame;
use crate::app::sample::{FrameTime, Sample};

pub(super) const TRIANGLE: RasterPipeline = RasterPipeline::flat(
    "hello_triangle",
    "hello_triangle: triangle",
    &[shader!("hello_triangle", "triangle.vert"), shader!("hello_triangle", "triangle.frag")],
);

lvk::shader_struct! {
    /// `Push` in the shaders.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    struct Push {
        turn: f32,
        aspect: f32,
    }
}

/// Draws the triangle.
pub struct HelloTriangle {
    ctx: Context,
    target: RenderTarget,
    pipeline: Holder<RenderPipelineHandle>,
    backdrop: [f32; 3],
    turn: f32,
}

impl HelloTriangle {
    /// Makes a picture of `extent` pixels and the pipeline that draws on it.
    ///
    /// # Errors
    /// [`SampleError`] when the picture is beyond the device, or the device fails.
    pub fn new(ctx: &Context, extent: [u32; 2]) -> Result<Self, SampleError> {
        Ok(Self {
            ctx: ctx.clone(),
            target: RenderTarget::flat(ctx, extent)?,
            pipeline: pipeline(ctx)?,
            backdrop: [0.012, 0.014, 0.022],
            turn: 0.0,
        })
    }
}

impl Sample for HelloTriangle {
    fn context(&self) -> &Context {
        &self.ctx
    }

    fn update(&mut self, time: FrameTime) {
        self.turn = time.phase();
    }

    fn record(&mut self, frame: &mut Frame<'_>) -> Result<TextureHandle, RunError> {
        let nothing = Dependencies::default();
        let mut pass = self.target.begin(&mut frame.cmd, "triangle", self.backdrop, &nothing)?;
        pass.bind_render_pipeline(*self.pipeline)?;
        pass.push_constants(&Push { turn: self.turn, aspect: self.target.aspect() })?;
        pass.draw(0..3, 0..1)?;
        Ok(self.target.image())
    }

    fn resize(&mut self, extent: [u32; 2]) -> Result<(), RunError> {
        self.target = RenderTarget::flat(&self.ctx, extent)?;
        Ok(())
    }

    #[cfg(feature = "window")]
    fn panel(&mut self, ui: &mut egui::Ui) {
        ui.label("backdrop");
        ui.color_edit_button_rgb(&mut self.backdrop);
    }

    fn reload(&mut self) -> Result<(), RunError> {
        self.pipeline = pipeline(&self.ctx)?;
        Ok(())
    }
}

fn pipeline(ctx: &Context) -> lvk::Result<Holder<RenderPipelineHandle>> {
    let layouts = &[BlockLayout::push_constants::<Push>()];
    TRIANGLE.create_with(ctx, &RenderPipelineDesc { layouts, ..RenderPipelineDesc::default() })
}
