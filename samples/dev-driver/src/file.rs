//! File operations whose errors name the file.

use std::fs::{self, File};
use std::path::Path;

use lvk::regular_file;

use crate::error::DownloadError;

/// Most bytes of a library that are read.
const MAX_BYTES: u64 = 1 << 30;
/// Most bytes of a text that are read.
const MAX_TEXT_BYTES: u64 = 1 << 20;

/// Creates `folder` and its parents.
pub(super) fn create_dir_all(folder: &Path) -> Result<(), DownloadError> {
    fs::create_dir_all(folder).map_err(DownloadError::file("create", folder))
}

/// Opens the file that locks `folder`, and creates it if it does not exist.
pub(super) fn open_lock(folder: &Path) -> Result<File, DownloadError> {
    let path = folder.join("lock");
    let opened = File::options().read(true).write(true).create(true).truncate(false).open(&path);
    opened.map_err(DownloadError::file("create", &path))
}

/// Writes `text` to the file `path`.
pub(super) fn write(path: &Path, text: impl AsRef<[u8]>) -> Result<(), DownloadError> {
    fs::write(path, text).map_err(DownloadError::file("write", path))
}

/// Moves the file or folder `from` to `to`.
pub(super) fn rename(from: &Path, to: &Path) -> Result<(), DownloadError> {
    fs::rename(from, to).map_err(DownloadError::file("move", from))
}

/// Reads the file `path`, a regular one.
pub(super) fn read(path: &Path) -> Result<Vec<u8>, DownloadError> {
    regular_file::read(path, MAX_BYTES).map_err(DownloadError::file("read", path))
}

/// Returns the text of the file `path`, a regular one; `None` if it cannot be read.
pub(super) fn text(path: &Path) -> Option<String> {
    regular_file::read_text(path, MAX_TEXT_BYTES).ok()
}
