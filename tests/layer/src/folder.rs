//! A folder in which the loader finds a layer.

use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::{Map, Value, json};

/// An implicit layer of a project, for the file by which the loader knows it.
#[derive(Debug, Clone, Copy)]
pub struct LayerDescription<'a> {
    /// Name of the layer, as `VK_LAYER_LVK_faults`.
    pub name: &'a str,
    /// The purpose of the layer, for tools that list layers.
    pub description: &'a str,
    /// Name of the library without prefix and suffix, as `lvk_faults`. It lies beside the running program, where cargo puts it.
    pub library: &'a str,
    /// Environment variable that enables the layer. Its value is the path of the library.
    pub enabled_by: &'a str,
    /// Environment variable that disables the layer.
    pub disabled_by: &'a str,
    /// Commands before there is an instance, and the layer's functions for them.
    pub pre_instance_functions: &'a [(&'a str, &'a str)],
}

/// A folder with the description of a layer, in which the Vulkan loader searches.
#[derive(Debug)]
pub struct LayerFolder {
    folder: tempfile::TempDir,
    library: PathBuf,
    enabled_by: String,
}

impl LayerFolder {
    /// Describes a layer.
    ///
    /// # Errors
    /// Those of files; `NotFound` where the library was not built.
    pub fn new(layer: &LayerDescription<'_>) -> io::Result<Self> {
        let library = library(&std::env::current_exe()?, layer.library)?;
        let folder = tempfile::tempdir()?;
        let layers = folder.path().join("vulkan/implicit_layer.d");
        fs::create_dir_all(&layers)?;
        let mut described = json!({
            "name": layer.name,
            "type": "GLOBAL",
            "library_path": library.to_string_lossy(),
            "api_version": "1.4.300",
            "implementation_version": "1",
            "description": layer.description,
            "enable_environment": { layer.enabled_by: library.to_string_lossy() },
            "disable_environment": { layer.disabled_by: "1" },
        });
        if !layer.pre_instance_functions.is_empty() {
            let functions = layer.pre_instance_functions.iter();
            described["pre_instance_functions"] = functions
                .map(|(command, function)| ((*command).to_owned(), Value::from(*function)))
                .collect::<Map<_, _>>()
                .into();
        }
        let file = json!({ "file_format_version": "1.2.1", "layer": described });
        fs::write(layers.join(format!("{}.json", layer.library)), file.to_string())?;
        Ok(Self { folder, library, enabled_by: layer.enabled_by.to_owned() })
    }

    /// Puts the layer between a program and its driver. The loader searches the folder of the user's data for layers, which is replaced.
    pub fn enable(&self, command: &mut Command) {
        command.env("XDG_DATA_HOME", self.folder.path()).env(&self.enabled_by, &self.library);
    }
}

/// Returns the newest library of this name in the folders of a program, where cargo puts it.
fn library(program: &Path, name: &str) -> io::Result<PathBuf> {
    let name = format!("{DLL_PREFIX}{name}{DLL_SUFFIX}");
    let folders =
        program.ancestors().skip(1).take(2).flat_map(|folder| [folder.to_owned(), folder.join("deps")]);
    let found = folders.map(|folder| folder.join(&name)).filter(|path| path.exists());
    let newest = found.max_by_key(|path| path.metadata().and_then(|data| data.modified()).ok());
    newest.ok_or_else(|| {
        let why = format!("{name} is not beside {}; build the workspace", program.display());
        io::Error::new(io::ErrorKind::NotFound, why)
    })
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]
mod tests {
    use super::*;
    use std::time::{Duration, SystemTime};

    #[test]
    fn the_newest_library_of_the_folders_is_taken() {
        let folder = tempfile::tempdir().unwrap();
        let program = folder.path().join("debug/deps/bench");
        fs::create_dir_all(program.parent().unwrap()).unwrap();
        let missing = library(&program, "a_layer").unwrap_err().to_string();
        assert!(missing.contains("a_layer") && missing.contains("is not beside"), "{missing}");
        let file = format!("{DLL_PREFIX}a_layer{DLL_SUFFIX}");
        let [beside, above] = [program.with_file_name(&file), folder.path().join("debug").join(&file)];
        let write = |path: &Path, age| {
            let time = SystemTime::now() - Duration::from_secs(age);
            fs::File::create(path).unwrap().set_modified(time).unwrap();
        };
        write(&beside, 20);
        for program in [program.clone(), folder.path().join("debug/bench")] {
            assert_eq!(library(&program, "a_layer").unwrap(), beside);
        }
        write(&above, 10);
        assert_eq!(library(&program, "a_layer").unwrap(), above);
        write(&beside, 0);
        assert_eq!(library(&program, "a_layer").unwrap(), beside);
    }
}
