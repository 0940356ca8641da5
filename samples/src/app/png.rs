//! Writes pictures so that a file is either complete or not there.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use lvk::temporary_file::{self, TemporaryFile, is_unique_part, unique_part};
use lvk::{readable_name, regular_file};

/// Errors of writing an image.
#[derive(Debug, thiserror::Error)]
pub enum PngError {
    /// The folder does not exist, is no folder, or may not be written to.
    #[error("cannot write {}: {source}; choose another --out", readable_name(path))]
    Unwritable {
        /// The path of the picture.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The name says that the file is no PNG.
    #[error("--out {}: the picture is a PNG; name it {}", readable_name(path), readable_name(path.with_extension("png")))]
    NotPng {
        /// The path of the picture.
        path: PathBuf,
    },
    /// The picture would replace a file that is read.
    #[error("--out and {option} are the same file, {}; choose another --out", readable_name(path))]
    IsInput {
        /// The path of the picture.
        path: PathBuf,
        /// The option that names the file as input.
        option: &'static str,
    },
    /// The pixels do not fit the size.
    #[error("{} pixels of 4 bytes were to be written to {}, but {bytes} bytes were given", width * height, readable_name(path))]
    WrongLength {
        /// The path of the picture.
        path: PathBuf,
        /// Pixels in a row.
        width: u32,
        /// Rows.
        height: u32,
        /// Bytes given.
        bytes: usize,
    },
    /// The picture could not be encoded.
    #[error("cannot encode {}: {source}", readable_name(path))]
    Encode {
        /// The path of the picture.
        path: PathBuf,
        /// Error of the encoder.
        source: image::ImageError,
    },
}

/// Checks that a picture at `path` would not replace the file `input`, which the option called `option` names, by
/// whatever way the two paths lead there.
///
/// # Errors
/// [`PngError::IsInput`].
pub fn check_not_input(path: &Path, option: &'static str, input: &Path) -> Result<(), PngError> {
    let is_same = match (path.canonicalize(), input.canonicalize()) {
        (Ok(path), Ok(input)) => path == input && path.is_file(),
        _ => false,
    };
    if is_same { Err(PngError::IsInput { path: path.into(), option }) } else { Ok(()) }
}

/// Checks that a picture can be written to `path` later, without leaving anything behind. An existing file at
/// `path` is not touched. Files in part that killed processes left in its folder more than an hour ago are removed.
///
/// # Errors
/// [`PngError::Unwritable`], and [`PngError::NotPng`] for a name that does not end in `.png`, in whatever case.
pub fn check_writable(path: &Path) -> Result<(), PngError> {
    let unwritable = |source| PngError::Unwritable { path: path.into(), source };
    if path.is_dir() || path.file_name().is_none() {
        return Err(unwritable(std::io::ErrorKind::IsADirectory.into()));
    }
    if is_null_device(path).map_err(unwritable)? {
        return Ok(());
    }
    if !path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("png")) {
        return Err(PngError::NotPng { path: path.into() });
    }
    remove_leftovers(path);
    create_partial(path).map(drop).map_err(unwritable)
}

/// Writes `width` x `height` pixels of 4 bytes (RGBA, sRGB, rows from the top) as a PNG. An earlier file at `path` is
/// replaced in one step; after an error it is unchanged. The null device takes the picture and stays what it is; other devices,
/// pipes and sockets are refused, as writing to them may never end.
///
/// # Errors
/// [`PngError`].
pub fn write(path: &Path, width: u32, height: u32, rgba: &[u8]) -> Result<(), PngError> {
    if rgba.len() as u64 != u64::from(width) * u64::from(height) * 4 {
        return Err(PngError::WrongLength { path: path.into(), width, height, bytes: rgba.len() });
    }
    let mut encoded = std::io::Cursor::new(Vec::new());
    image::write_buffer_with_format(
        &mut encoded,
        rgba,
        width,
        height,
        image::ExtendedColorType::Rgba8,
        image::ImageFormat::Png,
    )
    .map_err(|source| PngError::Encode { path: path.into(), source })?;
    let encoded = encoded.into_inner();
    let written = is_null_device(path).and_then(|is_null| match is_null {
        true => Ok(()),
        false => create_partial(path).and_then(|partial| partial.complete(&encoded, path)),
    });
    written.map_err(|source| PngError::Unwritable { path: path.into(), source })
}

/// True if `path` leads to the null device, false for a file, and for a path at which nothing is.
///
/// # Errors
/// [`InvalidInput`](std::io::ErrorKind::InvalidInput) for a folder, a pipe, a socket or another device.
fn is_null_device(path: &Path) -> std::io::Result<bool> {
    let Ok(found) = std::fs::metadata(path) else { return Ok(false) };
    if found.is_file() {
        return Ok(false);
    }
    let is_null = match cfg!(windows) {
        true => path.file_stem().is_some_and(|stem| stem.eq_ignore_ascii_case("nul")),
        false => path.canonicalize().is_ok_and(|device| device == Path::new("/dev/null")),
    };
    match is_null {
        true => Ok(true),
        false => regular_file::check_kind(&found).map(|()| false),
    }
}

