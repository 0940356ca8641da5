//! Provides a Vulkan driver without manual setup: the system driver if it supports ray tracing, otherwise a software driver
//! that is downloaded once.
//!
//! Call [`prepare`] before the first `lvk::Context` and pass [`Driver::loader`] to the context. The downloaded driver is
//! Mesa's lavapipe from Debian's `bookworm-backports`. `apt-get` resolves, downloads and verifies the packages as the current
//! user, into the project's `.vulkan` folder (or `vulkan` in [`cache_folder`] if the project folder no longer exists). Other
//! platforms than 64-bit x86 Linux with glibc have no packages: there the system driver is used, with or without ray tracing.
//!
//! | Variable | Meaning |
//! |---|---|
//! | `LVK_DRIVER=system` | use the system driver, with or without ray tracing |
//! | `LVK_DRIVER=software` | use the downloaded software driver even if the system has a GPU |
//! | `LVK_NO_DOWNLOAD=1` | never download |
//! | `LVK_VULKAN_DIR=path` | the folder for downloaded files |
//! | `VK_DRIVER_FILES`, `VK_ICD_FILENAMES` | drivers chosen by the user, used unchanged |

mod apt;
mod cache_folder;
mod display;
mod download;
mod elf;
mod error;
mod file;
mod install;
mod layer_json;
mod layout;
#[cfg(unix)]
mod library_preload;
#[cfg(not(unix))]
mod library_preload_disabled;
mod loader_environment;
mod platform;
mod process_limits;
mod settings;
mod system_vulkan;

use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use lvk::VulkanReport;

pub use cache_folder::cache_folder;
pub use display::VirtualDisplay;
pub use error::{DownloadError, DriverError};
use layout::{Component, Manifest};
#[cfg(not(unix))]
use library_preload_disabled as library_preload;
use settings::{DriverPreference, Settings};
use system_vulkan::SystemVulkan;

static PREPARED: Mutex<Option<Prepared>> = Mutex::new(None);

/// Options of [`prepare`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DriverRequest {
    /// Also provide a current Khronos validation layer.
    pub validation: bool,
    /// Let the downloaded driver compile shaders without optimisation (`GALLIVM_PERF=nopt`, unless the variable is set). Tests ask for
    /// it, as most of them compile a shader for longer than the shader runs. The first call of a process decides.
    pub quick_compilation: bool,
}

/// A Vulkan driver that this process can use.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Driver {
    /// Absolute path of the Vulkan loader; `None` for the loader that the dynamic linker finds.
    pub loader: Option<PathBuf>,
    /// Origin of the driver.
    pub origin: DriverOrigin,
    /// Report of the system's Vulkan, where the downloaded driver takes its place because it cannot trace rays.
    pub system: Option<Arc<VulkanReport>>,
}

/// Origin of a [`Driver`].
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum DriverOrigin {
    /// Installed on the system, or chosen by the user.
    System,
    /// The downloaded software driver.
    Downloaded {
        /// Folder of the driver.
        folder: PathBuf,
    },
}

/// Result of the first call of [`prepare`].
struct Prepared {
    settings: Settings,
    driver: Driver,
    has_layer: bool,
}

/// Provides a Vulkan driver to this process. Downloads a software driver if the system has none with ray tracing.
///
/// Call this function before the first Vulkan call, from any thread. Later calls return the same driver at no cost. The
/// function prints one line with the reason if it takes the downloaded driver for lack of another. It sets
/// `VK_DRIVER_FILES` for a downloaded driver and adds the folder of the downloaded layer to `VK_ADD_LAYER_PATH`.
///
/// # Errors
/// See [`DriverError`]. Each message names what to install or set.
pub fn prepare(request: &DriverRequest) -> Result<Driver, DriverError> {
    let mut guard = PREPARED.lock().unwrap_or_else(PoisonError::into_inner);
    let prepared = match guard.take() {
        Some(prepared) => prepared,
        None => Prepared::new(request)?,
    };
    let prepared = guard.insert(prepared);
    if request.validation && !prepared.has_layer {
        ensure_installed(&prepared.settings, &[Component::Validation])?;
        prepared.has_layer = true;
    }
    Ok(prepared.driver.clone())
}

