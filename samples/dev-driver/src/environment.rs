//! Telling the Vulkan loader, which reads the environment, where the fetched files are.

use std::env;
use std::ffi::{OsStr, OsString};
use std::path::PathBuf;

use super::prefix::{DRIVER_JSON, LAYER_FOLDER, Part};
use super::settings::Settings;
use super::{Driver, DriverOrigin};

/// Where Mesa keeps compiled shaders; without it, in the user's own cache folder.
const MESA_CACHE: &str = "MESA_SHADER_CACHE_DIR";

/// Sets the variables for `driver` and for layers, in one go and once per process.
///
/// The layer folders are named whether or not they are there yet: the loader skips those that are not, and a
/// layer fetched later is then found without touching the environment again.
pub(super) fn publish(settings: &Settings, driver: &Driver) {
    let (name, value) =
        layer_variable(env::var_os("VK_LAYER_PATH"), env::var_os("VK_ADD_LAYER_PATH"), &settings.folders);
    let prefix = match &driver.origin {
        DriverOrigin::Provisioned { prefix } => Some(prefix),
        DriverOrigin::System => None,
    };
    let keeps_shaders = env::var_os(MESA_CACHE).is_some();
    // SAFETY: changing the environment is unsound only while another thread reads it through the C library.
    // This runs once per process, under the lock of `prepare`, which is documented to come before the first
    // Vulkan call; other threads of this project read the environment through `std` only, which locks.
    unsafe {
        env::set_var(name, value);
        if let Some(prefix) = prefix {
            env::set_var("VK_DRIVER_FILES", prefix.join(DRIVER_JSON));
            if !keeps_shaders {
                env::set_var(MESA_CACHE, prefix.with_file_name("shader_cache"));
            }
        }
    }
}

/// The variable and value that add our layer folders to the user's, which come first. `VK_LAYER_PATH` makes
/// the loader ignore `VK_ADD_LAYER_PATH`, so it is extended where it is set.
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
    for ours in folders.iter().map(|folder| Part::Validation.folder(folder).join(LAYER_FOLDER)) {
        // A folder whose name holds the separator cannot be listed.
        if !all.contains(&ours) && env::join_paths([&ours]).is_ok() {
            all.push(ours);
        }
    }
    (name, env::join_paths(all).unwrap_or(users))
}

#[cfg(test)]
mod tests {
    use super::*;

    const OURS: &str = "/p/validation/explicit_layer.d";

    fn variable(path: Option<&str>, added: Option<&str>) -> (&'static str, String) {
        let folders = [PathBuf::from("/p")];
        let (name, value) = layer_variable(path.map(Into::into), added.map(Into::into), &folders);
        (name, value.into_string().unwrap())
    }

    #[test]
    fn our_folder_is_added_once_and_last() {
        assert_eq!(variable(None, None), ("VK_ADD_LAYER_PATH", OURS.into()));
        assert_eq!(variable(None, Some("/own")), ("VK_ADD_LAYER_PATH", format!("/own:{OURS}")));
        assert_eq!(variable(None, Some(OURS)), ("VK_ADD_LAYER_PATH", OURS.into()));
    }

    #[test]
    fn a_users_full_path_is_extended() {
        assert_eq!(variable(Some("/full"), Some("/own")), ("VK_LAYER_PATH", format!("/full:{OURS}")));
        assert_eq!(variable(Some(""), None), ("VK_ADD_LAYER_PATH", OURS.into()));
    }
}
