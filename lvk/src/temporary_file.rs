//! Names of temporary files, and removal of those that killed processes left.

use std::ffi::OsStr;
use std::hash::{BuildHasher, RandomState};
use std::path::Path;
use std::sync::LazyLock;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, SystemTime};

/// Age from which a temporary file is a leftover of a process that was killed. A write takes seconds.
const LEFTOVER_AGE: Duration = Duration::from_secs(3600);

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
