//! Environment variables that point the Vulkan loader to the downloaded driver and layers.

use std::env;
use std::ffi::{OsStr, OsString};
use std::path::PathBuf;

use crate::layout::{Component, DRIVER_JSON, LAYER_FOLDER};
use crate::settings::Settings;
use crate::{Driver, DriverOrigin};

/// Folder of Mesa's shader cache. Mesa uses the user's cache folder if the variable is not set.
const MESA_CACHE: &str = "MESA_SHADER_CACHE_DIR";
/// Options of lavapipe's compiler. Its cache keeps programs of other options apart.
const MESA_COMPILER: &str = "GALLIVM_PERF";

/// Sets the variables for `driver` and for layers, once per process.
///
/// The list contains layer folders that do not exist yet. The loader skips them, and finds a layer that is downloaded later
/// without another change of the environment.
pub(super) fn set_variables(settings: &Settings, driver: &Driver, quick_compilation: bool) {
    let (name, value) =
        layer_variable(env::var_os("VK_LAYER_PATH"), env::var_os("VK_ADD_LAYER_PATH"), &settings.folders);
    let folder = match &driver.origin {
        DriverOrigin::Downloaded { folder } => Some(folder),
        DriverOrigin::System => None,
    };
    let has_shader_cache = env::var_os(MESA_CACHE).is_some();
    let is_quick = quick_compilation && env::var_os(MESA_COMPILER).is_none();
    // SAFETY: changing the environment is unsound only while another thread reads it through the C library.
    // This runs once per process, under the lock of `prepare`, whose documentation requires the call before the first
    // Vulkan call. Other threads of this project read the environment through `std` only, which locks.
    unsafe {
        env::set_var(name, value);
        if let Some(folder) = folder {
            env::set_var("VK_DRIVER_FILES", folder.join(DRIVER_JSON));
            if !has_shader_cache {
                env::set_var(MESA_CACHE, folder.with_file_name("shader_cache"));
            }
            if is_quick {
                env::set_var(MESA_COMPILER, "nopt");
            }
        }
    }
}

/// Returns the variable and value that append the downloaded layer folders to the user's folders. The loader ignores
/// `VK_ADD_LAYER_PATH` if `VK_LAYER_PATH` is set, so the function extends `VK_LAYER_PATH` in that case.
fn layer_variable(
    path: Option<OsString>,
    added: Option<OsString>,
    folders: &[PathBuf],
) -> (&'static str, OsString) {
    let (name, users) = match path.filter(|path| !path.is_empty()) {
        Some(path) => ("VK_LAYER_PATH", path),
        None => ("VK_ADD_LAYER_PATH", added.unwrap_or_default()),
    };
    let mut all: Vec<PathBuf> = env::split_paths(&users).filter(|path| path != OsStr::new("")).collect();
    for ours in folders.iter().map(|folder| Component::Validation.folder(folder).join(LAYER_FOLDER)) {
        // `join_paths` rejects a folder whose name contains the path separator.
        if !all.contains(&ours) && env::join_paths([&ours]).is_ok() {
            all.push(ours);
        }
    }
    (name, env::join_paths(all).unwrap_or(users))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ours() -> String {
        let folder = Component::Validation.folder("/p".as_ref()).join(LAYER_FOLDER);
        folder.into_os_string().into_string().unwrap()
    }

    /// A list with the separator of the platform.
    fn list(folders: &[&str]) -> String {
        env::join_paths(folders).unwrap().into_string().unwrap()
    }

    fn variable(path: Option<&str>, added: Option<&str>) -> (&'static str, String) {
        let folders = [PathBuf::from("/p")];
        let (name, value) = layer_variable(path.map(Into::into), added.map(Into::into), &folders);
        (name, value.into_string().unwrap())
    }

    #[test]
    fn our_folder_is_added_once_and_last() {
        let ours = ours();
        assert_eq!(variable(None, None), ("VK_ADD_LAYER_PATH", ours.clone()));
        assert_eq!(variable(None, Some("/own")), ("VK_ADD_LAYER_PATH", list(&["/own", &ours])));
        assert_eq!(variable(None, Some(&ours)), ("VK_ADD_LAYER_PATH", ours.clone()));
    }

    #[test]
    fn a_users_full_path_is_extended() {
        assert_eq!(variable(Some("/full"), Some("/own")), ("VK_LAYER_PATH", list(&["/full", &ours()])));
        assert_eq!(variable(Some(""), None), ("VK_ADD_LAYER_PATH", ours()));
    }
}
