//! From unpacked packages to a folder that holds just what is needed, under the names libraries ask for.

use std::fs;
use std::path::{Path, PathBuf};

use super::elf;
use super::error::FetchError;
use super::layer_description;
use super::prefix::{
    CLIENT_LIBRARIES, DRIVER, DRIVER_JSON, KEYBOARD_COMPILER, KEYBOARDS, LAYER, LAYER_FOLDER, LOADER,
    Manifest, Part, RADV, RADV_JSON, SWIFTSHADER, SWIFTSHADER_JSON, X_SERVER,
};

const LIBRARY_FOLDERS: [&str; 3] = ["usr/lib/x86_64-linux-gnu", "lib/x86_64-linux-gnu", "usr/lib/chromium"];

/// Moves the files of `part` out of the unpacked packages in `tree` into `folder` and writes what describes
/// them, except for the manifest, which is returned.
pub(super) fn assemble(part: Part, tree: &Path, folder: &Path) -> Result<Manifest, FetchError> {
    for inner in ["lib", "icd.d", LAYER_FOLDER] {
        let path = folder.join(inner);
        fs::create_dir_all(&path).map_err(FetchError::file("create", &path))?;
    }
    match part {
        Part::Driver => {
            take(tree, folder, LOADER)?;
            driver(tree, folder, DRIVER, DRIVER_JSON)
        }
        Part::Radv => driver(tree, folder, RADV, RADV_JSON),
        Part::Validation => validation(tree, folder),
        Part::Display => display(tree, folder),
    }
}

/// Takes the driver `library` and all it needs.
fn driver(tree: &Path, folder: &Path, library: &str, description: &str) -> Result<Manifest, FetchError> {
    let needed = |name: &str| match find(tree, name) {
        Some(path) => read_needed(&path).map(Some),
        None => Ok(None),
    };
    let mut order = elf::load_order(file_name(library), needed)?;
    for name in &order {
        take(tree, folder, &format!("lib/{name}"))?;
    }
    if order.pop().as_deref() != Some(file_name(library)) {
        return Err(missing(library));
    }
    let version = driver_version(tree, file_name(description));
    write(&folder.join(description), &driver_description(library, &version))?;
    Ok(Manifest { preload: order.iter().map(|name| format!("lib/{name}")).collect(), ..Manifest::default() })
}

fn validation(tree: &Path, folder: &Path) -> Result<Manifest, FetchError> {
    take(tree, folder, LAYER)?;
    take(tree, folder, SWIFTSHADER)?;
    write(&folder.join(SWIFTSHADER_JSON), &driver_description(SWIFTSHADER, "1.3.0"))?;
    let description = layer_description::of(&folder.join(LAYER), &format!("../{LAYER}"))?;
    write(&folder.join(LAYER_FOLDER).join("VkLayer_khronos_validation.json"), &description)?;
    Ok(Manifest::default())
}

/// The X server and the program that it compiles keyboards with, which it shall find beside itself.
fn display(tree: &Path, folder: &Path) -> Result<Manifest, FetchError> {
    let bin = folder.join("bin");
    fs::create_dir_all(&bin).map_err(FetchError::file("create", &bin))?;
    let needed = |name: &str| match find(tree, name) {
        Some(path) => read_needed(&path).map(Some),
        None => Ok(None),
    };
    let mut libraries = Vec::new();
    for program in [X_SERVER, KEYBOARD_COMPILER] {
        let from = tree.join("usr").join(program);
        for direct in read_needed(&from)? {
            libraries.extend(elf::load_order(&direct, needed)?);
        }
        fs::rename(&from, folder.join(program)).map_err(FetchError::file("move", &from))?;
    }
    for name in CLIENT_LIBRARIES {
        libraries.extend(elf::load_order(name, needed)?);
    }
    libraries.sort_unstable();
    libraries.dedup();
    for name in libraries {
        take(tree, folder, &format!("lib/{name}"))?;
    }
    let keyboards = tree.join("usr/share/X11").join(KEYBOARDS);
    fs::rename(&keyboards, folder.join(KEYBOARDS)).map_err(FetchError::file("move", &keyboards))?;
    let server = folder.join(X_SERVER);
    let image = fs::read(&server).map_err(FetchError::file("read", &server))?;
    let image = with_own_programs(image).ok_or_else(|| missing("the folder of xkbcomp in Xvfb"))?;
    fs::write(&server, image).map_err(FetchError::file("write", &server))?;
    Ok(Manifest::default())
}

/// The X server with the folder of its programs, which no option names, made relative: it runs in its own folder, and no
/// file of the system is asked for. `None` if the folder is not there, or not once.
fn with_own_programs(mut image: Vec<u8>) -> Option<Vec<u8>> {
    const SYSTEM: &[u8] = b"\0/usr/bin\0";
    const OWN: &[u8] = b"\0bin\0\0\0\0\0\0";
    let places: Vec<usize> = image
        .windows(SYSTEM.len())
        .enumerate()
        .filter(|(_, bytes)| *bytes == SYSTEM)
        .map(|(at, _)| at)
        .collect();
    let [place] = places[..] else { return None };
    image[place..place + OWN.len()].copy_from_slice(OWN);
    Some(image)
}

