//! Selects a physical device and creates the logical device, its queues and its memory allocator.

use std::ffi::CStr;
use std::sync::Arc;
use std::sync::atomic::AtomicU32;

use ash::vk;

use super::calibrated_timestamps::ClockReader;
use super::caps::capabilities::Capabilities;
use super::caps::descriptor_limits::DescriptorLimits;
use super::caps::features::Features;
use super::caps::format_features::FormatFeatureCache;
use super::caps::host_image_copy::HostImageCopy;
use super::caps::image_limits::ImageLimitCache;
use super::caps::optional_features::OptionalFeature;
use super::caps::portability::{PortabilityNeed, first_missing};
use super::caps::queues::{QueueLocation, QueueRequest, Queues};
use super::caps::ray_query_path::RayQueryRequest;
use super::caps::ray_tracing_pipeline_path::RayTracingPipelineRequest;
use super::caps::shading_rate::{FragmentSize, ShadingRates, query_fragment_sizes};
use super::checkpoints::Checkpoints;
use super::debug::debugger::has_debugger;
use super::debug::messenger::{ValidationMode, ValidationSink};
use super::memory::allocator::DeviceMemory;
use super::memory::budget::HeapUse;
use super::start::driver_workarounds::with_exclusive_device_lock;
use super::start::external::RawContext;
use super::start::instance::Instance;
use super::start::physical_device::PhysicalDevice;
use super::start::profile::DeviceProfile;
use super::start::select::{Candidate, NoMatch, choose};
use super::start::surface::SurfaceProbe;
use super::start::user_extensions::UserExtensions;
use super::start::window::{WindowExtensions, WindowRef};
use super::timestamp_scale::TimestampScale;
use crate::error::device_candidate::DeviceCandidate;
use crate::error::{Error, Result, check_limit};
use crate::lock_order::{Guard, Mutex, Rank};

/// Requirements of the caller for a device.
#[derive(Debug, Clone, Copy)]
pub(crate) struct DeviceRequest<'a> {
    /// Index, or part of the name.
    pub(crate) wish: Option<&'a str>,
    pub(crate) pipeline: RayTracingPipelineRequest,
    pub(crate) query: RayQueryRequest,
    /// Required optional features. Devices that lack one are not considered.
    pub(crate) required: &'a [OptionalFeature],
    pub(crate) profile: Option<&'a DeviceProfile>,
    pub(crate) extra: UserExtensions<'a>,
    /// True to name objects for debuggers. `None`: name them if the validation layer or a debugger reads the
    /// names.
    pub(crate) debug_names: Option<bool>,
    /// The validation layer and the receiver of its messages, on the instance of another engine.
    pub(crate) validation: ValidationMode,
    pub(crate) validation_sink: Option<&'a ValidationSink>,
    /// True to write labels to the GPU as checkpoints, where the device supports it.
    pub(crate) checkpoints: bool,
    pub(crate) queues: QueueRequest,
    /// A window that the device must be able to present to.
    pub(crate) window: Option<WindowRef<'a>>,
}

