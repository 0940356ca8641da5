//! The picture, with one sample a pixel or with four that become one at the end of the pass.

use lvk::Format;
use lvk::{
    ColorAttachment, CommandBuffer, Context, Dependencies, DepthAttachment, Holder, RenderPass,
    RenderPassDesc, Resolve, TextureDesc, TextureHandle, TextureMemory, TextureUsage, TextureViewDesc,
};

use crate::raster::{Canvas, RasterError};

/// The picture, and what only lives inside the pass that draws it.
pub(super) struct Targets {
    extent: [u32; 2],
    samples: Option<Holder<TextureHandle>>,
    depth: Holder<TextureHandle>,
    picture: Holder<TextureHandle>,
    encoded: Holder<TextureHandle>,
}

impl Targets {
    /// # Errors
    /// [`RasterError::BadSize`], and what Vulkan answers.
    pub(super) fn new(ctx: &Context, extent: [u32; 2], samples: u32) -> Result<Self, RasterError> {
        let limit = ctx.capabilities().limits.max_texture_2d;
        let [width, height] = extent;
        if !(1..=limit).contains(&width) || !(1..=limit).contains(&height) {
            return Err(RasterError::BadSize { width, height, limit });
        }
        let target = |format, debug_name| {
            ctx.create_texture(&TextureDesc {
                format,
                extent,
                samples,
                usage: TextureUsage::TARGET,
                memory: TextureMemory::Transient,
                debug_name,
                ..TextureDesc::default()
            })
        };
        let picture = ctx.create_texture(&TextureDesc {
            format: Canvas::COLOR,
            extent,
            usage: TextureUsage::TARGET | TextureUsage::SAMPLED,
            view_formats: &[Format::Rgba8Unorm],
            debug_name: "picture",
            ..TextureDesc::default()
        })?;
        let encoded = ctx.create_texture_view(&TextureViewDesc {
            texture: Some(*picture),
            format: Some(Format::Rgba8Unorm),
            usage: Some(TextureUsage::SAMPLED),
            debug_name: "encoded picture",
            ..TextureViewDesc::default()
        })?;
        let is_multisampled = samples > 1;
        Ok(Self {
            extent,
            samples: is_multisampled.then(|| target(Canvas::COLOR, "samples")).transpose()?,
            depth: target(Canvas::DEPTH, "depth")?,
            picture,
            encoded,
        })
    }

    pub(super) fn extent(&self) -> [u32; 2] {
        self.extent
    }

    /// As [`Sample::record`](crate::app::sample::Sample::record) answers it.
    pub(super) fn picture(&self) -> TextureHandle {
        *self.encoded
    }

    /// Begins the pass that draws the picture.
    pub(super) fn begin<'c>(
        &self,
        cmd: &'c mut CommandBuffer,
        reads: &Dependencies<'_>,
    ) -> lvk::Result<RenderPass<'c>> {
        let black = [0.0, 0.0, 0.0, 1.0];
        let color = match &self.samples {
            Some(samples) => ColorAttachment {
                store: false,
                resolve: Some(Resolve { texture: *self.picture, mip: 0, layer: 0 }),
                ..ColorAttachment::clear(**samples, black)
            },
            None => ColorAttachment::clear(*self.picture, black),
        };
        let depth = DepthAttachment {
            store: false,
            stencil_store: false,
            ..DepthAttachment::clear(*self.depth, 0.0)
        };
        cmd.begin_rendering(&RenderPassDesc {
            color: &[color],
            depth: Some(depth),
            dependencies: *reads,
            debug_name: "surfaces",
            ..RenderPassDesc::default()
        })
    }
}
