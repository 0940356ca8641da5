//! What the machine's own Vulkan can do.

use ash::{Entry, Instance, vk};

use super::layer_description::LAYER_NAME;

/// Oldest validation layer that knows the hazards of shader accesses (Vulkan SDK 1.3.296).
const CURRENT_LAYER: u32 = vk::make_api_version(0, 1, 3, 296);
const NEEDED_API: u32 = vk::API_VERSION_1_3;

/// The machine's own Vulkan loader, opened.
pub(super) struct SystemVulkan {
    entry: Entry,
}

impl SystemVulkan {
    /// Opens the loader the dynamic linker finds, or answers with the linker's message.
    pub(super) fn open() -> Result<Self, String> {
        // SAFETY: the machine's loader is trusted like every system library, and has no preconditions.
        let entry = unsafe { Entry::load() }.map_err(|error| error.to_string())?;
        Ok(Self { entry })
    }

    /// Whether a device can trace rays with Vulkan 1.3, by ray query or by ray tracing pipeline.
    pub(super) fn can_trace_rays(&self) -> bool {
        let application = vk::ApplicationInfo::default().api_version(NEEDED_API);
        let description = vk::InstanceCreateInfo::default().application_info(&application);
        // SAFETY: the description names no layer and no extension and lives through the call.
        let Ok(instance) = (unsafe { self.entry.create_instance(&description, None) }) else { return false };
        // SAFETY: the instance is alive.
        let devices = unsafe { instance.enumerate_physical_devices() }.unwrap_or_default();
        let found = devices.into_iter().any(|device| is_capable(&instance, device));
        // SAFETY: nothing made from the instance is left.
        unsafe { instance.destroy_instance(None) };
        found
    }

    /// Whether a validation layer is installed that finds the hazards of ray tracing.
    pub(super) fn has_current_layer(&self) -> bool {
        // SAFETY: enumeration has no preconditions.
        let layers = unsafe { self.entry.enumerate_instance_layer_properties() }.unwrap_or_default();
        layers
            .iter()
            .any(|layer| layer.layer_name_as_c_str() == Ok(LAYER_NAME) && layer.spec_version >= CURRENT_LAYER)
    }
}

fn is_capable(instance: &Instance, device: vk::PhysicalDevice) -> bool {
    // SAFETY: the device was just enumerated from this instance.
    let api = unsafe { instance.get_physical_device_properties(device) }.api_version;
    // SAFETY: as above.
    let extensions = unsafe { instance.enumerate_device_extension_properties(device) }.unwrap_or_default();
    let has = |name| extensions.iter().any(|extension| extension.extension_name_as_c_str() == Ok(name));
    api >= NEEDED_API
        && has(ash::khr::acceleration_structure::NAME)
        && (has(ash::khr::ray_query::NAME) || has(ash::khr::ray_tracing_pipeline::NAME))
}
