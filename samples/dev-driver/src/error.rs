//! What can go wrong between "no driver here" and a usable one.

use std::io;
use std::path::{Path, PathBuf};

/// Why [`prepare`](super::prepare) could not make a driver available.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DriverError {
    /// The machine has no capable driver and none could be fetched.
    #[error(
        "no Vulkan driver with ray tracing was found and none can be fetched because {cause}; install a GPU driver \
         with ray tracing, or on Debian and Ubuntu `apt install mesa-vulkan-drivers libvulkan1` (Mesa 24.1 or newer)"
    )]
    NoDriver {
        /// What stopped the fetch.
        #[source]
        cause: FetchError,
    },
    /// Validation was asked for, the machine has no current layer and none could be fetched.
    #[error(
        "no current Vulkan validation layer was found and none can be fetched because {cause}; install \
         VK_LAYER_KHRONOS_validation 1.3.296 or newer (package `vulkan-validationlayers`, or the Vulkan SDK), \
         or run without validation"
    )]
    NoValidationLayer {
        /// What stopped the fetch.
        #[source]
        cause: FetchError,
    },
    /// The driver for AMD cards cannot be fetched.
    #[error("the driver for AMD cards (RADV) cannot be fetched because {cause}")]
    NoRadv {
        /// What stopped the fetch.
        #[source]
        cause: FetchError,
    },
    /// The X server without a screen cannot be fetched.
    #[error(
        "no Xvfb was found and none can be fetched because {cause}; install the packages xvfb and x11-xkb-utils"
    )]
    NoDisplay {
        /// What stopped the fetch.
        #[source]
        cause: FetchError,
    },
    /// `LVK_DRIVER=system` on a machine without a Vulkan loader.
    #[error(
        "LVK_DRIVER=system, but this machine has no Vulkan loader ({reason}); install `libvulkan1` and a driver, or \
         unset LVK_DRIVER"
    )]
    NoSystemLoader {
        /// The dynamic linker's message.
        reason: String,
    },
    /// An environment variable holds a value this program does not know.
    #[error("{name}={value} is not understood; expected {expected}")]
    Variable {
        /// Name of the variable.
        name: &'static str,
        /// Its value.
        value: String,
        /// The accepted values.
        expected: &'static str,
    },
    /// A folder fetched earlier is complete, yet cannot be used.
    #[error("the fetched {} cannot be used: {reason}; delete its folder and start again", path.display())]
    Broken {
        /// The fetched file.
        path: PathBuf,
        /// What failed.
        reason: String,
    },
}

/// Why a driver or layer could not be fetched.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FetchError {
    /// `LVK_NO_DOWNLOAD` is set.
    #[error("LVK_NO_DOWNLOAD is set")]
    Forbidden,
    /// The packages are for another kind of machine.
    #[error("fetched drivers exist for 64-bit x86 Linux with glibc only")]
    Platform,
    /// A program or file of the package system is missing.
    #[error("{what} is missing, which comes with Debian's package system")]
    MissingTool {
        /// The program or file.
        what: String,
    },
    /// The package system refused; offline, an old glibc or a bad signature end here.
    #[error("`{command}` failed: {message}")]
    PackageTool {
        /// The command that failed.
        command: String,
        /// Its error output in one line.
        message: String,
    },
    /// The packages do not hold what is needed from them.
    #[error("the fetched packages are not as expected: {reason}")]
    Content {
        /// What is missing.
        reason: String,
    },
    /// No folder can be written to.
    #[error("no folder for it can be written (tried {tried}); set LVK_VULKAN_DIR to one that can")]
    NoFolder {
        /// The folders tried.
        tried: String,
    },
    /// A file operation failed.
    #[error("cannot {action} {}: {source}", path.display())]
    File {
        /// What was attempted, as a verb.
        action: &'static str,
        /// The file or folder.
        path: PathBuf,
        /// The system's error.
        source: io::Error,
    },
}

impl FetchError {
    /// Makes the closure for `map_err` that names the file and what was attempted.
    pub(super) fn file<'a>(action: &'static str, path: &'a Path) -> impl FnOnce(io::Error) -> Self + 'a {
        move |source| Self::File { action, path: path.to_path_buf(), source }
    }
}
