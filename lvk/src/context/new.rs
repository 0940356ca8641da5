//! Creation of a context.

use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicU64};
use std::sync::{Arc, OnceLock};

use super::config::ContextDesc;
use super::default_descriptors::fill_default_descriptors;
use super::frame::FrameRing;
use super::prologue::Prologue;
use super::{Context, ContextInner};
use crate::accel::compaction::Compactions;
use crate::accel::scratch_buffer::ScratchBuffer;
use crate::accel::storage::AccelStorage;
use crate::background::BackgroundJobs;
use crate::barrier::{RayQueryStages, ResourceId};
use crate::bindless::layout::TLAS_TABLE_ENTRY_BYTES;
use crate::bindless::{Bindless, YuvSlots};
use crate::command::RecordingStatePool;
use crate::device_state::{DeviceState, SharedDeviceState};
use crate::error::driver_report::{DriverReport, VulkanReport};
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::gpu::caps::capabilities::Capabilities;
use crate::gpu::caps::queues::QueueRequest;
use crate::gpu::debug::messenger::{ValidationMode, ValidationSink};
use crate::gpu::device::DeviceRequest;
use crate::gpu::start::instance::{Instance, InstanceDesc};
use crate::gpu::start::physical_device::PhysicalDevice;
use crate::gpu::start::user_extensions::UserExtensions;
use crate::kernels::Kernels;
use crate::lock_order::{Mutex, Rank};
use crate::parallel::core_count;
use crate::pipeline::{GraphicsParts, PipelineCache, PipelineLayout};
use crate::resource::Buffer;
use crate::resource::buffer::{BufferDesc, BufferUsage, InternalUsage};
use crate::shader::ShaderCache;
use crate::store::Store;
use crate::submit::Submitter;
use crate::submit::profiler::Profiler;
use crate::upload::{BufferRecycler, Staging};

impl Context {
    /// Loads Vulkan and creates a device that meets the requirements of `desc`.
    ///
    /// # Errors
    /// [`NoVulkan`](crate::Error::NoVulkan) with the reason for each driver when there is no loader, driver or device;
    /// [`NoDevice`](crate::Error::NoDevice) with the reason for each device when no device is suitable; [`Unsupported`](crate::Error::Unsupported) when validation is
    /// required and its layer is missing, the instance has no extension of [`ContextDesc::user_extensions`], or
    /// [`RayQueryRequest::Software`](crate::RayQueryRequest::Software) or
    /// [`RayTracingPipelineRequest::Software`](crate::RayTracingPipelineRequest::Software) is requested without the
    /// feature `software-ray-query`.
    pub fn new(desc: &ContextDesc<'_>) -> Result<Self> {
        desc.ray_query.check()?;
        desc.ray_tracing_pipeline.check()?;
        let sink = desc.validation_sink.clone().unwrap_or_default();
        let instance = Instance::new(&InstanceDesc {
            application_name: desc.application_name,
            library: desc.vulkan_library,
            validation: desc.validation,
            extra: desc.user_extensions.instance_extensions(),
            window: desc.window_ref(),
            sink,
        })?;
        let wish = std::env::var("LVK_DEVICE").ok().filter(|wish| !wish.is_empty());
        let request = DeviceRequest {
            wish: wish.as_deref().or(desc.device),
            profile: desc.profile,
            extra: desc.user_extensions,
            ..external_request(desc)
        };
        Self::with_gpu(Arc::new(Gpu::new(instance, &request)?), desc)
    }

    /// Creates a context on a device. Uses the members of `desc` that do not configure device creation.
    pub(super) fn with_gpu(gpu: Arc<Gpu>, desc: &ContextDesc<'_>) -> Result<Self> {
        let shared = Arc::new(SharedDeviceState::new(new_device_state(gpu, desc)?));
        let inner = ContextInner {
            background: BackgroundJobs::new(core_count() / 2),
            prologue: Mutex::new(Rank::Pending, Prologue::default()),
            compactions: Mutex::new(Rank::Compactions, Compactions::default()),
            frames: Mutex::new(Rank::Frames, FrameRing::new(desc.frames_in_flight)),
            recording_states: RecordingStatePool::new(),
            #[cfg(feature = "window")]
            window: desc.window.clone(),
            shared,
        };
        let context = Self { inner: Arc::new(inner) };
        fill_default_descriptors(&context)?;
        Ok(context)
    }

    /// Returns the capabilities of all devices of the machine, in the order of their indices.
    ///
    /// `vulkan_library` is the loader to open; `None` opens the system's loader.
    pub fn devices(vulkan_library: Option<&Path>) -> Result<Vec<Capabilities>> {
        let instance = plain_instance(vulkan_library)?;
        let devices = physical_devices(&instance)?;
        Ok(devices.into_iter().map(|device| device.capabilities).collect())
    }

    /// Reports the loader, the driver manifests with the error of each library that cannot be opened, and the devices with
    /// the features they lack. Never fails. Opens every driver, so call it after a failure only.
    ///
    /// `vulkan_library` is the loader to open; `None` opens the system's loader.
    #[must_use]
    pub fn vulkan_report(vulkan_library: Option<&Path>) -> VulkanReport {
        let instance = match plain_instance(vulkan_library) {
            Ok(instance) => instance,
            Err(error) => {
                let drivers = failed_report(error, || DriverReport::query_loader(vulkan_library));
                return VulkanReport { drivers, devices: Vec::new() };
            }
        };
        match physical_devices(&instance) {
            Ok(devices) => {
                let devices = devices.iter().enumerate().map(|(index, device)| device.candidate(index));
                VulkanReport { drivers: instance.driver_report(), devices: devices.collect() }
            }
            Err(error) => {
                let drivers = failed_report(error, || instance.driver_report());
                VulkanReport { drivers, devices: Vec::new() }
            }
        }
    }
}

