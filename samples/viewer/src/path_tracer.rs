//! Paths by a ray tracing pipeline, or by a compute shader with ray queries.

use lvk::{
    BlockLayout, BufferHandle, CommandBuffer, ComputePipelineDesc, ComputePipelineHandle, Context,
    Dependencies, HitGroup, Holder, RayTracingPipelineDesc, RayTracingPipelineHandle,
};
use lvk_samples::hybrid::RayPath;
use lvk_samples::pipelines::SampleStage;

use crate::gpu::FrameScene;
use crate::gpu::layout::{Push, SCENE_LAYOUTS};
use crate::pipelines::{CANDIDATE, NEAREST_HIT, NEAREST_MISS, PATH_QUERY, PATH_RAYS, SAMPLE};

/// Side of a work group in pixels.
const GROUP: u32 = 8;

/// Adds samples to the sums of all pixels.
pub(crate) enum PathTracer {
    Pipeline(Holder<RayTracingPipelineHandle>),
    Query(Holder<ComputePipelineHandle>),
}

impl PathTracer {
    pub(crate) fn new(ctx: &Context, path: RayPath) -> lvk::Result<Self> {
        Ok(match path {
            RayPath::Pipeline => Self::Pipeline(ray_pipeline(ctx, &[PATH_RAYS], "viewer paths")?),
            RayPath::Query => Self::Query(compute(ctx, PATH_QUERY, SCENE_LAYOUTS)?),
        })
    }

    /// Records a pass over a picture of `extent` pixels whose sums are `sums`.
    pub(crate) fn record(
        &self,
        cmd: &mut CommandBuffer,
        push: &Push,
        sums: BufferHandle,
        scene: FrameScene<'_>,
        extent: [u32; 2],
    ) -> lvk::Result<()> {
        let dependencies = Dependencies {
            buffers: &scene.buffers(sums),
            read_buffers: scene.written,
            ..Dependencies::default()
        };
        match self {
            Self::Pipeline(pipeline) => {
                cmd.bind_ray_tracing_pipeline(**pipeline)?;
                cmd.push_constants(push)?;
                cmd.trace_rays([extent[0], extent[1], 1], &dependencies)
            }
            Self::Query(pipeline) => {
                cmd.bind_compute_pipeline(**pipeline)?;
                cmd.push_constants(push)?;
                cmd.dispatch(groups(extent), &dependencies)
            }
        }
    }
}

/// Work groups that cover a picture.
pub(crate) fn groups([width, height]: [u32; 2]) -> [u32; 3] {
    [width.div_ceil(GROUP), height.div_ceil(GROUP), 1]
}

/// A compute pipeline of a stage.
pub(crate) fn compute(
    ctx: &Context,
    stage: SampleStage,
    layouts: &[BlockLayout],
) -> lvk::Result<Holder<ComputePipelineHandle>> {
    let module = stage.create(ctx, SAMPLE)?;
    ctx.create_compute_pipeline(&ComputePipelineDesc {
        module: Some(*module),
        layouts,
        debug_name: stage.name,
        ..ComputePipelineDesc::default()
    })
}

/// A pipeline with these ray generation shaders, and the hit group of all surfaces.
pub(crate) fn ray_pipeline(
    ctx: &Context,
    ray_gen: &[SampleStage],
    debug_name: &str,
) -> lvk::Result<Holder<RayTracingPipelineHandle>> {
    let modules = ray_gen.iter().map(|stage| stage.create(ctx, SAMPLE)).collect::<lvk::Result<Vec<_>>>()?;
    let handles: Vec<_> = modules.iter().map(|module| **module).collect();
    let [miss, hit, candidate] =
        [NEAREST_MISS, NEAREST_HIT, CANDIDATE].map(|stage| stage.create(ctx, SAMPLE));
    let (miss, hit, candidate) = (miss?, hit?, candidate?);
    let group = HitGroup { closest_hit: Some(*hit), any_hit: Some(*candidate), ..HitGroup::default() };
    ctx.create_ray_tracing_pipeline(&RayTracingPipelineDesc {
        ray_gen: &handles,
        miss: &[*miss],
        hit_groups: &[group],
        max_recursion: 1,
        layouts: SCENE_LAYOUTS,
        debug_name,
        ..RayTracingPipelineDesc::default()
    })
}
