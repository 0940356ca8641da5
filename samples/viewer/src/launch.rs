//! Pipelines of the viewer, and launches that trace rays by a ray tracing pipeline or by a compute shader with ray queries.

use lvk::{
    BlockLayout, CommandBuffer, ComputePipelineHandle, Context, Dependencies, HitGroup, Holder,
    RayTracingPipelineDesc, RayTracingPipelineHandle,
};
use lvk_samples::hybrid::RayPath;
use lvk_samples::pipelines::SampleStage;

use crate::gpu::layout::SCENE_LAYOUTS;
use crate::pipelines::{CANDIDATE, NEAREST_HIT, NEAREST_MISS, SAMPLE};

/// Side of a work group in invocations.
const GROUP: u32 = 8;

/// The shaders that trace rays, either of which is enough.
pub(crate) struct RayStages {
    pub(crate) rays: SampleStage,
    pub(crate) query: SampleStage,
    pub(crate) debug_name: &'static str,
}

/// The pipeline of one of them.
pub(crate) enum RayLaunch {
    Pipeline(Holder<RayTracingPipelineHandle>),
    Query(Holder<ComputePipelineHandle>),
}

impl RayLaunch {
    pub(crate) fn new(ctx: &Context, path: RayPath, stages: &RayStages) -> lvk::Result<Self> {
        Ok(match path {
            RayPath::Pipeline => Self::Pipeline(ray_pipeline(ctx, stages)?),
            RayPath::Query => Self::Query(compute(ctx, stages.query, SCENE_LAYOUTS)?),
        })
    }

    /// Binds the pipeline.
    pub(crate) fn bind(&self, cmd: &mut CommandBuffer) -> lvk::Result<()> {
        match self {
            Self::Pipeline(pipeline) => cmd.bind_ray_tracing_pipeline(**pipeline),
            Self::Query(pipeline) => cmd.bind_compute_pipeline(**pipeline),
        }
    }

    /// Records a launch of the bound pipeline; queries have whole work groups.
    pub(crate) fn record(
        &self,
        cmd: &mut CommandBuffer,
        extent: [u32; 2],
        dependencies: &Dependencies<'_>,
    ) -> lvk::Result<()> {
        match self {
            Self::Pipeline(_) => cmd.trace_rays([extent[0], extent[1], 1], dependencies),
            Self::Query(_) => cmd.dispatch(groups(extent), dependencies),
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
    stage.create_compute_pipeline(ctx, SAMPLE, layouts)
}

/// A pipeline of the ray generation shader and the hit group of all surfaces.
fn ray_pipeline(ctx: &Context, stages: &RayStages) -> lvk::Result<Holder<RayTracingPipelineHandle>> {
    let create = |stage: SampleStage| stage.create(ctx, SAMPLE);
    let (rays, miss, hit) = (create(stages.rays)?, create(NEAREST_MISS)?, create(NEAREST_HIT)?);
    let candidate = create(CANDIDATE)?;
    let group = HitGroup { closest_hit: Some(*hit), any_hit: Some(*candidate), ..HitGroup::default() };
    ctx.create_ray_tracing_pipeline(&RayTracingPipelineDesc {
        ray_gen: &[*rays],
        miss: &[*miss],
        hit_groups: &[group],
        max_recursion: 1,
        layouts: SCENE_LAYOUTS,
        debug_name: stages.debug_name,
        ..RayTracingPipelineDesc::default()
    })
}
