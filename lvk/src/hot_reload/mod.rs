//! Shaders that are compiled anew when their files change.

mod shader_files;

use std::fmt;
use std::ops::Deref;
use std::time::Duration;

use crate::context::Context;
use crate::error::Result;

pub use shader_files::ShaderFiles;

type Build<T> = Box<dyn FnMut(&Context, &ShaderFiles) -> Result<T> + Send>;

/// Pipelines, or any other value, built from files of shaders, and built anew when one of the files changes.
///
/// The value derefs to `T`: a holder of a pipeline, or a struct of several. All of it is replaced, or nothing. The
/// files are those that the build has read through [`ShaderFiles::create_module`], with their includes. Changes are
/// noticed by the times and lengths of files; there is no watcher thread.
///
/// ```no_run
/// use lvk::*;
///
/// # fn frame(cmd: &mut CommandBuffer, ctx: &Context) -> Result<()> {
/// let mut blur = Reloadable::new(ctx, |ctx, files| {
///     let module = files.create_module(
///         ctx,
///         "shaders/blur.comp.glsl",
///         &ShaderModuleDesc { stage: ShaderStage::Compute, debug_name: "blur", ..Default::default() },
///     )?;
///     ctx.create_compute_pipeline(&ComputePipelineDesc {
///         module: Some(*module),
///         debug_name: "blur",
///         ..Default::default()
///     })
/// })?;
/// // In each frame:
/// match blur.poll() {
///     Ok(true) => println!("blur is compiled anew"),
///     Ok(false) => {}
///     Err(error) => eprintln!("the old blur stays: {error}"),
/// }
/// cmd.bind_compute_pipeline(**blur)?;
/// # Ok(()) }
/// ```
pub struct Reloadable<T> {
    value: T,
    files: ShaderFiles,
    build: Build<T>,
    ctx: Context,
}

impl<T> Reloadable<T> {
    /// Builds the value. `build` runs again for each reload.
    ///
    /// # Errors
    /// Those of `build`.
    pub fn new(
        ctx: &Context,
        mut build: impl FnMut(&Context, &ShaderFiles) -> Result<T> + Send + 'static,
    ) -> Result<Self> {
        let files = ShaderFiles::new();
        let value = build(ctx, &files)?;
        Ok(Self { value, files, build: Box::new(build), ctx: ctx.clone() })
    }

    /// Sets the least time between two checks of the files. The default is 300 milliseconds.
    #[must_use]
    pub fn with_period(self, period: Duration) -> Self {
        self.files.set_period(period);
        self
    }

    /// Builds the value anew if a file has changed. Returns true if the value was replaced. Call it once in each frame:
    /// it checks the files only a few times a second.
    ///
    /// # Errors
    /// Those of the build, once for each change. The old value stays, and the next change of a file leads to the next
    /// build. This includes a file that comes back, or an include that was missing.
    pub fn poll(&mut self) -> Result<bool> {
        if !self.files.changed() {
            return Ok(false);
        }
        self.reload()?;
        Ok(true)
    }

    /// Builds the value anew, whether or not a file has changed.
    ///
    /// # Errors
    /// Those of the build. The old value stays.
    pub fn reload(&mut self) -> Result<()> {
        let read = self.files.sibling();
        match (self.build)(&self.ctx, &read) {
            Ok(value) => {
                self.value = value;
                self.files = read;
                Ok(())
            }
            Err(error) => {
                self.files.add(&read);
                Err(error)
            }
        }
    }

    /// Returns the files that are checked.
    pub fn files(&self) -> &ShaderFiles {
        &self.files
    }
}

impl<T> Deref for Reloadable<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.value
    }
}

impl<T: fmt::Debug> fmt::Debug for Reloadable<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Reloadable")
            .field("value", &self.value)
            .field("files", &self.files)
            .finish_non_exhaustive()
    }
}