/// Creates an instance without layers, windows and extensions.
fn plain_instance(library: Option<&Path>) -> Result<Instance> {
    Instance::new(&InstanceDesc {
        application_name: "lvk",
        library,
        validation: ValidationMode::Off,
        extra: &[],
        window: None,
        sink: ValidationSink::default(),
    })
}

fn physical_devices(instance: &Instance) -> Result<Vec<PhysicalDevice>> {
    let devices = instance.physical_devices()?;
    devices.into_iter().map(|raw| PhysicalDevice::query(&instance.raw, raw)).collect()
}

/// Returns the report of the error, or `otherwise` with the error as its failure.
fn failed_report(error: Error, otherwise: impl FnOnce() -> DriverReport) -> DriverReport {
    match error {
        Error::NoVulkan { report } => Arc::unwrap_or_clone(report),
        error => DriverReport { failure: Some(error.to_string()), ..otherwise() },
    }
}

/// Returns the request for a device that another engine creates. Members of `desc` that choose or change a device of
/// the library do not count.
pub(super) fn external_request<'a>(desc: &'a ContextDesc<'_>) -> DeviceRequest<'a> {
    DeviceRequest {
        wish: None,
        pipeline: desc.ray_tracing_pipeline,
        query: desc.ray_query,
        required: desc.required_features,
        profile: None,
        extra: UserExtensions::default(),
        debug_names: desc.debug_names,
        validation: desc.validation,
        validation_sink: desc.validation_sink.as_ref(),
        checkpoints: desc.checkpoints,
        queues: requested_queues(desc),
        window: desc.window_ref(),
    }
}

/// Returns the queues to request. Index checks need a shared queue, because command buffers record faults one after the
/// other.
fn requested_queues(desc: &ContextDesc<'_>) -> QueueRequest {
    if desc.check_indices { QueueRequest::Shared } else { desc.queues }
}

fn new_device_state(gpu: Arc<Gpu>, desc: &ContextDesc<'_>) -> Result<DeviceState> {
    let yuv = YuvSlots::new(&gpu, desc.yuv, desc.max_yuv_textures)?;
    let (several, all_blas) = (gpu.queues.has_several(), ResourceId::next());
    let bindless = Bindless::new(&gpu, desc.max_textures, yuv, desc.check_indices)?;
    Ok(DeviceState {
        default_objects: OnceLock::new(),
        store: Store::new(),
        staging: Staging::new(&gpu, desc.staging_bytes),
        scratch: std::array::from_fn(|_| new_scratch(&gpu, desc.scratch_budget_bytes)),
        accel_storage: AccelStorage::new(desc.accel_budget_bytes),
        graphics_queries: RayQueryStages::default(),
        kernels: Kernels::new(),
        instance_buffers: BufferRecycler::new(BufferUsage::STORAGE),
        launch_buffers: BufferRecycler::new(BufferUsage::STORAGE | BufferUsage::INDIRECT),
        tlas_table: new_tlas_table(&gpu)?,
        layout: PipelineLayout::new(&gpu, bindless.set_layout)?,
        pipeline_cache: desc.pipeline_cache.map(|path| PipelineCache::new(&gpu, path)).transpose()?,
        shader_cache: desc.shader_cache.map(ShaderCache::new),
        #[cfg(feature = "software-ray-query")]
        tree_cache: desc.tree_cache.map(crate::software_ray_query::bvh_cache::BvhCache::new),
        graphics_parts: GraphicsParts::new(),
        bindless,
        submitter: Submitter::new(&gpu)?,
        profiler: Profiler::new(&gpu),
        all_blas,
        new_blas: std::array::from_fn(|_| if several { ResourceId::next() } else { all_blas }),
        all_tlas: ResourceId::next(),
        hit_tables_id: ResourceId::next(),
        outdated_tlas: AtomicBool::new(false),
        blas_moves: AtomicU64::new(0),
        freed_tlas_slots: Mutex::new(Rank::FreedTlas, Vec::new()),
        gpu,
    })
}

/// Creates the table with an entry for each element of `kTLAS[]`.
fn new_tlas_table(gpu: &Arc<Gpu>) -> Result<Option<Arc<Buffer>>> {
    if !gpu.has_acceleration_structures() {
        return Ok(None);
    }
    let desc = BufferDesc {
        size_bytes: u64::from(gpu.caps.limits.max_bindless_tlas.max(1)) * TLAS_TABLE_ENTRY_BYTES,
        debug_name: "table of top-level structures",
        ..Default::default()
    };
    Ok(Some(Arc::new(Buffer::new(gpu, &desc, InternalUsage::NONE)?)))
}

/// Creates a scratch buffer that is no larger than the limit of one build.
fn new_scratch(gpu: &Gpu, budget_bytes: u64) -> ScratchBuffer {
    let limits = &gpu.caps.limits;
    let largest = limits.max_buffer_bytes.min(limits.max_accel_scratch_bytes);
    ScratchBuffer::new(budget_bytes.min(largest), limits.scratch_alignment.into())
}
