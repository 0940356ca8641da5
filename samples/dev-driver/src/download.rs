//! Downloads missing components: one process at a time, all or nothing, with one line of output.

use std::fs::{self, File, TryLockError};
use std::io;
use std::path::Path;

use indicatif::{ProgressBar, ProgressStyle};

use crate::apt::{Apt, DownloadPlan};
use crate::error::DownloadError;
use crate::file;
use crate::install::install;
use crate::layout::{Component, Manifest};

/// Downloads those of `components` that are incomplete below `root`. Concurrent processes wait for each other. Removes the
/// files of an interrupted download first.
pub(super) fn download_missing(root: &Path, components: &[Component]) -> Result<(), DownloadError> {
    file::create_dir_all(root)?;
    let lock = lock_folder(root)?;
    let missing: Vec<Component> = components
        .iter()
        .copied()
        .filter(|component| Manifest::read(&component.folder(root)).is_none())
        .collect();
    if missing.is_empty() {
        return Ok(());
    }
    let work = root.join("fetch.partial");
    remove_folder(&work)?;
    for component in Component::ALL {
        remove_folder(&component.staging_folder(root))?;
    }
    fs::create_dir(&work).map_err(DownloadError::file("create", &work))?;
    let outcome = download_and_install(root, &work, &lock, &missing);
    let removed = remove_folder(&work);
    outcome.and(removed)
}

fn download_and_install(
    root: &Path,
    work: &Path,
    lock: &File,
    components: &[Component],
) -> Result<(), DownloadError> {
    let apt = with_progress("reading package lists", |progress| Apt::open(work, lock, progress))?;
    let plans =
        components.iter().map(|component| apt.plan(component.packages())).collect::<Result<Vec<_>, _>>()?;
    let items: Vec<_> = components
        .iter()
        .zip(&plans)
        .map(|(component, plan)| (component.title(), plan, apt.origin(component.packages().suite)))
        .collect();
    eprintln!("{}", announcement(&items, apt.index_size(), root));
    for (component, plan) in components.iter().zip(plans) {
        let tree = work.join("tree");
        let message = format!("downloading the {}", component.title());
        with_progress(&message, |progress| apt.download(component.packages(), &tree, progress))?;
        install_atomically(root, *component, plan, &tree)?;
        remove_folder(&tree)?;
    }
    Ok(())
}

/// Assembles the folder of `component` in its staging folder and renames that to the final folder.
fn install_atomically(
    root: &Path,
    component: Component,
    plan: DownloadPlan,
    tree: &Path,
) -> Result<(), DownloadError> {
    let (partial, folder) = (component.staging_folder(root), component.folder(root));
    let manifest = Manifest { packages: plan.packages, ..install(component, tree, &partial)? };
    manifest.write(&partial).map_err(DownloadError::file("write the manifest of", &partial))?;
    sync_to_disk(&partial)?;
    remove_folder(&folder)?;
    file::rename(&partial, &folder)
}

/// Waits until `folder` is on the disk: a power failure must not leave a manifest beside incomplete libraries.
fn sync_to_disk(folder: &Path) -> Result<(), DownloadError> {
    let listed = || DownloadError::file("list", folder);
    for entry in fs::read_dir(folder).map_err(listed())? {
        let entry = entry.map_err(listed())?;
        let kind = entry.file_type().map_err(listed())?;
        if kind.is_dir() {
            sync_to_disk(&entry.path())?;
        } else if kind.is_file() {
            sync_file(&entry.path())?;
        }
    }
    // Windows neither opens folders nor needs it.
    if cfg!(unix) { sync_file(folder) } else { Ok(()) }
}

fn sync_file(path: &Path) -> Result<(), DownloadError> {
    // Windows flushes files that are open for writing only.
    let opened = File::options().read(true).write(cfg!(windows)).open(path);
    opened.and_then(|file| file.sync_all()).map_err(DownloadError::file("flush", path))
}

/// Returns one line with the title, packages, origin and size of each item.
fn announcement(items: &[(&str, &DownloadPlan, String)], index: Option<&str>, root: &Path) -> String {
    let describe = |(title, plan, origin): &(&str, &DownloadPlan, String)| {
        let packages = plan.packages.iter().map(|(name, version)| format!("{name} {version}"));
        format!("{title} ({}) from {origin}", packages.collect::<Vec<_>>().join(", "))
    };
    let what: Vec<String> = items.iter().map(describe).collect();
    let size_bytes: u64 = items.iter().map(|(_, plan, _)| plan.size_bytes).sum();
    let index = index.map(|size| format!(" after {size} of package lists")).unwrap_or_default();
    format!(
        "lvk: not installed, downloading once: {}; {:.0} MB{index}, into {}",
        what.join(" and "),
        size_bytes as f64 / 1e6,
        lvk::readable_name(root)
    )
}

