//! The ray pass: shading, shadows, reflection and refraction of every pixel, by a ray tracing pipeline or by a
//! compute shader with ray queries.

use lvk::{
    BufferHandle, CommandBuffer, ComputePipelineDesc, ComputePipelineHandle, Context, Dependencies, HitGroup,
    Holder, RayTracingPipelineDesc, RayTracingPipelineHandle, ShaderStage, SpecializationConstant,
    SpecializationValue, TextureHandle,
};

use super::config::{Geometry, HybridConfig, Method, RayPath};
use super::frame::Push;
use super::shader_module::module;
use crate::shaders::hybrid as texts;

/// Side of a work group in pixels (`shaders/hybrid/render.comp.glsl`).
const GROUP: u32 = 8;
/// `constant_id` of the depth limit (`shaders/hybrid/integrator.glsl`).
const DEPTH_CONSTANT: u32 = 0;

/// The pass: its pipeline and all it touches.
pub(super) struct RayPass {
    pipeline: Pipeline,
    output: TextureHandle,
}

/// What a geometry pass leaves for the ray pass to read.
#[derive(Debug, Default)]
pub(super) struct GeometryLeft {
    pub(super) textures: Vec<TextureHandle>,
    pub(super) buffers: Vec<BufferHandle>,
}

enum Pipeline {
    Tracing(Holder<RayTracingPipelineHandle>),
    Compute(Holder<ComputePipelineHandle>),
}

impl RayPass {
    /// The pass that `config` asks for, into `output`.
    pub(super) fn new(ctx: &Context, config: &HybridConfig, output: TextureHandle) -> lvk::Result<Self> {
        let defines = match (config.method, config.geometry) {
            (Method::Standalone, _) => &[],
            (Method::Hybrid, Geometry::Paper) => texts::WITH_GBUFFER,
            (Method::Hybrid, Geometry::Visibility(_)) => texts::WITH_VISIBILITY,
        };
        let value = SpecializationValue::U32(config.max_depth);
        let depth = [SpecializationConstant { id: DEPTH_CONSTANT, value }];
        let pipeline = match config.path {
            RayPath::Pipeline => Pipeline::Tracing(tracing_pipeline(ctx, defines, &depth)?),
            RayPath::Query => Pipeline::Compute(compute_pipeline(ctx, defines, &depth)?),
        };
        Ok(Self { pipeline, output })
    }

    /// Records the rows that `push` names, in an image `width` pixels wide, from what the geometry pass left.
    pub(super) fn record(
        &self,
        cmd: &mut CommandBuffer,
        width: u32,
        push: &Push,
        left: &GeometryLeft,
    ) -> lvk::Result<()> {
        let rows = push.end_row.saturating_sub(push.first_row);
        let dependencies = Dependencies {
            sampled_images: &left.textures,
            read_buffers: &left.buffers,
            storage_images: &[self.output],
            ..Dependencies::default()
        };
        cmd.push_label("ray pass");
        match &self.pipeline {
            Pipeline::Tracing(pipeline) => {
                cmd.bind_ray_tracing_pipeline(**pipeline)?;
                cmd.push_constants(push)?;
                cmd.trace_rays([width, rows, 1], &dependencies)?;
            }
            Pipeline::Compute(pipeline) => {
                cmd.bind_compute_pipeline(**pipeline)?;
                cmd.push_constants(push)?;
                cmd.dispatch([width.div_ceil(GROUP), rows.div_ceil(GROUP), 1], &dependencies)?;
            }
        }
        cmd.pop_label();
        Ok(())
    }
}

fn tracing_pipeline(
    ctx: &Context,
    defines: &[(&str, &str)],
    specialization: &[SpecializationConstant],
) -> lvk::Result<Holder<RayTracingPipelineHandle>> {
    let ray_gen = module(ctx, ShaderStage::RayGen, texts::RENDER_RGEN, defines, "render.rgen")?;
    let closest_miss = module(ctx, ShaderStage::Miss, texts::CLOSEST_RMISS, &[], "closest.rmiss")?;
    let shadow_miss = module(ctx, ShaderStage::Miss, texts::SHADOW_RMISS, &[], "shadow.rmiss")?;
    let closest_hit = module(ctx, ShaderStage::ClosestHit, texts::CLOSEST_RCHIT, &[], "closest.rchit")?;
    ctx.create_ray_tracing_pipeline(&RayTracingPipelineDesc {
        ray_gen: &[*ray_gen],
        miss: &[*closest_miss, *shadow_miss],
        hit_groups: &[HitGroup { closest_hit: Some(*closest_hit), ..HitGroup::default() }],
        max_recursion: 1,
        specialization,
        debug_name: "ray pass",
        ..RayTracingPipelineDesc::default()
    })
}

fn compute_pipeline(
    ctx: &Context,
    defines: &[(&str, &str)],
    specialization: &[SpecializationConstant],
) -> lvk::Result<Holder<ComputePipelineHandle>> {
    let shader = module(ctx, ShaderStage::Compute, texts::RENDER_COMP, defines, "render.comp")?;
    ctx.create_compute_pipeline(&ComputePipelineDesc {
        module: Some(*shader),
        specialization,
        debug_name: "ray pass",
    })
}
