//! `lvk` is a bindless, handle-based, lightweight Vulkan library with a focus on ray tracing.
//!
//! The application creates objects from plain descriptions and refers to them by handles. Shaders access textures,
//! samplers and acceleration structures by a bindless index ([`Holder::index`]), and buffers by address
//! ([`Context::buffer_address`]). The library manages descriptor sets, shader binding tables, barriers, image
//! layouts, scratch memory and staging memory. It keeps objects alive while the GPU uses them.
//!
//! ```no_run
//! use lvk::*;
//!
//! # fn main() -> lvk::Result<()> {
//! let ctx = Context::new(&ContextDesc::default())?;
//! let numbers = ctx.create_buffer(&BufferDesc { data: Some(&[0; 256]), ..Default::default() })?;
//! let module = ctx.create_shader_module(&ShaderModuleDesc {
//!     stage: ShaderStage::Compute,
//!     source: ShaderSource::Glsl(
//!         r"
//!         layout(local_size_x = 64) in;
//!         layout(buffer_reference, scalar) buffer Numbers { uint value[]; };
//!         layout(push_constant, scalar) uniform Push { Numbers numbers; };
//!         void main() { numbers.value[gl_GlobalInvocationID.x] = gl_GlobalInvocationID.x; }",
//!     ),
//!     ..Default::default()
//! })?;
//! let pipeline =
//!     ctx.create_compute_pipeline(&ComputePipelineDesc { module: Some(*module), ..Default::default() })?;
//! let mut cmd = ctx.acquire_command_buffer()?;
//! cmd.bind_compute_pipeline(*pipeline)?;
//! cmd.push_constants(&ctx.buffer_address(*numbers)?)?;
//! cmd.dispatch([1, 1, 1], &Dependencies { buffers: &[*numbers], ..Default::default() })?;
//! ctx.submit(cmd)?;
//! let mut bytes = [0; 256];
//! ctx.download_buffer(*numbers, 0, &mut bytes)?;
//! # Ok(())
//! # }
//! ```
//!
//! # Map
//!
//! | Task | Start at |
//! |---|---|
//! | open a device, query its capabilities | [`Context::new`], [`ContextDesc`], [`Capabilities`] |
//! | create objects | `Context::create_*`, each with its `*Desc` |
//! | use part of a texture, or another format of it | [`Context::create_texture_view`], [`TextureViewDesc`] |
//! | let targets of a frame share memory | [`Context::create_transient_heap`], [`CommandBuffer::begin_transient_step`] |
//! | pass data of one frame to shaders | [`CommandBuffer::upload`], [`RenderPass::upload`] |
//! | move data | [`manual::queues_and_uploads`], [`Context::upload_buffer`], [`Context::download_texture`], [`Readback`] and similar methods |
//! | record commands | [`Context::acquire_command_buffer`], [`CommandBuffer`] |
//! | draw | [`CommandBuffer::begin_rendering`], [`RenderPass`], [`manual::rendering`] |
//! | read targets in their own pass | [`RenderPassDesc::local_read`], [`TextureUsage::INPUT`], [`RenderPass::read_targets`] |
//! | shade several pixels at once | [`RenderPipelineDesc::shading_rate`], [`Context::shading_rates`] |
//! | draw with task and mesh shaders | [`RenderPipelineDesc::mesh`], [`RenderPass::draw_mesh_tasks`] |
//! | present to windows | [`manual::windows`], [`Context::create_swapchain`], [`Context::present`] |
//! | compute | [`CommandBuffer::dispatch`] |
//! | trace rays with a pipeline | [`RayTracingPipelineDesc`], [`CommandBuffer::trace_rays`], [`manual::ray_tracing_pipelines`], [`manual::lowered_pipelines`] |
//! | link compiled shaders into several pipelines | [`RayTracingLibraryDesc`] |
//! | keep compiled pipelines on disk | [`ContextDesc::pipeline_cache`] |
//! | keep compiled shaders on disk | [`ContextDesc::shader_cache`] |
//! | compile pipelines in the background | [`Context::create_render_pipeline_in_background`], [`PendingPipeline`] |
//! | compile shaders anew when their files change | [`Reloadable`], [`ShaderFiles`] |
//! | write shaders, in GLSL, Slang or HLSL | [`ShaderModuleDesc`], [`manual::shader_interface`], [`HLSL_HEADER`] |
//! | compare Rust structs with the blocks of shaders | [`shader_struct!`], [`BlockLayout`], [`ShaderRecord`], [`manual::shaders`] |
//! | trace rays in any shader | [`ShaderModuleDesc`] with `#include <lvk/ray_query.glsl>` |
//! | build acceleration structures | [`BlasDesc`], [`TlasDesc`], [`CommandBuffer::build_blas`], [`CommandBuffer::update_tlas`] |
//! | declare the resources that a shader accesses | [`Dependencies`] |
//! | submit, wait, pace frames | [`Context::submit`], [`Context::wait`], [`Context::next_frame`] |
//! | compute, build and copy while the graphics queue draws | [`Context::acquire_command_buffer_on`] a [`Queue`], [`Context::create_blas_batch_on`], [`manual::queues_and_uploads`] |
//! | measure | [`manual::measuring`], [`Context::set_profiling`], [`QueryPoolDesc`], [`CommandBuffer::write_timestamp`] |
//! | debug | [`manual::debugging`], [`ValidationMode`], [`ValidationSink`], [`CommandBuffer::push_label`] |
//! | know what is not checked | [`manual::unchecked`] |
//! | find out why a device was lost | [`DeviceLossReport`], [`ContextDesc::checkpoints`] |
//! | use raw Vulkan calls, or another engine's device | [`manual::interop`], [`Context::requirements`] |
//! | compare with LightweightVK, feature by feature | [`manual::parity`] |
//! | port a program | [`manual::from_lightweightvk`], [`manual::from_wgpu`] |
//! | learn the concepts | [`manual`] |
//!
//! # Barriers
//!
//! The library tracks every buffer, and every mip and layer of every texture. The caller declares nothing for
//! attachments, copies, uploads, traces, builds and refits of acceleration structures, and ray queries in any stage.
//!
//! Resources that a shader accesses only by index or address are declared in [`Dependencies`] in two cases: an
//! earlier command *wrote* the resource, or this command writes it. A resource that was only uploaded is readable
//! everywhere.
//!
//! A render pass cannot contain barriers. Resources that its draws read and the same command buffer wrote are
//! therefore declared in the dependencies of the pass. A missing declaration is an error for indices, vertices and
//! indirect arguments. It is a hazard for resources that shaders access by index or address.
//!
//! Acceleration structures are the exception. If any graphics pipeline queries rays, a render pass waits for the
//! builds recorded before it. Create such pipelines before their pass begins.
//!
//! # What is not checked
//!
//! Shaders are not checked: their indices, addresses, loops, and the dependencies of their commands. One table,
//! [`manual::unchecked`], lists the known mistakes of safe code that are neither an [`Error`] nor a warning, with their
//! results, the tools that notice them, and the remedies.
//!
//! # What `lvk` does not do (yet)
//!
//! Most pages of the [manual] end with a list of unsupported features. `lvk` is neither a scene graph nor a renderer.
//!
//! # Features
//!
//! The code and the crates of a disabled feature are not compiled. Enabled by default are:
//!
//! * `glsl` compiles GLSL at run time. It needs a C++17 compiler when the library is built. Without it, modules take
//!   only SPIR-V words, and [`ShaderSource::Glsl`] is [`Error::Unsupported`].
//! * `software-ray-query` contains the library's own BVH builders and traversal, for devices without ray queries.
//!   Without it, such devices have neither ray queries nor ray tracing pipelines: [`RayQueryRequest::Auto`] and
//!   [`RayTracingPipelineRequest::Auto`] select the device's features or nothing, [`RayQueryRequest::Software`] and
//!   [`RayTracingPipelineRequest::Software`] are [`Error::Unsupported`], and [`ContextDesc::tree_cache`] has no effect.
//! * `window` contains swapchains for windows of any library that implements `raw-window-handle`. Without it, a
//!   context renders only to textures: `ContextDesc::window`, `Context::create_swapchain` and their types do not exist.
//!
//! Disabled by default are:
//!
//! * `glam` adds `transform_rows`, which takes a transform of the crate `glam`, and exports the crate as `lvk::glam`.
//!   No other item has types of `glam`: transforms are `[f32; 12]` ([`rows_from_columns`]), points and matrices are
//!   arrays.
//! * `profiling` opens a scope of the crate [`profiling`](https://docs.rs/profiling) around calls that can take long:
//!   submissions, waits, presents, acquisitions, creation of pipelines and shaders, uploads and builds. The application
//!   chooses the profiler by a feature of that crate, or by `tracy` of this one.
//! * `tracy` sends the scopes to Tracy, and the labels of command buffers as GPU zones: see
//!   [`manual::measuring`]. It needs a C++ compiler when the library is built.
//!
//! # Targets
//!
//! Targets are little-endian, of 32 or 64 bits. A big-endian target is a compile error: shaders read the bytes of a
//! software BVH as words, and cache files hold them unchanged. No byte slice of the application needs an alignment.

