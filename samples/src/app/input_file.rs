//! Files that programs read, with the most bytes that are read of each kind.

use std::fs::File;
use std::io::{self, ErrorKind, Read};
use std::path::Path;

use lvk::regular_file;

/// The path of standard input, which `--scene` and `--cameras` accept in place of a file.
const STANDARD_INPUT: &str = "/dev/stdin";

/// Kind of a file that a program reads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FileKind {
    /// Wavefront OBJ.
    Obj,
    /// MTL library.
    Mtl,
    /// Camera file.
    Cameras,
    /// Image file, before it is decoded.
    Picture,
    /// Light from all directions (Radiance HDR).
    Environment,
    /// Acceleration structure that an earlier start kept.
    Structure,
    /// A line of arguments.
    Line,
}

impl FileKind {
    /// Returns the most bytes of such a file. A larger one is not read.
    #[must_use]
    pub fn most_bytes(self) -> u64 {
        match self {
            Self::Obj | Self::Structure => 4 << 30,
            Self::Mtl => 64 << 20,
            Self::Cameras => 1 << 20,
            Self::Picture | Self::Environment => 1 << 30,
            Self::Line => 64 << 10,
        }
    }
}

/// Reads a file, as long as it was when it was opened.
///
/// # Errors
/// Those of the operating system; [`ErrorKind::InvalidInput`] for anything but a regular file, which is not opened;
/// [`ErrorKind::FileTooLarge`] for more than [`FileKind::most_bytes`], with the size and the bound;
/// [`ErrorKind::OutOfMemory`].
pub fn read(path: &Path, kind: FileKind) -> io::Result<Vec<u8>> {
    regular_file::read(path, kind.most_bytes())
}

/// Reads a file that the command line names, as [`read`], or standard input where it names `/dev/stdin`.
///
/// # Errors
/// As [`read`].
pub fn read_named_by_user(path: &Path, kind: FileKind) -> io::Result<Vec<u8>> {
    match cfg!(unix) && path == Path::new(STANDARD_INPUT) {
        true => read_stream(io::stdin().lock(), kind.most_bytes()),
        false => read(path, kind),
    }
}

/// Opens a file that the command line names, as [`read_named_by_user`], to be read as a stream. Returns its size, too, but for
/// standard input.
///
/// # Errors
/// As [`read`]; those about the size of standard input when it is read.
pub fn open_named_by_user(path: &Path, kind: FileKind) -> io::Result<(Box<dyn Read>, Option<u64>)> {
    if cfg!(unix) && path == Path::new(STANDARD_INPUT) {
        return Ok((Box::new(BoundedStream::new(io::stdin().lock(), kind.most_bytes())), None));
    }
    let (file, size) = regular_file::open(path, kind.most_bytes())?;
    Ok((Box::new(file.take(size)), Some(size)))
}

/// Opens a file for reading.
///
/// # Errors
/// As [`read`].
pub fn open(path: &Path, kind: FileKind) -> io::Result<File> {
    regular_file::open(path, kind.most_bytes()).map(|(file, _)| file)
}

/// Reads a stream of unknown length to its end.
fn read_stream(stream: impl Read, most_bytes: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    BoundedStream::new(stream, most_bytes).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// A stream of unknown length that fails when it exceeds a bound.
struct BoundedStream<R> {
    stream: R,
    /// Bytes that may follow.
    left: u64,
    most_bytes: u64,
}

impl<R> BoundedStream<R> {
    fn new(stream: R, most_bytes: u64) -> Self {
        Self { stream, left: most_bytes, most_bytes }
    }
}

impl<R: Read> Read for BoundedStream<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.stream.read(buffer)?;
        self.left = self.left.checked_sub(count as u64).ok_or_else(|| {
            let most_bytes = self.most_bytes;
            let message = format!("it has more than the {most_bytes} bytes that are read of such a file");
            io::Error::new(ErrorKind::FileTooLarge, message)
        })?;
        Ok(count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn size_and_bound_are_told() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.mtl");
        std::fs::write(&path, "newmtl a\n").unwrap();
        assert_eq!(read(&path, FileKind::Mtl).unwrap(), b"newmtl a\n");
        File::options().write(true).open(&path).unwrap().set_len(65 << 20).unwrap();
        for error in [read(&path, FileKind::Mtl).unwrap_err(), open(&path, FileKind::Mtl).unwrap_err()] {
            assert_eq!(error.kind(), ErrorKind::FileTooLarge);
            assert_eq!(
                error.to_string(),
                "it has 68157440 bytes, more than the 67108864 that are read of such a file"
            );
        }
    }

    #[test]
    fn an_endless_stream_is_left_at_the_bound() {
        assert_eq!(read_stream(&b"ab"[..], 2).unwrap(), b"ab");
        let error = read_stream(io::repeat(0), 1_000).unwrap_err();
        assert_eq!(error.to_string(), "it has more than the 1000 bytes that are read of such a file");
    }
}
