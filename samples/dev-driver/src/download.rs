//! Downloads missing components: one process at a time, all or nothing, with one line of output.

use std::fs::{self, File};
use std::path::Path;

use indicatif::{ProgressBar, ProgressStyle};
use rustix::fs::FlockOperation;

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
    let handle = File::open(folder).map_err(DownloadError::file("open", folder))?;
    rustix::fs::syncfs(&handle).map_err(|error| DownloadError::file("flush", folder)(error.into()))
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
        root.display()
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
    let path = root.join("lock");
    let opened = File::options().read(true).write(true).create(true).truncate(false).open(&path);
    let lock_file = opened.map_err(DownloadError::file("create", &path))?;
    if rustix::fs::flock(&lock_file, FlockOperation::NonBlockingLockExclusive).is_err() {
        eprintln!("lvk: another process is downloading into {}; waiting for it", root.display());
        let locked =
            rustix::io::retry_on_intr(|| rustix::fs::flock(&lock_file, FlockOperation::LockExclusive));
        locked.map_err(|error| DownloadError::file("lock", &path)(error.into()))?;
    }
    Ok(lock_file)
}

/// Removes a folder and its contents. Succeeds if the folder does not exist.
fn remove_folder(folder: &Path) -> Result<(), DownloadError> {
    match fs::remove_dir_all(folder) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
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
        assert!(rustix::fs::flock(&other, FlockOperation::NonBlockingLockExclusive).is_err());
        let other_child = std::process::Command::new("sleep").arg("60").spawn();
        drop(held);
        // A process that another test forks at this moment holds a copy of the file until `exec`.
        let is_free = || rustix::fs::flock(&other, FlockOperation::NonBlockingLockExclusive).is_ok();
        let becomes_free = (0..500).any(|_| {
            let free = is_free();
            std::thread::sleep(Duration::from_millis(if free { 0 } else { 10 }));
            free
        });
        assert!(becomes_free, "an unrelated child process holds the lock");
        let mut other_child = other_child.unwrap();
        other_child.kill().unwrap();
        other_child.wait().unwrap();
    }
}
