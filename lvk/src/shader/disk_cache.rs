//! Disk cache of SPIR-V that was compiled from GLSL.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::SystemTime;

use super::disk_file::{CachedModule, Fingerprint, Included, decode_file, encode_file};
use crate::error::readable::readable_name;
use crate::lock_order::{Mutex, Rank};
use crate::regular_file;
use crate::temporary_file::{is_replacement, remove_replacements, replace_file};

/// Maximum size of a cache folder in bytes. If a folder exceeds it, the least recently used files are removed until the
/// folder is three quarters full.
const MAX_BYTES: u64 = 64 << 20;
const EXTENSION: &str = ".spirv";
/// Digits of a key in a file name.
const KEY_DIGITS: usize = 32;

/// Counts of cache hits and misses of modules created from GLSL
/// ([`ContextDesc::shader_cache`](crate::ContextDesc::shader_cache)).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ShaderCacheStats {
    /// Modules whose words were in the cache.
    pub found: u64,
    /// Modules that were compiled and stored.
    pub compiled: u64,
}

/// A folder of compiled modules. Each file is named after the fingerprint of its compilation's inputs.
pub(crate) struct ShaderCache {
    folder: PathBuf,
    most_bytes: u64,
    /// Bytes in the folder; `None` until the first module is stored.
    bytes: Mutex<Option<u64>>,
    found: AtomicU64,
    compiled: AtomicU64,
}

impl ShaderCache {
    /// Creates a cache in `folder`, which need not exist.
    pub(crate) fn new(folder: &Path) -> Self {
        remove_replacements(folder, is_module_name);
        Self {
            folder: folder.to_owned(),
            most_bytes: MAX_BYTES,
            bytes: Mutex::new(Rank::ShaderCacheFolder, None),
            found: AtomicU64::new(0),
            compiled: AtomicU64::new(0),
        }
    }

    pub(crate) fn counts(&self) -> ShaderCacheStats {
        let load = |count: &AtomicU64| count.load(Ordering::Relaxed);
        ShaderCacheStats { found: load(&self.found), compiled: load(&self.compiled) }
    }

    /// Returns the words of an earlier compilation, if `is_same` accepts its includes as unchanged.
    pub(super) fn load(
        &self,
        key: Fingerprint,
        is_same: impl FnOnce(&[Included]) -> bool,
    ) -> Option<Vec<u32>> {
        let path = self.path(key);
        let file = match regular_file::read(&path, MAX_BYTES) {
            Ok(file) => file,
            Err(error) => {
                if error.kind() != ErrorKind::NotFound {
                    log::warn!("the compiled shader '{}' cannot be read: {error}", readable_name(&path));
                }
                return None;
            }
        };
        let entry = match decode_file(key, &file) {
            Ok(entry) => entry,
            Err(reason) => {
                log::warn!("the compiled shader '{}' is dropped: {reason}", readable_name(&path));
                return None;
            }
        };
        if !is_same(&entry.included) {
            return None;
        }
        mark_used(&path);
        self.found.fetch_add(1, Ordering::Relaxed);
        Some(entry.words)
    }

    /// Stores the words of a compilation. A file error is logged, not returned.
    pub(super) fn store(&self, key: Fingerprint, entry: &CachedModule) {
        self.compiled.fetch_add(1, Ordering::Relaxed);
        let path = self.path(key);
        let file = encode_file(key, entry);
        let written = std::fs::create_dir_all(&self.folder).and_then(|()| replace_file(&path, &file));
        if let Err(error) = written {
            log::warn!("the compiled shader '{}' cannot be kept: {error}", readable_name(&path));
            return;
        }
        self.count_bytes(file.len() as u64);
    }

    /// Adds a new file to the folder's size. Removes old files if the folder is too large.
    fn count_bytes(&self, bytes: u64) {
        let mut total = self.bytes.lock();
        let now = match *total {
            Some(known) => known + bytes,
            None => cache_files(&self.folder).iter().map(|file| file.bytes).sum(),
        };
        *total = Some(now);
        if now > self.most_bytes {
            *total = Some(trim(cache_files(&self.folder), self.most_bytes / 4 * 3));
        }
    }

    fn path(&self, key: Fingerprint) -> PathBuf {
        self.folder.join(format!("{:016x}{:016x}{EXTENSION}", key.0[0], key.0[1]))
    }
}

