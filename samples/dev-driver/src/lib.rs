//! A Vulkan driver without set-up: the machine's own if it can trace rays, else a software driver fetched once.
//!
//! Call [`prepare`] before the first `lvk::Context` and hand [`Driver::loader`] to it. The fetched driver is
//! Mesa's lavapipe from Debian's `bookworm-backports`; apt resolves, downloads and verifies it as whatever user
//! runs the program, into the project's `.vulkan` folder (or `~/.cache/lvk/vulkan` once the project has moved).
//!
//! | Variable | Meaning |
//! |---|---|
//! | `LVK_DRIVER=system` | use the machine's driver, whatever it can do |
//! | `LVK_DRIVER=software` | use the fetched software driver even beside a GPU |
//! | `LVK_NO_DOWNLOAD=1` | never fetch anything |
//! | `LVK_VULKAN_DIR=path` | the folder for fetched files |
//! | `VK_DRIVER_FILES`, `VK_ICD_FILENAMES` | drivers of the user's choice, used as they are |

mod apt;
mod assemble;
mod display;
mod elf;
mod environment;
mod error;
mod layer_description;
mod prefix;
mod preload;
mod probe;
mod provision;
mod settings;

use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

pub use display::VirtualDisplay;
pub use error::{DriverError, FetchError};
use prefix::{Manifest, Part};
use probe::SystemVulkan;
use settings::{Settings, Wish};

static PREPARED: Mutex<Option<Prepared>> = Mutex::new(None);

/// What to make available besides a driver.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DriverRequest {
    /// Also a current Khronos validation layer.
    pub validation: bool,
}

/// A driver this process can use.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Driver {
    /// The Vulkan loader to open by absolute path; `None` for the one the dynamic linker finds.
    pub loader: Option<PathBuf>,
    /// Whose driver it is.
    pub origin: DriverOrigin,
}

/// Whose driver a [`Driver`] is.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum DriverOrigin {
    /// The machine's or the user's own.
    System,
    /// The fetched software driver.
    Provisioned {
        /// The folder it lives in.
        prefix: PathBuf,
    },
}

/// What the first call of [`prepare`] found out.
struct Prepared {
    settings: Settings,
    driver: Driver,
    has_layer: bool,
}

/// Makes a Vulkan driver available to this process, fetching one if the machine has none that can trace rays.
///
/// Call it before the first Vulkan call, from any thread; later calls cost nothing. It sets `VK_DRIVER_FILES`
/// for a fetched driver and adds the folder of the fetched layer to `VK_ADD_LAYER_PATH`.
///
/// # Errors
/// See [`DriverError`]; each message says what to install or set.
pub fn prepare(request: &DriverRequest) -> Result<Driver, DriverError> {
    let mut guard = PREPARED.lock().unwrap_or_else(PoisonError::into_inner);
    let prepared = match guard.take() {
        Some(prepared) => prepared,
        None => Prepared::new(request)?,
    };
    let prepared = guard.insert(prepared);
    if request.validation && !prepared.has_layer {
        obtain(&prepared.settings, &[Part::Validation])?;
        prepared.has_layer = true;
    }
    Ok(prepared.driver.clone())
}

/// The description file of SwiftShader, a software driver with Vulkan 1.3 and without ray tracing: a process
/// started with `VK_DRIVER_FILES` set to it sees what a device without ray tracing is like.
///
/// # Errors
/// [`DriverError::NoValidationLayer`] if the package that carries both cannot be fetched.
pub fn swiftshader_icd() -> Result<PathBuf, DriverError> {
    Ok(folder_of(Part::Validation, &Settings::from_env()?)?.join(prefix::SWIFTSHADER_JSON))
}

/// The description file of RADV, Mesa's driver for AMD cards, whose libraries this opens in the process: one started
/// with `VK_DRIVER_FILES` set to it and `RADV_FORCE_FAMILY` to the name of a chip, such as `navi31`, compiles pipelines
/// for that chip with no card in the machine. The device has no memory, so nothing else works on it.
///
/// # Errors
/// [`DriverError::NoRadv`] if the package cannot be fetched, [`DriverError::Broken`] if a fetched file is damaged.
pub fn radv_icd() -> Result<PathBuf, DriverError> {
    let prefix = folder_of(Part::Radv, &Settings::from_env()?)?;
    preload::preload(&prefix, &Manifest::read(&prefix).unwrap_or_default().preload)?;
    Ok(prefix.join(prefix::RADV_JSON))
}

/// Starts an X server without a screen, for programs that need windows: the machine's own Xvfb, or a fetched one.
///
/// # Errors
/// [`DriverError::NoDisplay`] if there is none and the packages cannot be fetched, [`DriverError::Broken`] if it does not
/// start.
pub fn virtual_display() -> Result<VirtualDisplay, DriverError> {
    match VirtualDisplay::of_machine() {
        Some(display) => display,
        None => VirtualDisplay::of_folder(&folder_of(Part::Display, &Settings::from_env()?)?),
    }
}

impl Prepared {
    fn new(request: &DriverRequest) -> Result<Self, DriverError> {
        let settings = Settings::from_env()?;
        let system = SystemVulkan::open();
        let has_layer = system.as_ref().is_ok_and(|system| request.validation && system.has_current_layer());
        let choice = choose(&settings, system)?;
        let layer = [Part::Validation].into_iter().filter(|_| request.validation && !has_layer);
        let parts: Vec<Part> = choice.fetched_part().into_iter().chain(layer).collect();
        obtain(&settings, &parts)?;
        let driver = choice.start(&settings)?;
        environment::publish(&settings, &driver);
        Ok(Self { settings, driver, has_layer: request.validation })
    }
}

