//! Opens the Vulkan loader and creates an instance, with the validation layer if requested.

use std::ffi::{CStr, CString};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use ash::vk;

use super::driver_workarounds::with_exclusive_loader_lock;
use super::window::{WindowExtensions, WindowRef};
use crate::error::driver_report::{DriverReport, LoaderReport};
use crate::error::{Error, Result};
use crate::gpu::debug::messenger::{Messenger, ValidationMode, ValidationSink, c_name};

const VALIDATION_LAYER: &CStr = c"VK_LAYER_KHRONOS_validation";

/// An instance and its messenger, destroyed on drop.
pub(crate) struct Instance {
    pub(crate) entry: ash::Entry,
    pub(crate) raw: ash::Instance,
    /// The loader that the caller named.
    library: Option<PathBuf>,
    pub(crate) debug_utils: bool,
    /// True if the validation layer is enabled.
    pub(crate) validated: bool,
    /// True if the validation layer instruments shaders.
    pub(crate) gpu_assisted: bool,
    /// `None` if the context does not present to windows.
    pub(crate) windows: Option<WindowExtensions>,
    messenger: Messenger,
    /// True if the caller created the instance and destroys it.
    is_external: bool,
}

/// Description of an instance.
pub(crate) struct InstanceDesc<'a> {
    pub(crate) application_name: &'a str,
    /// The loader to open.
    pub(crate) library: Option<&'a Path>,
    pub(crate) validation: ValidationMode,
    /// Additional extensions of the caller.
    pub(crate) extra: &'a [&'a CStr],
    /// A window that the context presents to.
    pub(crate) window: Option<WindowRef<'a>>,
    pub(crate) sink: ValidationSink,
}

impl Instance {
    pub(crate) fn new(desc: &InstanceDesc<'_>) -> Result<Self> {
        let entry = load_entry(desc.library).map_err(|error| {
            let loader = LoaderReport::not_opened(desc.library, &error);
            Error::NoVulkan { report: Arc::new(DriverReport::query(loader, None)) }
        })?;
        if loader_version(&entry)? < (1, 3, 0) {
            return Err(no_vulkan(&entry, desc.library, None));
        }
        let layer = find_layer(&entry, desc.validation)?;
        let extensions = Extensions::query(&entry, layer, desc)
            .map_err(|error| blame_drivers(error, &entry, desc.library))?;
        let mut messenger = Messenger::new(desc.sink.clone());
        let raw = create_instance(&entry, desc, layer, &extensions, &messenger)?;
        if extensions.debug_utils
            && layer.is_some()
            && let Err(result) = messenger.install(&entry, &raw)
        {
            // SAFETY: the instance was created above and nothing uses it.
            with_exclusive_loader_lock(|| unsafe { raw.destroy_instance(None) });
            return Err(Error::vulkan("vkCreateDebugUtilsMessengerEXT", "messages of the validation layer")(
                result,
            ));
        }
        let gpu_assisted = desc.validation == ValidationMode::GpuAssisted;
        let validated = layer.is_some();
        let Extensions { debug_utils, windows, .. } = extensions;
        let library = desc.library.map(Path::to_path_buf);
        Ok(Self {
            entry,
            raw,
            library,
            debug_utils,
            validated,
            gpu_assisted,
            windows,
            messenger,
            is_external: false,
        })
    }

    /// Wraps an instance that the caller created.
    pub(crate) fn external(entry: ash::Entry, raw: ash::Instance, extensions: &[&CStr]) -> Self {
        Self {
            entry,
            raw,
            library: None,
            debug_utils: extensions.contains(&ash::ext::debug_utils::NAME),
            validated: false,
            gpu_assisted: false,
            windows: WindowExtensions::enabled(extensions),
            messenger: Messenger::new(ValidationSink::default()),
            is_external: true,
        }
    }

    /// Receives the messages of the validation layer that the caller of [`external`](Self::external) turned on.
    pub(crate) fn listen(&mut self, sink: ValidationSink) -> Result<()> {
        if !self.debug_utils {
            let why = "ContextDesc::validation needs VK_EXT_debug_utils, which is not listed; enable and list it, or \
                       leave the messages to the engine";
            return Err(Error::usage("RawContext::instance_extensions", why));
        }
        self.messenger = Messenger::new(sink);
        self.messenger
            .install(&self.entry, &self.raw)
            .map_err(Error::vulkan("vkCreateDebugUtilsMessengerEXT", "messages of the validation layer"))?;
        self.validated = true;
        Ok(())
    }

