//! The image and the sums of samples that it is resolved from.

use lvk::{BufferHandle, Context, Holder, TextureHandle};

use crate::app::array_buffer::buffer;
use crate::app::render_target::storage_image;

/// The picture, and a colour a pixel where it has several samples.
pub(super) struct Accumulation {
    pub(super) picture: Holder<TextureHandle>,
    sums: Option<Holder<BufferHandle>>,
}

impl Accumulation {
    /// A accumulation of `extent` pixels.
    pub(super) fn new(ctx: &Context, extent: [u32; 2], samples: u32) -> lvk::Result<Self> {
        let picture = storage_image(ctx, extent)?;
        let size_bytes = u64::from(extent[0]) * u64::from(extent[1]) * size_of::<[f32; 3]>() as u64;
        let sums = (samples > 1).then(|| buffer(ctx, "sums of samples", size_bytes)).transpose()?;
        Ok(Self { picture, sums })
    }

    /// Address of the sums; 0 where there are none.
    pub(super) fn sums_address(&self) -> lvk::Result<u64> {
        self.sums.as_ref().map_or(Ok(0), |sums| sums.address())
    }

    /// The sums, for the ray pass to write.
    pub(super) fn sums(&self) -> Option<BufferHandle> {
        self.sums.as_ref().map(Holder::handle)
    }
}
