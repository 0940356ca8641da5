//! Files that are written under a temporary name and then renamed, and removal of those that killed processes left.

use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::fs::File;
use std::hash::{BuildHasher, RandomState};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::LazyLock;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, SystemTime};

use crate::lock_order::{Mutex, Rank};

/// Age from which a temporary file is a leftover of a process that was killed. A write takes seconds.
const LEFTOVER_AGE: Duration = Duration::from_secs(3600);
/// Extension of the temporary files of [`replace_file`].
const EXTENSION: &str = ".tmp";

/// Paths of the temporary files of this process.
static WRITTEN: Mutex<BTreeSet<PathBuf>> = Mutex::new(Rank::TemporaryFiles, BTreeSet::new());

/// A file under a temporary name. Dropping this removes the file, unless it was completed.
#[derive(Debug)]
pub struct TemporaryFile {
    path: PathBuf,
    file: File,
}

impl TemporaryFile {
    /// Creates an empty file.
    ///
    /// # Errors
    /// Those of the operating system, and [`AlreadyExists`](io::ErrorKind::AlreadyExists) if there is such a file.
    pub fn create(path: PathBuf) -> io::Result<Self> {
        let mut written = WRITTEN.lock();
        let file = File::create_new(&path)?;
        written.insert(path.clone());
        Ok(Self { path, file })
    }

    /// Writes the contents to the disk and renames the file to `target`, in the same folder. A file there is replaced.
    ///
    /// # Errors
    /// Those of the operating system. The temporary file is removed then.
    pub fn complete(mut self, contents: &[u8], target: &Path) -> io::Result<()> {
        self.file.write_all(contents)?;
        self.file.sync_all()?;
        let mut written = WRITTEN.lock();
        std::fs::rename(&self.path, target)?;
        written.remove(&self.path);
        Ok(())
    }
}

impl Drop for TemporaryFile {
    fn drop(&mut self) {
        if WRITTEN.lock().remove(&self.path) {
            // The first error is reported; `remove_leftovers` removes the file later.
            let _ = std::fs::remove_file(&self.path);
        }
    }
}

/// Removes the temporary files of this process, which is about to end. Threads that create, complete or drop a
/// [`TemporaryFile`] wait from now on, so the caller must end the process without waiting for them.
pub fn remove_all_before_exit() {
    let mut written = WRITTEN.lock();
    for path in std::mem::take(&mut *written) {
        // A later start removes the file.
        let _ = std::fs::remove_file(path);
    }
    std::mem::forget(written);
}

/// Replaces a file atomically. Concurrent readers, and processes after a crash, find either the old bytes or the new ones.
///
/// # Errors
/// Those of the operating system, and [`InvalidInput`](io::ErrorKind::InvalidInput) if `path` has no file name.
pub fn replace_file(path: &Path, contents: &[u8]) -> io::Result<()> {
    TemporaryFile::create(name_beside(path)?)?.complete(contents, path)
}

/// Returns a name in the same folder that no other context uses, in no process.
fn name_beside(path: &Path) -> io::Result<PathBuf> {
    let Some(name) = path.file_name() else {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "the path names no file"));
    };
    let mut name = name.to_owned();
    name.push(format!(".{}{EXTENSION}", unique_part()));
    Ok(path.with_file_name(name))
}

/// True if [`replace_file`] may give `name` to a temporary file, for a file whose name passes `is_final`.
#[must_use]
pub fn is_replacement(name: &OsStr, is_final: impl Fn(&str) -> bool) -> bool {
    let Some(name) = name.to_str().and_then(|name| name.strip_suffix(EXTENSION)) else { return false };
    let Some((target, unique)) = name.rsplit_once('.') else { return false };
    is_unique_part(unique) && is_final(target)
}

/// Removes the temporary files that [`replace_file`] of killed processes left in a folder, for files whose name passes
/// `is_final`. Files of the last hour stay. Errors are ignored: the next start tries again.
pub fn remove_replacements(folder: &Path, is_final: impl Fn(&str) -> bool) {
    remove_leftovers(folder, |name| is_replacement(name, &is_final));
}