    /// True if the caller created the instance.
    #[cfg(feature = "window")]
    pub(crate) fn is_external(&self) -> bool {
        self.is_external
    }

    /// Returns the messages of the validation layer.
    pub(crate) fn sink(&self) -> &ValidationSink {
        self.messenger.sink()
    }

    /// Returns the devices, at least one.
    pub(crate) fn physical_devices(&self) -> Result<Vec<vk::PhysicalDevice>> {
        const CALL: &str = "vkEnumeratePhysicalDevices";
        // SAFETY: the instance is alive.
        let (devices, text) = match unsafe { self.raw.enumerate_physical_devices() } {
            Ok(devices) => (devices, "found no device".to_owned()),
            // The loader returns this if no driver has a device.
            Err(result @ vk::Result::ERROR_INITIALIZATION_FAILED) => {
                (Vec::new(), format!("returned {result:?}"))
            }
            Err(result) => return Err(Error::vulkan(CALL, "instance")(result)),
        };
        if !devices.is_empty() {
            return Ok(devices);
        }
        Err(no_vulkan(&self.entry, self.library.as_deref(), Some(format!("{CALL} {text}"))))
    }

    /// Returns the report of loader and drivers. The instance keeps the drivers open, so they are not loaded anew.
    pub(crate) fn driver_report(&self) -> DriverReport {
        DriverReport::query(loader_report(&self.entry, self.library.as_deref()), None)
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        self.messenger.remove();
        if self.is_external {
            return;
        }
        // SAFETY: the device is destroyed first, as `Gpu` declares it first.
        with_exclusive_loader_lock(|| unsafe { self.raw.destroy_instance(None) });
    }
}

impl DriverReport {
    /// Opens the loader, and searches and opens the drivers.
    pub(crate) fn query_loader(library: Option<&Path>) -> Self {
        match load_entry(library) {
            Ok(entry) => Self::query(loader_report(&entry, library), None),
            Err(error) => Self::query(LoaderReport::not_opened(library, &error), None),
        }
    }
}

/// Returns the extensions that another engine enables for an instance that presents to `window`, and for names of
/// objects if `debug_names`.
pub(crate) fn external_extensions(
    entry: &ash::Entry,
    window: Option<WindowRef<'_>>,
    debug_names: bool,
) -> Result<Vec<&'static CStr>> {
    // SAFETY: no preconditions.
    let list = unsafe { entry.enumerate_instance_extension_properties(None) }
        .map_err(Error::vulkan("vkEnumerateInstanceExtensionProperties", "Vulkan loader"))?;
    let has = |name: &CStr| list.iter().any(|e| e.extension_name_as_c_str() == Ok(name));
    let windows = window.map(|window| WindowExtensions::query(window, &has)).transpose()?;
    let debug_utils = ash::ext::debug_utils::NAME;
    if debug_names && !has(debug_utils) {
        let why = "the Vulkan loader and its drivers do not have it; leave ContextDesc::debug_names at None";
        return Err(Error::unsupported("the instance extension VK_EXT_debug_utils", why));
    }
    let of_windows = windows.iter().flat_map(WindowExtensions::names);
    Ok(of_windows.chain(debug_names.then_some(debug_utils)).collect())
}

fn load_entry(library: Option<&Path>) -> Result<ash::Entry, ash::LoadingError> {
    // SAFETY: opening a library runs its code. It is the system's loader, or the one that the application trusts, as
    // `ContextDesc::vulkan_library` demands.
    unsafe {
        match library {
            Some(path) => ash::Entry::load_from(path),
            None => ash::Entry::load(),
        }
    }
}

fn loader_version(entry: &ash::Entry) -> Result<(u32, u32, u32)> {
    // SAFETY: no preconditions.
    let version = unsafe { entry.try_enumerate_instance_version() }
        .map_err(Error::vulkan("vkEnumerateInstanceVersion", "Vulkan loader"))?
        .unwrap_or(vk::API_VERSION_1_0);
    Ok((vk::api_version_major(version), vk::api_version_minor(version), vk::api_version_patch(version)))
}

