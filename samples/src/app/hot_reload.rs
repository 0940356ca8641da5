//! Watches shaders, and recompiles them when they change.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

/// Time between two looks at the folder.
const PERIOD: Duration = Duration::from_millis(300);

/// The time and length of a file, which reveal changes.
type Stamp = (Option<SystemTime>, u64);

/// Watches the GLSL files of a folder, those in folders below it included, by their times and lengths.
#[derive(Debug)]
pub struct ShaderWatch {
    folder: PathBuf,
    files: BTreeMap<PathBuf, Stamp>,
    looked: Instant,
}

impl ShaderWatch {
    /// Watches from now on.
    #[must_use]
    pub fn new(folder: &Path) -> Self {
        Self { folder: folder.to_owned(), files: stamps(folder), looked: Instant::now() }
    }

    /// True if anything has changed, come or gone since the last time that this was so. Looks a few times a second only.
    pub fn poll(&mut self, now: Instant) -> bool {
        if now.duration_since(self.looked) < PERIOD {
            return false;
        }
        self.looked = now;
        let found = stamps(&self.folder);
        let changed = found != self.files;
        self.files = found;
        changed
    }
}

/// Leaves out files that cannot be read; their compilation reports the error.
fn stamps(folder: &Path) -> BTreeMap<PathBuf, Stamp> {
    let mut found = BTreeMap::new();
    let Ok(entries) = std::fs::read_dir(folder) else { return found };
    for entry in entries.flatten() {
        let (path, Ok(about)) = (entry.path(), entry.metadata()) else { continue };
        if about.is_dir() {
            found.extend(stamps(&path));
        } else if path.extension().is_some_and(|extension| extension == "glsl") {
            found.insert(path, (about.modified().ok(), about.len()));
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn changes_are_noticed_once_and_in_folders_below() {
        let folder = tempfile::tempdir().unwrap();
        let below = folder.path().join("sample");
        std::fs::create_dir(&below).unwrap();
        let (file, note) = (below.join("a.comp.glsl"), below.join("note.txt"));
        std::fs::write(&file, "a").unwrap();
        let mut watch = ShaderWatch::new(folder.path());
        let mut now = Instant::now();
        let mut polls = || {
            now += PERIOD;
            [watch.poll(now), watch.poll(now + PERIOD / 2)]
        };
        assert_eq!(polls(), [false, false]);
        std::fs::write(&note, "text").unwrap();
        assert_eq!(polls(), [false, false]);
        std::fs::write(&file, "ab").unwrap();
        assert_eq!(polls(), [true, false]);
        let earlier = SystemTime::now() - Duration::from_secs(60);
        std::fs::File::open(&file).unwrap().set_modified(earlier).unwrap();
        assert_eq!(polls(), [true, false], "the same length at another time");
        std::fs::write(below.join("b.glsl"), "").unwrap();
        assert_eq!(polls(), [true, false]);
        std::fs::remove_file(&file).unwrap();
        assert_eq!([polls(), polls()], [[true, false], [false, false]]);
        assert!(stamps(&folder.path().join("absent")).is_empty());
    }
}