/// One logical device with its functions, queues and memory. It is independent of resources.
pub(crate) struct Gpu {
    pub(crate) device: ash::Device,
    pub(crate) caps: Capabilities,
    /// Features that are enabled.
    pub(crate) features: Features,
    /// The profile applied to `caps`; the default profile if the caller gave none.
    pub(crate) profile: DeviceProfile,
    /// SPIR-V capabilities that the caller's additional extensions allow.
    pub(crate) extra_capabilities: Vec<u32>,
    pub(crate) queues: Queues,
    pub(crate) accel: Option<ash::khr::acceleration_structure::Device>,
    pub(crate) ray_tracing: Option<ash::khr::ray_tracing_pipeline::Device>,
    /// Functions of opacity micromaps.
    pub(crate) micromaps: Option<ash::ext::opacity_micromap::Device>,
    pub(crate) mesh: Option<ash::ext::mesh_shader::Device>,
    pub(crate) shading_rates: Option<ShadingRates>,
    pub(crate) local_read: Option<ash::khr::dynamic_rendering_local_read::Device>,
    /// Writes the first contents of images from the host. `None` where that is not the faster way.
    pub(crate) host_copies: Option<HostImageCopy>,
    /// Reads the clocks of device and host together.
    pub(crate) clock_reader: Option<ClockReader>,
    /// Writes labels as checkpoints. `None` if the device cannot, or the caller did not request it.
    pub(crate) checkpoints: Option<Checkpoints>,
    /// Number of live samplers with a custom border colour. Devices allow few of them.
    pub(crate) custom_borders: AtomicU32,
    /// `None` if the context does not present to windows.
    #[cfg(feature = "window")]
    pub(crate) windows: Option<super::start::surface::WindowFunctions>,
    physical: vk::PhysicalDevice,
    /// Sets names and labels. `None` if no tool reads them, because each name costs as much as creating a
    /// small buffer.
    pub(super) debug_utils: Option<ash::ext::debug_utils::Device>,
    pub(super) device_fault: Option<ash::ext::device_fault::Device>,
    memory: Mutex<Option<DeviceMemory>>,
    pub(super) heap_use: HeapUse,
    pub(super) format_answers: FormatFeatureCache,
    pub(super) image_limits: ImageLimitCache,
    /// True if the caller created the device and destroys it.
    is_external: bool,
    /// Declared last, so that it is destroyed after the device.
    pub(crate) instance: Instance,
}

/// The device and its parts, created by the library or given by the caller.
struct DeviceParts {
    device: ash::Device,
    caps: Capabilities,
    features: Features,
    memory: DeviceMemory,
    fragment_sizes: Vec<FragmentSize>,
    queues: Queues,
    /// True if objects get names.
    is_named: bool,
    is_external: bool,
}

/// Returns the sizes of fragments that shade several pixels; none without shading rates of pipelines.
fn fragment_sizes(
    instance: &Instance,
    physical: vk::PhysicalDevice,
    caps: &Capabilities,
) -> Result<Vec<FragmentSize>> {
    if caps.has(OptionalFeature::PipelineShadingRate) {
        query_fragment_sizes(&instance.entry, &instance.raw, physical)
    } else {
        Ok(Vec::new())
    }
}

impl Gpu {
    pub(crate) fn new(instance: Instance, request: &DeviceRequest<'_>) -> Result<Self> {
        let chosen = choose_device(&instance, request)?;
        let is_named = should_name_objects(&instance, &chosen, request.debug_names)?;
        let (device, caps, features) = create_with_fallback(&instance, &chosen, request)?;
        let prepared = DeviceMemory::new(&instance.raw, &device, chosen.raw)
            .and_then(|memory| Ok((memory, fragment_sizes(&instance, chosen.raw, &caps)?)));
        let (memory, fragment_sizes) = match prepared {
            Ok(prepared) => prepared,
            Err(error) => {
                // SAFETY: nothing was created from the device yet.
                with_exclusive_device_lock(caps.driver_id, || unsafe { device.destroy_device(None) });
                return Err(error);
            }
        };
        let raw = chosen.queue_locations.map(|QueueLocation { family, index }| {
            // SAFETY: the device was created with this queue of the family.
            (unsafe { device.get_device_queue(family, index) }, family)
        });
        let queues = Queues::new(raw, request.queues);
        let made = DeviceParts {
            device,
            caps,
            features,
            memory,
            fragment_sizes,
            queues,
            is_named,
            is_external: false,
        };
        let mut gpu = Self::from_parts(instance, chosen.raw, made);
        gpu.profile = request.profile.cloned().unwrap_or_default();
        gpu.extra_capabilities = request.extra.capabilities().to_vec();
        Ok(gpu)
    }

