//! The source of the samples' GLSL: the binary, or the folder that `LVK_SHADERS` names, so that a shader can be changed
//! and tried without a build; or the one that `--hot-reload` names, which is watched too.

use std::cell::RefCell;
use std::path::{Path, PathBuf};
use std::sync::{LazyLock, OnceLock};

use lvk::{Context, Holder, ShaderFiles, ShaderModuleDesc, ShaderModuleHandle};

/// Names a folder with what `shaders/` of the project holds; its texts are taken instead of those in the binary.
pub const VARIABLE: &str = "LVK_SHADERS";

/// The folder that `--hot-reload` names.
static TAKEN: OnceLock<PathBuf> = OnceLock::new();

/// The files that shaders were compiled from, so that their changes are noticed.
static FILES: LazyLock<ShaderFiles> = LazyLock::new(ShaderFiles::new);

/// Takes texts from `folder` from now on. Answers the folder where it is none.
pub(crate) fn set_folder(folder: &Path) -> Result<(), PathBuf> {
    if !folder.is_dir() {
        return Err(folder.to_owned());
    }
    // The first one counts: a program has one command line.
    let _ = TAKEN.set(folder.to_owned());
    Ok(())
}

thread_local! {
    /// The folder that [`with`] names.
    static LENT: RefCell<Option<PathBuf>> = const { RefCell::new(None) };
}

/// Does `work`, for which this thread takes texts from `folder`, whatever else is named: for tests, whose neighbours in the
/// same process keep theirs.
pub fn with<R>(folder: &Path, work: impl FnOnce() -> R) -> R {
    /// Puts back what was there, also where `work` panics.
    struct Restored(Option<PathBuf>);
    impl Drop for Restored {
        fn drop(&mut self) {
            LENT.set(self.0.take());
        }
    }
    let _before = Restored(LENT.replace(Some(folder.to_owned())));
    work()
}

/// The folder that texts are taken from, if it is not the binary.
pub(crate) fn folder() -> Option<PathBuf> {
    let named = || std::env::var_os(VARIABLE).filter(|folder| !folder.is_empty()).map(PathBuf::from);
    LENT.with_borrow(Clone::clone).or_else(|| TAKEN.get().cloned()).or_else(named)
}

/// The files that shaders were compiled from, if a folder is named.
#[cfg(feature = "window")]
pub(crate) fn watched_files() -> Option<ShaderFiles> {
    folder().map(|_| FILES.clone())
}

/// Compiles a stage of `sample`, whose GLSL is the file `<sample>/<debug name>.glsl` of the folder if one is named, and
/// the description's own otherwise.
///
/// # Errors
/// [`Error::File`](lvk::Error::File) when the file cannot be read, [`Error::Shader`](lvk::Error::Shader) when the GLSL is
/// wrong.
pub fn create_module(
    ctx: &Context,
    sample: &str,
    desc: &ShaderModuleDesc<'_>,
) -> lvk::Result<Holder<ShaderModuleHandle>> {
    match folder() {
        None => ctx.create_shader_module(desc),
        Some(folder) => {
            let path = folder.join(sample).join(format!("{}.glsl", desc.debug_name));
            let include_dirs: &[&Path] = &[&folder];
            FILES.create_module(ctx, path, &ShaderModuleDesc { includes: &[], include_dirs, ..*desc })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_is_lent_to_one_thread_until_its_work_is_done() {
        let (outer, inner) = (Path::new("outer"), Path::new("inner"));
        let before = folder();
        with(outer, || {
            assert_eq!(folder().as_deref(), Some(outer));
            with(inner, || assert_eq!(folder().as_deref(), Some(inner)));
            assert_eq!(folder().as_deref(), Some(outer));
            let elsewhere = std::thread::spawn(folder).join().unwrap();
            assert_eq!(elsewhere, before);
            let fails = || with(inner, || std::panic::resume_unwind(Box::new(())));
            assert!(std::panic::catch_unwind(fails).is_err());
            assert_eq!(folder().as_deref(), Some(outer));
        });
        assert_eq!(folder(), before);
    }
}
