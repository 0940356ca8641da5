//! The files that shaders were compiled from, and whether they have changed since.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant, SystemTime};

use crate::context::Context;
use crate::context::holder::Holder;
use crate::error::readable::readable_name;
use crate::error::{Error, Result};
use crate::handle::ShaderModuleHandle;
use crate::lock_order::{Guard, Mutex, Rank};
use crate::regular_file;
use crate::shader::{MAX_GLSL_BYTES, ShaderModuleDesc, ShaderSource};

/// Compiles files of shaders, and notices when one of them changes.
///
/// [`Reloadable`](crate::Reloadable) uses it for one pipeline or a few. On its own it serves programs that compile all
/// of their shaders anew after any change. Cloning is cheap and returns the same list of files. Any number of threads
/// may compile at once.
#[derive(Clone)]
pub struct ShaderFiles {
    watched: Arc<Mutex<WatchedFiles>>,
}

impl ShaderFiles {
    /// Starts with no file.
    #[must_use]
    pub fn new() -> Self {
        Self::from_watched(WatchedFiles::new(DEFAULT_PERIOD))
    }

    fn from_watched(watched: WatchedFiles) -> Self {
        Self { watched: Arc::new(Mutex::new(Rank::ShaderFiles, watched)) }
    }

    /// Compiles the GLSL of a file to a module ([`Context::create_shader_module`]). [`ShaderModuleDesc::source`] is
    /// ignored. Includes are searched in the folder of the file before
    /// [`include_dirs`](ShaderModuleDesc::include_dirs).
    ///
    /// From now on the file and its includes are checked for changes, also if the compilation fails, and also the places
    /// where an include was searched in vain.
    ///
    /// # Errors
    /// [`File`](Error::File) if the file cannot be read, is no regular file or has more than 16 MiB, otherwise as
    /// [`Context::create_shader_module`].
    pub fn create_module(
        &self,
        ctx: &Context,
        path: impl AsRef<Path>,
        desc: &ShaderModuleDesc<'_>,
    ) -> Result<Holder<ShaderModuleHandle>> {
        let path = path.as_ref();
        self.watch(path);
        let text = regular_file::read_text(path, MAX_GLSL_BYTES).map_err(|error| Error::File {
            path: path.to_owned(),
            message: format!(
                "the text of shader '{}' cannot be read: {error}",
                readable_name(desc.debug_name)
            ),
        })?;
        let dirs: Vec<&Path> = path.parent().into_iter().chain(desc.include_dirs.iter().copied()).collect();
        let desc = ShaderModuleDesc { source: ShaderSource::Glsl(&text), include_dirs: &dirs, ..*desc };
        ctx.create_module_from_files(&desc, &|include| self.watch(include))
    }

    /// True if a file has changed, appeared or disappeared since the last call that returned true. Checks the files by
    /// their times and lengths, at most once in each period.
    ///
    /// A second change within the resolution of the file system's times, which leaves the length, is not noticed.
    #[must_use]
    pub fn changed(&self) -> bool {
        self.lock().changed(Instant::now())
    }

    /// Sets the least time between two checks of the files. The default is 300 milliseconds.
    pub fn set_period(&self, period: Duration) {
        self.lock().period = period;
    }

    /// Returns the paths that are checked, in alphabetical order. Those of includes that were searched in vain are among
    /// them.
    #[must_use]
    pub fn paths(&self) -> Vec<PathBuf> {
        self.lock().stamps.keys().cloned().collect()
    }

    /// Returns an empty list with the same period.
    pub(super) fn sibling(&self) -> Self {
        Self::from_watched(WatchedFiles::new(self.lock().period))
    }

    /// Adds the files of a later build.
    pub(super) fn add(&self, later: &Self) {
        let later = std::mem::replace(&mut *later.lock(), WatchedFiles::new(Duration::ZERO));
        self.lock().add(later);
    }

    /// Checks the file from now on. Called before the file is read, so that no later change is missed.
    fn watch(&self, path: &Path) {
        let found = stamp(path);
        self.lock().watch(path, found);
    }

    fn lock(&self) -> Guard<'_, WatchedFiles> {
        self.watched.lock()
    }
}

impl Default for ShaderFiles {
    fn default() -> Self {
        Self::new()
    }
}

impl std::fmt::Debug for ShaderFiles {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_set().entries(self.paths()).finish()
    }
}

const DEFAULT_PERIOD: Duration = Duration::from_millis(300);