    /// Wraps a device that the caller created.
    ///
    /// # Safety
    /// The requirements of [`Context::from_raw`](crate::Context::from_raw).
    pub(crate) unsafe fn from_raw(raw: RawContext<'_>, request: &DeviceRequest<'_>) -> Result<Self> {
        let mut chosen = raw.physical()?;
        chosen.capabilities.checkpoints &= request.checkpoints;
        use_single_queue(&mut chosen, request.queues);
        let mut caps = chosen.capabilities.clone();
        caps.choose_ray_tracing(request.pipeline, request.query, request.required);
        let given = raw.queues();
        if request.query.prefers_hardware() && !raw.ray_query {
            caps.ray_query_reason = "the engine's device has no ray queries enabled";
        }
        if request.pipeline.prefers_hardware() && !raw.ray_tracing_pipeline {
            caps.ray_tracing_pipeline_reason = "the engine's device has no ray tracing pipelines enabled";
        }
        let mut instance =
            Instance::external(raw.entry.clone(), raw.instance.clone(), raw.instance_extensions);
        if request.validation != ValidationMode::Off {
            instance.listen(request.validation_sink.cloned().unwrap_or_default())?;
        }
        if let Some(window) = request.window {
            raw.check_window(&instance, window, &chosen)?;
        }
        let features = enabled_features(&chosen, &caps, false);
        let made = DeviceParts {
            memory: DeviceMemory::new(&instance.raw, &raw.device, chosen.raw)?,
            fragment_sizes: fragment_sizes(&instance, chosen.raw, &caps)?,
            device: raw.device,
            caps,
            features,
            queues: Queues::new(given, request.queues),
            is_named: should_name_objects(&instance, &chosen, request.debug_names)?,
            is_external: true,
        };
        Ok(Self::from_parts(instance, chosen.raw, made))
    }

    fn from_parts(instance: Instance, physical: vk::PhysicalDevice, made: DeviceParts) -> Self {
        let DeviceParts { device, mut caps, features, memory, fragment_sizes, queues, is_named, is_external } =
            made;
        let raw = &instance.raw;
        let structures = caps.builds_device_structures();
        let host_copies = HostImageCopy::new(raw, &device, physical, &caps);
        caps.host_image_copy = host_copies.is_some();
        Self {
            queues,
            accel: structures.then(|| ash::khr::acceleration_structure::Device::new(raw, &device)),
            ray_tracing: caps
                .device_pipelines()
                .then(|| ash::khr::ray_tracing_pipeline::Device::new(raw, &device)),
            micromaps: caps
                .has(OptionalFeature::OpacityMicromaps)
                .then(|| ash::ext::opacity_micromap::Device::new(raw, &device)),
            mesh: caps.mesh_shader.then(|| ash::ext::mesh_shader::Device::new(raw, &device)),
            shading_rates: caps
                .has(OptionalFeature::PipelineShadingRate)
                .then(|| ShadingRates::new(raw, &device, fragment_sizes)),
            local_read: caps
                .has(OptionalFeature::LocalRead)
                .then(|| ash::khr::dynamic_rendering_local_read::Device::new(raw, &device)),
            host_copies,
            checkpoints: caps.checkpoints.then(|| Checkpoints::new(raw, &device)),
            clock_reader: ClockReader::new(&instance, &device, physical, features.calibration),
            #[cfg(feature = "window")]
            windows: super::start::surface::WindowFunctions::new(&instance, &device, |feature| {
                caps.has(feature)
            }),
            debug_utils: is_named.then(|| ash::ext::debug_utils::Device::new(raw, &device)),
            device_fault: (features.ext.fault.device_fault == vk::TRUE)
                .then(|| ash::ext::device_fault::Device::new(raw, &device)),
            memory: Mutex::new(Rank::Memory, Some(memory)),
            heap_use: HeapUse::new(raw, physical),
            format_answers: FormatFeatureCache::default(),
            image_limits: ImageLimitCache::new(),
            custom_borders: AtomicU32::new(0),
            physical,
            device,
            caps,
            features,
            profile: DeviceProfile::default(),
            extra_capabilities: Vec::new(),
            is_external,
            instance,
        }
    }

