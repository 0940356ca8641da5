//! Settings from environment variables, and the folders that result from them.

use std::env;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

use crate::cache_folder::cache_folder;
use crate::error::{DownloadError, DriverError};
use crate::file;
use crate::layout::Component;
use crate::platform::HAS_PACKAGES;

/// The driver that the user prefers, from `LVK_DRIVER`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum DriverPreference {
    /// The system driver if it supports ray tracing, otherwise the downloaded driver.
    Auto,
    /// The system driver, with or without ray tracing.
    System,
    /// The downloaded software driver.
    Software,
}

impl DriverPreference {
    /// Reads the value of `LVK_DRIVER`; unset and empty mean [`DriverPreference::Auto`].
    pub(super) fn parse(value: Option<&str>) -> Result<Self, DriverError> {
        match value {
            None | Some("") => Ok(Self::Auto),
            Some("system") => Ok(Self::System),
            Some("software") => Ok(Self::Software),
            Some(other) => Err(DriverError::Variable {
                name: "LVK_DRIVER",
                value: other.to_owned(),
                expected: "`system` or `software`",
            }),
        }
    }
}

/// The environment variables that concern drivers, read once.
#[derive(Clone, Debug)]
pub(super) struct Settings {
    /// The preferred driver: `LVK_DRIVER`.
    pub(super) preference: DriverPreference,
    /// True on the platform of the downloadable packages.
    pub(super) has_packages: bool,
    /// True unless `LVK_NO_DOWNLOAD` forbids downloads.
    pub(super) download_allowed: bool,
    /// Folders for downloaded drivers, the preferred one first.
    pub(super) folders: Vec<PathBuf>,
    /// `VK_DRIVER_FILES` or `VK_ICD_FILENAMES` as the user set it.
    pub(super) driver_files: Option<OsString>,
}

impl Settings {
    /// Reads the environment of this process.
    pub(super) fn from_env() -> Result<Self, DriverError> {
        let text = |name| env::var_os(name).map(|value| value.to_string_lossy().into_owned());
        let preference = DriverPreference::parse(text("LVK_DRIVER").as_deref())?;
        let download_allowed = matches!(text("LVK_NO_DOWNLOAD").as_deref(), None | Some("" | "0"));
        let path = |name| env::var_os(name).filter(|value| !value.is_empty()).map(PathBuf::from);
        let folders = candidate_folders(
            path("LVK_VULKAN_DIR"),
            Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2),
            cache_folder(),
        );
        let driver_files = path("VK_DRIVER_FILES").or_else(|| path("VK_ICD_FILENAMES")).map(Into::into);
        Ok(Self { preference, has_packages: HAS_PACKAGES, download_allowed, folders, driver_files })
    }

    /// Returns the folder of a complete component; `None` where its libraries would not run.
    pub(super) fn find(&self, component: Component) -> Option<PathBuf> {
        self.has_packages.then(|| component.find(&self.folders))?
    }

    /// Returns the user's driver list; `None` if a parent process of this project set the variable.
    pub(super) fn user_driver_files(&self) -> Option<&OsString> {
        let ours = |files: &OsString| {
            self.folders.iter().any(|folder| {
                Component::Driver.folder(folder).join(super::layout::DRIVER_JSON) == Path::new(files)
            })
        };
        self.driver_files.as_ref().filter(|files| !self.has_packages || !ours(files))
    }

    /// Returns the first folder that is writable, or can be created, and creates it.
    pub(super) fn writable_folder(&self) -> Result<&Path, DownloadError> {
        self.folders.iter().map(PathBuf::as_path).find(|folder| is_writable(folder)).ok_or_else(|| {
            let tried = self.folders.iter().map(lvk::readable_name);
            DownloadError::NoFolder { tried: tried.collect::<Vec<_>>().join(", ") }
        })
    }
}

/// Returns the folders for downloaded drivers, the preferred one first. A folder that the user names is the only one.
fn candidate_folders(named: Option<PathBuf>, project: Option<&Path>, cache: Option<PathBuf>) -> Vec<PathBuf> {
    if let Some(named) = named {
        return vec![std::path::absolute(&named).unwrap_or(named)];
    }
    let project = project.filter(|folder| folder.is_dir()).map(|folder| folder.join(".vulkan"));
    project.into_iter().chain(cache.map(|folder| folder.join("vulkan"))).collect()
}

/// True if `folder` exists, or can be created, and takes the file that locks it.
fn is_writable(folder: &Path) -> bool {
    file::create_dir_all(folder).and_then(|()| file::open_lock(folder)).is_ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn preference_accepts_its_two_words_only() {
        assert_eq!(DriverPreference::parse(None).unwrap(), DriverPreference::Auto);
        assert_eq!(DriverPreference::parse(Some("")).unwrap(), DriverPreference::Auto);
        assert_eq!(DriverPreference::parse(Some("system")).unwrap(), DriverPreference::System);
        assert_eq!(DriverPreference::parse(Some("software")).unwrap(), DriverPreference::Software);
        let message = DriverPreference::parse(Some("Software ")).unwrap_err().to_string();
        assert!(message.contains("LVK_DRIVER") && message.contains("Software "), "{message}");
    }

    #[test]
    fn a_named_folder_is_the_only_candidate() {
        let project = std::env::temp_dir();
        let found = candidate_folders(Some(project.join("b")), Some(&project), Some("/cache/lvk".into()));
        assert_eq!(found, [project.join("b")]);
        assert!(candidate_folders(Some("b".into()), None, None)[0].is_absolute());
    }

    #[test]
    fn the_project_comes_before_the_cache() {
        let project = tempfile::tempdir().unwrap();
        let found = candidate_folders(None, Some(project.path()), Some("/cache/lvk".into()));
        assert_eq!(found, [project.path().join(".vulkan"), "/cache/lvk/vulkan".into()]);
    }

    #[test]
    fn a_moved_project_falls_back_to_the_cache() {
        let gone = Path::new("/no/such/project");
        let found = candidate_folders(None, Some(gone), Some("/cache/lvk".into()));
        assert_eq!(found, [PathBuf::from("/cache/lvk/vulkan")]);
        assert!(candidate_folders(None, Some(gone), None).is_empty());
    }

    #[test]
    fn unwritable_folders_are_skipped() {
        let good = tempfile::tempdir().unwrap();
        let file = good.path().join("file");
        std::fs::write(&file, "").unwrap();
        let settings = |folders| Settings {
            preference: DriverPreference::Auto,
            has_packages: true,
            download_allowed: true,
            folders,
            driver_files: None,
        };
        let chosen = settings(vec![file.join("below a file"), good.path().join("new/deep")]);
        assert_eq!(chosen.writable_folder().unwrap(), good.path().join("new/deep"));
        assert!(good.path().join("new/deep").is_dir());
        let message = settings(vec![file.join("x")]).writable_folder().unwrap_err().to_string();
        assert!(message.contains("LVK_VULKAN_DIR"), "{message}");
    }

    #[test]
    fn drivers_listed_by_a_parent_process_are_not_the_users() {
        let ours = Path::new("/p/.vulkan").join("driver").join(crate::layout::DRIVER_JSON);
        let settings = |files: &Path| Settings {
            preference: DriverPreference::Auto,
            has_packages: true,
            download_allowed: true,
            folders: vec!["/p/.vulkan".into()],
            driver_files: Some(files.into()),
        };
        assert_eq!(settings(&ours).user_driver_files(), None);
        assert!(settings(Path::new("/etc/vulkan/icd.d/other.json")).user_driver_files().is_some());
    }
}
