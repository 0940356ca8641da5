//! Bytes in memory or in an open file, of which those that are needed are read.

use std::borrow::Cow;
use std::fs::{self, File};
use std::io::{self, ErrorKind, Read, Seek as _, SeekFrom};
use std::path::Path;
use std::sync::{Mutex, PoisonError};

use super::place::shortened_path;
use crate::Problem;

/// Most bytes of a file. GLB can state no more.
const MAX_FILE_BYTES: u64 = 1 << 32;

/// A regular file of bounded size that is open.
#[derive(Debug)]
pub(super) struct OpenFile {
    /// For errors.
    name: String,
    file: Mutex<File>,
    /// Bytes that it had when it was opened.
    length: u64,
}

impl OpenFile {
    /// Opens a regular file of at most `most_bytes` and 4 GiB.
    pub(super) fn open(path: &Path, most_bytes: u64) -> io::Result<Self> {
        // Opening a named pipe would wait for its writer.
        let not_regular = || io::Error::new(ErrorKind::InvalidInput, "it is not a regular file");
        if !fs::metadata(path)?.is_file() {
            return Err(not_regular());
        }
        let file = File::open(path)?;
        let about = file.metadata()?;
        if !about.is_file() {
            return Err(not_regular());
        }
        let most_bytes = most_bytes.min(MAX_FILE_BYTES);
        if about.len() > most_bytes {
            let message =
                format!("it has {} bytes, more than the {most_bytes} that may be read", about.len());
            return Err(io::Error::new(ErrorKind::FileTooLarge, message));
        }
        Ok(Self { name: shortened_path(path), file: Mutex::new(file), length: about.len() })
    }

    /// Bytes of the file.
    pub(super) fn length(&self) -> u64 {
        self.length
    }

    /// All bytes of the file.
    pub(super) fn whole(&self) -> Source<'_> {
        Source::File { file: self, start: 0, length: self.length }
    }

    fn read(&self, start: u64, length: u64) -> io::Result<Vec<u8>> {
        let size = usize::try_from(length).map_err(|_| ErrorKind::OutOfMemory)?;
        let mut bytes = Vec::new();
        bytes.try_reserve_exact(size).map_err(|_| ErrorKind::OutOfMemory)?;
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        file.seek(SeekFrom::Start(start))?;
        if Read::by_ref(&mut *file).take(length).read_to_end(&mut bytes)? < size {
            return Err(io::Error::new(ErrorKind::UnexpectedEof, "it has become shorter meanwhile"));
        }
        Ok(bytes)
    }
}

/// A run of bytes.
#[derive(Debug, Clone, Copy)]
pub(super) enum Source<'a> {
    Memory(&'a [u8]),
    File { file: &'a OpenFile, start: u64, length: u64 },
}

impl<'a> Source<'a> {
    /// Number of bytes.
    pub(super) fn length(&self) -> u64 {
        match self {
            Self::Memory(bytes) => bytes.len() as u64,
            Self::File { length, .. } => *length,
        }
    }

    /// Some of the bytes, or `None` if they are out of range.
    pub(super) fn part(&self, offset: u64, length: u64) -> Option<Self> {
        if offset.checked_add(length)? > self.length() {
            return None;
        }
        match self {
            Self::Memory(bytes) => {
                let (offset, length) = (usize::try_from(offset).ok()?, usize::try_from(length).ok()?);
                bytes.get(offset..offset + length).map(Self::Memory)
            }
            Self::File { file, start, .. } => Some(Self::File { file, start: start + offset, length }),
        }
    }

    /// Reads all bytes. Those in memory are not copied.
    pub(super) fn read(&self) -> Result<Cow<'a, [u8]>, Problem> {
        match *self {
            Self::Memory(bytes) => Ok(Cow::Borrowed(bytes)),
            Self::File { file, start, length } => {
                let bytes = file.read(start, length);
                bytes.map(Cow::Owned).map_err(|source| Problem::File { name: file.name.clone(), source })
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_of_a_file_are_those_of_its_bytes() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("bytes");
        let bytes: Vec<u8> = (0..200).collect();
        fs::write(&path, &bytes).unwrap();
        let file = OpenFile::open(&path, 200).unwrap();
        for source in [file.whole(), Source::Memory(&bytes)] {
            let part = source.part(20, 100).and_then(|part| part.part(5, 3)).unwrap();
            assert_eq!(*part.read().unwrap(), [25, 26, 27]);
            assert_eq!(*source.read().unwrap(), bytes);
            assert!(source.part(200, 0).unwrap().read().unwrap().is_empty());
            assert!(source.part(100, 101).is_none() && source.part(u64::MAX, 2).is_none());
        }
        assert!(OpenFile::open(&path, 199).is_err());
    }

    #[test]
    fn a_file_that_is_cut_off_after_it_was_opened_is_an_error() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("cut");
        fs::write(&path, [1; 64]).unwrap();
        let file = OpenFile::open(&path, u64::MAX).unwrap();
        fs::write(&path, [1; 10]).unwrap();
        assert_eq!(*file.whole().part(0, 10).unwrap().read().unwrap(), [1; 10]);
        let error = file.whole().read().unwrap_err();
        assert!(error.to_string().contains("shorter"), "{error}");
    }

    #[test]
    fn a_folder_and_a_missing_file_are_refused() {
        let folder = std::env::temp_dir();
        for path in [folder.clone(), folder.join("lvk-gltf-no-such-file")] {
            assert!(OpenFile::open(&path, u64::MAX).is_err());
        }
    }
}
