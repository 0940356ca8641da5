//! Where the samples' GLSL comes from: the binary, or the folder that `LVK_SHADERS` names, so that a shader can be changed
//! and tried without a build; or the one that `--hot-reload` names, which is watched too.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use lvk::{Context, Error, Holder, ShaderModuleDesc, ShaderModuleHandle, ShaderSource};

/// Names a folder with what `shaders/` of the project holds; its texts are taken instead of those in the binary.
pub const VARIABLE: &str = "LVK_SHADERS";

/// What `--hot-reload` names.
static TAKEN: OnceLock<PathBuf> = OnceLock::new();

/// Takes texts from `folder` from now on. Answers the folder where it is none.
pub(crate) fn take(folder: &Path) -> Result<(), PathBuf> {
    if !folder.is_dir() {
        return Err(folder.to_owned());
    }
    // The first one counts: a program has one command line.
    let _ = TAKEN.set(folder.to_owned());
    Ok(())
}

/// The folder that texts are taken from, if it is not the binary.
pub(crate) fn folder() -> Option<PathBuf> {
    let named = || std::env::var_os(VARIABLE).filter(|folder| !folder.is_empty()).map(PathBuf::from);
    TAKEN.get().cloned().or_else(named)
}

/// Compiles a stage of `sample`, whose GLSL is the file `<sample>/<debug name>.glsl` of the folder if one is named, and
/// the description's own otherwise.
///
/// # Errors
/// [`Error::InvalidUsage`] when the file cannot be read, [`Error::Shader`] when the GLSL is wrong.
pub fn create_module(
    ctx: &Context,
    sample: &str,
    desc: &ShaderModuleDesc<'_>,
) -> lvk::Result<Holder<ShaderModuleHandle>> {
    match folder() {
        None => ctx.create_shader_module(desc),
        Some(folder) => create_from(ctx, &folder, sample, desc),
    }
}

fn create_from(
    ctx: &Context,
    folder: &Path,
    sample: &str,
    desc: &ShaderModuleDesc<'_>,
) -> lvk::Result<Holder<ShaderModuleHandle>> {
    let path = folder.join(sample).join(format!("{}.glsl", desc.debug_name));
    let text = std::fs::read_to_string(&path).map_err(|error| Error::InvalidUsage {
        object: desc.debug_name.to_owned(),
        message: format!("{}: {error}; {VARIABLE} names a folder like 'shaders'", path.display()),
    })?;
    ctx.create_shader_module(&ShaderModuleDesc {
        source: ShaderSource::Glsl(&text),
        includes: &[],
        include_dirs: &[folder],
        ..*desc
    })
}
