//! Shader modules and pipelines.

pub(crate) mod blend;
pub(crate) mod cache;
pub(crate) mod cache_file;
pub(crate) mod compute;
mod deferred_operation;
pub(crate) mod depth_stencil;
pub(crate) mod graphics;
mod graphics_check;
pub(crate) mod graphics_desc;
pub(crate) mod local_read;
pub(crate) mod pipeline_layout;
mod portability;
pub(crate) mod rasterization;
mod rasterization_state;
pub(crate) mod ray_tracing;
mod ray_tracing_compile;
pub(crate) mod ray_tracing_desc;
pub(crate) mod ray_tracing_library;
mod ray_tracing_stack;
mod render_modules;
pub(crate) mod rendering_formats;
mod sbt;
mod sbt_order;
mod shader_groups;
pub(crate) mod shader_module;
pub(crate) mod stage;
mod state_check;
mod workgroup_memory;
mod workgroup_size;

pub(crate) use cache::PipelineCache;
pub(crate) use compute::ComputePipeline;
pub(crate) use graphics::{FrontEnd, PassState, RenderPipeline};
pub(crate) use pipeline_layout::{PipelineBase, PipelineLayout};
pub(crate) use ray_tracing::RayTracingPipeline;
pub(crate) use ray_tracing_library::RayTracingLibrary;
pub(crate) use shader_module::ShaderModule;