/// Calls [`prepare`] for a test that needs a device. Returns false and prints a line where there is no driver, if the environment has
/// `LVK_SKIP_GPU_TESTS` and no `LVK_REQUIRE_GPU`.
///
/// # Errors
/// As [`prepare`], unless the test is to be skipped.
pub fn prepare_unless_skipped(request: &DriverRequest) -> Result<bool, DriverError> {
    match prepare(request) {
        Ok(_) => Ok(true),
        Err(error) if is_set("LVK_SKIP_GPU_TESTS") && !is_set("LVK_REQUIRE_GPU") => {
            eprintln!("SKIPPED, no Vulkan device: {error}");
            Ok(false)
        }
        Err(error) => Err(error),
    }
}

/// True if an environment variable has a value other than `0`.
pub fn is_set(variable: &str) -> bool {
    std::env::var(variable).is_ok_and(|value| !value.is_empty() && value != "0")
}

/// Returns the path of SwiftShader's driver manifest (ICD JSON). SwiftShader is a software driver with Vulkan 1.3 and without
/// ray tracing. Start a process with `VK_DRIVER_FILES` set to this path to test a device without ray tracing.
///
/// # Errors
/// [`DriverError::NoValidationLayer`] if the package that contains both cannot be downloaded.
pub fn swiftshader_icd() -> Result<PathBuf, DriverError> {
    Ok(installed_folder(Component::Validation, &Settings::from_env()?)?.join(layout::SWIFTSHADER_JSON))
}

/// Opens the libraries of RADV, Mesa's driver for AMD GPUs, and returns the path of its driver manifest (ICD JSON). A process
/// started with `VK_DRIVER_FILES` set to this path and `RADV_FORCE_FAMILY` set to a chip name, such as `navi31`, compiles
/// pipelines for that chip without a GPU in the machine. The device has no memory, so nothing else works on it.
///
/// # Errors
/// [`DriverError::NoRadv`] if the package cannot be downloaded, [`DriverError::Broken`] if a downloaded file is damaged.
pub fn radv_icd() -> Result<PathBuf, DriverError> {
    let folder = installed_folder(Component::Radv, &Settings::from_env()?)?;
    library_preload::preload(&folder, &Manifest::read(&folder).unwrap_or_default().preload)?;
    Ok(folder.join(layout::RADV_JSON))
}

/// Starts a headless X server (Xvfb) for programs that open windows: the system's Xvfb, or a downloaded one.
///
/// # Errors
/// [`DriverError::NoDisplay`] if Xvfb is not installed and cannot be downloaded, [`DriverError::Broken`] if it does not
/// start.
pub fn virtual_display() -> Result<VirtualDisplay, DriverError> {
    match VirtualDisplay::from_system() {
        Some(display) => display,
        None => VirtualDisplay::from_folder(&installed_folder(Component::Display, &Settings::from_env()?)?),
    }
}

impl Prepared {
    fn new(request: &DriverRequest) -> Result<Self, DriverError> {
        let settings = Settings::from_env()?;
        let system = SystemVulkan::open();
        let has_layer = system.as_ref().is_ok_and(|system| request.validation && system.has_current_layer());
        let source = choose_source(&settings, system)?;
        let report = source.replaces_system(&settings).then(|| Arc::new(system_vulkan::report()));
        let layer = [Component::Validation].into_iter().filter(|_| request.validation && !has_layer);
        let components: Vec<Component> = source.required_component().into_iter().chain(layer).collect();
        ensure_installed(&settings, &components).map_err(|error| {
            let no_loader = (source == DriverSource::UserDrivers).then(|| Arc::new(system_vulkan::report()));
            error.with_system(no_loader.or_else(|| report.clone()))
        })?;
        let driver = Driver { system: report, ..source.activate(&settings)? };
        if let Some(report) = &driver.system {
            eprintln!("lvk: a software driver is used, because {}", report.summary());
        }
        loader_environment::set_variables(&settings, &driver, request.quick_compilation);
        Ok(Self { settings, driver, has_layer: request.validation })
    }
}

