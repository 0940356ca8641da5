//! Why the sample cannot render.

use std::path::PathBuf;

use crate::app::loading::Stopped;
use crate::app::run_error::RunError;
use crate::hybrid::HybridError;
use crate::rtx::RtxError;

/// Why the sample cannot render.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LargeSceneError {
    /// The picture or the path is not possible, or `lvk` reported an error.
    #[error(transparent)]
    Rtx(#[from] RtxError),
    /// Nobody waits for it any more.
    #[error(transparent)]
    Stopped(#[from] Stopped),
    /// A street needs something that stands in it.
    #[error("there is no scene to show; name an OBJ file with --scene")]
    NoScenes,
    /// A folder without scenes.
    #[error("no OBJ file in {}; unpack the scenes there (tar -xJf NAME.tar.xz), or name another folder", folder.display())]
    EmptyFolder {
        /// The folder.
        folder: PathBuf,
    },
    /// No folder was named.
    #[error("--archive needs a folder of OBJ files: name one behind it, or in LVK_SCENES")]
    NoFolder,
    /// More triangles than one mesh of this sample holds.
    #[error(
        "{count} triangles are more than the {limit} that this sample puts into one mesh; use --layout instanced, fewer \
         --copies or fewer --triangles"
    )]
    TooManyTriangles {
        /// Triangles that there would be.
        count: u64,
        /// Most triangles.
        limit: u64,
    },
}

impl From<lvk::Error> for LargeSceneError {
    fn from(error: lvk::Error) -> Self {
        Self::Rtx(error.into())
    }
}

impl From<HybridError> for LargeSceneError {
    fn from(error: HybridError) -> Self {
        Self::Rtx(error.into())
    }
}

impl From<LargeSceneError> for RunError {
    fn from(error: LargeSceneError) -> Self {
        match error {
            LargeSceneError::Rtx(error) => error.into(),
            LargeSceneError::Stopped(stopped) => stopped.into(),
            _ => Self::input(error),
        }
    }
}
