//! The map of the sun's shadows.

use lvk::{
    AddressMode, BorderColor, CommandBuffer, CompareOp, Context, Dependencies, DepthAttachment, DepthBias,
    Filter, Format, Holder, RenderPassDesc, RenderPipelineDesc, RenderPipelineHandle, SamplerDesc,
    SamplerHandle, TextureDesc, TextureHandle, TextureUsage,
};

use super::config::DrawPath;
use super::culling::Culling;
use super::pipelines::SHADOW;

/// Number of the view in [`Culling`].
pub(super) const VIEW: usize = 1;

/// The map of the sun's shadows.
pub(super) struct Shadow {
    pub(super) map: Holder<TextureHandle>,
    pub(super) sampler: Holder<SamplerHandle>,
    pub(super) pipeline: Holder<RenderPipelineHandle>,
    /// Keeps surfaces from shadowing themselves.
    pub(super) bias: DepthBias,
}

impl Shadow {
    pub(super) const FORMAT: Format = Format::D32Float;

    pub(super) fn new(ctx: &Context, size: u32) -> lvk::Result<Self> {
        let map = ctx.create_texture(&TextureDesc {
            format: Self::FORMAT,
            extent: [size; 2],
            usage: TextureUsage::TARGET | TextureUsage::SAMPLED,
            debug_name: "shadow map",
            ..TextureDesc::default()
        })?;
        // Beyond the map nothing is in the sun's way.
        let sampler = ctx.create_sampler(&SamplerDesc {
            mag_filter: Filter::Linear,
            min_filter: Filter::Linear,
            mip_filter: Filter::Nearest,
            address: [AddressMode::ClampToBorder; 3],
            border: BorderColor::OpaqueWhite,
            compare: Some(CompareOp::LessOrEqual),
            debug_name: "shadow sampler",
            ..SamplerDesc::default()
        })?;
        let bias = DepthBias { constant: 2.0, slope: 2.5, clamp: 0.0 };
        Ok(Self { map, sampler, pipeline: Self::pipeline(ctx)?, bias })
    }

    pub(super) fn pipeline(ctx: &Context) -> lvk::Result<Holder<RenderPipelineHandle>> {
        SHADOW.create_with(
            ctx,
            &RenderPipelineDesc { depth_bias: Some(DepthBias::default()), ..RenderPipelineDesc::default() },
        )
    }

    /// Draws what the sun sees.
    pub(super) fn record(
        &self,
        cmd: &mut CommandBuffer,
        culling: &Culling,
        path: DrawPath,
        frame: u64,
    ) -> lvk::Result<()> {
        let depth = DepthAttachment { stencil_store: false, ..DepthAttachment::clear(*self.map, 1.0) };
        let reads = culling.reads(VIEW);
        let mut pass = cmd.begin_rendering(&RenderPassDesc {
            depth: Some(depth),
            dependencies: Dependencies { read_buffers: &reads, ..Dependencies::default() },
            debug_name: "shadow map",
            ..RenderPassDesc::default()
        })?;
        pass.bind_render_pipeline(*self.pipeline)?;
        pass.depth_bias(self.bias)?;
        pass.push_constants(&frame)?;
        culling.draw(&mut pass, VIEW, path)
    }
}
