//! The extensions and features that a device of another engine needs for a context.

use std::ffi::CStr;
use std::fmt;

use ash::vk;

use super::caps::capabilities::Capabilities;
use super::caps::features::Features;
use super::caps::optional_features::FeatureSet;
use super::caps::queues::QueueLocation;
use super::device::{
    DeviceRequest, candidate, device_extensions, enabled_features, queue_infos, use_single_queue,
};
use super::start::external::{RawContext, check_physical_device};
use super::start::feature_chain::FeatureChain;
use super::start::instance::Instance;
use super::start::physical_device::PhysicalDevice;
use super::start::surface::SurfaceProbe;
use super::start::user_extensions::UserExtensions;
use super::start::window::WindowExtensions;
use crate::error::{Error, Result};

/// Queue priorities of a device with a separate queue for each queue of the library.
const PRIORITIES: [f32; 3] = [1.0; 3];

/// The extensions, features and queues that a device of another engine needs for a context: those that
/// [`Context::new`](crate::Context::new) enables for the same description on the same physical device.
///
/// [`Context::requirements`](crate::Context::requirements) creates it. The engine creates its device with
/// [`feature_chain`](Self::feature_chain); [`raw_context`](Self::raw_context) then describes that device.
pub struct DeviceRequirements<'a> {
    instance: Instance,
    instance_extensions: &'a [&'a CStr],
    found: PhysicalDevice,
    caps: Capabilities,
    features: Features,
    extensions: Vec<&'static CStr>,
}

impl<'a> DeviceRequirements<'a> {
    /// # Safety
    /// The requirements of [`Context::requirements`](crate::Context::requirements).
    pub(crate) unsafe fn query(
        entry: &ash::Entry,
        instance: &ash::Instance,
        instance_extensions: &'a [&'a CStr],
        physical_device: vk::PhysicalDevice,
        request: &DeviceRequest<'_>,
    ) -> Result<Self> {
        check_physical_device(instance, physical_device, "physical_device")?;
        let instance = Instance::external(entry.clone(), instance.clone(), instance_extensions);
        let mut found = PhysicalDevice::query(&instance.raw, physical_device)?;
        let unavailable = WindowExtensions::unavailable_features(instance.windows.as_ref());
        found.capabilities.remove_features(unavailable);
        if let Some(window) = request.window {
            if let Some(name) = WindowExtensions::missing(instance.windows.as_ref(), window)? {
                let name = name.to_string_lossy();
                let message = format!(
                    "{name} is missing; ContextDesc::window needs it, see Context::instance_requirements"
                );
                return Err(Error::usage("instance_extensions", message));
            }
            let probe = SurfaceProbe::new(&instance, window)?;
            found.select_present_queue(probe.queue_family(found.raw))?;
        }
        let candidate = candidate(0, &mut found, request).device;
        if !candidate.missing.is_empty() {
            return Err(Error::NoDevice { problem: None, candidates: vec![candidate], drivers: None });
        }
        use_single_queue(&mut found, request.queues);
        let mut caps = found.capabilities.clone();
        caps.choose_ray_tracing(request.pipeline, request.query, request.required);
        let (features, extensions) = plan(&found, &caps);
        Ok(Self { instance, instance_extensions, found, caps, features, extensions })
    }

    /// Returns the requirements without these optional features, and without those that need them. The features that
    /// every context requires stay. [`FeatureSet::ALL`] leaves nothing else but ray tracing and mesh shaders.
    #[must_use]
    pub fn without(mut self, features: FeatureSet) -> Self {
        self.caps.remove_features(features);
        (self.features, self.extensions) = plan(&self.found, &self.caps);
        self
    }

    /// Returns the names of the device extensions to enable, without duplicates.
    pub fn extensions(&self) -> &[&'static CStr] {
        &self.extensions
    }

    /// Returns the optional features to enable. Ray tracing and mesh shaders are not among them.
    pub fn optional_features(&self) -> FeatureSet {
        self.caps.optional
    }

    /// Returns the structures and extension names to create the device with.
    pub fn feature_chain(&self) -> FeatureChain {
        FeatureChain::new(self.features, self.extensions.clone(), |name| self.found.has_extension(name))
    }

    /// Returns the family and the index within it of the queue that [`Context::new`](crate::Context::new) would use for
    /// each queue of the library, in the order of [`Queue::ALL`](crate::Queue::ALL). An engine may use others: of
    /// these, only the first queue's graphics and compute are required.
    pub fn queue_locations(&self) -> [(u32, u32); 3] {
        self.found.queue_locations.map(|QueueLocation { family, index }| (family, index))
    }

    /// Returns the description of the queues at [`queue_locations`](Self::queue_locations), for `VkDeviceCreateInfo`.
    pub fn queue_create_infos(&self) -> Vec<vk::DeviceQueueCreateInfo<'static>> {
        queue_infos(&self.found.queue_locations, &PRIORITIES)
    }

    /// Returns the queues at [`queue_locations`](Self::queue_locations) of a device, with their families
    /// (`vkGetDeviceQueue`).
    ///
    /// # Safety
    /// The device was created on the same physical device, with [`queue_create_infos`](Self::queue_create_infos).
    pub unsafe fn queues(&self, device: &ash::Device) -> [(vk::Queue, u32); 3] {
        // SAFETY: by the caller's promise.
        self.queue_locations()
            .map(|(family, index)| (unsafe { device.get_device_queue(family, index) }, family))
    }

    /// Returns the description of a device that was created with all of these extensions and features, for
    /// [`Context::from_raw`](crate::Context::from_raw). `queues` are the Vulkan queue and the family of each queue of the
    /// library, in the order of [`Queue::ALL`](crate::Queue::ALL); `[(queue, family); 3]` uses one queue for all.
    pub fn raw_context(&self, device: ash::Device, queues: [(vk::Queue, u32); 3]) -> RawContext<'_> {
        let on = |feature: vk::Bool32| feature == vk::TRUE;
        let ext = &self.features.ext;
        let [(queue, queue_family), compute, transfer] = queues;
        RawContext {
            entry: self.instance.entry.clone(),
            instance: self.instance.raw.clone(),
            instance_extensions: self.instance_extensions,
            physical_device: self.found.raw,
            device,
            device_extensions: &self.extensions,
            features: self.caps.optional,
            ray_tracing_pipeline: on(ext.ray_tracing.ray_tracing_pipeline),
            trace_rays_indirect: on(ext.ray_tracing.ray_tracing_pipeline_trace_rays_indirect),
            primitive_culling: on(ext.ray_tracing.ray_traversal_primitive_culling),
            ray_query: on(ext.ray_query.ray_query),
            position_fetch: on(ext.position_fetch.ray_tracing_position_fetch),
            mesh_shader: on(ext.mesh.mesh_shader),
            queue,
            queue_family,
            compute_queue: Some(compute),
            transfer_queue: Some(transfer),
        }
    }
}

impl fmt::Debug for DeviceRequirements<'_> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.debug_struct("DeviceRequirements")
            .field("device", &self.caps.device_name)
            .field("extensions", &self.extensions)
            .field("features", &self.features)
            .field("queue_locations", &self.queue_locations())
            .finish()
    }
}

/// Returns the features and extensions to enable.
fn plan(found: &PhysicalDevice, caps: &Capabilities) -> (Features, Vec<&'static CStr>) {
    let features = enabled_features(found, caps, false);
    let extensions = device_extensions(&features, caps, &UserExtensions::default());
    (features, extensions)
}
