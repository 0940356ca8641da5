//! The files and folders where the Vulkan loader looks for driver manifests.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use crate::error::driver_report::SearchedPath;

/// Returns the value of an environment variable.
pub(super) type Variables<'a> = &'a dyn Fn(&str) -> Option<OsString>;

/// Variables that replace the loader's own folders; the first that is set counts.
const REPLACING: [&str; 2] = ["VK_DRIVER_FILES", "VK_ICD_FILENAMES"];
/// The variable whose files precede the loader's own folders.
const ADDING: &str = "VK_ADD_DRIVER_FILES";

/// Returns the files and folders that the loader searches, in order, as the Vulkan loader's documentation of driver discovery
/// lists them.
pub(super) fn searched_paths(variables: Variables<'_>) -> Vec<SearchedPath> {
    if let Some((name, value)) = REPLACING.iter().find_map(|name| Some((*name, set(variables, name)?))) {
        return paths_in(&value, Some(name));
    }
    let added = set(variables, ADDING).map(|value| paths_in(&value, Some(ADDING)));
    let own = default_roots(variables).into_iter().map(|root| root.join("vulkan/icd.d"));
    let own = own.map(|path| SearchedPath { path, variable: None });
    added.into_iter().flatten().chain(own).collect()
}

/// Returns the manifests of these files and folders, each once. A file that a variable names need not exist.
pub(super) fn manifest_files(searched: &[SearchedPath]) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for SearchedPath { path, variable } in searched {
        let found = match (path.is_dir(), variable) {
            (true, _) => json_files(path),
            (false, Some(_)) => vec![path.clone()],
            (false, None) => Vec::new(),
        };
        files.extend(found);
    }
    let mut seen = std::collections::HashSet::new();
    files.retain(|file| seen.insert(file.clone()));
    files
}

fn set(variables: Variables<'_>, name: &str) -> Option<OsString> {
    variables(name).filter(|value| !value.is_empty())
}

fn paths_in(value: &OsString, variable: Option<&'static str>) -> Vec<SearchedPath> {
    let paths = std::env::split_paths(value).filter(|path| !path.as_os_str().is_empty());
    paths.map(|path| SearchedPath { path, variable }).collect()
}

/// Returns the manifests of a folder by name. A folder that cannot be read has none.
fn json_files(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut files: Vec<_> = entries.map(|entry| entry.path()).filter(|path| is_json(path)).collect();
    files.sort();
    files
}

fn is_json(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension == "json")
}

/// Returns the folders below which the loader looks for `vulkan/icd.d`. On Windows the loader reads the registry, and on
/// Android the system's own folder; the standard library reads neither.
fn default_roots(variables: Variables<'_>) -> Vec<PathBuf> {
    if cfg!(any(windows, target_os = "android")) {
        return Vec::new();
    }
    let home = |below: &str| Some(PathBuf::from(set(variables, "HOME")?).join(below));
    let one = |name: &str, below: &str| set(variables, name).map(PathBuf::from).or_else(|| home(below));
    let list = |name: &str, otherwise: &str| {
        let value = set(variables, name).unwrap_or_else(|| otherwise.into());
        std::env::split_paths(&value).collect::<Vec<_>>()
    };
    let mut roots: Vec<PathBuf> = bundle_resources().into_iter().collect();
    roots.extend(one("XDG_CONFIG_HOME", ".config"));
    roots.extend(list("XDG_CONFIG_DIRS", "/etc/xdg"));
    roots.extend(["/usr/local/etc", "/etc"].map(PathBuf::from));
    roots.extend(one("XDG_DATA_HOME", ".local/share"));
    roots.extend(list("XDG_DATA_DIRS", "/usr/local/share:/usr/share"));
    roots.retain(|root| !root.as_os_str().is_empty());
    roots
}

/// Returns the folder of the resources of a macOS application, `Contents/Resources` beside `Contents/MacOS`.
fn bundle_resources() -> Option<PathBuf> {
    if !cfg!(target_os = "macos") {
        return None;
    }
    Some(std::env::current_exe().ok()?.parent()?.parent()?.join("Resources"))
}

#[cfg(test)]
#[cfg(target_os = "linux")]
mod tests {
    use super::*;

    /// Returns the searched paths, as they are displayed, with these variables.
    fn searched(variables: &[(&str, &str)]) -> Vec<String> {
        let lookup = |name: &str| {
            variables.iter().find(|(key, _)| *key == name).map(|(_, value)| OsString::from(value))
        };
        searched_paths(&lookup).iter().map(SearchedPath::to_string).collect()
    }

    const SYSTEM: [&str; 5] = [
        "/etc/xdg/vulkan/icd.d",
        "/usr/local/etc/vulkan/icd.d",
        "/etc/vulkan/icd.d",
        "/usr/local/share/vulkan/icd.d",
        "/usr/share/vulkan/icd.d",
    ];

    #[test]
    fn machine_without_variables_has_the_systems_folders() {
        assert_eq!(searched(&[]), SYSTEM);
        assert_eq!(searched(&[("VK_DRIVER_FILES", ""), ("XDG_DATA_DIRS", "")]), SYSTEM);
        let home = searched(&[("HOME", "/home/u")]);
        assert_eq!(home[0], "/home/u/.config/vulkan/icd.d");
        assert_eq!(home[4], "/home/u/.local/share/vulkan/icd.d");
        assert_eq!(home.len(), 7);
    }

    #[test]
    fn variables_of_the_desktop_replace_their_defaults() {
        let found = searched(&[
            ("HOME", "/home/u"),
            ("XDG_CONFIG_HOME", "/c"),
            ("XDG_CONFIG_DIRS", "/x:/y"),
            ("XDG_DATA_HOME", "/d"),
            ("XDG_DATA_DIRS", "/z"),
        ]);
        let expected = ["/c", "/x", "/y", "/usr/local/etc", "/etc", "/d", "/z"];
        assert_eq!(found, expected.map(|root| format!("{root}/vulkan/icd.d")));
    }

    #[test]
    fn listed_drivers_replace_all_folders() {
        let both = [("VK_ICD_FILENAMES", "/old.json"), ("VK_ADD_DRIVER_FILES", "/added.json")];
        assert_eq!(searched(&both), ["VK_ICD_FILENAMES=/old.json"]);
        let all = [both[0], both[1], ("VK_DRIVER_FILES", "/a.json::/b")];
        assert_eq!(searched(&all), ["VK_DRIVER_FILES=/a.json", "VK_DRIVER_FILES=/b"]);
        let added = searched(&both[1..]);
        assert_eq!((added[0].as_str(), added.len()), ("VK_ADD_DRIVER_FILES=/added.json", 6));
    }

    #[test]
    fn folders_hold_manifests_by_name_and_files_need_not_exist() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["b.json", "a.json", "readme.txt"] {
            std::fs::write(folder.path().join(name), "").unwrap();
        }
        let path = |name: &str| folder.path().join(name);
        let named = |path| SearchedPath { path, variable: Some("VK_DRIVER_FILES") };
        let own = |path| SearchedPath { path, variable: None };
        let searched = [
            named(path("absent.json")),
            own(folder.path().into()),
            named(path("a.json")),
            own("/no/such".into()),
        ];
        assert_eq!(manifest_files(&searched), [path("absent.json"), path("a.json"), path("b.json")]);
    }
}
