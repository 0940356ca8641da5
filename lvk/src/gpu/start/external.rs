//! A device that the application or another engine has created.

use std::ffi::CStr;

use ash::vk;

use super::instance::Instance;
use super::physical_device::{PhysicalDevice, calibration_extension};
use super::surface::SurfaceProbe;
use super::window::{WindowExtensions, WindowRef};
use crate::error::{Error, Result};
use crate::gpu::caps::features::Calibration;
use crate::gpu::caps::optional_features::{FeatureSet, OptionalFeature};
use crate::gpu::caps::queues::{QueueFamily, QueueLocation};

/// An instance, a device and queues that the caller has created, with the extensions and features enabled at
/// their creation. [`DeviceRequirements::raw_context`](crate::DeviceRequirements::raw_context) fills it in.
#[derive(Clone)]
pub struct RawContext<'a> {
    /// The loader's entry points.
    pub entry: ash::Entry,
    /// The instance. Its version must be 1.3 or later.
    pub instance: ash::Instance,
    /// Extensions enabled at creation of the instance. Swapchains need `VK_KHR_surface` and the extension of the
    /// window system among them.
    pub instance_extensions: &'a [&'a CStr],
    /// The physical device.
    pub physical_device: vk::PhysicalDevice,
    /// The device.
    pub device: ash::Device,
    /// Extensions enabled at creation of the device.
    pub device_extensions: &'a [&'a CStr],
    /// Features that are enabled, beside those that every context requires. Swapchains need
    /// [`Swapchain`](OptionalFeature::Swapchain) among them. Those of
    /// [`FeatureSet::PORTABILITY`] count only on devices with `VK_KHR_portability_subset`; other devices always have
    /// them.
    pub features: FeatureSet,
    /// True if `accelerationStructure`, its `descriptorBindingAccelerationStructureUpdateAfterBind`, and
    /// `rayTracingPipeline` are enabled.
    pub ray_tracing_pipeline: bool,
    /// True if `rayTracingPipelineTraceRaysIndirect` is enabled. Needs `ray_tracing_pipeline`.
    pub trace_rays_indirect: bool,
    /// True if `rayTraversalPrimitiveCulling` is enabled. Needs `ray_tracing_pipeline`.
    pub primitive_culling: bool,
    /// True if `accelerationStructure`, its `descriptorBindingAccelerationStructureUpdateAfterBind`, and
    /// `rayQuery` are enabled.
    pub ray_query: bool,
    /// True if `rayTracingPositionFetch` is enabled. Needs `ray_tracing_pipeline` or `ray_query`.
    pub position_fetch: bool,
    /// True if `taskShader` and `meshShader` are enabled.
    pub mesh_shader: bool,
    /// A queue for graphics and compute.
    pub queue: vk::Queue,
    /// Queue family of `queue`.
    pub queue_family: u32,
    /// A separate queue for [`Queue::Compute`](crate::Queue::Compute), and its queue family. If it is `None`
    /// or equal to `queue`, [`Queue::Compute`](crate::Queue::Compute) shares `queue`.
    pub compute_queue: Option<(vk::Queue, u32)>,
    /// As `compute_queue`, for [`Queue::Transfer`](crate::Queue::Transfer). It may equal the queue of
    /// `compute_queue`.
    pub transfer_queue: Option<(vk::Queue, u32)>,
}