#[cfg(target_endian = "big")]
compile_error!("lvk needs a little-endian target: shaders read the bytes of its software BVHs as words");

/// Compiles the program of the README.
#[cfg(all(doctest, feature = "glsl"))]
#[doc = include_str!("../README.md")]
struct Readme;

mod accel;
mod background;
mod barrier;
mod bindless;
mod cache_file;
mod command;
mod context;
mod cpu_scope;
mod device_state;
mod error;
mod format;
mod gpu;
mod handle;
mod handle_cache;
#[cfg(feature = "glsl")]
mod hot_reload;
mod kernels;
mod leak_report;
mod lock_order;
pub mod manual;
mod parallel;
mod pipeline;
mod pool;
mod queue;
#[doc(hidden)]
pub mod regular_file;
mod resource;
mod shader;
#[cfg_attr(not(feature = "software-ray-query"), path = "software_ray_query/disabled/mod.rs")]
mod software_ray_query;
mod store;
mod submit;
#[cfg(feature = "window")]
mod swapchain;
#[doc(hidden)]
pub mod temporary_file;
#[cfg(any(test, feature = "test-hooks"))]
mod test_support;
mod upload;

#[cfg(any(test, feature = "test-hooks"))]
#[doc(hidden)]
pub use test_support::hooks as test_hooks;

