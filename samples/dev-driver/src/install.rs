//! Installs a component from unpacked packages: moves the required files into a folder, named by their sonames.

use std::fs;
use std::path::{Path, PathBuf};

use crate::elf;
use crate::error::DownloadError;
use crate::file;
use crate::layer_json;
use crate::layout::{
    CLIENT_LIBRARIES, Component, DRIVER, DRIVER_JSON, KEYBOARD_COMPILER, KEYBOARDS, LAYER, LAYER_FOLDER,
    LOADER, Manifest, RADV, RADV_JSON, SWIFTSHADER, SWIFTSHADER_JSON, X_SERVER,
};

const LIBRARY_FOLDERS: [&str; 3] = ["usr/lib/x86_64-linux-gnu", "lib/x86_64-linux-gnu", "usr/lib/chromium"];

/// Moves the files of `component` from the unpacked packages in `tree` into `folder`, and writes the driver and layer
/// manifests. Returns the component manifest, which the caller writes.
pub(super) fn install(component: Component, tree: &Path, folder: &Path) -> Result<Manifest, DownloadError> {
    for inner in ["lib", "icd.d", LAYER_FOLDER] {
        let path = folder.join(inner);
        file::create_dir_all(&path)?;
    }
    match component {
        Component::Driver => {
            move_library(tree, folder, LOADER)?;
            install_driver(tree, folder, DRIVER, DRIVER_JSON)
        }
        Component::Radv => install_driver(tree, folder, RADV, RADV_JSON),
        Component::Validation => install_validation(tree, folder),
        Component::Display => install_display(tree, folder),
    }
}

/// Installs the driver `library` and its dependencies.
fn install_driver(
    tree: &Path,
    folder: &Path,
    library: &str,
    description: &str,
) -> Result<Manifest, DownloadError> {
    let mut order = load_order(tree, file_name(library))?;
    for name in &order {
        move_library(tree, folder, &format!("lib/{name}"))?;
    }
    if order.pop().as_deref() != Some(file_name(library)) {
        return Err(missing(library));
    }
    let version = driver_version(tree, file_name(description));
    file::write(&folder.join(description), driver_json(library, &version))?;
    Ok(Manifest { preload: order.iter().map(|name| format!("lib/{name}")).collect(), ..Manifest::default() })
}

fn install_validation(tree: &Path, folder: &Path) -> Result<Manifest, DownloadError> {
    move_library(tree, folder, LAYER)?;
    move_library(tree, folder, SWIFTSHADER)?;
    file::write(&folder.join(SWIFTSHADER_JSON), driver_json(SWIFTSHADER, "1.3.0"))?;
    let description = layer_json::describe(&folder.join(LAYER), &format!("../{LAYER}"))?;
    file::write(&folder.join(LAYER_FOLDER).join("VkLayer_khronos_validation.json"), &description)?;
    Ok(Manifest::default())
}

/// Installs the X server and its keymap compiler, which the server must find in its own folder.
fn install_display(tree: &Path, folder: &Path) -> Result<Manifest, DownloadError> {
    let bin = folder.join("bin");
    file::create_dir_all(&bin)?;
    let mut libraries = Vec::new();
    for program in [X_SERVER, KEYBOARD_COMPILER] {
        let from = tree.join("usr").join(program);
        for direct in read_needed(&from)? {
            libraries.extend(load_order(tree, &direct)?);
        }
        file::rename(&from, &folder.join(program))?;
    }
    for name in CLIENT_LIBRARIES {
        libraries.extend(load_order(tree, name)?);
    }
    libraries.sort_unstable();
    libraries.dedup();
    for name in libraries {
        move_library(tree, folder, &format!("lib/{name}"))?;
    }
    let keyboards = tree.join("usr/share/X11").join(KEYBOARDS);
    file::rename(&keyboards, &folder.join(KEYBOARDS))?;
    let server = folder.join(X_SERVER);
    let image = file::read(&server)?;
    let image =
        with_relative_program_folder(image).ok_or_else(|| missing("the folder of xkbcomp in Xvfb"))?;
    file::write(&server, image)?;
    Ok(Manifest::default())
}

/// Replaces the absolute folder of helper programs in the X server's binary by a relative one, as no option sets that folder.
/// The server runs in its own folder and uses no file of the system. Returns `None` if the folder does not occur exactly once.
fn with_relative_program_folder(mut image: Vec<u8>) -> Option<Vec<u8>> {
    const SYSTEM: &[u8] = b"\0/usr/bin\0";
    const OWN: &[u8] = b"\0bin\0\0\0\0\0\0";
    let offsets: Vec<usize> = image
        .windows(SYSTEM.len())
        .enumerate()
        .filter(|(_, bytes)| *bytes == SYSTEM)
        .map(|(at, _)| at)
        .collect();
    let [offset] = offsets[..] else { return None };
    image[offset..offset + OWN.len()].copy_from_slice(OWN);
    Some(image)
}

/// Moves a library to `to` (relative to `folder`). Packages contain most libraries as a link to a file with a longer name. The
/// installed file has the short name, because dependents request that name.
fn move_library(tree: &Path, folder: &Path, to: &str) -> Result<(), DownloadError> {
    let from = find_library(tree, file_name(to)).ok_or_else(|| missing(to))?;
    file::rename(&from, &folder.join(to))
}