impl RawContext<'_> {
    /// Returns the device, limited to the features that the caller declares enabled. Fails if the declaration cannot
    /// be true.
    pub(crate) fn physical(&self) -> Result<PhysicalDevice> {
        self.check_handles()?;
        let mut found = PhysicalDevice::query(&self.instance, self.physical_device)?;
        if !found.missing.is_empty() {
            let candidates = vec![found.candidate(0)];
            return Err(Error::NoDevice { problem: None, candidates, drivers: None });
        }
        self.check_queues(&found.families)?;
        self.check_features(&found)?;
        found.features.calibration = calibration_extension(&|name| self.has_extension(name));
        let ray_tracing = &mut found.features.ext.ray_tracing;
        ray_tracing.ray_tracing_pipeline_trace_rays_indirect &= vk::Bool32::from(self.trace_rays_indirect);
        ray_tracing.ray_traversal_primitive_culling &= vk::Bool32::from(self.primitive_culling);
        let caps = &mut found.capabilities;
        caps.mesh_shader &= self.mesh_shader;
        caps.trace_rays_indirect &= self.trace_rays_indirect;
        caps.position_fetch &= self.position_fetch;
        caps.pipeline_libraries &= self.has_extension(ash::khr::pipeline_library::NAME);
        caps.checkpoints &= self.has_extension(ash::nv::device_diagnostic_checkpoints::NAME);
        caps.limit_ray_tracing(self.ray_tracing_pipeline, self.ray_query);
        caps.remove_features(undeclared(self.features, caps.portability_subset));
        let windows = WindowExtensions::enabled(self.instance_extensions);
        caps.remove_features(WindowExtensions::unavailable_features(windows.as_ref()));
        found.queue_family = Some(self.queue_family);
        found.set_queues(self.queue_locations());
        Ok(found)
    }

    pub(crate) fn has_extension(&self, extension: &CStr) -> bool {
        self.device_extensions.contains(&extension)
    }

    /// Returns the Vulkan queue of each library queue, and its family.
    pub(crate) fn queues(&self) -> [(vk::Queue, u32); 3] {
        let first = (self.queue, self.queue_family);
        [first, self.compute_queue.unwrap_or(first), self.transfer_queue.unwrap_or(first)]
    }

    /// Returns the location of each queue. The indices within the families are unknown, so these are
    /// arbitrary; only their equality has a meaning.
    fn queue_locations(&self) -> [QueueLocation; 3] {
        let queues = self.queues();
        let number = |raw| queues.iter().position(|(queue, _)| *queue == raw).unwrap_or_default();
        queues.map(|(queue, family)| QueueLocation { family, index: number(queue) as u32 })
    }

    /// Checks the handles without a use of the device.
    fn check_handles(&self) -> Result<()> {
        if self.instance.handle() == vk::Instance::null() {
            return Err(wrong("instance", "the handle is null"));
        }
        if self.device.handle() == vk::Device::null() {
            return Err(wrong("device", "the handle is null"));
        }
        let names = ["queue", "compute_queue", "transfer_queue"];
        if let Some((_, name)) =
            self.queues().iter().zip(names).find(|((queue, _), _)| *queue == vk::Queue::null())
        {
            return Err(wrong(name, "the handle is null"));
        }
        check_physical_device(&self.instance, self.physical_device, "RawContext::physical_device")
    }

    fn check_queues(&self, families: &[QueueFamily]) -> Result<()> {
        use vk::QueueFlags as Flags;
        let [graphics, compute, transfer] = self.queues();
        let everything = Flags::GRAPHICS | Flags::COMPUTE;
        let copies = everything | Flags::TRANSFER;
        check_family(families, graphics.1, "queue_family", "graphics or no compute", |flags| {
            flags.contains(everything)
        })?;
        check_family(families, compute.1, "compute_queue", "compute", |flags| {
            flags.contains(Flags::COMPUTE)
        })?;
        check_family(families, transfer.1, "transfer_queue", "transfer", |flags| flags.intersects(copies))?;
        for (field, queue, others) in
            [("compute_queue", compute, &[graphics][..]), ("transfer_queue", transfer, &[graphics, compute])]
        {
            if let Some(other) = others.iter().find(|other| other.0 == queue.0 && other.1 != queue.1) {
                let [own, given] = [queue.1, other.1];
                let message = format!("the same queue is given with the families {own} and {given}");
                return Err(wrong(field, message));
            }
        }
        Ok(())
    }

    /// Checks that the device has the features, their extensions, and the features that they depend on.
    fn check_features(&self, found: &PhysicalDevice) -> Result<()> {
        let known: FeatureSet =
            OptionalFeature::all().filter(|feature| self.features.contains(*feature)).collect();
        if let Some(feature) = known.without(found.capabilities.optional).iter().next() {
            let name = feature.vulkan_name();
            return Err(wrong("features", format!("{name} cannot be on: the device does not have it")));
        }
        let subset = ash::khr::portability_subset::NAME;
        if found.capabilities.portability_subset && !self.has_extension(subset) {
            return Err(lacks_extension(subset, "the device, which lists it,"));
        }
        for feature in known.iter() {
            let mut names = FeatureSet::NONE.with(feature).extensions();
            if let Some(name) = names.find(|name| !self.has_extension(name)) {
                let user = format!("the feature {} in `features`", feature.vulkan_name());
                return Err(lacks_extension(name, &user));
            }
        }
        let clocks = calibration_extension(&|name| self.has_extension(name));
        if known.contains(OptionalFeature::CalibratedTimestamps) && clocks == Calibration::None {
            let user = "the feature VK_KHR_calibrated_timestamps in `features`";
            return Err(lacks_extension(ash::khr::calibrated_timestamps::NAME, user));
        }
        let library = ash::khr::pipeline_library::NAME;
        if known.contains(OptionalFeature::GraphicsPipelineLibrary) && !self.has_extension(library) {
            return Err(lacks_extension(library, "the feature graphicsPipelineLibrary in `features`"));
        }
        self.check_instance_extensions(known)?;
        self.check_flags(found)
    }

    /// Checks the extensions of the instance that features of presentation depend on.
    fn check_instance_extensions(&self, features: FeatureSet) -> Result<()> {
        let needs: [(OptionalFeature, &[&CStr]); 2] = [
            (OptionalFeature::Swapchain, &[ash::khr::surface::NAME]),
            (
                OptionalFeature::SwapchainMaintenance1,
                &[ash::khr::get_surface_capabilities2::NAME, ash::ext::surface_maintenance1::NAME],
            ),
        ];
        for (feature, names) in needs.iter().filter(|(feature, _)| features.contains(*feature)) {
            if let Some(name) = names.iter().find(|name| !self.instance_extensions.contains(name)) {
                let user = format!("the feature {} in `features`", feature.vulkan_name());
                return Err(lacks_instance_extension(name, &user));
            }
        }
        Ok(())
    }

    /// Checks the features that have flags of their own.
    fn check_flags(&self, found: &PhysicalDevice) -> Result<()> {
        use ash::{ext, khr};
        let caps = &found.capabilities;
        let culling = found.features.ext.ray_tracing.ray_traversal_primitive_culling == vk::TRUE;
        let pipeline = ("ray_tracing_pipeline", self.ray_tracing_pipeline);
        let any = ("ray_tracing_pipeline` or `ray_query", self.ray_tracing_pipeline || self.ray_query);
        let [pipelines, queries] = [khr::ray_tracing_pipeline::NAME, khr::ray_query::NAME];
        let fetch = khr::ray_tracing_position_fetch::NAME;
        let indirect = caps.trace_rays_indirect;
        #[rustfmt::skip]
        let flags = [
            ("ray_tracing_pipeline", self.ray_tracing_pipeline, caps.ray_tracing_pipeline, pipelines, None),
            ("ray_query", self.ray_query, caps.ray_query, queries, None),
            ("trace_rays_indirect", self.trace_rays_indirect, indirect, pipelines, Some(pipeline)),
            ("primitive_culling", self.primitive_culling, culling, pipelines, Some(pipeline)),
            ("position_fetch", self.position_fetch, caps.position_fetch, fetch, Some(any)),
            ("mesh_shader", self.mesh_shader, caps.mesh_shader, ext::mesh_shader::NAME, None),
        ];
        for (field, _, has, extension, base) in flags.into_iter().filter(|(_, is_on, ..)| *is_on) {
            if !has {
                return Err(wrong(field, "it cannot be true: the device does not have the feature"));
            }
            if let Some((base, false)) = base {
                return Err(wrong(field, format!("it needs `{base}`, which is false")));
            }
            let structures = [khr::acceleration_structure::NAME, khr::deferred_host_operations::NAME];
            let structures = structures.into_iter().filter(|_| field != "mesh_shader");
            if let Some(name) = structures.chain([extension]).find(|name| !self.has_extension(name)) {
                return Err(lacks_extension(name, &format!("`{field}`")));
            }
        }
        Ok(())
    }

    /// Checks that the context can present to a window.
    pub(crate) fn check_window(
        &self,
        instance: &Instance,
        window: WindowRef<'_>,
        found: &PhysicalDevice,
    ) -> Result<()> {
        if let Some(name) = WindowExtensions::missing(instance.windows.as_ref(), window)? {
            return Err(lacks_instance_extension(name, "ContextDesc::window"));
        }
        if !found.capabilities.has(OptionalFeature::Swapchain) {
            return Err(wrong("features", "VK_KHR_swapchain is missing; ContextDesc::window needs it"));
        }
        if !SurfaceProbe::new(instance, window)?.presents(self.physical_device, self.queue_family)? {
            let family = self.queue_family;
            return Err(wrong(
                "queue_family",
                format!("family {family} cannot present to ContextDesc::window"),
            ));
        }
        Ok(())
    }
}

