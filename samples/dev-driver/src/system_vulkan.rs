//! Queries the capabilities of the system's Vulkan installation.

use ash::{Entry, Instance, vk};
use lvk::{Context, VulkanReport, with_causes};

use crate::layer_json::LAYER_NAME;

/// Oldest validation layer that detects hazards of shader accesses (Vulkan SDK 1.3.296).
const MIN_LAYER_VERSION: u32 = vk::make_api_version(0, 1, 3, 296);
const REQUIRED_API: u32 = vk::API_VERSION_1_3;

/// The system's Vulkan loader, opened.
pub(super) struct SystemVulkan {
    entry: Entry,
}

impl SystemVulkan {
    /// Opens the loader that the dynamic linker finds. Returns the linker's message, with its cause, on failure.
    pub(super) fn open() -> Result<Self, String> {
        // SAFETY: the system's loader is trusted like every system library, and has no preconditions.
        let entry = unsafe { Entry::load() }.map_err(|error| with_causes(&error))?;
        Ok(Self { entry })
    }

    /// True if a device has Vulkan 1.3 and ray queries or ray tracing pipelines.
    pub(super) fn can_trace_rays(&self) -> bool {
        let application = vk::ApplicationInfo::default().api_version(REQUIRED_API);
        let description = vk::InstanceCreateInfo::default().application_info(&application);
        // SAFETY: the description names no layer and no extension and lives through the call.
        let Ok(instance) = (unsafe { self.entry.create_instance(&description, None) }) else { return false };
        // SAFETY: the instance is alive.
        let devices = unsafe { instance.enumerate_physical_devices() }.unwrap_or_default();
        let found = devices.into_iter().any(|device| can_trace(&instance, device));
        // SAFETY: nothing made from the instance is left.
        unsafe { instance.destroy_instance(None) };
        found
    }

    /// True if a validation layer of at least [`MIN_LAYER_VERSION`] is installed. Warns if the system's loader does not tell.
    pub(super) fn has_current_layer(&self) -> bool {
        // SAFETY: enumeration has no preconditions.
        let layers = unsafe { self.entry.enumerate_instance_layer_properties() };
        let layers = layers.unwrap_or_else(|error| {
            eprintln!(
                "warning: the downloaded validation layer is used: {error} in vkEnumerateInstanceLayerProperties of the \
                 system's Vulkan loader"
            );
            Vec::new()
        });
        layers.iter().any(|layer| {
            layer.layer_name_as_c_str() == Ok(LAYER_NAME) && layer.spec_version >= MIN_LAYER_VERSION
        })
    }
}

/// Reports the system's loader, drivers and devices, none of which traces rays.
pub(super) fn report() -> VulkanReport {
    let mut report = Context::vulkan_report(None);
    for device in &mut report.devices {
        device.missing.push("ray tracing".to_owned());
    }
    report
}

fn can_trace(instance: &Instance, device: vk::PhysicalDevice) -> bool {
    // SAFETY: the device was just enumerated from this instance.
    let api = unsafe { instance.get_physical_device_properties(device) }.api_version;
    // SAFETY: as above.
    let extensions = unsafe { instance.enumerate_device_extension_properties(device) }.unwrap_or_default();
    let has = |name| extensions.iter().any(|extension| extension.extension_name_as_c_str() == Ok(name));
    api >= REQUIRED_API
        && has(ash::khr::acceleration_structure::NAME)
        && (has(ash::khr::ray_query::NAME) || has(ash::khr::ray_tracing_pipeline::NAME))
}
