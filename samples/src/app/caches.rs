//! The caches of a sample between two starts: compiled shaders, pipelines, the BVHs that
//! software traverses, and acceleration structures.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use lvk::ContextDesc;

use super::run_args::RunArgs;

/// Names the folder; empty, nothing is kept.
pub const VARIABLE: &str = "LVK_CACHE";

/// The places of one sample's caches, in the user's folder for such things.
pub(super) struct Caches {
    pipelines: PathBuf,
    shaders: PathBuf,
    trees: PathBuf,
    structures: PathBuf,
}

impl Caches {
    /// Makes the folder for the sample called `name`; `None`, with a warning, where that fails, and where none is wished for.
    pub(super) fn open(name: &str, args: &RunArgs) -> Option<Self> {
        if args.no_cache {
            return None;
        }
        let usual = || folder(std::env::var_os(VARIABLE), lvk_dev_driver::cache_folder());
        let folder = args.cache.clone().or_else(usual)?;
        match std::fs::create_dir_all(&folder) {
            Ok(()) => Some(Self::below(&folder, name)),
            Err(error) => {
                let folder = lvk::readable_name(&folder);
                let text = format!("nothing is kept for the next start, as {folder} cannot be made: {error}");
                super::print_message("warning", text);
                None
            }
        }
    }

    fn below(folder: &Path, name: &str) -> Self {
        Self {
            pipelines: folder.join(format!("{name}.pipelines")),
            shaders: folder.join("shaders"),
            trees: folder.join("trees"),
            structures: folder.join("structures"),
        }
    }

    /// The folder of structures that samples keep by themselves, which need not exist.
    pub(super) fn structures(&self) -> &Path {
        &self.structures
    }

    /// A description of a context that uses them.
    pub(super) fn desc(caches: Option<&Self>) -> ContextDesc<'_> {
        ContextDesc {
            pipeline_cache: caches.map(|caches| caches.pipelines.as_path()),
            shader_cache: caches.map(|caches| caches.shaders.as_path()),
            tree_cache: caches.map(|caches| caches.trees.as_path()),
            ..ContextDesc::default()
        }
    }
}

/// The folder that the variable names, otherwise the user's; `None` if the variable is empty.
fn folder(named: Option<OsString>, users: Option<PathBuf>) -> Option<PathBuf> {
    match named {
        Some(named) => (!named.is_empty()).then(|| named.into()),
        None => users,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_variable_comes_before_the_folder_of_the_user() {
        let of = |named: Option<&str>, users: Option<&str>| {
            folder(named.map(OsString::from), users.map(PathBuf::from))
        };
        assert_eq!(of(None, Some("/u/lvk")), Some("/u/lvk".into()));
        assert_eq!(of(Some("kept"), Some("/u/lvk")), Some("kept".into()));
        assert_eq!(of(Some(""), Some("/u/lvk")), None, "switched off");
        assert_eq!(of(None, None), None);
    }
}