    /// Locks the Vulkan queue for graphics and compute, which only one thread may use at a time.
    #[cfg(feature = "window")]
    pub(crate) fn graphics_queue(&self) -> Guard<'_, vk::Queue> {
        self.queues.raw(0)
    }

    /// Locks the memory allocator. `None` only while the context is being destroyed.
    pub(super) fn memory(&self) -> Guard<'_, Option<DeviceMemory>> {
        self.memory.lock()
    }

    /// Returns the descriptor limits of the device.
    pub(crate) fn descriptor_limits(&self) -> DescriptorLimits {
        DescriptorLimits::query(&self.instance.raw, self.physical)
    }

    /// Returns the functions of `VK_KHR_acceleration_structure`, or an error that names the missing feature.
    pub(crate) fn accel_functions(&self) -> Result<&ash::khr::acceleration_structure::Device> {
        self.accel.as_ref().ok_or_else(|| self.unsupported("acceleration structures"))
    }

    /// Returns the functions of opacity micromaps. Fails on devices without them.
    pub(crate) fn micromap_functions(&self) -> Result<&ash::ext::opacity_micromap::DeviceFn> {
        let functions = self.micromaps.as_ref().map(ash::ext::opacity_micromap::Device::fp);
        functions.ok_or_else(|| self.unsupported("opacity micromaps"))
    }

    /// True if acceleration structures exist, built by the device or by the library.
    pub(crate) fn has_acceleration_structures(&self) -> bool {
        self.accel.is_some() || self.caps.builds_software_structures()
    }

    /// Returns an error unless acceleration structures of either kind exist.
    pub(crate) fn check_acceleration_structures(&self) -> Result<()> {
        if self.has_acceleration_structures() {
            Ok(())
        } else {
            Err(self.unsupported("acceleration structures"))
        }
    }

    /// Returns the functions of `VK_KHR_ray_tracing_pipeline`, or an error that names the missing feature.
    pub(crate) fn ray_tracing_functions(&self) -> Result<&ash::khr::ray_tracing_pipeline::Device> {
        self.ray_tracing.as_ref().ok_or_else(|| self.unsupported("ray tracing pipelines"))
    }

    /// Returns an error unless ray tracing pipelines work, by the device or lowered.
    pub(crate) fn check_ray_tracing_pipelines(&self) -> Result<()> {
        if self.caps.ray_tracing_pipeline { Ok(()) } else { Err(self.unsupported("ray tracing pipelines")) }
    }

    /// Returns the functions of `VK_EXT_mesh_shader`, or an error that names the missing feature.
    pub(crate) fn mesh_functions(&self) -> Result<&ash::ext::mesh_shader::Device> {
        self.mesh.as_ref().ok_or_else(|| self.unsupported("mesh shaders"))
    }

    /// Returns the functions for windows, or an error that says how to enable them.
    #[cfg(feature = "window")]
    pub(crate) fn window_functions(&self) -> Result<&super::start::surface::WindowFunctions> {
        self.windows.as_ref().ok_or_else(|| {
            let why = if self.is_external {
                "the engine's device has none on; they need VK_KHR_surface and the extension of the window system in \
                 RawContext::instance_extensions, and VK_KHR_swapchain in device_extensions and features"
            } else {
                "the context was made without a window; set ContextDesc::window"
            };
            Error::unsupported("a swapchain", why)
        })
    }

    /// Returns an [`Error::Unsupported`] that names the device.
    pub(crate) fn unsupported(&self, what: &str) -> Error {
        let profile = Some(&self.profile).filter(|profile| profile.has_restrictions());
        let profile = profile.map(|profile| format!("the device profile '{}' hides it, ", profile.name));
        let reason = self.caps.ray_tracing_fallback.clone().unwrap_or_else(|| {
            format!("{}its driver does not offer it, or it was turned off", profile.unwrap_or_default())
        });
        Error::unsupported(what, format!("the device '{}' lacks support: {reason}", self.caps.device_name))
    }

    /// Returns an error unless the device has `feature`. `what` is the refused operation in the error.
    pub(crate) fn require(&self, feature: OptionalFeature, what: &str) -> Result<()> {
        if self.caps.has(feature) {
            return Ok(());
        }
        let hidden = self.profile.hidden.contains(feature);
        let why = if hidden {
            format!("the device profile '{}' hides it", self.profile.name)
        } else {
            "its driver does not offer it".to_owned()
        };
        let name = feature.vulkan_name();
        Err(Error::unsupported(what, format!("the device '{}' lacks {name}: {why}", self.caps.device_name)))
    }

    /// Returns an error unless the device has the features of all `needs` of `object`.
    pub(crate) fn require_portable(
        &self,
        object: &str,
        needs: impl IntoIterator<Item = PortabilityNeed>,
    ) -> Result<()> {
        let Some(need) = first_missing(needs, self.caps.optional) else { return Ok(()) };
        match self.require(need.feature, &format!("{} of {object}", need.what)) {
            Err(Error::Unsupported { what, why }) => {
                Err(Error::unsupported(what, format!("{why}; {}", need.remedy)))
            }
            answer => answer,
        }
    }

    /// Returns an error unless the device can draw the views of `view_mask` in one pass.
    pub(crate) fn check_view_mask(&self, name: &str, view_mask: u32) -> Result<()> {
        self.require(OptionalFeature::Multiview, &format!("the view mask {view_mask:#b} of '{name}'"))?;
        let views = u64::from(u32::BITS - view_mask.leading_zeros());
        check_limit(name, "count of views, up to the highest bit", views, self.caps.limits.max_views.into())
    }

    /// Returns the scale of the device's timestamps.
    pub(crate) fn timestamps(&self) -> TimestampScale {
        TimestampScale::new(&self.caps)
    }

    pub(crate) fn physical(&self) -> vk::PhysicalDevice {
        self.physical
    }
}