/// Creates the file in part beside the final one.
fn create_partial(target: &Path) -> std::io::Result<TemporaryFile> {
    TemporaryFile::create(target.with_file_name(partial_name()))
}

/// Returns a name that no other process uses.
fn partial_name() -> String {
    format!(".lvk-{}.partial", unique_part())
}

/// True if `name` is that of a file in part, of this or of an earlier version.
fn is_partial(name: &OsStr) -> bool {
    let name = name.to_str().unwrap_or_default();
    let unique = name.strip_prefix(".lvk-").and_then(|name| name.strip_suffix(".partial"));
    unique.is_some_and(is_unique_part)
}

/// Removes the files in part that killed processes left beside `target` more than an hour ago.
pub(super) fn remove_leftovers(target: &Path) {
    let folder = target.parent().filter(|folder| !folder.as_os_str().is_empty());
    temporary_file::remove_leftovers(folder.unwrap_or(Path::new(".")), is_partial);
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, SystemTime};

    use super::*;

    fn files(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> = std::fs::read_dir(folder)
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn a_picture_comes_back_as_it_was() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        std::fs::write(&path, "older").unwrap();
        check_writable(&path).unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"older");
        let pixels: Vec<u8> = (0..24).collect();
        write(&path, 3, 2, &pixels).unwrap();
        let read = image::open(&path).unwrap().into_rgba8();
        assert_eq!((read.dimensions(), read.into_raw()), ((3, 2), pixels));
        assert_eq!(files(folder.path()), ["a.png"]);
    }

    #[test]
    fn only_old_files_in_part_are_removed() {
        let folder = tempfile::tempdir().unwrap();
        let create = |name: &str, seconds: u64| {
            let file = std::fs::File::create(folder.path().join(name)).unwrap();
            file.set_modified(SystemTime::now() - Duration::from_secs(seconds)).unwrap();
        };
        for name in [".lvk-12-3.partial", ".lvk-00ff00ff00ff00ff-0.partial"] {
            create(name, 9000);
        }
        let kept = [".lvk-12-4.partial", ".lvk-12.partial", ".lvk-my-notes.partial", "lvk-12-3.partial"];
        for (name, seconds) in kept.into_iter().zip([60, 9000, 9000, 9000]) {
            create(name, seconds);
        }
        check_writable(&folder.path().join("a.png")).unwrap();
        assert_eq!(files(folder.path()), kept);
        remove_leftovers(&folder.path().join("absent/a.png"));
    }

    #[test]
    fn names_of_files_in_part_differ_and_are_recognised() {
        let names = [partial_name(), partial_name()];
        assert_ne!(names[0], names[1]);
        assert!(names.iter().all(|name| is_partial(OsStr::new(name))), "{names:?}");
        assert!(!names[0].contains(&format!("-{}-", std::process::id())));
    }

    #[cfg(unix)]
    #[test]
    fn a_device_stays_one() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("null");
        std::os::unix::fs::symlink("/dev/null", &path).unwrap();
        check_writable(&path).unwrap();
        write(&path, 1, 1, &[0; 4]).unwrap();
        assert!(path.is_symlink(), "the way to the device was replaced by a file");
        assert_eq!(files(folder.path()), ["null"]);
    }

    #[cfg(unix)]
    #[test]
    fn pipes_sockets_and_devices_are_refused_at_once() {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("pipe.png");
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        let socket = folder.path().join("socket.png");
        let _listener = std::os::unix::net::UnixListener::bind(&socket).unwrap();
        let names = files(folder.path());
        for (path, kind) in
            [(pipe.as_path(), "a named pipe"), (&socket, "a socket"), (Path::new("/dev/zero"), "a device")]
        {
            for error in [check_writable(path).unwrap_err(), write(path, 1, 1, &[0; 4]).unwrap_err()] {
                let expected =
                    format!("cannot write {}: it is {kind}, no file; choose another --out", path.display());
                assert_eq!(error.to_string(), expected);
            }
        }
        assert_eq!(files(folder.path()), names);
    }

    #[test]
    fn leftovers_of_a_killed_process_are_no_obstacle() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        for number in 0..1_000 {
            std::fs::create_dir(folder.path().join(format!(".lvk-{}-{number}.partial", std::process::id())))
                .unwrap();
        }
        write(&path, 1, 1, &[0; 4]).unwrap();
        assert!(path.is_file());
    }

    #[test]
    fn an_error_names_the_path_and_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let lost = folder.path().join("absent/a.png");
        for error in [check_writable(&lost).unwrap_err(), write(&lost, 1, 1, &[0; 4]).unwrap_err()] {
            assert!(matches!(error, PngError::Unwritable { .. }));
            assert!(error.to_string().contains("absent/a.png"), "{error}");
        }
        assert!(check_writable(folder.path()).is_err(), "a folder is no picture");
        let path = folder.path().join("b.png");
        assert!(matches!(write(&path, 2, 2, &[0; 15]), Err(PngError::WrongLength { bytes: 15, .. })));
        assert_eq!(files(folder.path()), Vec::<String>::new());
    }
}
