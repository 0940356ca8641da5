//! The ray pass: shading, shadows, reflection and refraction of every pixel, by a ray tracing pipeline or by compute
//! shaders with ray queries; at once, or first surfaces first and mirrors and glass in a launch of their own.

use super::pipelines;
use crate::pipelines::SampleStage;
use lvk::{
    BufferHandle, CommandBuffer, ComputePipelineDesc, ComputePipelineHandle, Context, Dependencies, HitGroup,
    Holder, RayTracingPipelineDesc, RayTracingPipelineHandle, SpecializationConstant, SpecializationValue,
    TextureHandle,
};

use super::accumulation::Accumulation;
use super::compute_raster::groups_for;
use super::config::{Bounces, Geometry, HybridConfig, Method, RayPath};
use super::frame::{LAYOUTS, Push, ReflectivePixelAddresses};
use super::reflective_pixels::ReflectivePixels;
use super::shader_module::module;

/// Side of a work group in pixels (`shaders/hybrid/render.comp.glsl`).
const GROUP: u32 = 8;
/// `constant_id` of the depth limit (`shaders/hybrid/integrator.glsl`).
const DEPTH_CONSTANT: u32 = 0;
/// Ray generation shaders by their place in the pipeline.
const RENDER: u32 = 0;
const BOUNCES: u32 = 1;

/// The pass: its pipelines and all they touch.
pub(super) struct RayPass {
    pipeline: Pipeline,
    queue: Option<ReflectivePixels>,
    /// True if pixels are taken in their order and not by rows.
    ordered: bool,
}

/// The resources that a geometry pass leaves for the ray pass.
#[derive(Debug, Default)]
pub(super) struct GeometryLeft {
    pub(super) textures: Vec<TextureHandle>,
    pub(super) buffers: Vec<BufferHandle>,
}

enum Pipeline {
    Tracing(Holder<RayTracingPipelineHandle>),
    Compute { render: Holder<ComputePipelineHandle>, bounces: Option<Holder<ComputePipelineHandle>> },
}

impl RayPass {
    /// The pass that `config` asks for, of launches of `tile_pixels` pixels.
    pub(super) fn new(ctx: &Context, config: &HybridConfig, tile_pixels: u32) -> lvk::Result<Self> {
        let bounces = config.bounces.filter(|_| config.max_depth > 0);
        let (queued, ordered) = (bounces == Some(Bounces::Queued), bounces == Some(Bounces::First));
        let stages = Stages::from_config(config, queued, ordered);
        let pipeline = match config.path {
            RayPath::Pipeline => Pipeline::Tracing(tracing_pipeline(ctx, &stages)?),
            RayPath::Query => Pipeline::Compute {
                render: stages.compute(ctx, &pipelines::RENDER_COMP)?,
                bounces: queued.then(|| stages.compute(ctx, &pipelines::BOUNCES_COMP)).transpose()?,
            },
        };
        let queue = queued.then(|| ReflectivePixels::new(ctx, tile_pixels)).transpose()?;
        Ok(Self { pipeline, queue, ordered })
    }

    /// Addresses of the queue.
    pub(super) fn reflective_pixel_addresses(&self) -> lvk::Result<ReflectivePixelAddresses> {
        self.queue.as_ref().map_or(Ok(bytemuck::Zeroable::zeroed()), |queue| queue.addresses())
    }

    /// Records the rows that `push` names, in an image `width` pixels wide, from what the geometry pass left onto `accumulation`.
    pub(super) fn record(
        &self,
        cmd: &mut CommandBuffer,
        width: u32,
        push: &Push,
        left: &GeometryLeft,
        accumulation: &Accumulation,
    ) -> lvk::Result<()> {
        let (push, launch) = self.launch(width, push);
        let mut buffers: Vec<_> = accumulation.sums().into_iter().collect();
        if let Some(queue) = &self.queue {
            queue.record_reset(cmd)?;
            buffers.extend(queue.buffers());
        }
        let dependencies = Dependencies {
            sampled_images: &left.textures,
            read_buffers: &left.buffers,
            storage_images: &[*accumulation.picture],
            buffers: &buffers,
            ..Dependencies::default()
        };
        let push = &push;
        match &self.pipeline {
            Pipeline::Tracing(pipeline) => {
                cmd.bind_ray_tracing_pipeline(**pipeline)?;
                cmd.push_constants(push)?;
                cmd.trace_rays_with(RENDER, launch, &dependencies)?;
                if let Some(queue) = &self.queue {
                    cmd.trace_rays_indirect(BOUNCES, queue.head(), ReflectivePixels::RAYS, &dependencies)?;
                }
            }
            Pipeline::Compute { render, bounces } => {
                cmd.bind_compute_pipeline(**render)?;
                cmd.push_constants(push)?;
                cmd.dispatch(self.groups(launch), &dependencies)?;
                if let (Some(queue), Some(bounces)) = (&self.queue, bounces) {
                    cmd.bind_compute_pipeline(**bounces)?;
                    cmd.push_constants(push)?;
                    cmd.dispatch_indirect(queue.head(), ReflectivePixels::GROUPS, &dependencies)?;
                }
            }
        }
        Ok(())
    }

