//! The sample's pipelines as data, with the stages and macros that its passes use.

use super::geometry_pass::GBuffer;
use super::hardware_raster::HardwareRaster;
use crate::pipelines::{SamplePipeline, SampleStage, shader};

pub(super) const GEOMETRY_VERT: SampleStage = shader!("hybrid", "geometry.vert");
pub(super) const GEOMETRY_FRAG: SampleStage = shader!("hybrid", "geometry.frag");
pub(super) const VISIBILITY_FRAG: SampleStage = shader!("hybrid", "visibility.frag");
pub(super) const RASTER_SMALL_COMP: SampleStage = shader!("hybrid", "raster_small.comp");
pub(super) const RASTER_MEDIUM_COMP: SampleStage = shader!("hybrid", "raster_medium.comp");
pub(super) const RASTER_TILE_COMP: SampleStage = shader!("hybrid", "raster_tile.comp");
pub(super) const CULL_COMP: SampleStage = shader!("hybrid", "cull.comp");
pub(super) const COMPACT_COMP: SampleStage = shader!("hybrid", "compact.comp");
pub(super) const ORDER_COMP: SampleStage = shader!("hybrid", "order.comp");
pub(super) const RENDER_COMP: SampleStage = shader!("hybrid", "render.comp");
pub(super) const BOUNCES_COMP: SampleStage = shader!("hybrid", "bounces.comp");
pub(super) const RENDER_RGEN: SampleStage = shader!("hybrid", "render.rgen");
pub(super) const BOUNCES_RGEN: SampleStage = shader!("hybrid", "bounces.rgen");
pub(super) const CLOSEST_RMISS: SampleStage = shader!("hybrid", "closest.rmiss");
pub(super) const SHADOW_RMISS: SampleStage = shader!("hybrid", "shadow.rmiss");
pub(super) const CLOSEST_RCHIT: SampleStage = shader!("hybrid", "closest.rchit");

/// Names and values of macros.
type Defines = &'static [(&'static str, &'static str)];

/// Macros of ray stages that start from the paper's G-buffer.
pub(super) const WITH_GBUFFER: Defines = &[("HYBRID_GBUFFER", "1")];
/// Macros of ray stages that start from the visible triangles.
pub(super) const WITH_VISIBILITY: Defines = &[("HYBRID_VISIBILITY", "1")];
/// Macros of the ray stage that queues mirrors and glass.
pub(super) const WITH_QUEUE: Defines = &[("HYBRID_QUEUE", "1")];
/// Macros of ray stages that take pixels in sorted order.
pub(super) const WITH_VISIBILITY_AND_ORDER: Defines = &[("HYBRID_VISIBILITY", "1"), ("HYBRID_ORDERED", "1")];
/// Macros of the ray stage that queues mirrors and glass, from the visible triangles.
const WITH_VISIBILITY_AND_QUEUE: Defines = &[("HYBRID_VISIBILITY", "1"), ("HYBRID_QUEUE", "1")];

/// Returns every pipeline of the sample.
pub(super) fn pipelines() -> Vec<SamplePipeline> {
    let compute = |name, stage: SampleStage| SamplePipeline::new(name, &[stage]);
    let query = |name, defines| compute(name, RENDER_COMP.with_defines(defines));
    vec![
        SamplePipeline::raster(
            "hybrid: the paper's geometry pass",
            &[GEOMETRY_VERT, GEOMETRY_FRAG],
            &GBuffer::COLOR,
            Some(GBuffer::DEPTH),
        ),
        SamplePipeline::raster(
            "hybrid: visibility by hardware",
            &[GEOMETRY_VERT, VISIBILITY_FRAG],
            &[HardwareRaster::IMAGE],
            Some(HardwareRaster::DEPTH),
        ),
        compute("hybrid: small triangles", RASTER_SMALL_COMP),
        compute("hybrid: medium triangles", RASTER_MEDIUM_COMP),
        compute("hybrid: tiles of large triangles", RASTER_TILE_COMP),
        compute("hybrid: culling", CULL_COMP),
        compute("hybrid: survivors of culling", COMPACT_COMP),
        tracing("hybrid: rays by pipeline", WITH_VISIBILITY),
        tracing("hybrid: rays from the paper's G-buffer by pipeline", WITH_GBUFFER),
        tracing("stand-alone: rays by pipeline", &[]),
        queued_tracing("hybrid: rays in two launches by pipeline", WITH_VISIBILITY_AND_QUEUE),
        queued_tracing("stand-alone: rays in two launches by pipeline", WITH_QUEUE),
        query("hybrid: rays by query", WITH_VISIBILITY),
        query("hybrid: rays from the paper's G-buffer by query", WITH_GBUFFER),
        query("stand-alone: rays by query", &[]),
        compute("hybrid: order of pixels", ORDER_COMP),
        tracing("hybrid: rays in order by pipeline", WITH_VISIBILITY_AND_ORDER),
        query("hybrid: rays in order by query", WITH_VISIBILITY_AND_ORDER),
        query("hybrid: first surfaces by query", WITH_VISIBILITY_AND_QUEUE),
        query("stand-alone: first surfaces by query", WITH_QUEUE),
        compute("hybrid: bounces by query", BOUNCES_COMP.with_defines(WITH_VISIBILITY)),
        compute("stand-alone: bounces by query", BOUNCES_COMP),
    ]
}

fn tracing(name: &'static str, defines: Defines) -> SamplePipeline {
    SamplePipeline::new(
        name,
        &[RENDER_RGEN.with_defines(defines), CLOSEST_RMISS, SHADOW_RMISS, CLOSEST_RCHIT],
    )
}

/// First surfaces, with mirrors and glass queued for the second ray generation stage.
fn queued_tracing(name: &'static str, defines: Defines) -> SamplePipeline {
    let mut pipeline = tracing(name, defines);
    pipeline.stages.insert(1, BOUNCES_RGEN.with_defines(defines));
    pipeline
}
