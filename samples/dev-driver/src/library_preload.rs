//! Opens downloaded libraries inside this process, so that the caller need not set `LD_LIBRARY_PATH`.

use std::ffi::OsStr;
use std::mem::forget;
use std::path::Path;

use libloading::os::unix::{Library, RTLD_LOCAL, RTLD_NOW};
use lvk::with_causes;

use crate::error::DriverError;

/// Makes `dlopen` succeed only for libraries that are already open (`dlfcn.h` of glibc and musl on x86-64).
const RTLD_NOLOAD: i32 = 4;

/// Opens `libraries` (relative to `folder`, dependencies first) until the process ends.
///
/// The dynamic linker resolves later requests for the same soname to the open library, so the driver finds its dependencies
/// without a search path. The function skips a library that the process has already opened: a process must not contain two
/// copies of one library, such as the C++ runtime.
pub(super) fn preload(folder: &Path, libraries: &[String]) -> Result<(), DriverError> {
    for library in libraries {
        let path = folder.join(library);
        if path.file_name().is_some_and(is_open) {
            continue;
        }
        // SAFETY: the file belongs to a complete folder made from verified packages; initialisers of these
        // libraries have no preconditions. The handle is never closed, so its code stays mapped.
        let opened = unsafe { Library::open(Some(&path), RTLD_NOW | RTLD_LOCAL) };
        forget(opened.map_err(|error| broken(&path, &error))?);
    }
    Ok(())
}

fn is_open(soname: &OsStr) -> bool {
    // SAFETY: with RTLD_NOLOAD nothing is loaded, hence no initialiser runs.
    let open = unsafe { Library::open(Some(soname), RTLD_NOLOAD | RTLD_NOW) };
    // The handle leaks on purpose: the library must stay open until the driver uses it.
    open.map(forget).is_ok()
}

fn broken(path: &Path, error: &libloading::Error) -> DriverError {
    DriverError::Broken { path: path.to_path_buf(), reason: with_causes(error) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_c_library_is_open_and_an_unknown_library_is_not() {
        assert!(is_open(OsStr::new("libc.so.6")));
        assert!(!is_open(OsStr::new("libnothing-of-this-name.so.9")));
    }

    #[test]
    fn open_libraries_are_not_opened_again() {
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