impl Drop for Gpu {
    fn drop(&mut self) {
        self.memory().take();
        if self.is_external {
            return;
        }
        // SAFETY: all objects of the device are destroyed: the context destroys them before its `Gpu`.
        let destroy = || unsafe { self.device.destroy_device(None) };
        with_exclusive_device_lock(self.caps.driver_id, destroy);
    }
}

/// True if objects get names: as requested by the caller, or else if the validation layer or a debugger reads
/// them.
fn should_name_objects(
    instance: &Instance,
    device: &PhysicalDevice,
    requested: Option<bool>,
) -> Result<bool> {
    match requested {
        _ if !instance.debug_utils => Ok(false),
        Some(requested) => Ok(requested),
        None if instance.validated => Ok(true),
        None => has_debugger(&instance.raw, device.raw, &device.capabilities.device_name),
    }
}

fn choose_device(instance: &Instance, request: &DeviceRequest<'_>) -> Result<PhysicalDevice> {
    let mut devices = Vec::new();
    for raw in instance.physical_devices()? {
        devices.push(PhysicalDevice::query(&instance.raw, raw)?);
    }
    let probe = request.window.map(|window| SurfaceProbe::new(instance, window)).transpose()?;
    let unknown = WindowExtensions::unavailable_features(instance.windows.as_ref());
    for device in &mut devices {
        device.capabilities.remove_features(unknown);
        if let Some(probe) = &probe {
            device.select_present_queue(probe.queue_family(device.raw))?;
        }
    }
    let indexed = devices.iter_mut().enumerate();
    let candidates: Vec<_> = indexed.map(|(index, device)| candidate(index, device, request)).collect();
    let index = match choose(&candidates, request.wish) {
        Ok(index) => index,
        Err(NoMatch(problem)) => {
            let candidates = candidates.into_iter().map(|candidate| candidate.device).collect();
            let drivers = Some(Arc::new(instance.driver_report()));
            return Err(Error::NoDevice { problem, candidates, drivers });
        }
    };
    let mut chosen = devices.swap_remove(index);
    chosen.capabilities.checkpoints &= request.checkpoints;
    use_single_queue(&mut chosen, request.queues);
    Ok(chosen)
}

/// Uses one Vulkan queue for all queues if requested.
pub(super) fn use_single_queue(device: &mut PhysicalDevice, request: QueueRequest) {
    if request == QueueRequest::Shared {
        device.set_queues([device.queue_locations[0]; 3]);
    }
}

