//! The sample's pipelines as data, with the texts and formats that its passes use.

use lvk::ShaderStage;

use super::geometry_pass::GBuffer;
use super::hardware_raster::HardwareRaster;
use crate::pipelines::{SamplePipeline, SampleStage};
use crate::shaders::hybrid as texts;

type Defines = &'static [(&'static str, &'static str)];

/// Every pipeline of the sample.
#[must_use]
pub fn pipelines() -> Vec<SamplePipeline> {
    vec![
        geometry(),
        visibility(),
        compute("hybrid: small triangles", texts::RASTER_SMALL_COMP, &[], "raster_small.comp"),
        compute("hybrid: medium triangles", texts::RASTER_MEDIUM_COMP, &[], "raster_medium.comp"),
        compute("hybrid: tiles of large triangles", texts::RASTER_TILE_COMP, &[], "raster_tile.comp"),
        compute("hybrid: culling", texts::CULL_COMP, &[], "cull.comp"),
        compute("hybrid: survivors of culling", texts::COMPACT_COMP, &[], "compact.comp"),
        tracing("hybrid: rays by pipeline", texts::WITH_VISIBILITY),
        tracing("hybrid: rays from the paper's G-buffer by pipeline", texts::WITH_GBUFFER),
        tracing("stand-alone: rays by pipeline", &[]),
        queued_tracing("hybrid: rays in two launches by pipeline", texts::WITH_VISIBILITY_AND_QUEUE),
        queued_tracing("stand-alone: rays in two launches by pipeline", texts::WITH_QUEUE),
        rays("hybrid: rays by query", texts::WITH_VISIBILITY),
        rays("hybrid: rays from the paper's G-buffer by query", texts::WITH_GBUFFER),
        rays("stand-alone: rays by query", &[]),
        compute("hybrid: order of pixels", texts::ORDER_COMP, &[], "order.comp"),
        tracing("hybrid: rays in order by pipeline", texts::WITH_VISIBILITY_AND_ORDER),
        rays("hybrid: rays in order by query", texts::WITH_VISIBILITY_AND_ORDER),
        rays("hybrid: first surfaces by query", texts::WITH_VISIBILITY_AND_QUEUE),
        rays("stand-alone: first surfaces by query", texts::WITH_QUEUE),
        compute("hybrid: bounces by query", texts::BOUNCES_COMP, texts::WITH_VISIBILITY, "bounces.comp"),
        compute("stand-alone: bounces by query", texts::BOUNCES_COMP, &[], "bounces.comp"),
    ]
}

fn geometry() -> SamplePipeline {
    SamplePipeline {
        name: "hybrid: the paper's geometry pass",
        stages: vec![
            stage(ShaderStage::Vertex, texts::GEOMETRY_VERT, &[], "geometry.vert"),
            stage(ShaderStage::Fragment, texts::GEOMETRY_FRAG, &[], "geometry.frag"),
        ],
        color: GBuffer::COLOR.to_vec(),
        depth: Some(GBuffer::DEPTH),
    }
}

fn tracing(name: &'static str, defines: Defines) -> SamplePipeline {
    let stages = vec![
        stage(ShaderStage::RayGen, texts::RENDER_RGEN, defines, "render.rgen"),
        stage(ShaderStage::Miss, texts::CLOSEST_RMISS, &[], "closest.rmiss"),
        stage(ShaderStage::Miss, texts::SHADOW_RMISS, &[], "shadow.rmiss"),
        stage(ShaderStage::ClosestHit, texts::CLOSEST_RCHIT, &[], "closest.rchit"),
    ];
    SamplePipeline { name, stages, color: Vec::new(), depth: None }
}

/// First surfaces, with mirrors and glass queued for the second ray generation stage.
fn queued_tracing(name: &'static str, defines: Defines) -> SamplePipeline {
    let mut pipeline = tracing(name, defines);
    pipeline.stages.insert(1, stage(ShaderStage::RayGen, texts::BOUNCES_RGEN, defines, "bounces.rgen"));
    pipeline
}

fn visibility() -> SamplePipeline {
    SamplePipeline {
        name: "hybrid: visibility by hardware",
        stages: vec![
            stage(ShaderStage::Vertex, texts::GEOMETRY_VERT, &[], "geometry.vert"),
            stage(ShaderStage::Fragment, texts::VISIBILITY_FRAG, &[], "visibility.frag"),
        ],
        color: vec![HardwareRaster::IMAGE],
        depth: Some(HardwareRaster::DEPTH),
    }
}

fn rays(name: &'static str, defines: Defines) -> SamplePipeline {
    compute(name, texts::RENDER_COMP, defines, "render.comp")
}

fn compute(name: &'static str, text: &'static str, defines: Defines, file: &'static str) -> SamplePipeline {
    let stages = vec![stage(ShaderStage::Compute, text, defines, file)];
    SamplePipeline { name, stages, color: Vec::new(), depth: None }
}

fn stage(stage: ShaderStage, text: &'static str, defines: Defines, name: &'static str) -> SampleStage {
    SampleStage { stage, text, defines, name }
}
