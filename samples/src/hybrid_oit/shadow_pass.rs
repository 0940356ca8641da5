//! Shadow rays from the G-buffer and from the spheres of glass to the sun, by a ray tracing pipeline or by queries.

use lvk::{
    CommandBuffer, ComputePipelineHandle, Context, Dependencies, HitGroup, Holder, RayTracingPipelineDesc,
    RayTracingPipelineHandle,
};

use super::buffers::Buffers;
use super::frame::Push;
use super::image_passes::compute_pipeline;
use super::pipelines::{self as stages, module};
use super::targets::Targets;
use crate::hybrid::RayPath;

/// Side of a work group in samples (`shaders/hybrid_oit/shadow.comp.glsl`).
const GROUP: u32 = 8;

/// The pass by either path.
pub(super) enum ShadowPass {
    /// A ray tracing pipeline.
    Tracing(Holder<RayTracingPipelineHandle>),
    /// A compute shader with ray queries.
    Compute(Holder<ComputePipelineHandle>),
}

impl ShadowPass {
    /// Compiles the pipeline.
    pub(super) fn new(ctx: &Context, path: RayPath) -> lvk::Result<Self> {
        Ok(match path {
            RayPath::Pipeline => Self::Tracing(tracing_pipeline(ctx)?),
            RayPath::Query => Self::Compute(compute_pipeline(ctx, &stages::SHADOW_QUERY)?),
        })
    }

    /// Records the pass over a raster of `samples`, and a row more for the spheres of glass.
    pub(super) fn record(
        &self,
        cmd: &mut CommandBuffer,
        targets: &Targets,
        buffers: &Buffers,
        push: &Push,
        samples: [u32; 2],
    ) -> lvk::Result<()> {
        let dependencies = Dependencies {
            sampled_images: &[*targets.position, *targets.surface],
            storage_images: &[*targets.shadow],
            buffers: &[*buffers.glass_light],
            read_buffers: &[*buffers.spheres],
            ..Dependencies::default()
        };
        let [width, height] = [samples[0], samples[1] + 1];
        match self {
            Self::Tracing(pipeline) => {
                cmd.bind_ray_tracing_pipeline(**pipeline)?;
                cmd.push_constants(push)?;
                cmd.trace_rays([width, height, 1], &dependencies)
            }
            Self::Compute(pipeline) => {
                cmd.bind_compute_pipeline(**pipeline)?;
                cmd.push_constants(push)?;
                cmd.dispatch([width.div_ceil(GROUP), height.div_ceil(GROUP), 1], &dependencies)
            }
        }
    }
}

/// The hit groups stand in the order of the offsets that instance records name: floor and blocks, glass, balls.
fn tracing_pipeline(ctx: &Context) -> lvk::Result<Holder<RayTracingPipelineHandle>> {
    let [ray_gen, miss, sphere, any_hit] = stages::SHADOW_TRACING.each_ref().map(|stage| module(ctx, stage));
    let (ray_gen, miss, sphere, any_hit) = (ray_gen?, miss?, sphere?, any_hit?);
    let ball = HitGroup { intersection: Some(*sphere), ..HitGroup::default() };
    ctx.create_ray_tracing_pipeline(&RayTracingPipelineDesc {
        ray_gen: &[*ray_gen],
        miss: &[*miss],
        hit_groups: &[HitGroup::default(), HitGroup { any_hit: Some(*any_hit), ..ball }, ball],
        max_recursion: 1,
        debug_name: "shadows",
        ..RayTracingPipelineDesc::default()
    })
}
