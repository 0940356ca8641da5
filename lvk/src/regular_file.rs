//! Reads regular files of a known size: never a pipe that waits for a writer, and never a device without an end.

use std::fs::{File, Metadata};
use std::io::{self, ErrorKind, Read as _};
use std::path::Path;

/// Opens a file of at most `most_bytes` for reading. Returns the number of its bytes, too.
///
/// # Errors
/// Those of the operating system; [`ErrorKind::InvalidInput`] for anything but a regular file, which is not opened;
/// [`ErrorKind::FileTooLarge`] for a larger file.
pub fn open(path: &Path, most_bytes: u64) -> io::Result<(File, u64)> {
    // Opening a named pipe would wait for its writer.
    check_kind(&std::fs::metadata(path)?)?;
    let file = File::open(path)?;
    let opened = file.metadata()?;
    check_kind(&opened)?;
    let size = opened.len();
    if size > most_bytes {
        let message = format!("it has {size} bytes, more than the {most_bytes} that are read of such a file");
        return Err(io::Error::new(ErrorKind::FileTooLarge, message));
    }
    Ok((file, size))
}

/// Reads a file of at most `most_bytes`, as long as it was when it was opened.
///
/// # Errors
/// As [`open`]; [`ErrorKind::OutOfMemory`].
pub fn read(path: &Path, most_bytes: u64) -> io::Result<Vec<u8>> {
    let (file, size) = open(path, most_bytes)?;
    let mut bytes = Vec::new();
    let capacity = usize::try_from(size).map_err(|_| ErrorKind::OutOfMemory)?;
    bytes.try_reserve_exact(capacity).map_err(|_| ErrorKind::OutOfMemory)?;
    file.take(size).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// Reads a file as [`read`] does, and returns its text.
///
/// # Errors
/// As [`read`]; [`ErrorKind::InvalidData`] for bytes that are no UTF-8.
pub fn read_text(path: &Path, most_bytes: u64) -> io::Result<String> {
    let not_text = |_| io::Error::new(ErrorKind::InvalidData, "it is not text in UTF-8");
    String::from_utf8(read(path, most_bytes)?).map_err(not_text)
}

/// Checks that a path names a regular file.
///
/// # Errors
/// [`ErrorKind::InvalidInput`], with the kind of what it names.
pub fn check_kind(about: &Metadata) -> io::Result<()> {
    match about.is_file() {
        true => Ok(()),
        false => Err(io::Error::new(ErrorKind::InvalidInput, format!("it is {}, no file", kind(about)))),
    }
}

/// Returns what a path names, with an article.
fn kind(about: &Metadata) -> &'static str {
    #[cfg(unix)]
    {
        use std::os::unix::fs::FileTypeExt as _;
        let kind = about.file_type();
        if kind.is_fifo() {
            return "a named pipe";
        } else if kind.is_socket() {
            return "a socket";
        }
    }
    if about.is_dir() { "a directory" } else { "a device" }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_up_to_the_bound_are_read_whole() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        std::fs::write(&path, "twelve bytes").unwrap();
        assert_eq!(read(&path, 12).unwrap(), b"twelve bytes");
        assert_eq!(read_text(&path, u64::MAX).unwrap(), "twelve bytes");
        let error = read(&path, 11).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::FileTooLarge);
        assert_eq!(error.to_string(), "it has 12 bytes, more than the 11 that are read of such a file");
        std::fs::write(&path, b"\xff").unwrap();
        assert_eq!(read_text(&path, 10).unwrap_err().to_string(), "it is not text in UTF-8");
        assert_eq!(read(&folder.path().join("absent"), 9).unwrap_err().kind(), ErrorKind::NotFound);
    }

    #[test]
    fn a_huge_file_without_contents_is_refused_by_its_size() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("sparse");
        std::fs::File::create(&path).unwrap().set_len(1 << 40).unwrap();
        assert_eq!(read(&path, 1 << 30).unwrap_err().kind(), ErrorKind::FileTooLarge);
    }

    #[test]
    fn a_directory_is_no_file() {
        let folder = tempfile::tempdir().unwrap();
        let error = read(folder.path(), 10).unwrap_err();
        assert_eq!(
            (error.kind(), error.to_string().as_str()),
            (ErrorKind::InvalidInput, "it is a directory, no file")
        );
    }

    #[cfg(unix)]
    #[test]
    fn pipes_sockets_and_devices_are_refused_at_once() {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("pipe");
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        let socket = folder.path().join("socket");
        let _listener = std::os::unix::net::UnixListener::bind(&socket).unwrap();
        let link = folder.path().join("link");
        std::os::unix::fs::symlink("/dev/zero", &link).unwrap();
        for (path, kind) in [
            (pipe.as_path(), "a named pipe"),
            (&socket, "a socket"),
            (&link, "a device"),
            (Path::new("/dev/zero"), "a device"),
        ] {
            let error = read(path, 1 << 30).unwrap_err();
            assert_eq!(error.kind(), ErrorKind::InvalidInput);
            assert_eq!(error.to_string(), format!("it is {kind}, no file"));
        }
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_file_of_unknown_size_has_no_contents() {
        assert_eq!(read(Path::new("/proc/self/pagemap"), 1 << 30).unwrap(), b"");
    }
}
