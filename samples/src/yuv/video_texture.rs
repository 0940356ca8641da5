//! The texture of a picture in one format and conversion, and the pipeline that samples it.

use lvk::{
    Aspect, Context, Holder, RenderPipelineDesc, RenderPipelineHandle, SpecializationConstant,
    SpecializationValue, TextureDesc, TextureHandle, TextureRegion, TextureViewDesc, Topology,
};

use super::config::{YuvFormat, YuvModel, YuvRange, conversion};
use super::encode;
use super::pipelines::PICTURE;
use super::synthetic_video::SyntheticVideo;

/// The format of a video texture and its conversion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct VideoFormat {
    pub(super) format: YuvFormat,
    pub(super) model: YuvModel,
    pub(super) range: YuvRange,
    pub(super) size: [u32; 2],
}

/// A texture with its conversion.
pub(super) struct VideoTexture {
    pub(super) video_format: VideoFormat,
    pub(super) texture: Holder<TextureHandle>,
    /// Planes of the texture, as textures of one or two channels.
    pub(super) planes: Vec<Holder<TextureHandle>>,
    /// Pipeline for this texture alone: shaders know the texture by a constant.
    pub(super) pipeline: Holder<RenderPipelineHandle>,
}

impl VideoTexture {
    /// Fails with [`lvk::Error::Unsupported`] where the device lacks the format or the conversion.
    pub(super) fn new(ctx: &Context, video_format: VideoFormat) -> lvk::Result<Self> {
        let texture = texture(ctx, video_format)?;
        let plane = |number: usize| {
            ctx.create_texture_view(&TextureViewDesc {
                texture: Some(*texture),
                aspect: Aspect::Plane(number as u8),
                debug_name: "plane",
                ..TextureViewDesc::default()
            })
        };
        let count = if video_format.format.has_two_planes() { 2 } else { 3 };
        let planes = (0..count).map(plane).collect::<lvk::Result<_>>()?;
        let pipeline = pipeline(ctx, texture.index())?;
        Ok(Self { video_format, texture, planes, pipeline })
    }

    /// Compiles the pipeline again.
    pub(super) fn reload(&mut self, ctx: &Context) -> lvk::Result<()> {
        self.pipeline = pipeline(ctx, self.texture.index())?;
        Ok(())
    }

    /// The planes at `phase`, as bytes.
    pub(super) fn encode(&self, phase: f32) -> Vec<Vec<u8>> {
        let VideoFormat { format, model, range, size } = self.video_format;
        encode::planes(&SyntheticVideo { size, phase }, format, model, range)
    }

    /// Uploads the planes at `phase`.
    pub(super) fn upload(&self, ctx: &Context, phase: f32) -> lvk::Result<()> {
        for (number, plane) in self.encode(phase).iter().enumerate() {
            let region = TextureRegion { aspect: Aspect::Plane(number as u8), ..TextureRegion::default() };
            ctx.upload_texture(*self.texture, &region, plane)?;
        }
        Ok(())
    }
}

/// Returns the formats that the device supports with this matrix and range.
pub(super) fn supported(ctx: &Context, video_format: VideoFormat) -> lvk::Result<Vec<YuvFormat>> {
    let mut found = Vec::new();
    for format in YuvFormat::ALL {
        match texture(ctx, VideoFormat { format, size: [2, 2], ..video_format }) {
            Ok(_) => found.push(format),
            Err(lvk::Error::Unsupported { .. }) => {}
            Err(error) => return Err(error),
        }
    }
    Ok(found)
}

fn texture(ctx: &Context, video_format: VideoFormat) -> lvk::Result<Holder<TextureHandle>> {
    let VideoFormat { format, model, range, size } = video_format;
    ctx.create_texture(&TextureDesc {
        format: format.raw(),
        extent: size,
        conversion: Some(conversion(format, model, range)),
        debug_name: "moving picture",
        ..TextureDesc::default()
    })
}

fn pipeline(ctx: &Context, index: u32) -> lvk::Result<Holder<RenderPipelineHandle>> {
    let constant = SpecializationConstant { id: 0, value: SpecializationValue::U32(index) };
    PICTURE.create_with(
        ctx,
        &RenderPipelineDesc {
            topology: Topology::TriangleStrip,
            specialization: &[constant],
            ..RenderPipelineDesc::default()
        },
    )
}