/// Returns a part of a name that no other file has, in no process: containers that share a folder may have equal process
/// numbers, so a random number takes their place.
#[must_use]
pub fn unique_part() -> String {
    static COUNT: AtomicU32 = AtomicU32::new(0);
    static PROCESS: LazyLock<u64> = LazyLock::new(|| RandomState::new().hash_one(std::process::id()));
    format!("{:016x}-{}", *PROCESS, COUNT.fetch_add(1, Ordering::Relaxed))
}

/// True if `text` is a [`unique_part`], of this or of an earlier version.
#[must_use]
pub fn is_unique_part(text: &str) -> bool {
    let is_hexadecimal = |part: &str| !part.is_empty() && part.bytes().all(|byte| byte.is_ascii_hexdigit());
    text.split_once('-').is_some_and(|(process, count)| is_hexadecimal(process) && is_hexadecimal(count))
}

/// Removes the temporary files of a folder that killed processes left: those whose name passes `is_temporary`. Files of
/// the last hour stay, since another process may be writing them. Errors are ignored: the next start tries again.
pub fn remove_leftovers(folder: &Path, is_temporary: impl Fn(&OsStr) -> bool) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    let now = SystemTime::now();
    for entry in entries.flatten().filter(|entry| is_temporary(&entry.file_name())) {
        let written = entry.metadata().and_then(|data| data.modified());
        let age = written.ok().and_then(|written| now.duration_since(written).ok());
        if age.is_some_and(|age| age > LEFTOVER_AGE) {
            let _ = std::fs::remove_file(entry.path());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = std::fs::read_dir(folder).unwrap();
        let mut names: Vec<_> =
            entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn a_replaced_file_has_the_new_bytes_and_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.bin");
        for contents in ["older", "new"] {
            replace_file(&path, contents.as_bytes()).unwrap();
            assert_eq!(std::fs::read_to_string(&path).unwrap(), contents);
        }
        assert_eq!(names(folder.path()), ["a.bin"]);
    }

    #[test]
    fn a_failed_or_dropped_write_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let taken = folder.path().join("taken");
        std::fs::create_dir(&taken).unwrap();
        assert!(replace_file(&taken, b"a file in place of a folder").is_err());
        assert!(replace_file(Path::new("/"), b"").is_err(), "the path names no file");
        let dropped = TemporaryFile::create(folder.path().join("dropped")).unwrap();
        let again = TemporaryFile::create(folder.path().join("dropped")).unwrap_err();
        assert_eq!(again.kind(), io::ErrorKind::AlreadyExists);
        assert_eq!(names(folder.path()), ["dropped", "taken"]);
        drop(dropped);
        assert_eq!(names(folder.path()), ["taken"]);
        assert!(!WRITTEN.lock().iter().any(|path| path.starts_with(folder.path())));
    }

    #[test]
    fn temporary_files_are_told_from_others() {
        let of = |name: &str| is_replacement(OsStr::new(name), |target| target == "a.bin");
        for name in ["a.bin.12-3.tmp", "a.bin.00ff00ff00ff00ff-0.tmp"] {
            assert!(of(name), "{name}");
        }
        for name in ["a.bin", "a.bin.tmp", "a.bin.12.tmp", "b.bin.12-3.tmp", "a.bin.my-notes.tmp", ".tmp", ""]
        {
            assert!(!of(name), "{name}");
        }
        let made = name_beside(Path::new("folder/a.bin")).unwrap();
        assert!(of(made.file_name().unwrap().to_str().unwrap()), "{}", made.display());
        assert_ne!(made, name_beside(Path::new("folder/a.bin")).unwrap());
    }

    #[test]
    fn only_old_leftovers_of_the_cache_are_removed() {
        let folder = tempfile::tempdir().unwrap();
        let create = |name: &str, seconds: u64| {
            let file = File::create(folder.path().join(name)).unwrap();
            file.set_modified(SystemTime::now() - Duration::from_secs(seconds)).unwrap();
        };
        create("a.bin", 9000);
        create("a.bin.12-3.tmp", 9000);
        create("a.bin.12-4.tmp", 60);
        create("b.bin.12-3.tmp", 9000);
        remove_replacements(folder.path(), |target| target == "a.bin");
        assert_eq!(names(folder.path()), ["a.bin", "a.bin.12-4.tmp", "b.bin.12-3.tmp"]);
        remove_replacements(&folder.path().join("absent"), |_| true);
    }
}
