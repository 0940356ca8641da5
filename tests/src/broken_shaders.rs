//! Shaders broken on purpose, to show that a test would notice. The test runs in a process of its own, whose samples
//! take their GLSL from a copy of `shaders/` that is changed and restored (`LVK_SHADERS`).
#![expect(clippy::expect_used, reason = "a test that cannot change its shaders has failed")]

use std::fs;
use std::path::{Path, PathBuf};

use image::RgbaImage;
use lvk::{ClearValue, Context, TextureHandle, TextureRange};
use lvk_samples::shader_folder::VARIABLE;

use crate::image_comparison::{ImageSimilarity, Tolerance};
use crate::subprocess::in_subprocess;

/// A change that breaks a shader.
#[derive(Debug, Clone, Copy)]
pub struct Mistake {
    /// Description of the mistake.
    pub what: &'static str,
    /// File below `shaders/`.
    pub file: &'static str,
    /// Text to replace, which the file has once.
    pub right: &'static str,
    /// Replacement.
    pub wrong: &'static str,
}

/// Declares constant lists of [`Mistake`]s: the name of a list, and a row for each of its mistakes, which has the file,
/// the description, and the text that replaces another. `ALL` has all lists.
#[macro_export]
macro_rules! mistakes {
    ($($(#[$doc:meta])* $list:ident: $($file:literal: $what:literal: $right:expr => $wrong:expr;)*)*) => {
        $($(#[$doc])* pub(super) const $list: &[$crate::broken_shaders::Mistake] = &[
            $($crate::broken_shaders::Mistake { what: $what, file: $file, right: $right, wrong: $wrong }),*
        ];)*
        /// All lists.
        const ALL: &[&[$crate::broken_shaders::Mistake]] = &[$($list),*];
    };
}

/// Copy of `shaders/`.
pub struct BrokenShaders {
    folder: PathBuf,
}

impl BrokenShaders {
    /// Runs `body` in a process of its own with a copy of the shaders, and a shader cache of its own for lavapipe; `test` as for
    /// [`in_subprocess`].
    ///
    /// # Panics
    /// As [`in_subprocess`], and when the files cannot be copied.
    pub fn in_subprocess(test: impl Fn(), body: impl FnOnce(&Self)) {
        let folder = tempfile::tempdir().expect("temporary folders can be made");
        let [shaders, compiled] = ["shaders", "compiled"].map(|name| folder.path().join(name));
        copy(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../shaders"), &shaders)
            .expect("the shaders can be copied");
        let variables =
            [(VARIABLE, Some(shaders.as_os_str())), ("MESA_SHADER_CACHE_DIR", Some(compiled.as_os_str()))];
        in_subprocess(test, &variables, || {
            let folder = std::env::var_os(VARIABLE).expect("the parent has named the folder");
            body(&Self { folder: PathBuf::from(folder) });
        });
    }

    /// Breaks the shaders in each way, one after the other, and renders an image that must not be within `tolerance`
    /// of the expected one. The first image, by whole shaders, must be.
    ///
    /// # Panics
    /// When a mistake goes unnoticed, or does not fit its file.
    pub fn assert_each_changes_image(
        &self,
        by: &str,
        expected: &RgbaImage,
        tolerance: &Tolerance,
        mistakes: &[Mistake],
        image: impl Fn() -> RgbaImage,
    ) {
        let whole = ImageSimilarity::measure(&image(), expected);
        eprintln!("{by}, whole: {whole}");
        assert!(whole.is_within(tolerance), "{by}: whole shaders give another image: {whole}");
        let mut complaints = Vec::new();
        for mistake in mistakes {
            let broken = match self.image_with(mistake, &image) {
                Ok(broken) => broken,
                Err(misfit) => {
                    complaints.push(misfit);
                    continue;
                }
            };
            let similarity = ImageSimilarity::measure(&broken, expected);
            eprintln!("{by}, {}: {similarity}", mistake.what);
            if similarity.is_within(tolerance) {
                complaints.push(format!("unnoticed: {}: {similarity}", mistake.what));
            }
        }
        assert!(complaints.is_empty(), "{by}:\n{}", complaints.join("\n"));
    }

    /// Renders the image by shaders with that mistake, or returns why the mistake does not fit its file.
    fn image_with(&self, mistake: &Mistake, image: &impl Fn() -> RgbaImage) -> Result<RgbaImage, String> {
        let Mistake { what, file, right, wrong } = mistake;
        let path = self.folder.join(file);
        let text = fs::read_to_string(&path).expect("the file of a mistake is there");
        let count = text.matches(right).count();
        if count != 1 {
            return Err(format!("{what}: {right} is {count} times in {file}"));
        }
        fs::write(&path, text.replace(right, wrong)).expect("the copy can be written");
        let broken = image();
        fs::write(&path, text).expect("the copy can be written");
        Ok(broken)
    }
}

/// Fills an image with a colour that no sample renders. Memory keeps its contents, so a pixel that a broken shader
/// leaves out could have the colour of an earlier image.
///
/// # Panics
/// When the device fails.
pub fn paint_over(ctx: &Context, image: TextureHandle) {
    let mut cmd = ctx.acquire_command_buffer().expect("a command buffer can be had");
    cmd.clear_texture(image, ClearValue::Color([1.0, 0.0, 1.0, 1.0]), &TextureRange::default())
        .expect("pictures can be cleared");
    let submitted = ctx.submit(cmd).expect("the device works");
    ctx.wait(submitted).expect("the device works");
}

fn copy(from: &Path, to: &Path) -> std::io::Result<()> {
    fs::create_dir_all(to)?;
    for entry in fs::read_dir(from)? {
        let entry = entry?;
        let target = to.join(entry.file_name());
        if entry.file_type()?.is_dir() {
            copy(&entry.path(), &target)?;
        } else {
            fs::copy(entry.path(), target)?;
        }
    }
    Ok(())
}
