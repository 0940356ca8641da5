//! The order in which pixels are rendered: those with mirrors and glass first.

use super::pipelines;
use lvk::{
    BufferHandle, CommandBuffer, ComputePipelineDesc, ComputePipelineHandle, Context, Dependencies, Holder,
};

use super::frame::{LAYOUTS, Push};
use super::ray_pass::GeometryLeft;
use super::shader_module::module;
use crate::app::array_buffer::buffer;

/// Side in pixels of the square of a workgroup (`shaders/hybrid/order.comp.glsl`).
const SQUARE: u32 = 16;
/// Bytes of the head of `PixelOrder` in `shaders/hybrid/pixel_order.glsl`, and of a pixel.
const HEAD_BYTES: u64 = 8;
const PIXEL_BYTES: u64 = 4;

/// The pass that finds the order after the visible triangles, and the order.
pub(super) struct PixelOrder {
    pipeline: Holder<ComputePipelineHandle>,
    order: Holder<BufferHandle>,
    groups: [u32; 3],
}

impl PixelOrder {
    /// An order of the pixels of a picture of `extent` pixels.
    pub(super) fn new(ctx: &Context, extent: [u32; 2]) -> lvk::Result<Self> {
        let shader = module(ctx, &pipelines::ORDER_COMP, &[])?;
        let pixels = u64::from(extent[0]) * u64::from(extent[1]);
        Ok(Self {
            pipeline: ctx.create_compute_pipeline(&ComputePipelineDesc {
                module: Some(*shader),
                layouts: LAYOUTS,
                debug_name: "order of pixels",
                ..ComputePipelineDesc::default()
            })?,
            order: buffer(ctx, "order of pixels", HEAD_BYTES + pixels * PIXEL_BYTES)?,
            groups: [extent[0].div_ceil(SQUARE), extent[1].div_ceil(SQUARE), 1],
        })
    }

    /// Address of the buffer.
    pub(super) fn address(&self) -> lvk::Result<u64> {
        self.order.address()
    }

    /// Resources that the ray pass reads.
    pub(super) fn buffer(&self) -> BufferHandle {
        *self.order
    }

    /// Records the pass over what the visibility pass left.
    pub(super) fn record(
        &self,
        cmd: &mut CommandBuffer,
        push: &Push,
        left: &GeometryLeft,
    ) -> lvk::Result<()> {
        cmd.fill_buffer(*self.order, 0, HEAD_BYTES, 0)?;
        cmd.bind_compute_pipeline(*self.pipeline)?;
        cmd.push_constants(push)?;
        let dependencies = Dependencies {
            sampled_images: &left.textures,
            read_buffers: &left.buffers,
            buffers: &[*self.order],
            ..Dependencies::default()
        };
        cmd.dispatch(self.groups, &dependencies)
    }
}
