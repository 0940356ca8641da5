//! The image that a sample renders to, with its multisampled colours and its depth.

use lvk::{
    ColorAttachment, CommandBuffer, CompareOp, Context, Dependencies, DepthAttachment, DepthTest, Format,
    Holder, RenderPass, RenderPassDesc, Resolve, TextureDesc, TextureHandle, TextureMemory, TextureUsage,
    TextureViewDesc,
};

use super::sample_error::SampleError;

/// The image that a sample renders to.
///
/// Samples that rasterise draw colours in linear light, mostly of four samples a pixel; the end of the pass resolves them into
/// an sRGB image. Depth is for geometry that hides geometry. Every device has four samples a pixel in these formats. Samples
/// that trace rays store encoded pixels into a storage image.
pub struct RenderTarget {
    extent: [u32; 2],
    samples: Option<Holder<TextureHandle>>,
    depth: Option<Holder<TextureHandle>>,
    /// The image that passes draw to or resolve into; none of a storage image.
    color: Option<Holder<TextureHandle>>,
    /// The image as it is sampled: sRGB as encoded numbers.
    image: Holder<TextureHandle>,
}

impl RenderTarget {
    /// Format of colours. Shaders write linear light.
    pub const COLOR: Format = Format::Rgba8Srgb;
    /// Format of depth, which is reversed: 1 near, 0 far away.
    pub const DEPTH: Format = Format::D32Float;
    /// The test that keeps the nearest fragment.
    pub const NEAREST: DepthTest =
        DepthTest { format: Self::DEPTH, compare: CompareOp::Greater, write: true };
    /// Default number of samples a pixel.
    pub const SAMPLES: u32 = 4;

    /// A target of `extent` pixels without depth, for geometry that is drawn back to front.
    ///
    /// # Errors
    /// [`SampleError::BadSize`], and those of Vulkan.
    pub fn flat(ctx: &Context, extent: [u32; 2]) -> Result<Self, SampleError> {
        Self::of_samples(ctx, extent, Self::SAMPLES)
    }

    /// A target of `extent` pixels with depth.
    ///
    /// # Errors
    /// As [`flat`](Self::flat).
    pub fn with_depth(ctx: &Context, extent: [u32; 2]) -> Result<Self, SampleError> {
        Self::with_samples(ctx, extent, Self::SAMPLES)
    }

    /// A target with depth and this many samples a pixel. With one sample passes draw into the image itself, without a resolve.
    ///
    /// # Errors
    /// As [`flat`](Self::flat), also where the device does not support that many samples a pixel.
    pub fn with_samples(ctx: &Context, extent: [u32; 2], samples: u32) -> Result<Self, SampleError> {
        let flat = Self::of_samples(ctx, extent, samples)?;
        Ok(Self { depth: Some(attachment(ctx, Self::DEPTH, extent, samples, "depth")?), ..flat })
    }

    fn of_samples(ctx: &Context, extent: [u32; 2], samples: u32) -> Result<Self, SampleError> {
        SampleError::check_size(extent, ctx.capabilities())?;
        let color = ctx.create_texture(&TextureDesc {
            format: Self::COLOR,
            extent,
            usage: TextureUsage::TARGET | TextureUsage::SAMPLED,
            view_formats: &[Format::Rgba8Unorm],
            debug_name: "picture",
            ..TextureDesc::default()
        })?;
        let image = ctx.create_texture_view(&TextureViewDesc {
            texture: Some(*color),
            format: Some(Format::Rgba8Unorm),
            usage: Some(TextureUsage::SAMPLED),
            debug_name: "encoded picture",
            ..TextureViewDesc::default()
        })?;
        let is_multisampled = samples != 1;
        let samples = is_multisampled.then(|| attachment(ctx, Self::COLOR, extent, samples, "samples"));
        Ok(Self { extent, samples: samples.transpose()?, depth: None, color: Some(color), image })
    }

    /// A storage image of `extent` pixels, 8 bits a channel. Shaders encode sRGB themselves.
    ///
    /// # Errors
    /// As [`flat`](Self::flat).
    pub fn storage(ctx: &Context, extent: [u32; 2]) -> Result<Self, SampleError> {
        SampleError::check_size(extent, ctx.capabilities())?;
        let image = storage_image(ctx, extent)?;
        Ok(Self { extent, samples: None, depth: None, color: None, image })
    }

    /// Width and height in pixels.
    #[must_use]
    pub fn extent(&self) -> [u32; 2] {
        self.extent
    }

    /// Width over height.
    #[must_use]
    pub fn aspect(&self) -> f32 {
        self.extent[0] as f32 / self.extent[1] as f32
    }

    /// The image as [`Sample::record`](crate::app::sample::Sample::record) returns it.
    #[must_use]
    pub fn image(&self) -> TextureHandle {
        *self.image
    }

    /// The bindless index of the image.
    #[must_use]
    pub fn image_index(&self) -> u32 {
        self.image.index()
    }

    /// Begins the pass that draws the image on `backdrop`, a colour in linear light. `reads` names the resources that earlier
    /// commands wrote and the shaders of the pass read.
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
        let target = **self.color.as_ref().unwrap_or(&self.image);
        let color = match &self.samples {
            Some(samples) => ColorAttachment {
                store: false,
                resolve: Some(Resolve { texture: target, mip: 0, layer: 0 }),
                ..cleared(**samples)
            },
            None => cleared(target),
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

/// An attachment whose contents live inside of passes only.
fn attachment(
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

/// An image of 8 bits a channel that shaders store to and sample, for pixels encoded as sRGB.
pub(crate) fn storage_image(ctx: &Context, extent: [u32; 2]) -> lvk::Result<Holder<TextureHandle>> {
    ctx.create_texture(&TextureDesc {
        format: Format::Rgba8Unorm,
        extent,
        usage: TextureUsage::STORAGE | TextureUsage::SAMPLED,
        debug_name: "picture",
        ..TextureDesc::default()
    })
}
