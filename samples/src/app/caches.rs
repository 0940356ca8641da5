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
        let variable = |name| std::env::var_os(name);
        let named = args.cache.clone();
        let usual = || folder(variable(VARIABLE), variable("XDG_CACHE_HOME"), variable("HOME"));
        let folder = named.or_else(usual)?;
        match std::fs::create_dir_all(&folder) {
            Ok(()) => Some(Self::below(&folder, name)),
            Err(error) => {
                let folder = folder.display();
                eprintln!("warning: nothing is kept for the next start, as {folder} cannot be made: {error}");
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

/// The folder by our own variable, by that of the XDG base directories, which counts where it is absolute, or by default.
fn folder(own: Option<OsString>, xdg: Option<OsString>, home: Option<OsString>) -> Option<PathBuf> {
    if let Some(own) = own {
        return (!own.is_empty()).then(|| own.into());
    }
    let absolute = |name: Option<OsString>| name.map(PathBuf::from).filter(|path| path.is_absolute());
    let base = absolute(xdg).or_else(|| Some(absolute(home)?.join(".cache")))?;
    Some(base.join("lvk"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_folder_is_where_users_expect_it() {
        let of = |own: Option<&str>, xdg: Option<&str>, home: Option<&str>| {
            let name = |name: Option<&str>| name.map(OsString::from);
            folder(name(own), name(xdg), name(home))
        };
        assert_eq!(of(None, None, Some("/home/a")), Some("/home/a/.cache/lvk".into()));
        assert_eq!(of(None, Some("/x"), Some("/home/a")), Some("/x/lvk".into()));
        assert_eq!(of(None, Some("x"), Some("/home/a")), Some("/home/a/.cache/lvk".into()), "not absolute");
        assert_eq!(of(Some("kept"), Some("/x"), Some("/home/a")), Some("kept".into()));
        assert_eq!(of(Some(""), Some("/x"), Some("/home/a")), None, "switched off");
        assert_eq!(of(None, None, None), None);
    }
}