fn loader_report(entry: &ash::Entry, library: Option<&Path>) -> LoaderReport {
    LoaderReport::opened(library, loader_version(entry).ok())
}

/// Returns [`Error::NoVulkan`] in place of an error that the drivers cause: an extension is missing because no driver can be
/// loaded, or the loader is out of memory because it cannot parse a manifest, as it says.
fn blame_drivers(error: Error, entry: &ash::Entry, library: Option<&Path>) -> Error {
    use vk::Result as Code;
    let report = || DriverReport::query(loader_report(entry, library), Some(error.to_string()));
    let blamed = match &error {
        Error::Unsupported { .. } | Error::Vulkan { result: Code::ERROR_INCOMPATIBLE_DRIVER, .. } => {
            Some(report()).filter(|report| !report.has_driver())
        }
        Error::OutOfHostMemory { .. } => Some(report()).filter(DriverReport::has_unread_manifest),
        _ => None,
    };
    match blamed {
        Some(report) => Error::NoVulkan { report: Arc::new(report) },
        None => error,
    }
}

/// Returns the error for a loader that is too old, or finds no driver or device.
fn no_vulkan(entry: &ash::Entry, library: Option<&Path>, failure: Option<String>) -> Error {
    let report = DriverReport::query(loader_report(entry, library), failure);
    Error::NoVulkan { report: Arc::new(report) }
}

fn find_layer(entry: &ash::Entry, validation: ValidationMode) -> Result<Option<&'static CStr>> {
    if validation == ValidationMode::Off {
        return Ok(None);
    }
    // SAFETY: no preconditions.
    let layers = unsafe { entry.enumerate_instance_layer_properties() }
        .map_err(Error::vulkan("vkEnumerateInstanceLayerProperties", "Vulkan loader"))?;
    if layers.iter().any(|layer| layer.layer_name_as_c_str() == Ok(VALIDATION_LAYER)) {
        return Ok(Some(VALIDATION_LAYER));
    }
    Err(Error::unsupported(
        "validation",
        "the layer VK_LAYER_KHRONOS_validation was not found; install the Vulkan validation layers or name their \
         folder in VK_ADD_LAYER_PATH",
    ))
}

struct Extensions<'a> {
    debug_utils: bool,
    layer_settings: bool,
    /// True if the loader lists devices that implement a subset of Vulkan only on request.
    portability: bool,
    extra: &'a [&'a CStr],
    windows: Option<WindowExtensions>,
}

impl<'a> Extensions<'a> {
    fn query(entry: &ash::Entry, layer: Option<&CStr>, desc: &InstanceDesc<'a>) -> Result<Self> {
        let mut found = Self {
            debug_utils: false,
            layer_settings: false,
            portability: false,
            extra: desc.extra,
            windows: None,
        };
        let mut missing = desc.extra.to_vec();
        for source in [None, layer].into_iter().take(if layer.is_some() { 2 } else { 1 }) {
            // SAFETY: the layer, if any, was found above.
            let list = unsafe { entry.enumerate_instance_extension_properties(source) }
                .map_err(Error::vulkan("vkEnumerateInstanceExtensionProperties", "Vulkan loader"))?;
            let has = |name: &CStr| list.iter().any(|e| e.extension_name_as_c_str() == Ok(name));
            found.debug_utils |= has(ash::ext::debug_utils::NAME);
            found.layer_settings |= has(ash::ext::layer_settings::NAME);
            found.portability |= source.is_none() && has(ash::khr::portability_enumeration::NAME);
            missing.retain(|name| !has(name));
            if source.is_none() {
                found.windows =
                    desc.window.map(|window| WindowExtensions::query(window, &has)).transpose()?;
            }
        }
        if let Some(name) = missing.first() {
            let what = format!("the instance extension {}", name.to_string_lossy());
            return Err(Error::unsupported(what, "the Vulkan loader and its drivers do not have it"));
        }
        Ok(found)
    }