/// The loader and the drivers that the process uses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum DriverSource {
    /// The system's loader and drivers.
    System,
    /// The user's drivers with the downloaded loader: the system has no loader.
    UserDrivers,
    /// The downloaded loader and software driver.
    Software,
}

fn choose_source(
    settings: &Settings,
    system: Result<SystemVulkan, String>,
) -> Result<DriverSource, DriverError> {
    match (settings.preference, system) {
        (DriverPreference::Software, _) => Ok(DriverSource::Software),
        (DriverPreference::System, Ok(_)) => Ok(DriverSource::System),
        (DriverPreference::System, Err(_)) => {
            Err(DriverError::NoSystemLoader { report: Arc::new(system_vulkan::report()) })
        }
        (DriverPreference::Auto, Ok(_)) if settings.user_driver_files().is_some() => Ok(DriverSource::System),
        (DriverPreference::Auto, Err(_)) if settings.user_driver_files().is_some() => {
            Ok(DriverSource::UserDrivers)
        }
        // A child process inherits `VK_DRIVER_FILES` of the downloaded driver and must use the same driver.
        (DriverPreference::Auto, Ok(system))
            if settings.driver_files.is_none() && (!settings.has_packages || system.can_trace_rays()) =>
        {
            Ok(DriverSource::System)
        }
        (DriverPreference::Auto, _) => Ok(DriverSource::Software),
    }
}

impl DriverSource {
    fn required_component(self) -> Option<Component> {
        (self != Self::System).then_some(Component::Driver)
    }

    /// True if the software driver is used because the system's drivers do not serve, and not because it is asked for.
    fn replaces_system(self, settings: &Settings) -> bool {
        self == Self::Software
            && settings.preference == DriverPreference::Auto
            && settings.driver_files.is_none()
    }

    /// Loads the driver's libraries into this process where it was downloaded.
    fn activate(self, settings: &Settings) -> Result<Driver, DriverError> {
        if self == Self::System {
            return Ok(Driver { loader: None, origin: DriverOrigin::System, system: None });
        }
        let folder = installed_folder(Component::Driver, settings)?;
        let loader = Some(folder.join(layout::LOADER));
        if self == Self::UserDrivers {
            return Ok(Driver { loader, origin: DriverOrigin::System, system: None });
        }
        process_limits::check()?;
        library_preload::preload(&folder, &Manifest::read(&folder).unwrap_or_default().preload)?;
        Ok(Driver { loader, origin: DriverOrigin::Downloaded { folder }, system: None })
    }
}

/// Returns the folder of `component`. Downloads the component if no folder has it.
fn installed_folder(component: Component, settings: &Settings) -> Result<PathBuf, DriverError> {
    ensure_installed(settings, &[component])?;
    let gone = || {
        driver_error(
            component,
            DownloadError::Content { reason: "the downloaded folder was removed meanwhile".to_owned() },
        )
    };
    settings.find(component).ok_or_else(gone)
}

/// Downloads the missing ones of `components` together.
fn ensure_installed(settings: &Settings, components: &[Component]) -> Result<(), DriverError> {
    let missing: Vec<Component> =
        components.iter().copied().filter(|component| settings.find(*component).is_none()).collect();
    match missing.first() {
        Some(first) => download_components(settings, &missing).map_err(|cause| driver_error(*first, cause)),
        None => Ok(()),
    }
}

fn download_components(settings: &Settings, missing: &[Component]) -> Result<(), DownloadError> {
    if !settings.has_packages {
        return Err(DownloadError::Platform);
    }
    if !settings.download_allowed {
        return Err(DownloadError::Forbidden);
    }
    download::download_missing(settings.writable_folder()?, missing)
}

