//! Renders the sample at a frame time.

use crate::app::render_target::RenderTarget;
use crate::app::run_error::RunError;
use crate::app::sample_error::SampleError;
use bytemuck::{Pod, Zeroable};
use lvk::{
    AddressMode, Context, Dependencies, Holder, RenderPipelineDesc, RenderPipelineHandle, SamplerDesc,
    SamplerHandle, TextureHandle, Topology,
};

use super::config::{YuvConfig, YuvFormat};
use super::pipelines::PLANES;
use super::video_texture::{VideoFormat, VideoTexture, supported};
use crate::app::frame::Frame;
use crate::app::sample::{FrameTime, Sample};

/// Beside and above the picture.
const BACKDROP: [f32; 3] = [0.006, 0.007, 0.009];

/// Shows the moving picture.
pub struct Yuv {
    ctx: Context,
    config: YuvConfig,
    target: RenderTarget,
    formats: Vec<YuvFormat>,
    video: VideoTexture,
    planes: Holder<RenderPipelineHandle>,
    sampler: Holder<SamplerHandle>,
    phase: f32,
}

/// `Push` in `shaders/yuv/push.glsl`.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Push {
    /// Fraction of the target that the picture covers.
    covered: [f32; 2],
    /// Textures of Y, Cb and Cr, and the channels that hold them.
    planes: [u32; 3],
    channels: [u32; 3],
    sampler: u32,
}

impl Yuv {
    /// Makes textures and pipelines. The animation stands at its beginning. The context is made with
    /// [`CONVERSIONS`](super::CONVERSIONS).
    ///
    /// # Errors
    /// [`SampleError`] when the picture is beyond the device, the device lacks the format ([`lvk::Error::Unsupported`]), or it
    /// fails.
    pub fn new(ctx: &Context, config: &YuvConfig) -> Result<Self, SampleError> {
        let mut config = config.clamped();
        let target = RenderTarget::flat(ctx, config.extent)?;
        let video_format = video_format(&config, config.format.unwrap_or(YuvFormat::Nv12));
        let formats = supported(ctx, video_format)?;
        let format = config.format.or(formats.first().copied()).unwrap_or(video_format.format);
        config.format = Some(format);
        Ok(Self {
            target,
            video: VideoTexture::new(ctx, VideoFormat { format, ..video_format })?,
            planes: planes(ctx)?,
            sampler: ctx.create_sampler(&SamplerDesc {
                address: [AddressMode::ClampToEdge; 3],
                ..SamplerDesc::default()
            })?,
            ctx: ctx.clone(),
            config,
            formats,
            phase: 0.0,
        })
    }

    /// The formats that the device has.
    pub fn formats(&self) -> &[YuvFormat] {
        &self.formats
    }

    /// The format that is video.
    pub fn format(&self) -> YuvFormat {
        self.video.video_format.format
    }

    /// The current planes, as they were uploaded.
    pub fn planes(&self) -> Vec<Vec<u8>> {
        self.video.encode(self.phase)
    }

    /// Takes over what the panel or a key has chosen.
    fn apply(&mut self) -> Result<(), SampleError> {
        let wanted = video_format(&self.config, self.config.format.unwrap_or(self.video.video_format.format));
        if wanted != self.video.video_format {
            self.video = VideoTexture::new(&self.ctx, wanted)?;
        }
        Ok(())
    }

    fn push(&self) -> Push {
        let video_size = self.config.video_size;
        let relative = video_size[0] as f32 / video_size[1] as f32 / self.target.aspect();
        let planes = &self.video.planes;
        let [y, cb] = [planes[0].index(), planes[1].index()];
        let (cr, channel) = planes.get(2).map_or((cb, 1), |plane| (plane.index(), 0));
        Push {
            covered: [relative.min(1.0), relative.recip().min(1.0)],
            planes: [y, cb, cr],
            channels: [0, 0, channel],
            sampler: self.sampler.index(),
        }
    }
}

impl Sample for Yuv {
    fn context(&self) -> &Context {
        &self.ctx
    }

    fn update(&mut self, time: FrameTime) {
        self.phase = time.phase();
    }

    fn record(&mut self, frame: &mut Frame<'_>) -> Result<TextureHandle, RunError> {
        self.apply()?;
        self.video.upload(&self.ctx, self.phase)?;
        let sampled = [*self.video.texture];
        let reads = Dependencies { sampled_images: &sampled, ..Dependencies::default() };
        let mut pass = self.target.begin(&mut frame.cmd, "picture", BACKDROP, &reads)?;
        pass.bind_render_pipeline(*self.video.pipeline)?;
        pass.push_constants(&self.push())?;
        pass.draw(0..4, 0..1)?;
        if self.config.shows_planes {
            pass.bind_render_pipeline(*self.planes)?;
            pass.draw(0..4, 0..3)?;
        }
        Ok(self.target.image())
    }

    fn resize(&mut self, extent: [u32; 2]) -> Result<(), RunError> {
        self.target = RenderTarget::flat(&self.ctx, extent)?;
        self.config.extent = extent;
        Ok(())
    }

    fn next(&mut self) {
        let at = self.formats.iter().position(|format| *format == self.format());
        let next = at.map_or(0, |at| (at + 1) % self.formats.len());
        self.config.format = self.formats.get(next).copied();
    }

    #[cfg(feature = "window")]
    fn panel(&mut self, ui: &mut egui::Ui) {
        use super::config::{YuvModel, YuvRange};

        let config = &mut self.config;
        ui.horizontal(|ui| {
            for format in YuvFormat::ALL {
                let label = egui::Button::selectable(config.format == Some(format), format!("{format:?}"));
                if ui.add_enabled(self.formats.contains(&format), label).clicked() {
                    config.format = Some(format);
                }
            }
        });
        ui.horizontal(|ui| {
            for model in YuvModel::ALL {
                ui.selectable_value(&mut config.model, model, format!("{model:?}"));
            }
        });
        ui.horizontal(|ui| {
            for range in [YuvRange::Narrow, YuvRange::Full] {
                ui.selectable_value(&mut config.range, range, format!("{range:?}"));
            }
        });
        ui.checkbox(&mut config.shows_planes, "planes");
        ui.label("N is the next format");
    }

    fn reload(&mut self) -> Result<(), RunError> {
        let planes = planes(&self.ctx)?;
        self.video.reload(&self.ctx)?;
        self.planes = planes;
        Ok(())
    }
}

fn video_format(config: &YuvConfig, format: YuvFormat) -> VideoFormat {
    VideoFormat { format, model: config.model, range: config.range, size: config.video_size }
}

fn planes(ctx: &Context) -> lvk::Result<Holder<RenderPipelineHandle>> {
    let strip = RenderPipelineDesc { topology: Topology::TriangleStrip, ..RenderPipelineDesc::default() };
    PLANES.create_with(ctx, &strip)
}
