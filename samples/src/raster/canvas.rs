//! The picture that a sample draws.

use lvk::{
    ColorAttachment, CommandBuffer, CompareOp, Context, Dependencies, DepthAttachment, DepthTest, Format,
    Holder, RenderPass, RenderPassDesc, Resolve, TextureDesc, TextureHandle, TextureMemory, TextureUsage,
    TextureViewDesc,
};

use super::RasterError;

/// The picture that a sample draws: colours in linear light, mostly of four samples a pixel, which become one encoded as sRGB
/// at the end of the pass; with depth where things hide each other.
///
/// Every device has four samples a pixel in these formats.
pub struct Canvas {
    extent: [u32; 2],
    samples: Option<Holder<TextureHandle>>,
    depth: Option<Holder<TextureHandle>>,
    picture: Holder<TextureHandle>,
    encoded: Holder<TextureHandle>,
}

impl Canvas {
    /// What shaders write: linear light.
    pub const COLOR: Format = Format::Rgba8Srgb;
    /// Reversed: 1 near, 0 far away.
    pub const DEPTH: Format = Format::D32Float;
    /// Of what is nearest.
    pub const NEAREST: DepthTest =
        DepthTest { format: Self::DEPTH, compare: CompareOp::Greater, write: true };
    /// Samples a pixel, where nobody asks for others.
    pub const SAMPLES: u32 = 4;

    /// A picture of `extent` pixels for what hides nothing, or is drawn in the order in which it lies.
    ///
    /// # Errors
    /// [`RasterError::BadSize`], and what Vulkan answers.
    pub fn flat(ctx: &Context, extent: [u32; 2]) -> Result<Self, RasterError> {
        Self::of_samples(ctx, extent, Self::SAMPLES)
    }

    /// The same with depth.
    ///
    /// # Errors
    /// As [`flat`](Self::flat).
    pub fn with_depth(ctx: &Context, extent: [u32; 2]) -> Result<Self, RasterError> {
        Self::with_samples(ctx, extent, Self::SAMPLES)
    }

    /// The same with this many samples a pixel. One is drawn right into the picture, and nothing becomes one at the end.
    ///
    /// # Errors
    /// As [`flat`](Self::flat), also where the device has not so many samples a pixel.
    pub fn with_samples(ctx: &Context, extent: [u32; 2], samples: u32) -> Result<Self, RasterError> {
        let flat = Self::of_samples(ctx, extent, samples)?;
        Ok(Self { depth: Some(target(ctx, Self::DEPTH, extent, samples, "depth")?), ..flat })
    }

    fn of_samples(ctx: &Context, extent: [u32; 2], samples: u32) -> Result<Self, RasterError> {
        check_size(ctx, extent)?;
        let picture = ctx.create_texture(&TextureDesc {
            format: Self::COLOR,
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
        let is_multisampled = samples != 1;
        let samples = is_multisampled.then(|| target(ctx, Self::COLOR, extent, samples, "samples"));
        Ok(Self { extent, samples: samples.transpose()?, depth: None, picture, encoded })
    }

    /// Pixels in a row, and rows.
    #[must_use]
    pub fn extent(&self) -> [u32; 2] {
        self.extent
    }

    /// Width over height.
    #[must_use]
    pub fn aspect(&self) -> f32 {
        self.extent[0] as f32 / self.extent[1] as f32
    }

    /// The picture as [`Sample::record`](crate::app::sample::Sample::record) answers it.
    #[must_use]
    pub fn picture(&self) -> TextureHandle {
        *self.encoded
    }

    /// Begins the pass that draws the picture, on `backdrop`, a colour in linear light. `reads` is what its shaders reach that
    /// earlier commands wrote.
    ///
    /// # Errors
    /// Those of [`CommandBuffer::begin_rendering`].
    pub fn begin<'c>(
        &self,
        cmd: &'c mut CommandBuffer,
        name: &str,
        backdrop: [f32; 3],
        reads: &Dependencies<'_>,
    ) -> lvk::Result<RenderPass<'c>> {
        let [red, green, blue] = backdrop;
        let cleared = |texture| ColorAttachment::clear(texture, [red, green, blue, 1.0]);
        let color = match &self.samples {
            Some(samples) => ColorAttachment {
                store: false,
                resolve: Some(Resolve { texture: *self.picture, mip: 0, layer: 0 }),
                ..cleared(**samples)
            },
            None => cleared(*self.picture),
        };
        let depth = self.depth.as_ref().map(|depth| DepthAttachment {
            store: false,
            stencil_store: false,
            ..DepthAttachment::clear(**depth, 0.0)
        });
        cmd.begin_rendering(&RenderPassDesc {
            color: &[color],
            depth,
            dependencies: *reads,
            debug_name: name,
            ..RenderPassDesc::default()
        })
    }
}

/// What only lives inside of passes.
fn target(
    ctx: &Context,
    format: Format,
    extent: [u32; 2],
    samples: u32,
    debug_name: &str,
) -> lvk::Result<Holder<TextureHandle>> {
    ctx.create_texture(&TextureDesc {
        format,
        extent,
        samples,
        usage: TextureUsage::TARGET,
        memory: TextureMemory::Transient,
        debug_name,
        ..TextureDesc::default()
    })
}

/// Fails unless the device has pictures of so many pixels.
pub(crate) fn check_size(ctx: &Context, [width, height]: [u32; 2]) -> Result<(), RasterError> {
    let limit = ctx.capabilities().limits.max_texture_2d;
    let is_possible = |side| (1..=limit).contains(&side);
    match is_possible(width) && is_possible(height) {
        true => Ok(()),
        false => Err(RasterError::BadSize { width, height, limit }),
    }
}