fn driver_error(component: Component, cause: DownloadError) -> DriverError {
    match component {
        Component::Driver => DriverError::NoDriver { cause, system: None },
        Component::Validation => DriverError::NoValidationLayer { cause },
        Component::Radv => DriverError::NoRadv { cause },
        Component::Display => DriverError::NoDisplay { cause },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings(
        preference: DriverPreference,
        folder: &std::path::Path,
        driver_files: Option<&str>,
    ) -> Settings {
        let driver_files = driver_files.map(Into::into);
        let folders = vec![folder.to_path_buf()];
        Settings { preference, has_packages: true, download_allowed: false, folders, driver_files }
    }

    fn no_system() -> Result<SystemVulkan, String> {
        Err("no such library".to_owned())
    }

    #[test]
    fn a_system_without_vulkan_gets_the_software_driver() {
        let folder = tempfile::tempdir().unwrap();
        let choose =
            |preference, files| choose_source(&settings(preference, folder.path(), files), no_system());
        assert_eq!(choose(DriverPreference::Auto, None).unwrap(), DriverSource::Software);
        assert_eq!(choose(DriverPreference::Auto, Some("/own.json")).unwrap(), DriverSource::UserDrivers);
        assert_eq!(choose(DriverPreference::Software, Some("/own.json")).unwrap(), DriverSource::Software);
        let message = choose(DriverPreference::System, None).unwrap_err().to_string();
        assert!(message.contains("LVK_DRIVER=system") && message.contains("the loader"), "{message}");
    }

    #[test]
    fn only_an_unwanted_replacement_of_the_system_is_explained() {
        let folder = tempfile::tempdir().unwrap();
        let replaces = |source: DriverSource, preference, files| {
            source.replaces_system(&settings(preference, folder.path(), files))
        };
        assert!(replaces(DriverSource::Software, DriverPreference::Auto, None));
        assert!(!replaces(DriverSource::Software, DriverPreference::Software, None));
        assert!(!replaces(DriverSource::Software, DriverPreference::Auto, Some("/ours.json")));
        assert!(!replaces(DriverSource::System, DriverPreference::Auto, None));
    }

    #[test]
    fn a_forbidden_download_names_what_to_install() {
        let folder = tempfile::tempdir().unwrap();
        let settings = settings(DriverPreference::Auto, folder.path(), None);
        let driver =
            ensure_installed(&settings, &[Component::Driver, Component::Validation]).unwrap_err().to_string();
        assert!(driver.contains("LVK_NO_DOWNLOAD") && driver.contains(platform::INSTALL_DRIVER), "{driver}");
        let layer = ensure_installed(&settings, &[Component::Validation]).unwrap_err().to_string();
        assert!(layer.contains("LVK_NO_DOWNLOAD") && layer.contains(platform::INSTALL_LAYER), "{layer}");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }

    #[test]
    fn nothing_is_taken_from_a_folder_of_another_platform() {
        let root = tempfile::tempdir().unwrap();
        let folder = Component::Driver.folder(root.path());
        std::fs::create_dir(&folder).unwrap();
        Manifest::default().write(&folder).unwrap();
        let mut settings = settings(DriverPreference::Auto, root.path(), None);
        assert_eq!(installed_folder(Component::Driver, &settings).unwrap(), folder);
        settings.has_packages = false;
        let error = installed_folder(Component::Driver, &settings).unwrap_err();
        assert!(matches!(error, DriverError::NoDriver { cause: DownloadError::Platform, .. }), "{error}");
        assert!(error.to_string().contains(platform::INSTALL_DRIVER), "{error}");
    }

    #[cfg(unix)]
    #[test]
    fn a_damaged_driver_folder_is_named() {
        let root = tempfile::tempdir().unwrap();
        let folder = Component::Driver.folder(root.path());
        std::fs::create_dir_all(folder.join("lib")).unwrap();
        std::fs::write(folder.join("lib/libdamaged.so"), "text").unwrap();
        Manifest { preload: vec!["lib/libdamaged.so".into()], ..Manifest::default() }.write(&folder).unwrap();
        let error = DriverSource::Software
            .activate(&settings(DriverPreference::Auto, root.path(), None))
            .unwrap_err();
        assert!(matches!(&error, DriverError::Broken { path, .. } if path.starts_with(&folder)), "{error}");
    }
}
