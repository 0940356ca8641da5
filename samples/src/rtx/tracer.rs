//! Rays for each pixel, by a ray tracing pipeline or by a compute shader with ray queries.

use bytemuck::NoUninit;
use lvk::{
    BlockLayout, CommandBuffer, ComputePipelineHandle, Context, Dependencies, HitGroup, Holder,
    RayTracingPipelineDesc, RayTracingPipelineHandle, ShaderModuleHandle, TextureHandle,
};

use crate::app::frame::Frame;
use crate::app::render_target::RenderTarget;
use crate::hybrid::RayPath;
use crate::pipelines::{SamplePipeline, SampleStage};

/// Side of a work group in pixels.
const GROUP: u32 = 8;

/// The stages of both ways to trace the same rays.
pub(crate) struct RayStages {
    /// The sample, whose folder of `shaders/` they lie in.
    pub(crate) sample: &'static str,
    /// Names of both pipelines, for messages: by pipeline and by query.
    pub(crate) names: [&'static str; 2],
    pub(crate) ray_gen: SampleStage,
    pub(crate) misses: &'static [SampleStage],
    /// A hit group of triangles each.
    pub(crate) hits: &'static [SampleStage],
    /// Recursion depth of the pipeline's rays.
    pub(crate) max_recursion: u32,
    /// The compute stage, of work groups of 8 x 8 pixels.
    pub(crate) query: SampleStage,
    /// Structs that the stages read.
    pub(crate) layouts: &'static [BlockLayout],
}

/// One of the two.
pub(crate) enum Tracer {
    Pipeline(Holder<RayTracingPipelineHandle>),
    Query(Holder<ComputePipelineHandle>),
}

impl RayStages {
    /// Both, as data.
    pub(crate) fn pipelines(&self) -> Vec<SamplePipeline> {
        let rays = [&[self.ray_gen], self.misses, self.hits].concat();
        let of = |name, stages| SamplePipeline { name, stages, color: Vec::new(), depth: None };
        vec![of(self.names[0], rays), of(self.names[1], vec![self.query])]
    }
}

impl Tracer {
    pub(crate) fn new(ctx: &Context, path: RayPath, stages: &RayStages) -> lvk::Result<Self> {
        Ok(match path {
            RayPath::Pipeline => Self::Pipeline(ray_tracing_pipeline(ctx, stages)?),
            RayPath::Query => {
                Self::Query(stages.query.create_compute_pipeline(ctx, stages.sample, stages.layouts)?)
            }
        })
    }

    /// Records the pass `rays`, which stores every pixel of `target`. Returns the image.
    pub(crate) fn record_image<P: NoUninit>(
        &self,
        frame: &mut Frame<'_>,
        target: &RenderTarget,
        push: &P,
    ) -> lvk::Result<TextureHandle> {
        let image = target.image();
        let writes = Dependencies { storage_images: &[image], ..Dependencies::default() };
        frame.pass("rays", |cmd| self.record(cmd, push, target.extent(), &writes))?;
        Ok(image)
    }

    /// Records the rays of an image of `extent` pixels.
    pub(crate) fn record<P: NoUninit>(
        &self,
        cmd: &mut CommandBuffer,
        push: &P,
        extent: [u32; 2],
        dependencies: &Dependencies<'_>,
    ) -> lvk::Result<()> {
        match self {
            Self::Pipeline(pipeline) => {
                cmd.bind_ray_tracing_pipeline(**pipeline)?;
                cmd.push_constants(push)?;
                cmd.trace_rays([extent[0], extent[1], 1], dependencies)
            }
            Self::Query(pipeline) => {
                cmd.bind_compute_pipeline(**pipeline)?;
                cmd.push_constants(push)?;
                cmd.dispatch(groups(extent), dependencies)
            }
        }
    }
}

/// Work groups of 8 x 8 pixels that cover a picture.
pub(crate) fn groups([width, height]: [u32; 2]) -> [u32; 3] {
    [width.div_ceil(GROUP), height.div_ceil(GROUP), 1]
}

/// A compute pipeline of a stage of `sample`.
pub(crate) fn compute_pipeline(
    ctx: &Context,
    sample: &str,
    stage: SampleStage,
) -> lvk::Result<Holder<ComputePipelineHandle>> {
    stage.create_compute_pipeline(ctx, sample, &[])
}

fn ray_tracing_pipeline(ctx: &Context, stages: &RayStages) -> lvk::Result<Holder<RayTracingPipelineHandle>> {
    let create = |stage: &SampleStage| stage.create(ctx, stages.sample);
    let all = |stages: &[SampleStage]| stages.iter().map(create).collect::<lvk::Result<Vec<_>>>();
    let handles =
        |made: &[Holder<ShaderModuleHandle>]| made.iter().map(|module| **module).collect::<Vec<_>>();
    let ray_gen = create(&stages.ray_gen)?;
    let (misses, hits) = (all(stages.misses)?, all(stages.hits)?);
    let hit_group = |module| HitGroup { closest_hit: Some(module), ..HitGroup::default() };
    let hit_groups: Vec<HitGroup<'_>> = handles(&hits).into_iter().map(hit_group).collect();
    ctx.create_ray_tracing_pipeline(&RayTracingPipelineDesc {
        ray_gen: &[*ray_gen],
        miss: &handles(&misses),
        hit_groups: &hit_groups,
        max_recursion: stages.max_recursion,
        layouts: stages.layouts,
        debug_name: stages.names[0],
        ..RayTracingPipelineDesc::default()
    })
}
