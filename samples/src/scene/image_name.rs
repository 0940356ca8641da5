//! Images as libraries name them.

use std::path::PathBuf;
use std::rc::Rc;

use super::byte_names::{FileFinder, names_in, path_of, unquoted, why_absent};
use crate::app::input_file::FileKind;

/// Folders beside a library that hold its images, where the library names folders of another machine. Archives of models
/// often have `source` beside `textures`.
const IMAGE_FOLDERS: &[&str] = &["textures", "../textures"];

/// An image as a library names it.
#[derive(Clone)]
pub(super) struct Image {
    /// The folder of the library, then that of the OBJ file.
    folders: Rc<[PathBuf; 2]>,
    finder: Rc<FileFinder>,
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
    pub(super) fn new(folders: &Rc<[PathBuf; 2]>, finder: &Rc<FileFinder>, name: &[u8]) -> Self {
        Self { folders: folders.clone(), finder: finder.clone(), name: name.into() }
    }

    /// The file that the name means.
    pub(super) fn find(&self) -> Result<PathBuf, Absence> {
        let folders = self.folders.each_ref().map(|folder| folder.as_path());
        let named = |name| self.finder.find(&folders, unquoted(name), IMAGE_FOLDERS);
        names_in(&self.name).find_map(named).ok_or_else(|| {
            let name: Vec<u8> =
                unquoted(&self.name).iter().map(|b| if *b == b'\\' { b'/' } else { *b }).collect();
            let path = folders[0].join(path_of(&name));
            Absence { why: why_absent(&path, FileKind::Picture), path }
        })
    }
}