pub use ash;
#[cfg(feature = "glam")]
pub use {accel::transform::transform_rows, glam};

pub use accel::culling::InstanceCulling;
pub use accel::desc::{BlasDesc, PrimitiveOrder};
pub use accel::flags::{AccelStructSizes, BuildFlags, BuildMode};
pub use accel::geometry::{Aabbs, BlasGeometry, GeometryFlags, GeometryTransform, Indices, Triangles};
pub use accel::instance::{DeviceInstances, InstanceFlags, TlasInstance};
pub use accel::micromap_desc::{
    OpacityFormat, OpacityMap, OpacityMicromapDesc, OpacityState, TriangleOpacity,
};
pub use accel::tlas_desc::TlasDesc;
pub use accel::transform::rows_from_columns;
pub use bindless::index_checks::{BindlessArray, IndexFault, SlotState};
pub use command::CommandBuffer;
pub use command::dependencies::Dependencies;
pub use command::render::desc::{
    ColorAttachment, ColorLoadOp, DepthAttachment, DepthLoadOp, DepthResolve, RenderPassDesc, Resolve,
    ShadingRateAttachment, StencilLoadOp,
};
pub use command::render::indirect_count::IndirectCount;
pub use command::render::pass::RenderPass;
pub use command::transfer::{BufferCopy, ClearValue};
pub use context::Context;
pub use context::accel_info::{AccelMemory, AccelStructInfo, BuildProgress, Compaction};
pub use context::config::ContextDesc;
pub use context::destroy::Destroy;
pub use context::frame::Frame;
pub use context::holder::Holder;
pub use context::import::{ImportedBuffer, ImportedTexture, RawSignal, RawWait};
pub use context::pending_pipeline::PendingPipeline;
pub use context::readback::Readback;
pub use context::serialize::LoadedBlas;
pub use context::transient_heap::TransientHeap;
#[doc(hidden)]
pub use error::causes::with_causes;
pub use error::device_candidate::{DeviceCandidate, DeviceKind};
pub use error::device_fault::{DeviceFault, FaultAddress, FaultKind, VendorFault};
pub use error::device_loss::{
    DeviceLossReport, LabelProgress, QueueLossReport, ReportedLabel, UnfinishedCommands,
};
pub use error::driver_report::{
    DriverManifest, DriverReport, LoaderReport, ManifestOutcome, SearchedPath, VulkanReport,
};
pub use error::layout_difference::LayoutDifference;
pub use error::limit_origin::LimitOrigin;
#[doc(hidden)]
pub use error::readable::{readable_bytes, readable_line, readable_name, readable_text};
pub use error::{Error, Result};
pub use format::{Aspect, Format, IndexFormat, VertexFormat};
pub use gpu::calibrated_timestamps::CalibratedTimestamps;
pub use gpu::caps::capabilities::Capabilities;
pub use gpu::caps::limits::{Limits, MicromapLimits};
pub use gpu::caps::mesh_limits::MeshLimits;
pub use gpu::caps::optional_features::{FeatureSet, OptionalFeature};
pub use gpu::caps::queues::{QueueInfo, QueueRequest};
pub use gpu::caps::ray_query_path::{RayQueryPath, RayQueryRequest};
pub use gpu::caps::ray_tracing_pipeline_path::{RayTracingPipelinePath, RayTracingPipelineRequest};
pub use gpu::caps::resolve_modes::{DepthResolveLimits, ResolveMode, ResolveModes};
pub use gpu::caps::shading_rate::{FragmentSize, ShadingRate, ShadingRateCombiner, ShadingRateLimits};
pub use gpu::caps::subgroup_limits::SubgroupLimits;
pub use gpu::debug::label::Label;
pub use gpu::debug::messenger::{ValidationMessage, ValidationMode, ValidationSink};
pub use gpu::host_clock::HostClock;
pub use gpu::memory::allocator::MemoryKind;
pub use gpu::memory::budget::{MemoryBudget, MemoryHeap};
pub use gpu::requirements::DeviceRequirements;
pub use gpu::start::external::RawContext;
pub use gpu::start::feature_chain::FeatureChain;
pub use gpu::start::profile::DeviceProfile;
pub use gpu::start::user_extensions::UserExtensions;
pub use handle::{
    AccelStructHandle, BufferHandle, ComputePipelineHandle, Handle, OpacityMicromapHandle, QueryPoolHandle,
    RayTracingLibraryHandle, RayTracingPipelineHandle, RenderPipelineHandle, SamplerHandle,
    ShaderModuleHandle, TextureHandle,
};
#[cfg(feature = "glsl")]
pub use hot_reload::{Reloadable, ShaderFiles};
pub use pipeline::blend::{Blend, BlendComponent, BlendFactor, BlendOp, ColorWriteMask};
pub use pipeline::block_layout::BlockLayout;
pub use pipeline::compute::ComputePipelineDesc;
pub use pipeline::depth_stencil::{DepthState, DepthTest, StencilFace, StencilOp, StencilTest};
pub use pipeline::graphics_desc::{ColorTarget, RenderPipelineDesc, VertexAttribute, VertexBinding};
pub use pipeline::rasterization::{CullMode, DepthBias, FrontFace, PolygonMode, Topology};
pub use pipeline::ray_tracing_desc::{HitGroup, RayTracingPipelineDesc};
pub use pipeline::ray_tracing_library::RayTracingLibraryDesc;
pub use pipeline::shader_record::{ShaderRecord, record_bytes};
pub use pipeline::stage::{SpecializationConstant, SpecializationValue};
pub use queue::Queue;
pub use resource::buffer::{BufferDesc, BufferUsage};
pub use resource::format_support::FormatSupport;
pub use resource::query_pool::{PipelineStatistics, QueryKind, QueryPoolDesc};
pub use resource::region::{TextureRange, TextureRegion};
pub use resource::sampler::{AddressMode, BorderColor, CompareOp, Filter, SamplerDesc, SamplerReductionMode};
pub use resource::swizzle::{Channel, Swizzle};
pub use resource::texture_desc::{TextureDesc, TextureKind, TextureMemory, TextureUsage};
pub use resource::transient_heap::{TransientHeapDesc, TransientHeapMemory, TransientTexture};
pub use resource::view::TextureViewDesc;
pub use resource::ycbcr::{ChromaLocation, YuvConversion, YuvModel, YuvRange};
#[cfg(feature = "glsl")]
pub use shader::compile_glsl;
#[doc(hidden)]
pub use shader::shader_layout::{MemberProbe, PlainMember};
pub use shader::shader_layout::{NestedLayout, ShaderLayout, StructLayout, StructMember};
pub use shader::{HLSL_HEADER, ShaderCacheStats, ShaderModuleDesc, ShaderSource, ShaderStage};
pub use store::LiveObject;
pub use submit::{GpuProfile, GpuScope, SubmitHandle};
#[cfg(unix)]
pub use {
    context::external_semaphore::{SemaphoreFdType, SemaphoreKind, SharedSemaphore, SharedSemaphoreDesc},
    gpu::memory::external::{DrmLayout, DrmPlane, MemoryFd, MemoryFdType},
};
#[cfg(feature = "window")]
pub use {
    gpu::start::window::WindowHandles,
    handle::SwapchainHandle,
    raw_window_handle,
    swapchain::desc::{ColorSpace, HdrMetadata, PresentMode, SwapchainDesc, SwapchainImage, SwapchainInfo},
};
