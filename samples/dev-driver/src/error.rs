//! Errors of [`prepare`](crate::prepare) and of downloads.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use lvk::VulkanReport;

use crate::platform::{INSTALL_DRIVER, INSTALL_LAYER};

/// An error of [`prepare`](crate::prepare) and of the other functions of this crate.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DriverError {
    /// The system has no driver with ray tracing, and the software driver could not be downloaded.
    #[error(
        "no Vulkan driver with ray tracing was found{} and none can be downloaded because {cause}; {INSTALL_DRIVER}",
        in_brackets(system.as_deref())
    )]
    NoDriver {
        /// Report of the system's loader, drivers and devices. `None` if they were not wanted.
        system: Option<Arc<VulkanReport>>,
        /// Error of the download.
        #[source]
        cause: DownloadError,
    },
    /// Validation was requested, the system has no current layer, and the layer could not be downloaded.
    #[error(
        "no current Vulkan validation layer was found and none can be downloaded because {cause}; \
         {INSTALL_LAYER}, or run without validation"
    )]
    NoValidationLayer {
        /// Error of the download.
        #[source]
        cause: DownloadError,
    },
    /// RADV, the driver for AMD GPUs, could not be downloaded.
    #[error("the driver for AMD GPUs (RADV) cannot be downloaded because {cause}")]
    NoRadv {
        /// Error of the download.
        #[source]
        cause: DownloadError,
    },
    /// Xvfb is not installed and could not be downloaded.
    #[error(
        "no Xvfb was found and none can be downloaded because {cause}; install the packages xvfb and x11-xkb-utils"
    )]
    NoDisplay {
        /// Error of the download.
        #[source]
        cause: DownloadError,
    },
    /// `LVK_DRIVER=system` is set, but the system has no Vulkan loader.
    #[error(
        "LVK_DRIVER=system, but this system has no Vulkan loader ({report}); follow a remedy, or unset LVK_DRIVER"
    )]
    NoSystemLoader {
        /// Report of the loader and the drivers.
        report: Arc<VulkanReport>,
    },
    /// An environment variable has an unknown value.
    #[error("{name}={} is not valid; expected {expected}", lvk::readable_name(value))]
    Variable {
        /// Name of the variable.
        name: &'static str,
        /// Value of the variable.
        value: String,
        /// The accepted values.
        expected: &'static str,
    },
    /// The address space of the process is limited to less than the software driver needs.
    #[error(
        "the address space of this process is limited to {} MiB, and the software driver needs {} MiB: without them it \
         would end the process; raise the limit (`ulimit -v unlimited`)",
        limit >> 20, needed >> 20
    )]
    AddressSpace {
        /// The limit, in bytes.
        limit: u64,
        /// Bytes that the driver needs.
        needed: u64,
    },
    /// The files of the process are limited to less than the software driver needs.
    #[error(
        "files of this process are limited to {} MiB, and the software driver needs {} MiB for the memory of its objects: \
         without them it would end the process; raise the limit (`ulimit -f unlimited`)",
        limit >> 20, needed >> 20
    )]
    FileSize {
        /// The limit, in bytes.
        limit: u64,
        /// Bytes that the driver needs.
        needed: u64,
    },
    /// A downloaded file cannot be used.
    #[error("the downloaded {} cannot be used: {reason}; {}", lvk::readable_name(path), remedy(reason))]
    Broken {
        /// The downloaded file.
        path: PathBuf,
        /// Cause of the failure.
        reason: String,
    },
}

/// Reason why a download failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DownloadError {
    /// `LVK_NO_DOWNLOAD` is set.
    #[error("LVK_NO_DOWNLOAD is set")]
    Forbidden,
    /// The packages exist for another platform only.
    #[error("downloadable drivers exist for 64-bit x86 Linux with glibc only")]
    Platform,
    /// A program or file of the package system is missing.
    #[error("{what} is missing; it is part of Debian's package system")]
    MissingTool {
        /// The program or file.
        what: String,
    },
    /// A command of the package system failed: no network, a glibc that is too old, or an invalid signature.
    #[error("`{}` failed: {}", lvk::readable_line(command), lvk::readable_line(message))]
    PackageTool {
        /// The command that failed.
        command: String,
        /// The first error line of its output.
        message: String,
    },
    /// The packages lack an expected file.
    #[error("the downloaded packages are not as expected: {reason}")]
    Content {
        /// The missing file or the cause.
        reason: String,
    },
    /// None of the folders is writable.
    #[error("no writable folder for the download (tried {tried}); set LVK_VULKAN_DIR to a writable folder")]
    NoFolder {
        /// The folders tried.
        tried: String,
    },
    /// A file operation failed.
    #[error("cannot {action} {}: {source}", lvk::readable_name(path))]
    File {
        /// The attempted operation, as a verb.
        action: &'static str,
        /// The file or folder.
        path: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
}

impl DriverError {
    /// Adds the report of the system's Vulkan to the lack of a driver.
    pub(super) fn with_system(self, system: Option<Arc<VulkanReport>>) -> Self {
        match self {
            Self::NoDriver { cause, .. } => Self::NoDriver { cause, system },
            error => error,
        }
    }
}

fn in_brackets(system: Option<&VulkanReport>) -> String {
    system.map(|system| format!(" ({system})")).unwrap_or_default()
}

/// Returns the remedy for a file that cannot be used. A lack of memory or of file descriptors is no defect of the file.
fn remedy(reason: &str) -> &'static str {
    let is_short = |text: &str| reason.contains(text);
    let shortages = ["Too many open files", "annot allocate memory", "Out of memory", "out of memory"];
    let is_unmapped = is_short("failed to map segment") && !is_short("not permitted");
    if is_unmapped || shortages.into_iter().any(is_short) {
        "free memory, or raise the limits of the process (ulimit -a)"
    } else {
        "delete its folder and start again"
    }
}

impl DownloadError {
    /// Returns a closure for `map_err` that adds the file and the attempted operation.
    pub(super) fn file<'a>(action: &'static str, path: &'a Path) -> impl FnOnce(io::Error) -> Self + 'a {
        move |source| Self::File { action, path: path.to_path_buf(), source }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shortages_do_not_advise_to_delete_the_driver() {
        let text = |reason: &str| {
            DriverError::Broken { path: "/d/libtoy.so".into(), reason: reason.to_owned() }.to_string()
        };
        for reason in [
            "libtoy.so: cannot open shared object file: Too many open files",
            "libtoy.so: failed to map segment from shared object",
            "libtoy.so: cannot create shared object descriptor: Cannot allocate memory",
            "libtoy.so: cannot allocate memory in static TLS block",
        ] {
            assert!(text(reason).ends_with("(ulimit -a)"), "{}", text(reason));
        }
        for reason in [
            "libtoy.so: invalid ELF header",
            "libtoy.so: failed to map segment from shared object: Operation not permitted",
        ] {
            assert!(text(reason).ends_with("delete its folder and start again"), "{}", text(reason));
        }
    }
}
