//! Shader modules and pipelines.

pub(crate) mod compute;
pub(crate) mod graphics;
pub(crate) mod layout;
pub(crate) mod ray_tracing;
pub(crate) mod sbt;
pub(crate) mod shader_module;
pub(crate) mod stage;

pub(crate) use compute::ComputePipeline;
pub(crate) use graphics::RenderPipeline;
pub(crate) use layout::PipelineLayout;
pub(crate) use ray_tracing::RayTracingPipeline;
pub(crate) use shader_module::ShaderModule;