/// Moves the library `to` (relative to `folder`) there. Packages hold most libraries as a link to a file with
/// a longer name; the short one is what others ask for, so it is the one to keep.
fn take(tree: &Path, folder: &Path, to: &str) -> Result<(), FetchError> {
    let from = find(tree, file_name(to)).ok_or_else(|| missing(to))?;
    fs::rename(&from, folder.join(to)).map_err(FetchError::file("move", &from))
}

/// The file behind the library `name`; `None` if the packages do not hold it, or its link leads out of them.
fn find(tree: &Path, name: &str) -> Option<PathBuf> {
    let tree = tree.canonicalize().ok()?;
    let real = LIBRARY_FOLDERS.iter().find_map(|folder| tree.join(folder).join(name).canonicalize().ok())?;
    real.starts_with(&tree).then_some(real)
}

fn read_needed(path: &Path) -> Result<Vec<String>, FetchError> {
    let image = fs::read(path).map_err(FetchError::file("read", path))?;
    let damaged = || FetchError::Content { reason: format!("{} is no x86-64 library", path.display()) };
    elf::needed(&image).ok_or_else(damaged)
}

/// The Vulkan version in the driver's own description, whose `name` distributions lengthen in different ways.
fn driver_version(tree: &Path, name: &str) -> String {
    let stem = name.trim_end_matches(".json");
    let entries = fs::read_dir(tree.join("usr/share/vulkan/icd.d")).into_iter().flatten().flatten();
    let mut own = entries.filter(|entry| entry.file_name().to_string_lossy().starts_with(stem));
    let text = own.next().and_then(|entry| fs::read_to_string(entry.path()).ok()).unwrap_or_default();
    quoted_value(&text, "api_version").unwrap_or("1.3.0").to_owned()
}

/// The string value of `key` in a flat JSON text.
fn quoted_value<'a>(text: &'a str, key: &str) -> Option<&'a str> {
    let (_, rest) = text.split_once(&format!("\"{key}\""))?;
    let value = rest.trim_start().strip_prefix(':')?.trim_start().strip_prefix('"')?;
    value.split_once('"').map(|(value, _)| value)
}

/// A driver description; a library path with a slash is relative to the description's own folder.
fn driver_description(library: &str, version: &str) -> String {
    format!(
        "{{\n  \"file_format_version\": \"1.0.0\",\n  \"ICD\": {{\n    \"library_path\": \"../{library}\",\n    \
         \"api_version\": \"{version}\"\n  }}\n}}\n"
    )
}

fn missing(library: &str) -> FetchError {
    FetchError::Content { reason: format!("{} is not among them", file_name(library)) }
}

fn file_name(path: &str) -> &str {
    path.rsplit('/').next().unwrap_or(path)
}

fn write(path: &Path, text: &str) -> Result<(), FetchError> {
    fs::write(path, text).map_err(FetchError::file("write", path))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_version_is_read_from_the_description() {
        let text = "{ \"ICD\": { \"api_version\" : \"1.4.305\", \"library_path\": \"x.so\" } }";
        assert_eq!(quoted_value(text, "api_version"), Some("1.4.305"));
        assert_eq!(quoted_value(text, "version"), None);
        assert_eq!(quoted_value("", "api_version"), None);
    }

    #[test]
    fn the_x_server_asks_for_programs_in_its_own_folder() {
        let image = |middle: &str| [&b"..\0"[..], middle.as_bytes(), b"\0.."].concat();
        let own = with_own_programs(image("/usr/bin")).unwrap();
        assert_eq!(own, image("bin\0\0\0\0\0"));
        assert_eq!(with_own_programs(image("/usr/bin/other")), None);
        assert_eq!(with_own_programs([image("/usr/bin"), image("/usr/bin")].concat()), None);
    }

    #[test]
    fn a_description_points_from_its_folder_to_the_library() {
        let text = driver_description(DRIVER, "1.4.305");
        assert_eq!(quoted_value(&text, "library_path"), Some("../lib/libvulkan_lvp.so"));
        assert_eq!(quoted_value(&text, "api_version"), Some("1.4.305"));
    }

    #[test]
    fn links_are_followed_inside_the_packages_only() {
        let folder = tempfile::tempdir().unwrap();
        let libraries = folder.path().join(LIBRARY_FOLDERS[0]);
        fs::create_dir_all(&libraries).unwrap();
        fs::write(libraries.join("libx.so.1.2"), "x").unwrap();
        std::os::unix::fs::symlink("libx.so.1.2", libraries.join("libx.so.1")).unwrap();
        std::os::unix::fs::symlink("/etc/hostname", libraries.join("liby.so.1")).unwrap();
        assert!(find(folder.path(), "libx.so.1").unwrap().ends_with("libx.so.1.2"));
        assert_eq!(find(folder.path(), "liby.so.1"), None);
        assert_eq!(find(folder.path(), "libz.so.1"), None);
    }

    #[test]
    fn an_empty_package_is_an_error_that_names_the_library() {
        let (tree, folder) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        let message = assemble(Part::Driver, tree.path(), folder.path()).unwrap_err().to_string();
        assert!(message.contains("libvulkan.so.1"), "{message}");
    }
}
