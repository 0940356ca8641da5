//! A device that the application or another engine has created.

use std::ffi::CStr;

use ash::vk;

use super::physical_device::PhysicalDevice;
use crate::error::{Error, Result};
use crate::gpu::caps::optional_features::{FeatureSet, OptionalFeature};
use crate::gpu::caps::queues::{QueueFamily, QueueLocation};

/// An instance, a device and queues that the caller has created, with the extensions and features enabled at
/// their creation.
#[derive(Clone)]
pub struct RawContext<'a> {
    /// The loader's entry points.
    pub entry: ash::Entry,
    /// The instance. Its version must be 1.3 or later.
    pub instance: ash::Instance,
    /// Extensions enabled at creation of the instance.
    pub instance_extensions: &'a [&'a CStr],
    /// The physical device.
    pub physical_device: vk::PhysicalDevice,
    /// The device.
    pub device: ash::Device,
    /// Extensions enabled at creation of the device.
    pub device_extensions: &'a [&'a CStr],
    /// Features that are enabled, beside those that every context requires. Those of
    /// [`FeatureSet::PORTABILITY`] count only on devices with `VK_KHR_portability_subset`; other devices always have
    /// them.
    pub features: FeatureSet,
    /// True if `accelerationStructure`, its `descriptorBindingAccelerationStructureUpdateAfterBind`, and
    /// `rayTracingPipeline` are enabled.
    pub ray_tracing_pipeline: bool,
    /// True if `accelerationStructure`, its `descriptorBindingAccelerationStructureUpdateAfterBind`, and
    /// `rayQuery` are enabled.
    pub ray_query: bool,
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
        let mut found = PhysicalDevice::query(&self.instance, self.physical_device)?;
        if !found.missing.is_empty() {
            let candidates = vec![found.candidate(0)];
            return Err(Error::NoDevice { problem: None, candidates, drivers: None });
        }
        self.check_queues(&found.families)?;
        self.check_features(&found)?;
        let caps = &mut found.capabilities;
        caps.mesh_shader &= self.mesh_shader;
        caps.position_fetch = false;
        caps.pipeline_libraries &= self.has_extension(ash::khr::pipeline_library::NAME);
        caps.checkpoints &= self.has_extension(ash::nv::device_diagnostic_checkpoints::NAME);
        caps.limit_ray_tracing(self.ray_tracing_pipeline, self.ray_query);
        caps.remove_features(undeclared(self.features, caps.portability_subset));
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

    fn check_queues(&self, families: &[QueueFamily]) -> Result<()> {
        use vk::QueueFlags as Flags;
        let [graphics, compute, transfer] = self.queues().map(|(_, family)| family);
        let everything = Flags::GRAPHICS | Flags::COMPUTE;
        check_family(families, graphics, |flags| flags.contains(everything), "graphics or no compute")?;
        check_family(families, compute, |flags| flags.contains(Flags::COMPUTE), "compute")?;
        let copies = everything | Flags::TRANSFER;
        check_family(families, transfer, |flags| flags.intersects(copies), "transfer")
    }

    /// Checks that the device has the features, their extensions, and the features that they depend on.
    fn check_features(&self, found: &PhysicalDevice) -> Result<()> {
        let known: FeatureSet =
            OptionalFeature::all().filter(|feature| self.features.contains(*feature)).collect();
        let absent = known.without(found.capabilities.optional);
        if let Some(feature) = absent.iter().next() {
            let name = feature.vulkan_name();
            return Err(invalid(format!("feature {name} cannot be on: the device does not have it")));
        }
        let mut extensions: Vec<&CStr> = known.extensions().collect();
        if found.capabilities.portability_subset && !self.has_extension(ash::khr::portability_subset::NAME) {
            return Err(invalid(
                "the device lists VK_KHR_portability_subset; enable it and name it in device_extensions"
                    .to_owned(),
            ));
        }
        if self.ray_tracing_pipeline || self.ray_query {
            extensions
                .extend([ash::khr::acceleration_structure::NAME, ash::khr::deferred_host_operations::NAME]);
        }
        let flags = [
            (self.ray_tracing_pipeline, ash::khr::ray_tracing_pipeline::NAME),
            (self.ray_query, ash::khr::ray_query::NAME),
            (self.mesh_shader, ash::ext::mesh_shader::NAME),
        ];
        extensions.extend(flags.iter().filter(|(on, _)| *on).map(|(_, name)| *name));
        match extensions.into_iter().find(|name| !self.has_extension(name)) {
            Some(name) => {
                let name = name.to_string_lossy();
                Err(invalid(format!(
                    "a feature is said to be on whose extension {name} is not among device_extensions"
                )))
            }
            None => Ok(()),
        }
    }
}

/// Returns the features to treat as disabled: those not declared. Vulkan has no switch for the features of
/// portability on devices that implement all of Vulkan.
fn undeclared(declared: FeatureSet, portability_subset: bool) -> FeatureSet {
    let absent = FeatureSet::ALL.without(declared);
    if portability_subset { absent } else { absent.without(FeatureSet::PORTABILITY) }
}

fn check_family(
    families: &[QueueFamily],
    number: u32,
    fits: impl Fn(vk::QueueFlags) -> bool,
    lacks: &str,
) -> Result<()> {
    match families.get(number as usize) {
        Some(family) if fits(family.flags) => Ok(()),
        Some(_) => Err(invalid(format!("family {number} has no {lacks}"))),
        None => Err(invalid(format!("the device has no queue family {number}"))),
    }
}

fn invalid(message: String) -> Error {
    Error::usage("from_raw", message)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn features_of_portability_need_a_declaration_on_subsets_of_vulkan_only() {
        let declared = FeatureSet::NONE.with(OptionalFeature::TriangleFans);
        let whole = undeclared(declared, false);
        assert!(!whole.contains(OptionalFeature::ViewSwizzle) && whole.contains(OptionalFeature::Int64));
        let subset = undeclared(declared, true);
        assert!(subset.contains(OptionalFeature::ViewSwizzle));
        assert!(!subset.contains(OptionalFeature::TriangleFans));
    }
}
