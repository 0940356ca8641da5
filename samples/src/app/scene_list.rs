//! The list of scenes: the built-in one and the OBJ files in a folder.

use std::path::{Path, PathBuf};

use lvk::readable_name;

/// Environment variable that names the folder of scenes.
pub const FOLDER_VARIABLE: &str = "LVK_SCENES";

/// Name of the scene made by code.
pub const BUILT_IN: &str = "courtyard";

/// Depth of folders that are searched for scenes.
const DEPTH: u32 = 3;

/// A scene that was found.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct SceneFile {
    /// The file's stem.
    pub name: String,
    /// The file.
    pub path: PathBuf,
    /// Bytes of the file.
    pub bytes: u64,
}

/// The OBJ files in `folder` and the folders in it, three levels deep, by name. Folders that cannot be read count as
/// empty.
#[must_use]
pub fn find(folder: &Path) -> Vec<SceneFile> {
    let mut found = Vec::new();
    collect(folder, DEPTH, &mut found);
    found.sort();
    found
}

/// The folder that [`FOLDER_VARIABLE`] names.
#[must_use]
pub fn folder() -> Option<PathBuf> {
    std::env::var_os(FOLDER_VARIABLE).filter(|folder| !folder.is_empty()).map(PathBuf::from)
}

/// Returns the text of `--list-scenes`: the built-in scene, and those in `folder`, else in that of [`FOLDER_VARIABLE`].
#[must_use]
pub fn listing(folder: Option<&Path>) -> String {
    let folder =
        folder.filter(|folder| !folder.as_os_str().is_empty()).map(Path::to_owned).or_else(self::folder);
    let mut lines = vec![format!("{BUILT_IN}  built in: a sunny courtyard made by code; the default")];
    match folder {
        None => lines.push(format!("for scenes in a folder: --list-scenes FOLDER, or set {FOLDER_VARIABLE}")),
        Some(folder) => {
            let found = find(&folder);
            if found.is_empty() {
                lines.push(format!("no OBJ file in {}", readable_name(&folder)));
            }
            lines.extend(found.iter().map(|scene| {
                format!(
                    "{}  {} ({:.1} MB)",
                    readable_name(&scene.name),
                    readable_name(&scene.path),
                    scene.bytes as f64 / 1e6
                )
            }));
        }
    }
    lines.join("\n")
}

/// The file that `wish` means: itself, or, for a name without extension that is no file, the scene of that name in
/// `folder`.
#[must_use]
pub fn resolve(wish: &Path, folder: Option<&Path>) -> PathBuf {
    let is_name = wish.extension().is_none() && wish.components().count() == 1 && !wish.exists();
    let named = |folder: &Path| find(folder).into_iter().find(|scene| Path::new(&scene.name) == wish);
    let found = if is_name { folder.and_then(named) } else { None };
    found.map_or_else(|| wish.to_owned(), |scene| scene.path)
}

fn collect(folder: &Path, depth: u32, found: &mut Vec<SceneFile>) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    for path in entries.flatten().map(|entry| entry.path()) {
        let is_obj = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("obj"));
        match std::fs::metadata(&path) {
            Ok(data) if data.is_dir() && depth > 0 => collect(&path, depth - 1, found),
            Ok(data) if data.is_file() && is_obj => {
                let name =
                    path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
                found.push(SceneFile { name, path, bytes: data.len() });
            }
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scenes_are_listed_by_folder_and_by_name() {
        let folder = tempfile::tempdir().unwrap();
        let deep = folder.path().join("kitchen/kitchen");
        std::fs::create_dir_all(&deep).unwrap();
        for file in ["kitchen/kitchen/kitchen.obj", "teapot.OBJ", "kitchen/kitchen/kitchen.mtl"] {
            std::fs::write(folder.path().join(file), "v 0 0 0\n").unwrap();
        }
        let names: Vec<_> = find(folder.path()).into_iter().map(|scene| scene.name).collect();
        assert_eq!(names, ["kitchen", "teapot"]);
        let listing = listing(Some(folder.path()));
        assert!(listing.starts_with("courtyard  ") && listing.contains("kitchen.obj"), "{listing}");
        let found = resolve(Path::new("kitchen"), Some(folder.path()));
        assert_eq!(found, deep.join("kitchen.obj"));
        for other in ["sponza", "kitchen.obj", "a/kitchen"] {
            assert_eq!(resolve(Path::new(other), Some(folder.path())), Path::new(other));
        }
    }

    #[test]
    fn a_folder_without_scenes_says_so() {
        let folder = tempfile::tempdir().unwrap();
        assert!(listing(Some(folder.path())).contains("no OBJ file"));
    }
}
