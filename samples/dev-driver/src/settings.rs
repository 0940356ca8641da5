//! What the user asked for: environment variables and the folder that results from them.

use std::env;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

use super::error::{DriverError, FetchError};
use super::prefix::Part;

/// Which driver the user wants, from `LVK_DRIVER`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Wish {
    /// The machine's own if it can trace rays, else a fetched one.
    Auto,
    /// The machine's own, whatever it can do.
    System,
    /// The fetched software driver.
    Software,
}

impl Wish {
    /// Reads the value of `LVK_DRIVER`; unset and empty mean [`Wish::Auto`].
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

/// The environment as far as drivers are concerned, read once.
#[derive(Clone, Debug)]
pub(super) struct Settings {
    /// From `LVK_DRIVER`.
    pub(super) wish: Wish,
    /// From `LVK_NO_DOWNLOAD`.
    pub(super) may_download: bool,
    /// Where fetched drivers live, best place first.
    pub(super) folders: Vec<PathBuf>,
    /// `VK_DRIVER_FILES` or `VK_ICD_FILENAMES` as the user set it.
    pub(super) driver_files: Option<OsString>,
}

impl Settings {
    /// Reads the environment of this process.
    pub(super) fn from_env() -> Result<Self, DriverError> {
        let text = |name| env::var_os(name).map(|value| value.to_string_lossy().into_owned());
        let wish = Wish::parse(text("LVK_DRIVER").as_deref())?;
        let may_download = matches!(text("LVK_NO_DOWNLOAD").as_deref(), None | Some("" | "0"));
        let path = |name| env::var_os(name).filter(|value| !value.is_empty()).map(PathBuf::from);
        let folders = candidates(
            path("LVK_VULKAN_DIR"),
            Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2),
            path("XDG_CACHE_HOME"),
            path("HOME"),
        );
        let driver_files = path("VK_DRIVER_FILES").or_else(|| path("VK_ICD_FILENAMES")).map(Into::into);
        Ok(Self { wish, may_download, folders, driver_files })
    }

    /// The user's own driver list; one that an ancestor process of this project set counts as none.
    pub(super) fn users_driver_files(&self) -> Option<&OsString> {
        let ours = |files: &OsString| {
            self.folders.iter().any(|folder| {
                Part::Driver.folder(folder).join(super::prefix::DRIVER_JSON) == Path::new(files)
            })
        };
        self.driver_files.as_ref().filter(|files| !ours(files))
    }

    /// The folder to fetch into: the first that is there or can be made, and is writable.
    pub(super) fn writable_folder(&self) -> Result<&Path, FetchError> {
        self.folders.iter().map(PathBuf::as_path).find(|folder| can_write(folder)).ok_or_else(|| {
            let tried = self.folders.iter().map(|folder| folder.display().to_string());
            FetchError::NoFolder { tried: tried.collect::<Vec<_>>().join(", ") }
        })
    }
}

/// Folders for fetched drivers, best first; a folder the user names is the only one.
fn candidates(
    named: Option<PathBuf>,
    project: Option<&Path>,
    cache: Option<PathBuf>,
    home: Option<PathBuf>,
) -> Vec<PathBuf> {
    if let Some(named) = named {
        return vec![std::path::absolute(&named).unwrap_or(named)];
    }
    let project = project.filter(|folder| folder.is_dir()).map(|folder| folder.join(".vulkan"));
    let cache = cache.filter(|folder| folder.is_absolute()).or_else(|| home.map(|home| home.join(".cache")));
    project.into_iter().chain(cache.map(|folder| folder.join("lvk/vulkan"))).collect()
}

/// Whether files can be made in `folder`, or in the nearest of its ancestors that is there.
fn can_write(folder: &Path) -> bool {
    let existing = folder.ancestors().find(|ancestor| ancestor.exists());
    existing.is_some_and(|folder| {
        folder.is_dir()
            && rustix::fs::access(folder, rustix::fs::Access::WRITE_OK | rustix::fs::Access::EXEC_OK).is_ok()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wish_accepts_its_two_words_only() {
        assert_eq!(Wish::parse(None).unwrap(), Wish::Auto);
        assert_eq!(Wish::parse(Some("")).unwrap(), Wish::Auto);
        assert_eq!(Wish::parse(Some("system")).unwrap(), Wish::System);
        assert_eq!(Wish::parse(Some("software")).unwrap(), Wish::Software);
        let message = Wish::parse(Some("Software ")).unwrap_err().to_string();
        assert!(message.contains("LVK_DRIVER") && message.contains("Software "), "{message}");
    }

    #[test]
    fn a_named_folder_is_the_only_candidate() {
        let project = std::env::temp_dir();
        let found =
            candidates(Some("/a/b".into()), Some(&project), Some("/cache".into()), Some("/home/u".into()));
        assert_eq!(found, [PathBuf::from("/a/b")]);
        assert!(candidates(Some("b".into()), None, None, None)[0].is_absolute());
    }

    #[test]
    fn the_project_comes_before_the_cache() {
        let project = tempfile::tempdir().unwrap();
        let cache = Some(PathBuf::from("/cache"));
        let found = candidates(None, Some(project.path()), cache, Some("/home/u".into()));
        assert_eq!(found, [project.path().join(".vulkan"), "/cache/lvk/vulkan".into()]);
    }

    #[test]
    fn a_moved_project_falls_back_to_the_cache() {
        let gone = Path::new("/no/such/project");
        let home = Some(PathBuf::from("/home/u"));
        let expected = [PathBuf::from("/home/u/.cache/lvk/vulkan")];
        assert_eq!(candidates(None, Some(gone), None, home.clone()), expected);
        assert_eq!(candidates(None, Some(gone), Some("relative".into()), home), expected);
        assert!(candidates(None, Some(gone), None, None).is_empty());
    }

    #[test]
    fn unwritable_folders_are_skipped() {
        let good = tempfile::tempdir().unwrap();
        let file = good.path().join("file");
        std::fs::write(&file, "").unwrap();
        let settings =
            |folders| Settings { wish: Wish::Auto, may_download: true, folders, driver_files: None };
        let chosen = settings(vec![file.join("below a file"), good.path().join("new/deep")]);
        assert_eq!(chosen.writable_folder().unwrap(), good.path().join("new/deep"));
        let message = settings(vec![file.join("x")]).writable_folder().unwrap_err().to_string();
        assert!(message.contains("LVK_VULKAN_DIR"), "{message}");
    }

    #[test]
    fn drivers_listed_by_an_ancestor_of_ours_are_not_the_users() {
        let ours = Path::new("/p/.vulkan").join("driver").join(super::super::prefix::DRIVER_JSON);
        let settings = |files: &Path| Settings {
            wish: Wish::Auto,
            may_download: true,
            folders: vec!["/p/.vulkan".into()],
            driver_files: Some(files.into()),
        };
        assert_eq!(settings(&ours).users_driver_files(), None);
        assert!(settings(Path::new("/etc/vulkan/icd.d/other.json")).users_driver_files().is_some());
    }
}
