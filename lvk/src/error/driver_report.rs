//! The report of Vulkan as it is installed: the loader, the driver manifests, and the devices.

use std::fmt;
use std::path::PathBuf;

use super::device_candidate::DeviceCandidate;

/// The loader and the drivers of a machine, found out after a failure.
///
/// `{}` prints the report in one line, `{:#}` with a line for each item. Both end with the remedies.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct DriverReport {
    /// The loader.
    pub loader: LoaderReport,
    /// The Vulkan command that failed, and its result.
    pub failure: Option<String>,
    /// The folders, and the files of variables, that were searched for driver manifests, in order.
    pub searched: Vec<SearchedPath>,
    /// The driver manifests found there.
    pub manifests: Vec<DriverManifest>,
}

/// The result of opening the Vulkan loader.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum LoaderReport {
    /// The loader was opened.
    Opened {
        /// File of the loader, or the name that was opened where the file is unknown.
        path: PathBuf,
        /// Vulkan version of the loader: major, minor, patch. `None` if `vkEnumerateInstanceVersion` failed, as for lack of memory.
        version: Option<(u32, u32, u32)>,
    },
    /// The loader could not be opened.
    NotOpened {
        /// The file or name that was tried.
        path: PathBuf,
        /// Error of the dynamic linker.
        error: String,
    },
}

/// A file or folder that was searched for driver manifests.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SearchedPath {
    /// The file or folder.
    pub path: PathBuf,
    /// The environment variable that names it; `None` for the loader's own folders.
    pub variable: Option<&'static str>,
}

/// A driver manifest: the JSON file that tells the loader of a driver's library.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct DriverManifest {
    /// The file.
    pub path: PathBuf,
    /// The library that it names, as the dynamic linker gets it. `None` if the manifest cannot be read.
    pub library: Option<PathBuf>,
    /// The Vulkan version that it states.
    pub api_version: Option<String>,
    /// The result of opening the library.
    pub outcome: ManifestOutcome,
}

/// The result of opening the library of a driver manifest.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum ManifestOutcome {
    /// The library can be opened, and is a Vulkan driver.
    Loaded,
    /// The library cannot be opened, or is no Vulkan driver.
    LoadFailed {
        /// Error of the dynamic linker.
        error: String,
    },
    /// The manifest is no JSON file with the path of a library.
    NotRead {
        /// The problem.
        error: String,
    },
    /// The loader skips the manifest.
    Skipped {
        /// The reason.
        reason: String,
    },
}

/// Vulkan as installed on a machine: loader, drivers, and devices.
///
/// `{}` prints the report in one line, `{:#}` with a line for each item.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct VulkanReport {
    /// Loader and drivers.
    pub drivers: DriverReport,
    /// The devices, with the features they lack of those that every context requires.
    pub devices: Vec<DeviceCandidate>,
}

impl LoaderReport {
    /// True if the loader is older than Vulkan 1.3.
    #[must_use]
    pub fn is_too_old(&self) -> bool {
        matches!(self, Self::Opened { version: Some(version), .. } if *version < (1, 3, 0))
    }
}

impl DriverManifest {
    /// True if the loader uses the manifest, but its driver cannot be loaded.
    #[must_use]
    pub fn is_broken(&self) -> bool {
        matches!(self.outcome, ManifestOutcome::LoadFailed { .. } | ManifestOutcome::NotRead { .. })
    }
}

impl DriverReport {
    /// True if a driver can be loaded, or if the loader has drivers that the report does not know of.
    pub(crate) fn has_driver(&self) -> bool {
        self.searched.is_empty()
            || self.manifests.iter().any(|manifest| manifest.outcome == ManifestOutcome::Loaded)
    }

    /// True if the loader's own folders were searched: on Windows and Android the report cannot know of all drivers.
    fn knows_installed_drivers(&self) -> bool {
        self.searched.iter().any(|searched| searched.variable.is_none())
    }

    /// True if a manifest cannot be read.
    pub(crate) fn has_unread_manifest(&self) -> bool {
        self.manifests.iter().any(|manifest| matches!(manifest.outcome, ManifestOutcome::NotRead { .. }))
    }

    /// Returns the lines about the loader and the failure, and those about manifests.
    pub(super) fn lines(&self) -> Vec<String> {
        let mut lines = vec![self.loader.to_string()];
        lines.extend(self.failure.clone());
        lines.extend(self.manifests.iter().map(DriverManifest::to_string));
        if self.manifests.is_empty() {
            let searched: Vec<_> = self.searched.iter().map(SearchedPath::to_string).collect();
            let searched = if searched.is_empty() { "any variable".to_owned() } else { searched.join(", ") };
            lines.push(format!("no driver manifest in {searched}"));
        }
        lines
    }

    /// Returns the lines that explain why a device may be absent: the loader, and the drivers that cannot be loaded.
    pub(super) fn absences(&self) -> Vec<String> {
        let broken = self.manifests.iter().filter(|manifest| manifest.is_broken());
        std::iter::once(self.loader.to_string()).chain(broken.map(DriverManifest::to_string)).collect()
    }
}

impl VulkanReport {
    /// Returns the first reason, in a few words, why no device can be used.
    #[must_use]
    pub fn summary(&self) -> String {
        let DriverReport { loader, failure, manifests, .. } = &self.drivers;
        let none_installed = manifests.is_empty() && self.drivers.knows_installed_drivers();
        if let LoaderReport::NotOpened { path, .. } = loader {
            return format!("the Vulkan loader {} cannot be opened", path.display());
        }
        if loader.is_too_old() {
            return loader.to_string();
        }
        let devices: Vec<_> = self.devices.iter().map(DeviceCandidate::to_string).collect();
        let broken = manifests.iter().filter(|manifest| manifest.is_broken()).map(DriverManifest::to_string);
        let reasons: Vec<_> = broken.chain(devices).collect();
        match (reasons.is_empty(), failure) {
            (false, _) => reasons.join("; "),
            (true, _) if none_installed => "no Vulkan driver is installed".to_owned(),
            (true, Some(failure)) => failure.clone(),
            (true, None) => "the drivers offer no device".to_owned(),
        }
    }
}

impl fmt::Display for LoaderReport {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Opened { path, version: None } => {
                write!(out, "the loader {} does not tell its version", path.display())
            }
            Self::Opened { path, version: Some((major, minor, patch)) } => {
                write!(out, "the loader {} offers Vulkan {major}.{minor}.{patch}", path.display())?;
                if self.is_too_old() { out.write_str(", 1.3 is needed") } else { Ok(()) }
            }
            Self::NotOpened { path, error } => {
                write!(out, "the loader {} cannot be opened: {error}", path.display())
            }
        }
    }
}

impl fmt::Display for SearchedPath {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(variable) = self.variable {
            write!(out, "{variable}=")?;
        }
        write!(out, "{}", self.path.display())
    }
}

impl fmt::Display for DriverManifest {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "the driver manifest {}", self.path.display())?;
        if let Some(library) = &self.library {
            write!(out, " names {}", library.display())?;
        }
        if let Some(version) = &self.api_version {
            write!(out, " for Vulkan {version}")?;
        }
        match &self.outcome {
            ManifestOutcome::Loaded => out.write_str(", which can be loaded"),
            ManifestOutcome::LoadFailed { error } => write!(out, ", which cannot be loaded: {error}"),
            ManifestOutcome::NotRead { error } => write!(out, " cannot be read: {error}"),
            ManifestOutcome::Skipped { reason } => write!(out, ", and the loader skips it: {reason}"),
        }
    }
}