/// Time and length of a file; `None` for a file that does not exist.
type Stamp = Option<(Option<SystemTime>, u64)>;

fn stamp(path: &Path) -> Stamp {
    let about = std::fs::metadata(path).ok().filter(std::fs::Metadata::is_file)?;
    Some((about.modified().ok(), about.len()))
}

/// The stamps of files, as they were when the files were read.
struct WatchedFiles {
    stamps: BTreeMap<PathBuf, Stamp>,
    /// True if a file has changed between two reads.
    changed: bool,
    period: Duration,
    last_check: Instant,
}

impl WatchedFiles {
    fn new(period: Duration) -> Self {
        Self { stamps: BTreeMap::new(), changed: false, period, last_check: Instant::now() }
    }

    /// Adds the files of another list, as they were when its files were read.
    fn add(&mut self, later: Self) {
        self.stamps.extend(later.stamps);
        self.changed |= later.changed;
    }

    fn watch(&mut self, path: &Path, found: Stamp) {
        match self.stamps.get_mut(path) {
            Some(known) => self.changed |= std::mem::replace(known, found) != found,
            None => _ = self.stamps.insert(path.to_owned(), found),
        }
    }

    fn changed(&mut self, now: Instant) -> bool {
        if now.saturating_duration_since(self.last_check) < self.period {
            return false;
        }
        self.last_check = now;
        let mut changed = std::mem::take(&mut self.changed);
        for (path, known) in &mut self.stamps {
            let found = stamp(path);
            changed |= std::mem::replace(known, found) != found;
        }
        changed
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn each_change_is_noticed_once_and_at_most_once_in_a_period() {
        let folder = tempfile::tempdir().unwrap();
        let [file, absent] = ["a.glsl", "b.glsl"].map(|name| folder.path().join(name));
        fs::write(&file, "a").unwrap();
        let mut watched = WatchedFiles::new(DEFAULT_PERIOD);
        watched.watch(&file, stamp(&file));
        watched.watch(&absent, stamp(&absent));
        let mut now = Instant::now();
        let mut polls = |watched: &mut WatchedFiles| {
            now += DEFAULT_PERIOD;
            [watched.changed(now), watched.changed(now + DEFAULT_PERIOD / 2)]
        };
        assert_eq!(polls(&mut watched), [false, false]);
        fs::write(folder.path().join("c.glsl"), "another").unwrap();
        assert_eq!(polls(&mut watched), [false, false], "a file that nothing has read");
        fs::write(&file, "ab").unwrap();
        assert_eq!(polls(&mut watched), [true, false]);
        let earlier = SystemTime::now() - Duration::from_secs(60);
        fs::File::options().append(true).open(&file).unwrap().set_modified(earlier).unwrap();
        assert_eq!(polls(&mut watched), [true, false], "the same length at another time");
        fs::write(&absent, "").unwrap();
        assert_eq!(polls(&mut watched), [true, false]);
        fs::remove_file(&file).unwrap();
        assert_eq!([polls(&mut watched), polls(&mut watched)], [[true, false], [false, false]]);
    }

    /// The first of two modules of a build has the old text and fails, the second has the new one.
    #[test]
    fn a_change_within_a_build_that_fails_is_not_lost() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("shared.glsl");
        fs::write(&file, "a").unwrap();
        let files = ShaderFiles::new();
        files.set_period(Duration::ZERO);
        files.watch(&file);
        let failed = files.sibling();
        failed.watch(&file);
        fs::write(&file, "ab").unwrap();
        failed.watch(&file);
        files.add(&failed);
        assert!(files.changed(), "the first module was not compiled from the new text");
        assert!(!files.changed());
    }

    #[test]
    fn a_change_between_two_reads_is_not_lost() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("shared.glsl");
        fs::write(&file, "a").unwrap();
        let files = ShaderFiles::new();
        files.set_period(Duration::ZERO);
        files.watch(&file);
        fs::write(&file, "ab").unwrap();
        files.watch(&file);
        assert!(files.changed(), "the first reader has the old text");
        files.watch(&file);
        assert!(!files.changed());
    }

    #[test]
    fn a_failed_build_adds_its_files() {
        let (files, later) = (ShaderFiles::new(), ShaderFiles::new());
        files.watch(Path::new("/nowhere/a"));
        later.watch(Path::new("/nowhere/b"));
        files.add(&later);
        assert_eq!(files.paths(), ["/nowhere/a", "/nowhere/b"].map(PathBuf::from));
    }
}