/// A file of the cache.
#[derive(Debug, Clone)]
struct CacheFile {
    path: PathBuf,
    used: SystemTime,
    bytes: u64,
}

/// Returns the cache files of a folder, without foreign files.
fn cache_files(folder: &Path) -> Vec<CacheFile> {
    let Ok(entries) = std::fs::read_dir(folder) else { return Vec::new() };
    let kept = |entry: std::fs::DirEntry| {
        let data = entry.metadata().ok().filter(|data| data.is_file() && is_ours(&entry.file_name()))?;
        Some(CacheFile { path: entry.path(), used: data.modified().ok()?, bytes: data.len() })
    };
    entries.flatten().filter_map(kept).collect()
}

/// True if the name is that of a compiled shader, or of a temporary file that a crash left behind.
fn is_ours(name: &std::ffi::OsStr) -> bool {
    name.to_str().is_some_and(is_module_name) || is_replacement(name, is_module_name)
}

/// True if the name is that of a compiled shader.
fn is_module_name(name: &str) -> bool {
    name.strip_suffix(EXTENSION).is_some_and(|key| {
        key.len() == KEY_DIGITS
            && key.bytes().all(|byte| byte.is_ascii_digit() || (b'a'..=b'f').contains(&byte))
    })
}

/// Removes the least recently used files until at most `target` bytes are left. Returns the bytes that are left.
fn trim(mut files: Vec<CacheFile>, target: u64) -> u64 {
    files.sort_by_key(|file| file.used);
    let mut left: u64 = files.iter().map(|file| file.bytes).sum();
    for file in files {
        if left <= target {
            break;
        }
        // Another context may have removed the file first.
        let _ = std::fs::remove_file(&file.path);
        left -= file.bytes;
    }
    left
}

/// Updates the file's modification time. In a folder without write access, the file's age decides instead.
fn mark_used(path: &Path) {
    let file = std::fs::File::options().append(true).open(path);
    let _ = file.and_then(|file| file.set_modified(SystemTime::now()));
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    const WORDS: u64 = 250;

    fn cache(folder: &Path, files: u64) -> ShaderCache {
        ShaderCache { most_bytes: files * WORDS * 4 + files * 100, ..ShaderCache::new(folder) }
    }

    fn entry(number: u32) -> CachedModule {
        CachedModule { included: Vec::new(), words: vec![number; WORDS as usize] }
    }

    fn key(number: u32) -> Fingerprint {
        Fingerprint([number.into(), 7])
    }

    fn age(cache: &ShaderCache, number: u32, seconds: u64) {
        let file = std::fs::File::options().append(true).open(cache.path(key(number))).unwrap();
        file.set_modified(SystemTime::now() - Duration::from_secs(seconds)).unwrap();
    }

    #[test]
    fn least_recently_used_files_go_first_and_foreign_files_stay() {
        let folder = std::env::temp_dir().join(format!("lvk-shaders-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        std::fs::write(folder.join("mine.spirv"), vec![0; 1 << 16]).unwrap();
        let cache = cache(&folder, 8);
        for number in 0..8 {
            cache.store(key(number), &entry(number));
            age(&cache, number, 1000 - u64::from(number));
        }
        assert_eq!(cache.load(key(0), |_| true), Some(entry(0).words), "and so it is the newest");
        assert_eq!(cache.load(key(1), |_| false), None, "other includes");
        cache.store(key(8), &entry(8));
        let found: Vec<u32> = (0..9).filter(|number| cache.load(key(*number), |_| true).is_some()).collect();
        assert_eq!(found, [0, 4, 5, 6, 7, 8], "three quarters of eight are left");
        assert!(folder.join("mine.spirv").exists());
        assert_eq!(cache.counts(), ShaderCacheStats { found: 7, compiled: 9 });
        std::fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn names_of_the_cache_are_told_from_others() {
        let ours = |name: &str| is_ours(std::ffi::OsStr::new(name));
        let key = "0123456789abcdef0123456789abcdef";
        assert!(ours(&format!("{key}.spirv")) && ours(&format!("{key}.spirv.12-3.tmp")));
        for name in
            ["", ".spirv", "x.spirv", &format!("{key}.spv"), &format!("{key}0.spirv"), &key.replace('a', "G")]
        {
            assert!(!ours(name), "{name}");
        }
    }
}