/// Returns the file that the library `name` links to; `None` if the packages lack it, or its link leaves `tree`.
fn find_library(tree: &Path, name: &str) -> Option<PathBuf> {
    let tree = tree.canonicalize().ok()?;
    let real = LIBRARY_FOLDERS.iter().find_map(|folder| tree.join(folder).join(name).canonicalize().ok())?;
    real.starts_with(&tree).then_some(real)
}

/// Returns the library `name` and its dependencies in `tree`, dependencies first.
fn load_order(tree: &Path, name: &str) -> Result<Vec<String>, DownloadError> {
    elf::load_order(name, |name| find_library(tree, name).map(|path| read_needed(&path)).transpose())
}

fn read_needed(path: &Path) -> Result<Vec<String>, DownloadError> {
    let image = file::read(path)?;
    let damaged = || DownloadError::Content {
        reason: format!("{} is not an x86-64 library", lvk::readable_name(path)),
    };
    elf::needed_libraries(&image).ok_or_else(damaged)
}

/// Returns the Vulkan version in the packaged driver manifest, whose file name begins with the stem of `name`.
fn driver_version(tree: &Path, name: &str) -> String {
    let stem = name.trim_end_matches(".json");
    let entries = fs::read_dir(tree.join("usr/share/vulkan/icd.d")).into_iter().flatten().flatten();
    let mut own = entries.filter(|entry| entry.file_name().to_string_lossy().starts_with(stem));
    let text = own.next().and_then(|entry| file::text(&entry.path())).unwrap_or_default();
    quoted_value(&text, "api_version").unwrap_or("1.3.0").to_owned()
}

/// Returns the string value of `key` in a flat JSON text.
fn quoted_value<'a>(text: &'a str, key: &str) -> Option<&'a str> {
    let (_, rest) = text.split_once(&format!("\"{key}\""))?;
    let value = rest.trim_start().strip_prefix(':')?.trim_start().strip_prefix('"')?;
    value.split_once('"').map(|(value, _)| value)
}

/// Returns a driver manifest (ICD JSON). A library path with a slash is relative to the manifest's folder.
fn driver_json(library: &str, version: &str) -> String {
    format!(
        "{{\n  \"file_format_version\": \"1.0.0\",\n  \"ICD\": {{\n    \"library_path\": \"../{library}\",\n    \
         \"api_version\": \"{version}\"\n  }}\n}}\n"
    )
}

fn missing(library: &str) -> DownloadError {
    DownloadError::Content { reason: format!("the packages do not contain {}", file_name(library)) }
}

fn file_name(path: &str) -> &str {
    path.rsplit('/').next().unwrap_or(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_version_is_read_from_the_driver_manifest() {
        let text = "{ \"ICD\": { \"api_version\" : \"1.4.305\", \"library_path\": \"x.so\" } }";
        assert_eq!(quoted_value(text, "api_version"), Some("1.4.305"));
        assert_eq!(quoted_value(text, "version"), None);
        assert_eq!(quoted_value("", "api_version"), None);
    }

    #[test]
    fn the_x_server_runs_programs_of_its_own_folder() {
        let image = |middle: &str| [&b"..\0"[..], middle.as_bytes(), b"\0.."].concat();
        let own = with_relative_program_folder(image("/usr/bin")).unwrap();
        assert_eq!(own, image("bin\0\0\0\0\0"));
        assert_eq!(with_relative_program_folder(image("/usr/bin/other")), None);
        assert_eq!(with_relative_program_folder([image("/usr/bin"), image("/usr/bin")].concat()), None);
    }

    #[test]
    fn a_driver_manifest_points_from_its_folder_to_the_library() {
        let text = driver_json(DRIVER, "1.4.305");
        assert_eq!(quoted_value(&text, "library_path"), Some("../lib/libvulkan_lvp.so"));
        assert_eq!(quoted_value(&text, "api_version"), Some("1.4.305"));
    }

    #[cfg(unix)]
    #[test]
    fn links_are_followed_inside_the_packages_only() {
        let folder = tempfile::tempdir().unwrap();
        let libraries = folder.path().join(LIBRARY_FOLDERS[0]);
        fs::create_dir_all(&libraries).unwrap();
        fs::write(libraries.join("libx.so.1.2"), "x").unwrap();
        std::os::unix::fs::symlink("libx.so.1.2", libraries.join("libx.so.1")).unwrap();
        std::os::unix::fs::symlink("/etc/hostname", libraries.join("liby.so.1")).unwrap();
        assert!(find_library(folder.path(), "libx.so.1").unwrap().ends_with("libx.so.1.2"));
        assert_eq!(find_library(folder.path(), "liby.so.1"), None);
        assert_eq!(find_library(folder.path(), "libz.so.1"), None);
    }

    #[test]
    fn an_empty_package_is_an_error_that_names_the_library() {
        let (tree, folder) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        let message = install(Component::Driver, tree.path(), folder.path()).unwrap_err().to_string();
        assert!(message.contains("libvulkan.so.1"), "{message}");
    }
}
