//! The passes over pixels: rays by pipeline from what was rasterised, and the cache.

use lvk::{
    BufferHandle, CommandBuffer, ComputePipelineHandle, Context, Dependencies, Holder,
    RayTracingPipelineDesc, RayTracingPipelineHandle, TextureHandle,
};

use super::frame::Push;
use super::pipelines::{ACCUMULATE, LIGHT_RAYS, OPEN_MISS, SAMPLE};
use super::targets::Targets;
use crate::app::array_buffer::buffer;
use crate::rtx::{compute_pipeline, groups};

/// Rays from the targets of the rasteriser.
pub(super) struct LightRays {
    pipeline: Holder<RayTracingPipelineHandle>,
}

/// The sum of all passes since the last change.
pub(super) struct Cache {
    pub(super) pipeline: Holder<ComputePipelineHandle>,
    pub(super) sums: Holder<BufferHandle>,
}

impl LightRays {
    pub(super) fn new(ctx: &Context) -> lvk::Result<Self> {
        let (rays, open) = (LIGHT_RAYS.create(ctx, SAMPLE)?, OPEN_MISS.create(ctx, SAMPLE)?);
        let pipeline = ctx.create_ray_tracing_pipeline(&RayTracingPipelineDesc {
            ray_gen: &[*rays],
            miss: &[*open],
            max_recursion: 1,
            debug_name: "light",
            ..RayTracingPipelineDesc::default()
        })?;
        Ok(Self { pipeline })
    }

    pub(super) fn record(
        &self,
        cmd: &mut CommandBuffer,
        targets: &Targets,
        [width, height]: [u32; 2],
        frame: u64,
    ) -> lvk::Result<()> {
        let surface: Vec<TextureHandle> = targets.surface.iter().flatten().map(Holder::handle).collect();
        let dependencies = Dependencies {
            sampled_images: &surface,
            storage_images: &[*targets.light],
            ..Dependencies::default()
        };
        cmd.bind_ray_tracing_pipeline(*self.pipeline)?;
        cmd.push_constants(&Push::new(frame, 0))?;
        cmd.trace_rays([width, height, 1], &dependencies)
    }
}

impl Cache {
    pub(super) fn new(ctx: &Context, extent: [u32; 2]) -> lvk::Result<Self> {
        Ok(Self { pipeline: Self::pipeline(ctx)?, sums: Self::sums(ctx, extent)? })
    }

    /// The pipeline, compiled.
    pub(super) fn pipeline(ctx: &Context) -> lvk::Result<Holder<ComputePipelineHandle>> {
        compute_pipeline(ctx, SAMPLE, ACCUMULATE)
    }

    /// Room for the sums of a picture.
    pub(super) fn sums(ctx: &Context, [width, height]: [u32; 2]) -> lvk::Result<Holder<BufferHandle>> {
        let size_bytes = u64::from(width) * u64::from(height) * size_of::<[f32; 4]>() as u64;
        buffer(ctx, "cache", size_bytes)
    }

    /// Adds what was drawn, and writes the picture.
    pub(super) fn record(
        &self,
        cmd: &mut CommandBuffer,
        targets: &Targets,
        picture: TextureHandle,
        extent: [u32; 2],
        frame: u64,
    ) -> lvk::Result<()> {
        let dependencies = Dependencies {
            sampled_images: &[*targets.albedo, *targets.light],
            storage_images: &[picture],
            buffers: &[*self.sums],
            ..Dependencies::default()
        };
        cmd.bind_compute_pipeline(*self.pipeline)?;
        cmd.push_constants(&Push::new(frame, 0))?;
        cmd.dispatch(groups(extent), &dependencies)
    }
}
