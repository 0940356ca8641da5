//! Cache files: whole-file reads, atomic replacement, removal of what a killed process left, and checksums.

use std::ffi::OsStr;
use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use crate::temporary_file::{self, is_unique_part, unique_part};

/// Maximum size of a cache in bytes. A larger one is not read.
pub(crate) const MAX_BYTES: u64 = 1 << 30;
/// Extension of temporary files.
const TEMPORARY: &str = ".tmp";

/// Returns the 64-bit FNV-1a hash. It detects damage, but not tampering.
pub(crate) fn checksum(parts: &[&[u8]]) -> u64 {
    const BASIS: u64 = 0xcbf2_9ce4_8422_2325;
    const PRIME: u64 = 0x0000_0100_0000_01b3;
    let bytes = parts.iter().copied().flatten();
    bytes.fold(BASIS, |sum, byte| (sum ^ u64::from(*byte)).wrapping_mul(PRIME))
}

/// Replaces a file atomically. Concurrent readers, and processes after a crash, find either the old bytes or
/// the new ones.
pub(crate) fn replace_file(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let temporary = temporary_name(path)?;
    let written = write_temporary(&temporary, bytes).and_then(|()| std::fs::rename(&temporary, path));
    if written.is_err() {
        // The first error is reported; `remove_leftovers` removes the file later.
        let _ = std::fs::remove_file(&temporary);
    }
    written
}

fn write_temporary(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut file = File::create_new(path)?;
    file.write_all(bytes)?;
    file.sync_all()
}

/// Returns a name in the same folder that no other context uses, in no process.
fn temporary_name(path: &Path) -> io::Result<PathBuf> {
    let Some(name) = path.file_name() else {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "the path names no file"));
    };
    let mut name = name.to_owned();
    name.push(format!(".{}{TEMPORARY}", unique_part()));
    Ok(path.with_file_name(name))
}

/// True if `name` is that of a temporary file of a cache file whose name passes `is_cache`.
pub(crate) fn is_temporary(name: &OsStr, is_cache: impl Fn(&str) -> bool) -> bool {
    let Some(name) = name.to_str().and_then(|name| name.strip_suffix(TEMPORARY)) else { return false };
    let Some((cache, unique)) = name.rsplit_once('.') else { return false };
    is_unique_part(unique) && is_cache(cache)
}

/// Removes temporary files that killed processes left in a folder, of cache files whose name passes `is_cache`.
pub(crate) fn remove_leftovers(folder: &Path, is_cache: impl Fn(&str) -> bool) {
    temporary_file::remove_leftovers(folder, |name| is_temporary(name, &is_cache));
}

/// Returns a checksum, computed eight bytes at a time. It detects damage and different contents, but not
/// tampering.
pub(crate) fn fingerprint(bytes: &[u8], seed: u64) -> u64 {
    const PRIME: u64 = 0x9e37_79b9_7f4a_7c15;
    let mix = |sum: u64, word: u64| {
        let mixed = (sum ^ word).wrapping_mul(PRIME);
        mixed ^ mixed >> 29
    };
    let (words, rest) = bytes.as_chunks::<8>();
    let all = words.iter().fold(seed ^ bytes.len() as u64, |sum, word| mix(sum, u64::from_le_bytes(*word)));
    rest.iter().fold(all, |sum, byte| mix(sum, u64::from(*byte)))
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, SystemTime};

    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = std::fs::read_dir(folder).unwrap();
        let mut names: Vec<_> =
            entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn temporary_files_are_told_from_others() {
        let of = |name: &str| is_temporary(OsStr::new(name), |cache| cache == "a.bin");
        for name in ["a.bin.12-3.tmp", "a.bin.00ff00ff00ff00ff-0.tmp"] {
            assert!(of(name), "{name}");
        }
        for name in ["a.bin", "a.bin.tmp", "a.bin.12.tmp", "b.bin.12-3.tmp", "a.bin.my-notes.tmp", ".tmp", ""]
        {
            assert!(!of(name), "{name}");
        }
        let made = temporary_name(Path::new("folder/a.bin")).unwrap();
        assert!(of(made.file_name().unwrap().to_str().unwrap()), "{}", made.display());
        assert_ne!(made, temporary_name(Path::new("folder/a.bin")).unwrap());
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
        remove_leftovers(folder.path(), |cache| cache == "a.bin");
        assert_eq!(names(folder.path()), ["a.bin", "a.bin.12-4.tmp", "b.bin.12-3.tmp"]);
        remove_leftovers(&folder.path().join("absent"), |_| true);
    }
}