/// Runs `job` with a progress bar, which is visible on a terminal only.
fn with_progress<T>(message: &str, job: impl FnOnce(&dyn Fn(f64)) -> T) -> T {
    let bar = ProgressBar::new(100).with_message(message.to_owned());
    if let Ok(style) = ProgressStyle::with_template("{msg} {bar:30} {percent}%") {
        bar.set_style(style);
    }
    let outcome = job(&|percent| bar.set_position(percent as u64));
    bar.finish_and_clear();
    outcome
}

/// Locks `root`. The lock ends when the returned file and its copies in child processes are closed. A package tool that
/// outlives a killed process therefore keeps the lock and cannot write into the next attempt.
fn lock_folder(root: &Path) -> Result<File, DownloadError> {
    let lock_file = file::open_lock(root)?;
    let locked = match lock_file.try_lock() {
        Ok(()) => Ok(()),
        Err(TryLockError::WouldBlock) => {
            eprintln!(
                "lvk: another process is downloading into {}; waiting for it",
                lvk::readable_name(root)
            );
            wait_for_lock(&lock_file)
        }
        Err(TryLockError::Error(error)) => Err(error),
    };
    locked.map_err(DownloadError::file("lock", root))?;
    Ok(lock_file)
}

/// Waits for the lock, also if signals interrupt the call.
fn wait_for_lock(file: &File) -> io::Result<()> {
    loop {
        match file.lock() {
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            locked => return locked,
        }
    }
}

/// Removes a folder and its contents. Succeeds if the folder does not exist.
fn remove_folder(folder: &Path) -> Result<(), DownloadError> {
    match fs::remove_dir_all(folder) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => {
            Err(DownloadError::file("remove", folder)(error))
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn one_line_names_packages_origin_size_and_folder() {
        let plan = |name: &str, size_bytes| DownloadPlan {
            packages: vec![(name.into(), "1.2-3".into())],
            size_bytes,
        };
        let (driver, layer) = (plan("mesa", 56_400_000), plan("chromium", 31_600_000));
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
    fn complete_components_need_no_download() {
        let root = tempfile::tempdir().unwrap();
        let folder = Component::Driver.folder(root.path());
        fs::create_dir(&folder).unwrap();
        Manifest::default().write(&folder).unwrap();
        download_missing(root.path(), &[Component::Driver]).unwrap();
        assert_eq!(Manifest::read(&folder), Some(Manifest::default()));
    }

    #[test]
    fn the_lock_excludes_until_dropped() {
        let root = tempfile::tempdir().unwrap();
        let held = lock_folder(root.path()).unwrap();
        let other = File::open(root.path().join("lock")).unwrap();
        assert!(matches!(other.try_lock(), Err(TryLockError::WouldBlock)));
        drop(held);
        assert!(becomes_free(&other));
    }

    #[cfg(unix)]
    #[test]
    fn an_unrelated_child_process_does_not_keep_the_lock() {
        let root = tempfile::tempdir().unwrap();
        let held = lock_folder(root.path()).unwrap();
        let other = File::open(root.path().join("lock")).unwrap();
        let mut child = std::process::Command::new("sleep").arg("60").spawn().unwrap();
        drop(held);
        let is_free = becomes_free(&other);
        child.kill().unwrap();
        child.wait().unwrap();
        assert!(is_free);
    }

    /// Locks the file. A process that another test forks at this moment holds a copy of the file until `exec`.
    fn becomes_free(file: &File) -> bool {
        (0..500).any(|_| {
            let is_free = file.try_lock().is_ok();
            std::thread::sleep(Duration::from_millis(if is_free { 0 } else { 10 }));
            is_free
        })
    }

    #[test]
    fn folders_and_their_files_are_flushed() {
        let root = tempfile::tempdir().unwrap();
        fs::create_dir(root.path().join("inner")).unwrap();
        fs::write(root.path().join("inner/file"), "text").unwrap();
        sync_to_disk(root.path()).unwrap();
        let absent = root.path().join("absent");
        assert!(sync_to_disk(&absent).unwrap_err().to_string().contains("absent"));
    }
}