/// Returns the properties of the device that the selection depends on, with the profile applied.
pub(super) fn candidate(index: usize, device: &mut PhysicalDevice, request: &DeviceRequest<'_>) -> Candidate {
    let found = device.capabilities.clone();
    if let Some(profile) = request.profile {
        profile.apply(&mut device.capabilities);
    }
    let left = &device.capabilities;
    let mut missing = device.missing.clone();
    let mut demand = |name: &str, found: bool, left: bool| {
        if !left {
            missing.push(missing_requirement(name, request.profile.filter(|_| found)));
        }
    };
    if request.pipeline.requires_pipelines() {
        demand("ray tracing pipelines", found.ray_tracing_pipeline, left.ray_tracing_pipeline);
    }
    if request.query.requires_hardware() || request.pipeline.requires_queries() {
        demand("ray queries", found.ray_query, left.ray_query);
    }
    let swapchain = request.window.map(|_| OptionalFeature::Swapchain);
    for feature in request.required.iter().chain(&swapchain) {
        demand(feature.vulkan_name(), found.has(*feature), left.has(*feature));
    }
    for name in request.extra.device_extensions() {
        demand(&name.to_string_lossy(), false, device.has_extension(name));
    }
    let mut used = left.clone();
    used.choose_ray_tracing(request.pipeline, request.query, request.required);
    let lost = request.required.iter().filter(|feature| left.has(**feature) && !used.has(**feature));
    missing.extend(lost.map(|feature| {
        let (name, reason) = (feature.vulkan_name(), used.ray_tracing_pipeline_reason);
        format!("{name} (it is of ray tracing by the device, which is not used: {reason})")
    }));
    let wanted = [
        request.pipeline.prefers_hardware() && left.ray_tracing_pipeline,
        (request.query.prefers_hardware() || request.pipeline.requires_queries()) && left.ray_query,
    ];
    Candidate {
        device: DeviceCandidate { missing, ..device.candidate(index) },
        local_memory_bytes: device.local_memory_bytes,
        optional_score: wanted.into_iter().filter(|has| *has).count() as u32,
    }
}

fn missing_requirement(name: &str, hidden_by: Option<&DeviceProfile>) -> String {
    match hidden_by {
        Some(profile) => format!("{name} (hidden by the device profile '{}')", profile.name),
        None => name.to_owned(),
    }
}

/// Creates the device. If that fails with optional ray tracing enabled, tries again without it and stores the
/// reason.
fn create_with_fallback(
    instance: &Instance,
    chosen: &PhysicalDevice,
    request: &DeviceRequest<'_>,
) -> Result<(ash::Device, Capabilities, Features)> {
    let mut caps = chosen.capabilities.clone();
    caps.choose_ray_tracing(request.pipeline, request.query, request.required);
    let first = match create(instance, chosen, &caps, &request.extra) {
        Ok((device, features)) => return Ok((device, caps, features)),
        Err(error) => error,
    };
    let pipelines = request.pipeline.requires_pipelines() || request.pipeline.requires_queries();
    if pipelines || request.query.requires_hardware() || !caps.builds_device_structures() {
        return Err(Error::vulkan("vkCreateDevice", &caps.device_name)(first));
    }
    caps = chosen.capabilities.clone();
    caps.limit_ray_tracing(false, false);
    caps.limits.max_bindless_tlas = 0;
    caps.choose_ray_tracing(request.pipeline, request.query, request.required);
    caps.ray_tracing_fallback = Some(format!("vkCreateDevice with ray tracing returned {first}"));
    log::warn!("{}: ray tracing is off: vkCreateDevice with it returned {first}", caps.device_name);
    let (device, features) = create(instance, chosen, &caps, &request.extra)
        .map_err(Error::vulkan("vkCreateDevice", &caps.device_name))?;
    Ok((device, caps, features))
}

