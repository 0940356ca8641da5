//! Pixels that mirror or refract, waiting for a launch of their own.

use bytemuck::{Pod, Zeroable};
use lvk::{BufferDesc, BufferHandle, BufferUsage, CommandBuffer, Context, Holder};

use super::frame::ReflectivePixelAddresses;
use crate::app::array_buffer::buffer;

/// Bytes of `BouncePixel` in `shaders/hybrid/reflective_pixels.glsl`.
const PIXEL_BYTES: u64 = 28;

/// `BounceHead` in `shaders/hybrid/reflective_pixels.glsl`: how many pixels wait, as arguments of both kinds of launches.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Head {
    rays: [u32; 3],
    groups: [u32; 3],
}

/// The queue of a tile of the picture.
pub(super) struct ReflectivePixels {
    head: Holder<BufferHandle>,
    pixels: Holder<BufferHandle>,
}

impl ReflectivePixels {
    /// Offset of the size of an indirect trace in [`head`](Self::head).
    pub(super) const RAYS: u64 = std::mem::offset_of!(Head, rays) as u64;
    /// Offset of the workgroup count of an indirect dispatch.
    pub(super) const GROUPS: u64 = std::mem::offset_of!(Head, groups) as u64;

    /// A queue with room for `capacity` pixels.
    pub(super) fn new(ctx: &Context, capacity: u32) -> lvk::Result<Self> {
        let head = Head { rays: [0, 1, 1], groups: [0, 1, 1] };
        let usage = BufferUsage::STORAGE | BufferUsage::INDIRECT;
        Ok(Self {
            head: ctx.create_buffer(&BufferDesc {
                size_bytes: size_of::<Head>() as u64,
                usage,
                data: Some(bytemuck::bytes_of(&head)),
                debug_name: "bounce queue's head",
                ..BufferDesc::default()
            })?,
            pixels: buffer(ctx, "bounce queue", u64::from(capacity) * PIXEL_BYTES)?,
        })
    }

    /// Tells the shaders where it is.
    pub(super) fn addresses(&self) -> lvk::Result<ReflectivePixelAddresses> {
        Ok(ReflectivePixelAddresses { head: self.head.address()?, pixels: self.pixels.address()? })
    }

    /// Records the reset of the queue.
    pub(super) fn record_reset(&self, cmd: &mut CommandBuffer) -> lvk::Result<()> {
        const COUNT_BYTES: u64 = 4;
        cmd.fill_buffer(*self.head, Self::RAYS, COUNT_BYTES, 0)?;
        cmd.fill_buffer(*self.head, Self::GROUPS, COUNT_BYTES, 0)
    }

    /// The count of waiting pixels.
    pub(super) fn head(&self) -> BufferHandle {
        *self.head
    }

    /// All that its launches write and read.
    pub(super) fn buffers(&self) -> [BufferHandle; 2] {
        [*self.head, *self.pixels]
    }
}
