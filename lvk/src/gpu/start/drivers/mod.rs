//! Finds out after a failure which loader and which drivers the machine has, and which of them cannot be loaded.
//!
//! The folders and variables are those of the Vulkan loader's documentation. The loader itself tells of them only in its log.

mod json;
mod manifest;
mod manifest_search;
mod privileges;

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use crate::error::causes::with_causes;
use crate::error::driver_report::{DriverReport, LoaderReport};
use manifest::{check_manifest, open_library};
use manifest_search::{manifest_files, searched_paths};

/// Name of the loader, as `ash` opens it.
const LOADER_NAME: &str = if cfg!(windows) {
    "vulkan-1.dll"
} else if cfg!(any(target_os = "macos", target_os = "ios")) {
    "libvulkan.dylib"
} else if cfg!(any(target_os = "android", target_os = "fuchsia")) {
    "libvulkan.so"
} else {
    "libvulkan.so.1"
};

impl DriverReport {
    /// Searches the driver manifests and opens the library of each, which executes its initialisers.
    pub(crate) fn query(loader: LoaderReport, failure: Option<String>) -> Self {
        let is_privileged = privileges::exceed_the_users();
        let variables = |name: &str| trusted_variable(name, is_privileged);
        let searched = searched_paths(&variables);
        let files = manifest_files(&searched);
        let manifests = files.iter().map(|path| check_manifest(path, &variables, &open_library)).collect();
        Self { loader, failure, searched, manifests }
    }
}

impl LoaderReport {
    /// Returns the report of a loader that could not be opened; `library` is the caller's path of it.
    pub(crate) fn not_opened(library: Option<&Path>, error: &ash::LoadingError) -> Self {
        Self::NotOpened {
            path: library.unwrap_or(Path::new(LOADER_NAME)).to_owned(),
            error: with_causes(error),
        }
    }

    /// Returns the report of an open loader; `version` is `None` where it is not known.
    pub(crate) fn opened(library: Option<&Path>, version: Option<(u32, u32, u32)>) -> Self {
        let file = || mapped_file(&std::fs::read_to_string("/proc/self/maps").ok()?, LOADER_NAME);
        let path = library.map(Path::to_path_buf).or_else(file);
        Self::Opened { path: path.unwrap_or_else(|| LOADER_NAME.into()), version }
    }
}

/// Returns the value of an environment variable; `None` in a program with more privileges than its user, like the loader.
fn trusted_variable(name: &str, is_privileged: bool) -> Option<OsString> {
    if is_privileged { None } else { std::env::var_os(name) }
}

/// Returns the mapped file whose name begins with `name`, from Linux's list of the mappings of a process.
fn mapped_file(maps: &str, name: &str) -> Option<PathBuf> {
    let files = maps.lines().filter_map(|line| line.find('/').and_then(|start| line.get(start..)));
    files.map(Path::new).find(|path| file_name_starts_with(path, name)).map(Path::to_path_buf)
}

fn file_name_starts_with(path: &Path, name: &str) -> bool {
    path.file_name().is_some_and(|file| file.to_string_lossy().starts_with(name))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mappings_name_the_loader() {
        let maps = "7f00-7f01 r-xp 00000000 00:01 12  /usr/lib/libvulkan_lvp.so\n\
                    7f02-7f03 rw-p 00000000 00:00 0\n\
                    7f04-7f05 r--p 00000000 00:01 13  /opt/my libs/libvulkan.so.1.3.239\n";
        assert_eq!(mapped_file(maps, "libvulkan.so.1"), Some("/opt/my libs/libvulkan.so.1.3.239".into()));
        assert_eq!(mapped_file(maps, "vulkan-1.dll"), None);
        assert_eq!(mapped_file("", "libvulkan.so.1"), None);
    }

    #[test]
    fn a_privileged_program_takes_nothing_from_the_environment() {
        assert!(trusted_variable("PATH", false).is_some());
        assert_eq!(trusted_variable("PATH", true), None);
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn this_process_has_the_c_library_mapped() {
        let maps = std::fs::read_to_string("/proc/self/maps").unwrap();
        assert!(mapped_file(&maps, "libc.so").is_some_and(|path| path.is_file()), "{maps}");
    }
}