/// Checks that the instance lists the device. `object` names the device in errors.
pub(crate) fn check_physical_device(
    instance: &ash::Instance,
    device: vk::PhysicalDevice,
    object: &str,
) -> Result<()> {
    if device == vk::PhysicalDevice::null() {
        return Err(Error::usage(object, "the handle is null"));
    }
    // SAFETY: the caller of the public function promises a valid instance.
    let devices = unsafe { instance.enumerate_physical_devices() }
        .map_err(Error::vulkan("vkEnumeratePhysicalDevices", "instance"))?;
    if devices.contains(&device) {
        return Ok(());
    }
    Err(Error::usage(object, "the instance does not list the device"))
}

/// Returns the features to treat as disabled: those not declared. Vulkan has no switch for the features of
/// portability on devices that implement all of Vulkan.
fn undeclared(declared: FeatureSet, portability_subset: bool) -> FeatureSet {
    let absent = FeatureSet::ALL.without(declared);
    if portability_subset { absent } else { absent.without(FeatureSet::PORTABILITY) }
}

/// Checks the family of the queue in `field`. `lacks` names what a family that does not fit has not.
fn check_family(
    families: &[QueueFamily],
    number: u32,
    field: &str,
    lacks: &str,
    fits: impl Fn(vk::QueueFlags) -> bool,
) -> Result<()> {
    match families.get(number as usize) {
        Some(family) if fits(family.flags) => Ok(()),
        Some(_) => Err(wrong(field, format!("family {number} has no {lacks}"))),
        None => Err(wrong(field, format!("the device has no queue family {number}"))),
    }
}

fn lacks_extension(name: &CStr, user: &str) -> Error {
    wrong("device_extensions", format!("{} is missing; {user} needs it", name.to_string_lossy()))
}

fn lacks_instance_extension(name: &CStr, user: &str) -> Error {
    wrong("instance_extensions", format!("{} is missing; {user} needs it", name.to_string_lossy()))
}

/// Returns the error for a field of the description.
fn wrong(field: &str, message: impl Into<String>) -> Error {
    Error::usage(format!("RawContext::{field}"), message)
}

#[cfg(test)]
mod tests;
