//! The ray passes: what opaque surfaces reflect, then what the transparent ones in front of them do, by one ray
//! tracing pipeline with two ray generation shaders, or by two compute shaders with ray queries.

use lvk::{
    BufferHandle, CommandBuffer, ComputePipelineHandle, Context, Dependencies, HitGroup, Holder,
    RayTracingPipelineDesc, RayTracingPipelineHandle,
};

use super::animation::compute;
use super::frame::Push;
use super::pipelines::{
    CLOSEST_HIT, CLOSEST_MISS, LEAF_ANY_HIT, OPAQUE_QUERY, OPAQUE_RAYS, TRANSPARENT_QUERY, TRANSPARENT_RAYS,
};
use super::targets::{Targets, step};
use crate::hybrid::RayPath;

/// Side of a work group in pixels.
pub(super) const GROUP: u32 = 8;

/// Both passes.
pub(super) enum RayPasses {
    Pipeline(Holder<RayTracingPipelineHandle>),
    Query([Holder<ComputePipelineHandle>; 2]),
}

/// The surfaces to trace from.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Surfaces {
    Opaque,
    Transparent,
}

impl RayPasses {
    pub(super) fn new(ctx: &Context, path: RayPath) -> lvk::Result<Self> {
        Ok(match path {
            RayPath::Pipeline => Self::Pipeline(tracing_pipeline(ctx)?),
            RayPath::Query => Self::Query([compute(ctx, OPAQUE_QUERY)?, compute(ctx, TRANSPARENT_QUERY)?]),
        })
    }

    /// Records one of the passes over a picture of `extent` pixels.
    pub(super) fn record(
        &self,
        cmd: &mut CommandBuffer,
        surfaces: Surfaces,
        extent: [u32; 2],
        targets: &Targets,
        written: &[BufferHandle],
        frame: u64,
    ) -> lvk::Result<()> {
        targets.begin(
            cmd,
            match surfaces {
                Surfaces::Opaque => step::OPAQUE_RAYS,
                Surfaces::Transparent => step::TRANSPARENT_RAYS,
            },
        )?;
        let sampled = match surfaces {
            Surfaces::Opaque => targets.opaque(),
            Surfaces::Transparent => targets.glass(),
        };
        let opaque_images = [*targets.visibility, *targets.penumbra, *targets.reflection];
        let storage_images: &[_] = match surfaces {
            Surfaces::Opaque => &opaque_images,
            Surfaces::Transparent => &[*targets.glass_reflection],
        };
        let dependencies = Dependencies {
            sampled_images: &sampled,
            storage_images,
            read_buffers: written,
            ..Dependencies::default()
        };
        let push = Push { frame, arguments: [0; 4] };
        match self {
            Self::Pipeline(pipeline) => {
                cmd.bind_ray_tracing_pipeline(**pipeline)?;
                cmd.push_constants(&push)?;
                cmd.trace_rays_with(surfaces as u32, [extent[0], extent[1], 1], &dependencies)
            }
            Self::Query(pipelines) => {
                cmd.bind_compute_pipeline(*pipelines[surfaces as usize])?;
                cmd.push_constants(&push)?;
                cmd.dispatch([extent[0].div_ceil(GROUP), extent[1].div_ceil(GROUP), 1], &dependencies)
            }
        }
    }
}

fn tracing_pipeline(ctx: &Context) -> lvk::Result<Holder<RayTracingPipelineHandle>> {
    let stages = [OPAQUE_RAYS, TRANSPARENT_RAYS, CLOSEST_MISS, CLOSEST_HIT, LEAF_ANY_HIT];
    let modules = stages.map(|stage| stage.create(ctx, "reflections"));
    let [opaque, transparent, closest_miss, closest_hit, leaf] = modules;
    let (closest_hit, leaf) = (closest_hit?, leaf?);
    let solid = HitGroup { closest_hit: Some(*closest_hit), ..HitGroup::default() };
    ctx.create_ray_tracing_pipeline(&RayTracingPipelineDesc {
        ray_gen: &[*opaque?, *transparent?],
        miss: &[*closest_miss?],
        hit_groups: &[solid, HitGroup { any_hit: Some(*leaf), ..solid }],
        max_recursion: 1,
        debug_name: "reflections",
        ..RayTracingPipelineDesc::default()
    })
}
