//! Files of inputs, for readers that take paths.

use std::path::Path;

/// Writes files into a new folder in memory, where the system has one, and passes the folder to `read`. Returns its result.
///
/// # Panics
/// If a file cannot be written, as no input would be read.
#[allow(clippy::panic, reason = "a target that reads nothing has failed")]
pub(crate) fn with_files<T>(files: &[(&str, &[u8])], read: impl FnOnce(&Path) -> T) -> T {
    let memory = Path::new("/dev/shm");
    let parent = if memory.is_dir() { memory.to_owned() } else { std::env::temp_dir() };
    let folder = tempfile::Builder::new().prefix("lvk-fuzz-").tempdir_in(&parent);
    let folder = folder.unwrap_or_else(|error| panic!("no folder in {}: {error}", parent.display()));
    for (name, bytes) in files {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    }
    read(folder.path())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_files_are_there_and_gone_afterwards() {
        let mut was = None;
        with_files(&[("a", b"1"), ("b", b"")], |folder| {
            assert_eq!(std::fs::read(folder.join("a")).ok().as_deref(), Some(&b"1"[..]));
            assert!(folder.join("b").is_file());
            was = Some(folder.to_owned());
        });
        assert!(was.is_some_and(|folder| !folder.exists()));
    }

    #[test]
    #[should_panic(expected = "absent/a: ")]
    fn a_file_that_cannot_be_written_is_a_failure() {
        with_files(&[("absent/a", b"1")], |_| {});
    }
}
