//! Errors of a sample's program.

use super::interrupt;
use super::png::PngError;
use super::sample_error::SampleError;
use crate::scene::SceneError;
use lvk_dev_driver::DriverError;

/// Errors of a sample's program.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RunError {
    /// Wrong arguments or input.
    #[error("{0}")]
    Input(Box<dyn std::error::Error + Send + Sync>),
    /// Trouble with the device.
    #[error("{0}")]
    Device(Box<dyn std::error::Error + Send + Sync>),
    /// `--rt query`, and no device has what that asks for.
    #[error(
        "no Vulkan device has what --rt query requires: {reasons}; --rt software needs no ray queries of the device"
    )]
    NoRayQueries {
        /// Each device with what it lacks.
        reasons: String,
    },
    /// The sample cannot render.
    #[error(transparent)]
    Sample(#[from] SampleError),
    /// Loading was stopped before the sample was ready.
    #[error(transparent)]
    Stopped(#[from] super::loading::Stopped),
    /// The scene could not be loaded.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The picture could not be written.
    #[error(transparent)]
    Png(#[from] PngError),
    /// No usable Vulkan driver.
    #[error(transparent)]
    Driver(#[from] DriverError),
    /// A range of frames needs a name for each.
    #[error(
        "--out {}: a sequence needs # in the name, as frame_####.png, for the frames' numbers",
        lvk::readable_name(name)
    )]
    NoNumber {
        /// The name as given.
        name: String,
    },
    /// A single picture has no number.
    #[error(
        "--out {} names a sequence, for which --frames is a range, as --frames 0..240",
        lvk::readable_name(name)
    )]
    NoSequence {
        /// The name as given.
        name: String,
    },
    /// A window shows its frames as they come.
    #[error("--frames with --window is a number of frames to show, as --frames 100, and no range")]
    SequenceInWindow,
    /// The folder of shaders does not exist.
    #[error(
        "--hot-reload {}: no such folder; name one like 'shaders' of the project",
        lvk::readable_name(folder)
    )]
    NoShaders {
        /// The folder as given.
        folder: std::path::PathBuf,
    },
    /// No window can be opened.
    #[error("no window can be opened: {reason}; without --window the sample writes its picture")]
    NoWindow {
        /// Error of the window system.
        reason: String,
    },
    /// The window system gave the window no other size.
    #[error("--resized: the window did not get this size; leave the option out")]
    WindowKeepsSize,
    /// The program has no windows.
    #[error(
        "--window: this program was built without windows; build it with them by \
         `cargo run --release --features window --bin {name} -- --window`"
    )]
    BuiltWithoutWindows {
        /// Name of the program.
        name: String,
    },
    /// The window is gone, though it was not closed.
    #[error("{0}")]
    WindowLost(lvk::Error),
    /// The window holds its pixels in a way that no picture is made of.
    #[error(
        "no screenshot of a window whose format is {format:?}; without --window the sample writes its picture"
    )]
    NoScreenshot {
        /// The format.
        format: lvk::Format,
    },
    /// A sequence cannot be resumed that is none.
    #[error("--resume is for sequences, as --frames 0..240 --out frame_####.png")]
    NothingToResume,
    /// The validation layer was not silent.
    #[error("validation reported {}", crate::app::counted(*.0, "message"))]
    Validation(usize),
    /// Shaders have used wrong indices of bindless arrays, or textures that commands do not declare.
    #[error("shaders have {} of bindless arrays", crate::app::counted(*.0, "index fault"))]
    IndexFaults(usize),
    /// Ctrl-C, or the request of a batch system.
    #[error("interrupted after {done} of {count} frames; every picture written is whole{hint}")]
    Interrupted {
        /// Frames that are done.
        done: u32,
        /// Frames that were asked for.
        count: u32,
        /// The command that continues.
        hint: &'static str,
    },
}

impl RunError {
    /// Something the user can mend by other arguments or input.
    pub fn input(error: impl std::error::Error + Send + Sync + 'static) -> Self {
        Self::Input(Box::new(error))
    }

    /// Trouble with the device.
    pub fn device(error: impl std::error::Error + Send + Sync + 'static) -> Self {
        Self::Device(Box::new(error))
    }

    /// No window can be opened.
    #[cfg(feature = "window")]
    pub(super) fn window(error: &dyn std::error::Error) -> Self {
        Self::NoWindow { reason: error.to_string() }
    }

    /// The program's exit status: 2 when the user can mend it by other arguments or input, 130 after Ctrl-C, 1 for
    /// trouble with the device.
    #[must_use]
    pub fn status(&self) -> u8 {
        match self {
            Self::Input(_) | Self::Scene(_) | Self::Png(_) | Self::Driver(DriverError::Variable { .. }) => 2,
            Self::NoNumber { .. } | Self::NoSequence { .. } | Self::NothingToResume => 2,
            Self::SequenceInWindow | Self::NoShaders { .. } | Self::BuiltWithoutWindows { .. } => 2,
            Self::Sample(error) => error.status(),
            Self::Interrupted { .. } | Self::Stopped(_) => interrupt::STATUS,
            Self::Device(_) | Self::NoRayQueries { .. } | Self::NoWindow { .. } => 1,
            Self::NoScreenshot { .. } | Self::WindowLost(_) | Self::WindowKeepsSize => 1,
            Self::Driver(_) | Self::Validation(_) | Self::IndexFaults(_) => 1,
        }
    }
}

#[cfg(feature = "window")]
impl From<lvk_egui::Error> for RunError {
    fn from(error: lvk_egui::Error) -> Self {
        match error {
            lvk_egui::Error::Lvk(error) => error.into(),
            error => Self::device(error),
        }
    }
}

impl From<lvk::Error> for RunError {
    fn from(error: lvk::Error) -> Self {
        match error {
            lvk::Error::SurfaceLost { .. } => Self::WindowLost(error),
            error => Self::device(error),
        }
    }
}
