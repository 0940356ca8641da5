//! The GPU time of a child process, by the Vulkan layer of `lvk-gpu-timer`.

use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use super::peer::Failure;

/// The variable that names the layer's library. It enables the layer too.
const LIBRARY_VARIABLE: &str = "LVK_GPU_TIMER";

/// A folder with the description of the layer, in which the Vulkan loader searches.
pub(super) struct GpuTimer {
    folder: tempfile::TempDir,
    library: PathBuf,
}

impl GpuTimer {
    /// Describes the layer, the dynamic library beside this program.
    ///
    /// # Errors
    /// The library was not built, or the folder cannot be written.
    pub(super) fn new() -> Result<Self, Failure> {
        let library = library(&std::env::current_exe()?)?;
        let folder = tempfile::tempdir()?;
        let layers = folder.path().join("vulkan/implicit_layer.d");
        fs::create_dir_all(&layers)?;
        let description = format!(
            r#"{{ "file_format_version": "1.2.1", "layer": {{
                "name": "VK_LAYER_LVK_gpu_timer", "type": "GLOBAL", "library_path": {:?},
                "api_version": "1.4.300", "implementation_version": "1", "description": "Times submissions",
                "enable_environment": {{ "{LIBRARY_VARIABLE}": {:?} }},
                "disable_environment": {{ "LVK_NO_GPU_TIMER": "1" }} }} }}"#,
            library.display().to_string(),
            library.display().to_string(),
        );
        fs::write(layers.join("lvk_gpu_timer.json"), description)?;
        Ok(Self { folder, library })
    }

    /// Puts the layer between a program and its driver. The loader searches the folder of the user's data for layers.
    pub(super) fn enable(&self, command: &mut Command) {
        command.env("XDG_DATA_HOME", self.folder.path()).env(LIBRARY_VARIABLE, &self.library);
    }
}

/// Returns the newest library of the layer in the folders of a program, where cargo puts it.
fn library(program: &Path) -> Result<PathBuf, Failure> {
    let name = format!("{DLL_PREFIX}lvk_gpu_timer{DLL_SUFFIX}");
    let folders =
        program.ancestors().skip(1).take(2).flat_map(|folder| [folder.to_owned(), folder.join("deps")]);
    let found = folders.map(|folder| folder.join(&name)).filter(|path| path.exists());
    let newest = found.max_by_key(|path| path.metadata().and_then(|data| data.modified()).ok());
    Ok(newest.ok_or_else(|| format!("{name} is not beside {}", lvk::readable_name(program)))?)
}

/// Returns the milliseconds in which the GPU worked for this process since the last call. `None` without the layer, without a submission,
/// or where a queue has no timestamps.
///
/// # Errors
/// The library that the environment names is not that of the layer.
pub(super) fn take_busy_time() -> Result<Option<f64>, Failure> {
    let Some(path) = std::env::var_os(LIBRARY_VARIABLE) else { return Ok(None) };
    // SAFETY: the loader has opened the library, and its function has this type.
    let milliseconds = unsafe {
        let library = libloading::Library::new(path)?;
        let take = library.get::<extern "C" fn() -> f64>(lvk_gpu_timer::TAKE_BUSY_TIME.as_bytes())?;
        take()
    };
    Ok((milliseconds >= 0.0).then_some(milliseconds))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_library_of_the_folders_is_taken() {
        let folder = tempfile::tempdir().unwrap();
        let program = folder.path().join("debug/deps/bench");
        fs::create_dir_all(program.parent().unwrap()).unwrap();
        let missing = library(&program).unwrap_err().to_string();
        assert!(missing.contains("lvk_gpu_timer") && missing.contains("is not beside"), "{missing}");
        let beside = program.with_file_name(format!("{DLL_PREFIX}lvk_gpu_timer{DLL_SUFFIX}"));
        fs::write(&beside, "").unwrap();
        assert_eq!(library(&program).unwrap(), beside);
        assert_eq!(library(&folder.path().join("debug/bench")).unwrap(), beside, "of a program above");
    }
}