    /// Push constants for the rows that `push` names, and the number of threads along each axis.
    fn launch(&self, width: u32, push: &Push) -> (Push, [u32; 3]) {
        let rows = push.end.saturating_sub(push.first);
        if self.ordered {
            (Push { first: push.first * width, end: push.end * width, ..*push }, [width * rows, 1, 1])
        } else {
            (*push, [width, rows, 1])
        }
    }

    fn groups(&self, [width, height, depth]: [u32; 3]) -> [u32; 3] {
        if self.ordered {
            groups_for(width, GROUP * GROUP)
        } else {
            [width.div_ceil(GROUP), height.div_ceil(GROUP), depth]
        }
    }
}

/// Macros and constants of all stages.
struct Stages {
    defines: Vec<(&'static str, &'static str)>,
    specialization: [SpecializationConstant; 1],
    queued: bool,
}

impl Stages {
    fn from_config(config: &HybridConfig, queued: bool, ordered: bool) -> Self {
        let first = match (config.method, config.geometry) {
            (Method::Standalone, _) => &[],
            (Method::Hybrid, Geometry::Paper) => pipelines::WITH_GBUFFER,
            (Method::Hybrid, Geometry::Visibility(_)) if ordered => pipelines::WITH_VISIBILITY_AND_ORDER,
            (Method::Hybrid, Geometry::Visibility(_)) => pipelines::WITH_VISIBILITY,
        };
        let queue = if queued { pipelines::WITH_QUEUE } else { &[] };
        let value = SpecializationValue::U32(config.max_depth);
        Self {
            defines: [first, queue].concat(),
            specialization: [SpecializationConstant { id: DEPTH_CONSTANT, value }],
            queued,
        }
    }

    fn compute(&self, ctx: &Context, stage: &SampleStage) -> lvk::Result<Holder<ComputePipelineHandle>> {
        let shader = module(ctx, stage, &self.defines)?;
        ctx.create_compute_pipeline(&ComputePipelineDesc {
            module: Some(*shader),
            specialization: &self.specialization,
            layouts: LAYOUTS,
            debug_name: stage.name,
            ..ComputePipelineDesc::default()
        })
    }
}

fn tracing_pipeline(ctx: &Context, stages: &Stages) -> lvk::Result<Holder<RayTracingPipelineHandle>> {
    let ray_gen = |stage| module(ctx, stage, &stages.defines);
    let render = ray_gen(&pipelines::RENDER_RGEN)?;
    let bounces = stages.queued.then(|| ray_gen(&pipelines::BOUNCES_RGEN)).transpose()?;
    let ray_gens: Vec<_> = std::iter::once(&render).chain(&bounces).map(Holder::handle).collect();
    let closest_miss = module(ctx, &pipelines::CLOSEST_RMISS, &[])?;
    let shadow_miss = module(ctx, &pipelines::SHADOW_RMISS, &[])?;
    let closest_hit = module(ctx, &pipelines::CLOSEST_RCHIT, &[])?;
    ctx.create_ray_tracing_pipeline(&RayTracingPipelineDesc {
        ray_gen: &ray_gens,
        miss: &[*closest_miss, *shadow_miss],
        hit_groups: &[HitGroup { closest_hit: Some(*closest_hit), ..HitGroup::default() }],
        max_recursion: 1,
        specialization: &stages.specialization,
        layouts: LAYOUTS,
        debug_name: "ray pass",
        ..RayTracingPipelineDesc::default()
    })
}
