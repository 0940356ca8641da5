//! Images as libraries name them.

use std::path::{Path, PathBuf};

use super::byte_names::{find_file, names_in, path_of, unquoted, why_absent};
use crate::app::input_file::FileKind;

/// Folders beside a library that hold its images, where the library names folders of another machine.
const IMAGE_FOLDERS: &[&str] = &["textures"];

/// An image as a library names it, and the folder of that library.
#[derive(Clone)]
pub(super) struct Image {
    folder: PathBuf,
    /// The rest of the line.
    name: Vec<u8>,
}

/// An image that is not found.
#[derive(Debug)]
pub(super) struct Absence {
    /// Path as the library has it.
    pub path: PathBuf,
    /// Reason, for a warning.
    pub why: String,
}

impl Image {
    pub(super) fn new(folder: &Path, name: &[u8]) -> Self {
        Self { folder: folder.into(), name: name.into() }
    }

    /// The file that the name means.
    pub(super) fn find(&self) -> Result<PathBuf, Absence> {
        let named = |name| find_file(&self.folder, unquoted(name), IMAGE_FOLDERS);
        names_in(&self.name).find_map(named).ok_or_else(|| {
            let name: Vec<u8> =
                unquoted(&self.name).iter().map(|b| if *b == b'\\' { b'/' } else { *b }).collect();
            let path = self.folder.join(path_of(&name));
            Absence { why: why_absent(&path, FileKind::Picture), path }
        })
    }
}
