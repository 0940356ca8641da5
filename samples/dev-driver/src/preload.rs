//! Opening fetched libraries inside this process, so that no environment variable has to be set around it.

use std::ffi::OsStr;
use std::mem::forget;
use std::path::Path;

use libloading::os::unix::{Library, RTLD_LOCAL, RTLD_NOW};

use super::error::DriverError;

/// Answers only for libraries that are open already (`dlfcn.h` of glibc and musl on x86-64).
const RTLD_NOLOAD: i32 = 4;

/// Opens `libraries` (relative to `folder`, each after what it needs) for the rest of the process's life.
///
/// The dynamic linker satisfies later requests for the same soname from what is open, so the driver finds what
/// it needs without a search path. A library the process has already is kept: two copies of one library, such
/// as the C++ runtime, must not meet.
pub(super) fn preload(folder: &Path, libraries: &[String]) -> Result<(), DriverError> {
    for library in libraries {
        let path = folder.join(library);
        if path.file_name().is_some_and(is_open) {
            continue;
        }
        // SAFETY: the file belongs to a complete folder made from verified packages; initialisers of these
        // libraries have no preconditions. The handle is never closed, so no code of it can vanish.
        let opened = unsafe { Library::open(Some(&path), RTLD_NOW | RTLD_LOCAL) };
        forget(opened.map_err(|error| broken(&path, &error))?);
    }
    Ok(())
}

fn is_open(soname: &OsStr) -> bool {
    // SAFETY: with RTLD_NOLOAD nothing is loaded, hence no initialiser runs.
    let open = unsafe { Library::open(Some(soname), RTLD_NOLOAD | RTLD_NOW) };
    // The handle stays, so that the library cannot be closed between here and the driver that needs it.
    open.map(forget).is_ok()
}

fn broken(path: &Path, error: &libloading::Error) -> DriverError {
    DriverError::Broken { path: path.to_path_buf(), reason: error.to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_c_library_is_open_and_nonsense_is_not() {
        assert!(is_open(OsStr::new("libc.so.6")));
        assert!(!is_open(OsStr::new("libnothing-of-this-name.so.9")));
    }

    #[test]
    fn libraries_the_process_has_are_not_opened_again() {
        preload(Path::new("/no/such/folder"), &["lib/libc.so.6".to_owned()]).unwrap();
    }

    #[test]
    fn a_damaged_library_is_named() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("libdamaged.so.1"), "text").unwrap();
        let message = preload(folder.path(), &["libdamaged.so.1".to_owned()]).unwrap_err().to_string();
        assert!(message.contains("libdamaged.so.1"), "{message}");
    }
}
