//! Paths of all pixels by a ray tracing pipeline, or by a compute shader with ray queries.

use lvk::{
    BlockLayout, CommandBuffer, ComputePipelineDesc, ComputePipelineHandle, Context, Dependencies, HitGroup,
    Holder, RayTracingPipelineDesc, RayTracingPipelineHandle,
};
use lvk_samples::hybrid::RayPath;
use lvk_samples::pipelines::SampleStage;

use crate::gpu::layout::{Push, SCENE_LAYOUTS};
use crate::pipelines::{CANDIDATE, NEAREST_HIT, NEAREST_MISS, SAMPLE};

/// Side of a work group in pixels.
const GROUP: u32 = 8;
/// Pixels of an invocation of queries on a GPU (`shaders/viewer/pixel_loop.glsl`), in as many parts of the picture. With 1, 2, 4 and
/// 8 of them an H100 takes 39.7, 38.0, 34.9 and 34.1 ms for the light of the kitchen in software, and a pipeline 28.9, 43.6, 49.1 and
/// 51.6 ms.
const PIXELS_EACH: u32 = 4;

/// The shaders of paths, either of which is enough.
pub(crate) struct PathStages {
    pub(crate) rays: SampleStage,
    pub(crate) query: SampleStage,
    pub(crate) debug_name: &'static str,
}

/// A launch that follows the paths of all pixels.
pub(crate) enum PathPass {
    Pipeline(Holder<RayTracingPipelineHandle>),
    /// The second member is true on a CPU, where a work group goes through its own block of pixels.
    Query(Holder<ComputePipelineHandle>, bool),
}

impl PathPass {
    pub(crate) fn new(ctx: &Context, path: RayPath, stages: &PathStages) -> lvk::Result<Self> {
        Ok(match path {
            RayPath::Pipeline => Self::Pipeline(ray_pipeline(ctx, stages)?),
            RayPath::Query => {
                Self::Query(compute(ctx, stages.query, SCENE_LAYOUTS)?, ctx.capabilities().is_cpu)
            }
        })
    }

    /// Records a launch for a picture of `extent` pixels.
    pub(crate) fn record(
        &self,
        cmd: &mut CommandBuffer,
        push: &Push,
        dependencies: &Dependencies<'_>,
        [width, height]: [u32; 2],
    ) -> lvk::Result<()> {
        match self {
            Self::Pipeline(pipeline) => {
                cmd.bind_ray_tracing_pipeline(**pipeline)?;
                cmd.push_constants(push)?;
                cmd.trace_rays([width, height, 1], dependencies)
            }
            Self::Query(pipeline, is_cpu) => {
                cmd.bind_compute_pipeline(**pipeline)?;
                cmd.push_constants(push)?;
                let rows = if *is_cpu { height } else { height.div_ceil(PIXELS_EACH) };
                cmd.dispatch(groups([width, rows]), dependencies)
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

/// A pipeline of the ray generation shader and the hit group of all surfaces.
fn ray_pipeline(ctx: &Context, stages: &PathStages) -> lvk::Result<Holder<RayTracingPipelineHandle>> {
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
