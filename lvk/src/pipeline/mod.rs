//! Shader modules and pipelines.

pub(crate) mod blend;
pub(crate) mod cache;
pub(crate) mod cache_file;
pub(crate) mod compute;
mod deferred;
pub(crate) mod depth_stencil;
pub(crate) mod graphics;
mod graphics_check;
pub(crate) mod graphics_desc;
mod group_memory;
mod group_size;
mod groups;
pub(crate) mod layout;
pub(crate) mod library;
pub(crate) mod local_read;
pub(crate) mod raster;
pub(crate) mod ray_tracing;
mod sbt;
pub(crate) mod shader_module;
pub(crate) mod shape;
mod stack;
pub(crate) mod stage;
mod state_check;
mod table_order;

pub(crate) use cache::PipelineCache;
pub(crate) use compute::ComputePipeline;
pub(crate) use graphics::{FrontEnd, PassState, RenderPipeline};
pub(crate) use layout::{PipelineBase, PipelineLayout};
pub(crate) use library::RayTracingLibrary;
pub(crate) use ray_tracing::RayTracingPipeline;
pub(crate) use shader_module::ShaderModule;