fn create(
    instance: &Instance,
    chosen: &PhysicalDevice,
    caps: &Capabilities,
    extra: &UserExtensions<'_>,
) -> Result<(ash::Device, Features), vk::Result> {
    let features = enabled_features(chosen, caps, instance.gpu_assisted);
    let extensions = device_extensions(&features, caps, extra);
    let mut chain = features;
    let mut all = vk::PhysicalDeviceFeatures2::default().features(chain.core);
    // The structures pushed below precede the caller's chain, which stays unchanged.
    all.p_next = extra.feature_chain();
    let all = all.push_next(&mut chain.v11).push_next(&mut chain.v12).push_next(&mut chain.v13);
    let all = chain.ext.append_to_chain(all, &|name| extensions.contains(&name));
    let priorities = [1.0; 3];
    let queues = queue_infos(&chosen.queue_locations, &priorities);
    let names: Vec<_> = extensions.iter().map(|name| name.as_ptr()).collect();
    let mut info =
        vk::DeviceCreateInfo::default().queue_create_infos(&queues).enabled_extension_names(&names);
    // `push_next` would write to the last structure, which may be the caller's, in memory that is only shared.
    info.p_next = (&raw const all).cast();
    // SAFETY: every pointer in `info` lives until the end of this function. The caller guarantees the
    // validity of its own chain.
    let make = || unsafe { instance.raw.create_device(chosen.raw, &info, None) };
    let device = with_exclusive_device_lock(caps.driver_id, make)?;
    Ok((device, features))
}

/// Returns one create info per queue family, with enough queues to include the highest index in use.
pub(super) fn queue_infos<'a>(
    queue_locations: &[QueueLocation; 3],
    priorities: &'a [f32; 3],
) -> Vec<vk::DeviceQueueCreateInfo<'a>> {
    let mut lasts = std::collections::BTreeMap::new();
    for location in queue_locations {
        let last = lasts.entry(location.family).or_insert(0);
        *last = location.index.max(*last);
    }
    let info = |(family, last): (u32, u32)| {
        let queues = &priorities[..=(last as usize).min(2)];
        vk::DeviceQueueCreateInfo::default().queue_family_index(family).queue_priorities(queues)
    };
    lasts.into_iter().map(info).collect()
}

/// Returns the features to enable. `robustBufferAccess` is left out for GPU-assisted validation, which finds no
/// out-of-bounds access if the driver makes it harmless.
pub(super) fn enabled_features(chosen: &PhysicalDevice, caps: &Capabilities, gpu_assisted: bool) -> Features {
    let mut features = Features::supported_subset(&chosen.features, caps.optional);
    features.limit_ray_tracing(caps.device_pipelines(), caps.device_ray_queries());
    features.ext.position_fetch.ray_tracing_position_fetch &= vk::Bool32::from(caps.position_fetch);
    features.limit_mesh_shaders(caps.mesh_shader);
    if gpu_assisted {
        features.core.robust_buffer_access = vk::FALSE;
    }
    features
}

/// Returns the extensions to enable, without duplicates.
pub(super) fn device_extensions<'a>(
    features: &Features,
    caps: &Capabilities,
    extra: &UserExtensions<'a>,
) -> Vec<&'a CStr> {
    let links = caps.pipeline_libraries || caps.has(OptionalFeature::GraphicsPipelineLibrary);
    let libraries = links.then_some(ash::khr::pipeline_library::NAME);
    let checkpoints = caps.checkpoints.then_some(ash::nv::device_diagnostic_checkpoints::NAME);
    let subset = caps.portability_subset.then_some(ash::khr::portability_subset::NAME);
    let own = features.extensions().chain(caps.optional.extensions()).chain(libraries).chain(subset);
    let own = own.chain(checkpoints);
    let mut names: Vec<&'a CStr> = own.map(|name| -> &'a CStr { name }).collect();
    names.extend_from_slice(extra.device_extensions());
    names.sort_unstable();
    names.dedup();
    names
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_portability_subset_is_enabled_where_the_device_lists_it() {
        for portability_subset in [false, true] {
            let caps = Capabilities { portability_subset, ..Capabilities::default() };
            let names = device_extensions(&Features::default(), &caps, &UserExtensions::default());
            assert_eq!(names.contains(&ash::khr::portability_subset::NAME), portability_subset);
        }
    }
}