/// Which loader and which drivers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Choice {
    /// All of the machine.
    System,
    /// The user's drivers under the fetched loader, for want of one of the machine.
    UsersDrivers,
    /// All fetched.
    Software,
}

fn choose(settings: &Settings, system: Result<SystemVulkan, String>) -> Result<Choice, DriverError> {
    match (settings.wish, system) {
        (Wish::Software, _) => Ok(Choice::Software),
        (Wish::System, Ok(_)) => Ok(Choice::System),
        (Wish::System, Err(reason)) => Err(DriverError::NoSystemLoader { reason }),
        (Wish::Auto, Ok(_)) if settings.users_driver_files().is_some() => Ok(Choice::System),
        (Wish::Auto, Err(_)) if settings.users_driver_files().is_some() => Ok(Choice::UsersDrivers),
        // A child of a process that uses the fetched driver is told of it, so the machine's own is not asked.
        (Wish::Auto, Ok(system)) if settings.driver_files.is_none() && system.can_trace_rays() => {
            Ok(Choice::System)
        }
        (Wish::Auto, _) => Ok(Choice::Software),
    }
}

impl Choice {
    fn fetched_part(self) -> Option<Part> {
        (self != Self::System).then_some(Part::Driver)
    }

    /// Readies the process for the chosen driver.
    fn start(self, settings: &Settings) -> Result<Driver, DriverError> {
        if self == Self::System {
            return Ok(Driver { loader: None, origin: DriverOrigin::System });
        }
        let prefix = folder_of(Part::Driver, settings)?;
        let loader = Some(prefix.join(prefix::LOADER));
        if self == Self::UsersDrivers {
            return Ok(Driver { loader, origin: DriverOrigin::System });
        }
        preload::preload(&prefix, &Manifest::read(&prefix).unwrap_or_default().preload)?;
        Ok(Driver { loader, origin: DriverOrigin::Provisioned { prefix } })
    }
}

/// The complete folder of `part`, fetched if it is nowhere.
fn folder_of(part: Part, settings: &Settings) -> Result<PathBuf, DriverError> {
    obtain(settings, &[part])?;
    let gone = || refusal(part, FetchError::Content { reason: "what was fetched is gone again".to_owned() });
    part.find(&settings.folders).ok_or_else(gone)
}

/// Fetches those of `parts` that are nowhere, all in one go.
fn obtain(settings: &Settings, parts: &[Part]) -> Result<(), DriverError> {
    let missing: Vec<Part> =
        parts.iter().copied().filter(|part| part.find(&settings.folders).is_none()).collect();
    match missing.first() {
        Some(first) => fetch(settings, &missing).map_err(|cause| refusal(*first, cause)),
        None => Ok(()),
    }
}

fn fetch(settings: &Settings, missing: &[Part]) -> Result<(), FetchError> {
    if !settings.may_download {
        return Err(FetchError::Forbidden);
    }
    provision::provision(settings.writable_folder()?, missing)
}

fn refusal(part: Part, cause: FetchError) -> DriverError {
    match part {
        Part::Driver => DriverError::NoDriver { cause },
        Part::Validation => DriverError::NoValidationLayer { cause },
        Part::Radv => DriverError::NoRadv { cause },
        Part::Display => DriverError::NoDisplay { cause },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings(wish: Wish, folder: &std::path::Path, driver_files: Option<&str>) -> Settings {
        let driver_files = driver_files.map(Into::into);
        Settings { wish, may_download: false, folders: vec![folder.to_path_buf()], driver_files }
    }

    fn no_system() -> Result<SystemVulkan, String> {
        Err("no such library".to_owned())
    }

    #[test]
    fn a_machine_without_vulkan_gets_the_software_driver() {
        let folder = tempfile::tempdir().unwrap();
        let choose = |wish, files| choose(&settings(wish, folder.path(), files), no_system());
        assert_eq!(choose(Wish::Auto, None).unwrap(), Choice::Software);
        assert_eq!(choose(Wish::Auto, Some("/own.json")).unwrap(), Choice::UsersDrivers);
        assert_eq!(choose(Wish::Software, Some("/own.json")).unwrap(), Choice::Software);
        let message = choose(Wish::System, None).unwrap_err().to_string();
        assert!(message.contains("LVK_DRIVER=system") && message.contains("no such library"), "{message}");
    }

    #[test]
    fn a_forbidden_fetch_says_what_to_install() {
        let folder = tempfile::tempdir().unwrap();
        let settings = settings(Wish::Auto, folder.path(), None);
        let driver = obtain(&settings, &[Part::Driver, Part::Validation]).unwrap_err().to_string();
        assert!(driver.contains("LVK_NO_DOWNLOAD") && driver.contains("mesa-vulkan-drivers"), "{driver}");
        let layer = obtain(&settings, &[Part::Validation]).unwrap_err().to_string();
        assert!(layer.contains("LVK_NO_DOWNLOAD") && layer.contains("vulkan-validationlayers"), "{layer}");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }

    #[test]
    fn a_damaged_driver_folder_is_named() {
        let root = tempfile::tempdir().unwrap();
        let folder = Part::Driver.folder(root.path());
        std::fs::create_dir_all(folder.join("lib")).unwrap();
        std::fs::write(folder.join("lib/libdamaged.so"), "text").unwrap();
        Manifest { preload: vec!["lib/libdamaged.so".into()], ..Manifest::default() }.write(&folder).unwrap();
        let error = Choice::Software.start(&settings(Wish::Auto, root.path(), None)).unwrap_err();
        assert!(matches!(&error, DriverError::Broken { path, .. } if path.starts_with(&folder)), "{error}");
    }
}
