//! Fetching what is missing: one process at a time, all or nothing, and one line that says so.

use std::fs::{self, File};
use std::path::Path;

use indicatif::{ProgressBar, ProgressStyle};
use rustix::fs::FlockOperation;

use super::apt::{Apt, Quote};
use super::assemble::assemble;
use super::error::FetchError;
use super::prefix::{Manifest, Part};

/// Makes `parts` complete below `root`. Processes that want the same wait for each other; what an interrupted
/// one left behind is removed first.
pub(super) fn provision(root: &Path, parts: &[Part]) -> Result<(), FetchError> {
    fs::create_dir_all(root).map_err(FetchError::file("create", root))?;
    let lock = lock(root)?;
    let missing: Vec<Part> =
        parts.iter().copied().filter(|part| Manifest::read(&part.folder(root)).is_none()).collect();
    if missing.is_empty() {
        return Ok(());
    }
    let work = root.join("fetch.partial");
    remove(&work)?;
    for part in Part::ALL {
        remove(&part.partial_folder(root))?;
    }
    fs::create_dir(&work).map_err(FetchError::file("create", &work))?;
    let outcome = fetch(root, &work, &lock, &missing);
    let removed = remove(&work);
    outcome.and(removed)
}

fn fetch(root: &Path, work: &Path, lock: &File, parts: &[Part]) -> Result<(), FetchError> {
    let apt = with_progress("reading package lists", |progress| Apt::open(work, lock, progress))?;
    let quotes = parts.iter().map(|part| apt.quote(part.order())).collect::<Result<Vec<_>, _>>()?;
    let items: Vec<_> = parts
        .iter()
        .zip(&quotes)
        .map(|(part, quote)| (part.title(), quote, apt.origin(part.order().suite)))
        .collect();
    eprintln!("{}", announcement(&items, apt.index_size(), root));
    for (part, quote) in parts.iter().zip(quotes) {
        let tree = work.join("tree");
        let message = format!("fetching the {}", part.title());
        with_progress(&message, |progress| apt.fetch(part.order(), &tree, progress))?;
        complete(root, *part, quote, &tree)?;
        remove(&tree)?;
    }
    Ok(())
}

/// Builds the folder of `part` beside its final place and moves it there in one step.
fn complete(root: &Path, part: Part, quote: Quote, tree: &Path) -> Result<(), FetchError> {
    let (partial, folder) = (part.partial_folder(root), part.folder(root));
    let manifest = Manifest { packages: quote.packages, ..assemble(part, tree, &partial)? };
    manifest.write(&partial).map_err(FetchError::file("write the manifest of", &partial))?;
    sync(&partial)?;
    remove(&folder)?;
    fs::rename(&partial, &folder).map_err(FetchError::file("move", &partial))
}

/// Waits until `folder` is on the disk: a power cut must not leave a manifest beside half a library.
fn sync(folder: &Path) -> Result<(), FetchError> {
    let handle = File::open(folder).map_err(FetchError::file("open", folder))?;
    rustix::fs::syncfs(&handle).map_err(|error| FetchError::file("flush", folder)(error.into()))
}

/// One line with title, packages, source and size of each item.
fn announcement(items: &[(&str, &Quote, String)], index: Option<&str>, root: &Path) -> String {
    let describe = |(title, quote, origin): &(&str, &Quote, String)| {
        let packages = quote.packages.iter().map(|(name, version)| format!("{name} {version}"));
        format!("{title} ({}) from {origin}", packages.collect::<Vec<_>>().join(", "))
    };
    let what: Vec<String> = items.iter().map(describe).collect();
    let size_bytes: u64 = items.iter().map(|(_, quote, _)| quote.size_bytes).sum();
    let index = index.map(|size| format!(" after {size} of package lists")).unwrap_or_default();
    format!(
        "lvk: not on this machine, fetching once: {}; {:.0} MB{index}, into {}",
        what.join(" and "),
        size_bytes as f64 / 1e6,
        root.display()
    )
}

/// Runs `job` under a progress bar, which shows nothing unless a person watches.
fn with_progress<T>(message: &str, job: impl FnOnce(&dyn Fn(f64)) -> T) -> T {
    let bar = ProgressBar::new(100).with_message(message.to_owned());
    if let Ok(style) = ProgressStyle::with_template("{msg} {bar:30} {percent}%") {
        bar.set_style(style);
    }
    let outcome = job(&|percent| bar.set_position(percent as u64));
    bar.finish_and_clear();
    outcome
}

/// Takes the lock of `root`. It ends with the returned file and with the package tools that were handed it, so that one
/// that outlives a killed process is waited for and cannot write into the next attempt.
fn lock(root: &Path) -> Result<File, FetchError> {
    let path = root.join("lock");
    let options = File::options().read(true).write(true).create(true).truncate(false).open(&path);
    let file = options.map_err(FetchError::file("create", &path))?;
    if rustix::fs::flock(&file, FlockOperation::NonBlockingLockExclusive).is_err() {
        eprintln!("lvk: another process is fetching into {}; waiting for it", root.display());
        let locked = rustix::io::retry_on_intr(|| rustix::fs::flock(&file, FlockOperation::LockExclusive));
        locked.map_err(|error| FetchError::file("lock", &path)(error.into()))?;
    }
    Ok(file)
}

/// Removes a folder with all in it; one that is not there is removed already.
fn remove(folder: &Path) -> Result<(), FetchError> {
    match fs::remove_dir_all(folder) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            Err(FetchError::file("remove", folder)(error))
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn one_line_names_packages_source_size_and_place() {
        let quote =
            |name: &str, size_bytes| Quote { packages: vec![(name.into(), "1.2-3".into())], size_bytes };
        let (driver, layer) = (quote("mesa", 56_400_000), quote("chromium", 31_600_000));
        let items =
            [("driver", &driver, "http://near backports".into()), ("layer", &layer, "http://far sec".into())];
        let line = announcement(&items, Some("9,500 kB"), Path::new("/p"));
        for part in [
            "driver (mesa 1.2-3) from http://near backports",
            "layer (chromium 1.2-3) from http://far sec",
            "88 MB after 9,500 kB",
            "/p",
        ] {
            assert!(line.contains(part), "{part} in {line}");
        }
        assert_eq!(line.lines().count(), 1);
    }

    #[test]
    fn complete_parts_need_no_fetch() {
        let root = tempfile::tempdir().unwrap();
        let folder = Part::Driver.folder(root.path());
        fs::create_dir(&folder).unwrap();
        Manifest::default().write(&folder).unwrap();
        provision(root.path(), &[Part::Driver]).unwrap();
        assert_eq!(Manifest::read(&folder), Some(Manifest::default()));
    }

    #[test]
    fn the_lock_excludes_until_dropped() {
        let root = tempfile::tempdir().unwrap();
        let held = lock(root.path()).unwrap();
        let other = File::open(root.path().join("lock")).unwrap();
        assert!(rustix::fs::flock(&other, FlockOperation::NonBlockingLockExclusive).is_err());
        let bystander = std::process::Command::new("sleep").arg("60").spawn();
        drop(held);
        // A process that another test starts at this moment holds a copy until it has become its program.
        let is_free = || rustix::fs::flock(&other, FlockOperation::NonBlockingLockExclusive).is_ok();
        let patient = (0..500).any(|_| {
            let free = is_free();
            std::thread::sleep(Duration::from_millis(if free { 0 } else { 10 }));
            free
        });
        assert!(patient, "a bystander holds the lock");
        let mut bystander = bystander.unwrap();
        bystander.kill().unwrap();
        bystander.wait().unwrap();
    }
}
