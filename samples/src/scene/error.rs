//! Errors of loading a scene.

use std::path::PathBuf;

use lvk::{readable_line, readable_name};

/// Errors of loading a scene. Every message names the file and says what to change.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// The load was cancelled.
    #[error(transparent)]
    Stopped(#[from] crate::app::loading::Stopped),
    /// The file does not exist.
    #[error("no such file: {}", readable_name(path))]
    NotFound {
        /// The path as given.
        path: PathBuf,
    },
    /// The file exists but cannot be read.
    #[error("cannot read {}: {source}", readable_name(path))]
    Unreadable {
        /// The path as given.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The content is not a Wavefront OBJ.
    #[error("{} is not a Wavefront OBJ: {why}", readable_name(path))]
    NotObj {
        /// The path as given.
        path: PathBuf,
        /// The feature that identifies the format.
        why: &'static str,
    },
    /// A line cannot be understood.
    #[error("{}:{line}: {}", readable_name(path), readable_line(what))]
    BadLine {
        /// The path as given.
        path: PathBuf,
        /// Line number, from 1.
        line: usize,
        /// The error.
        what: String,
    },
    /// A position that a face uses is NaN or infinite.
    #[error(
        "{}:{line}: the position is not finite (NaN or infinity), and a face uses it; export the mesh again",
        readable_name(path)
    )]
    NotFinite {
        /// The path as given.
        path: PathBuf,
        /// Line number, from 1.
        line: usize,
    },
    /// A face names a vertex, texture coordinate or normal that the file does not have.
    #[error("{}:{line}: a face uses {what} {index}, but the file has {count}", readable_name(path))]
    IndexOutOfRange {
        /// The path as given.
        path: PathBuf,
        /// Line number, from 1.
        line: usize,
        /// `vertex`, `texture coordinate` or `normal`.
        what: &'static str,
        /// The number in the file: from 1, or negative and relative.
        index: i64,
        /// Number in the file.
        count: usize,
    },
    /// The scene has nothing to draw.
    #[error("{} has no triangle with an area ({degenerate} without); nothing to draw", readable_name(path))]
    Empty {
        /// The path as given.
        path: PathBuf,
        /// Triangles that were dropped because they have no area.
        degenerate: usize,
    },
    /// More vertices or triangles than 32-bit indices reach.
    #[error("{} has more than {limit} vertices or triangles; split it", readable_name(path))]
    TooLarge {
        /// The path as given.
        path: PathBuf,
        /// The largest count.
        limit: u32,
    },
    /// The scale is zero, negative or not finite.
    #[error("the scale {scale} is not usable: give a positive number")]
    BadScale {
        /// The scale as given.
        scale: f32,
    },
    /// A camera file is wrong. It consists of lines `scene NAME x y z` (the point light's position), each
    /// followed by `sun x y z` where the sun shines (the direction towards it), and by one to five lines `at ex ey ez tx ty tz fov` (eye, target, vertical field of view in
    /// degrees) or `dir ex ey ez dx dy dz fov` (eye, direction); `#` starts a comment.
    #[error(
        "{}:{line}: {} (expected `scene NAME x y z`, then `sun x y z`, `at` or `dir` with 7 numbers)",
        readable_name(path),
        readable_line(what)
    )]
    CameraFile {
        /// The path as given.
        path: PathBuf,
        /// Line number, from 1; 0 when the whole file is meant.
        line: usize,
        /// The error.
        what: String,
    },
}

impl SceneError {
    /// Turns an error of setup or reading `path` into the matching variant.
    pub(super) fn from_io(path: &std::path::Path, source: std::io::Error) -> Self {
        match source.kind() {
            std::io::ErrorKind::NotFound => SceneError::NotFound { path: path.into() },
            _ => SceneError::Unreadable { path: path.into(), source },
        }
    }
}