    /// Returns the names of the extensions to enable. The settings extension is left out: the layer reads its
    /// settings without it, and loaders older than the extension refuse it.
    fn names(&self) -> Vec<*const std::ffi::c_char> {
        let debug_utils = self.debug_utils.then_some(ash::ext::debug_utils::NAME);
        let portability = self.portability.then_some(ash::khr::portability_enumeration::NAME);
        let own = debug_utils.into_iter().chain(portability);
        let windows = self.windows.iter().flat_map(WindowExtensions::names).map(|name| -> &'a CStr { name });
        let mut names: Vec<&CStr> = own.chain(self.extra.iter().copied()).chain(windows).collect();
        names.sort_unstable();
        names.dedup();
        names.into_iter().map(CStr::as_ptr).collect()
    }
}

fn create_instance(
    entry: &ash::Entry,
    desc: &InstanceDesc<'_>,
    layer: Option<&CStr>,
    extensions: &Extensions<'_>,
    messenger: &Messenger,
) -> Result<ash::Instance> {
    let name = c_name(desc.application_name);
    let application = vk::ApplicationInfo::default()
        .application_name(&name)
        .engine_name(c"lvk")
        .api_version(vk::API_VERSION_1_3);
    let layers: Vec<_> = layer.iter().map(|layer| layer.as_ptr()).collect();
    let extension_names = extensions.names();
    let switches = layer_switches(desc.validation);
    let values: Vec<[vk::Bool32; 1]> = switches.iter().map(|(_, on)| [vk::Bool32::from(*on)]).collect();
    let settings: Vec<_> =
        switches.iter().zip(&values).map(|((key, _), value)| layer_setting(key, value)).collect();
    let mut settings = vk::LayerSettingsCreateInfoEXT::default().settings(&settings);
    let mut messages = messenger.create_info();
    let mut info = vk::InstanceCreateInfo::default()
        .application_info(&application)
        .enabled_layer_names(&layers)
        .enabled_extension_names(&extension_names);
    if extensions.portability {
        info = info.flags(vk::InstanceCreateFlags::ENUMERATE_PORTABILITY_KHR);
    }
    if layer.is_some() && extensions.debug_utils {
        info = info.push_next(&mut messages);
    }
    if layer.is_some() && extensions.layer_settings {
        info = info.push_next(&mut settings);
    }
    // SAFETY: every pointer in `info` lives until the end of this function.
    let made = with_exclusive_loader_lock(|| unsafe { entry.create_instance(&info, None) });
    #[cfg(any(test, feature = "test-hooks"))]
    let made = made
        .map(crate::test_support::null_commands::wrap_null_commands)
        .map(crate::test_support::fault_injection::wrap_fault_injection)
        .map(crate::test_support::unordered_queues::wrap_unordered_queues);
    made.map_err(|result| match result {
        // The loader returns this if it can load no driver.
        vk::Result::ERROR_INCOMPATIBLE_DRIVER => {
            no_vulkan(entry, desc.library, Some(format!("vkCreateInstance returned {result:?}")))
        }
        result => Error::vulkan("vkCreateInstance", "instance")(result),
    })
}

/// Returns the switches of the validation layer, by its own setting names.
fn layer_switches(validation: ValidationMode) -> Vec<(CString, bool)> {
    let gpu = validation == ValidationMode::GpuAssisted;
    [
        ("validate_core", true),
        ("validate_sync", true),
        ("syncval_full_validation", true),
        ("syncval_shader_accesses_heuristic", true),
        ("gpuav_enable", gpu),
        ("enable_message_limit", false),
    ]
    .map(|(key, on)| (c_name(key), on))
    .into()
}

fn layer_setting<'a>(key: &'a CStr, value: &'a [vk::Bool32; 1]) -> vk::LayerSettingEXT<'a> {
    let bytes = bytemuck::cast_slice(value);
    let setting = vk::LayerSettingEXT::default()
        .layer_name(VALIDATION_LAYER)
        .setting_name(key)
        .ty(vk::LayerSettingTypeEXT::BOOL32)
        .values(bytes);
    // ash counts bytes here; Vulkan counts values.
    vk::LayerSettingEXT { value_count: 1, ..setting }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn devices_of_portability_are_listed_where_the_loader_hides_them() {
        for portability in [false, true] {
            let found = Extensions {
                debug_utils: true,
                layer_settings: false,
                portability,
                extra: &[],
                windows: None,
            };
            let names = found.names();
            // SAFETY: the names are constants.
            let mut names = names.iter().map(|name| unsafe { CStr::from_ptr(*name) });
            assert_eq!(names.any(|name| name == ash::khr::portability_enumeration::NAME), portability);
        }
    }
}
