//! A bindless, handle-based, lightweight Vulkan library with ray tracing as its headline.

mod accel;
mod barrier;
mod bindless;
mod command;
mod context;
mod error;
mod format;
mod gpu;
mod handle;
mod pipeline;
mod resource;
mod shader;
mod shared;
mod store;
mod submit;
mod upload;

pub use ash;
pub use glam;

pub use accel::desc::{BlasDesc, TlasDesc};
pub use accel::geometry::{Aabbs, BlasGeometry, GeometryFlags, Indices, Triangles};
pub use accel::instance::{InstanceFlags, TlasInstance, transform_rows};
pub use accel::structure::{AccelStructSizes, BuildFlags, BuildMode};
pub use command::CommandBuffer;
pub use command::dependencies::Dependencies;
pub use command::render::RenderPass;
pub use command::render_pass::{ColorAttachment, ColorLoad, DepthAttachment, DepthLoad, RenderPassDesc};
pub use context::Context;
pub use context::config::ContextDesc;
pub use context::destroy::Destroy;
pub use context::frame::Frame;
pub use context::holder::Holder;
pub use error::{Error, Result};
pub use format::{Format, IndexFormat, VertexFormat};
pub use gpu::caps::{Capabilities, FeatureRequest, Limits};
pub use gpu::debug::{Validation, ValidationMessage, ValidationSink};
pub use gpu::memory::MemoryKind;
pub use handle::{
    AccelStructHandle, BufferHandle, ComputePipelineHandle, Handle, QueryPoolHandle,
    RayTracingPipelineHandle, RenderPipelineHandle, SamplerHandle, ShaderModuleHandle, TextureHandle,
};
pub use pipeline::compute::ComputePipelineDesc;
pub use pipeline::graphics::{
    Blend, ColorTarget, CullMode, DepthTest, FrontFace, RenderPipelineDesc, Topology, VertexAttribute,
    VertexBinding,
};
pub use pipeline::ray_tracing::{HitGroup, RayTracingPipelineDesc};
pub use pipeline::stage::{SpecializationConstant, SpecializationValue};
pub use resource::buffer::{BufferDesc, BufferUsage};
pub use resource::query::QueryPoolDesc;
pub use resource::sampler::{AddressMode, CompareOp, Filter, SamplerDesc};
pub use resource::texture::{TextureDesc, TextureKind, TextureRegion, TextureUsage};
pub use shader::{ShaderModuleDesc, ShaderSource, ShaderStage};
pub use submit::SubmitHandle;
