//! Folders and disks that cannot be written to: a failed cache is a warning, a failed picture is an error, and both name the file.

use std::fs;
use std::os::unix::fs::PermissionsExt as _;
use std::path::Path;
use std::process::Command;

use crate::kill_point::{KillPoint, wait_for};
use crate::program::{Desk, Ended, Task, has_device};

/// Runs `words` without the right to write where the permissions forbid it, which the superuser has. `None`, loudly, where that
/// right cannot be given up.
fn run_unprivileged(desk: &Desk, words: &[String], read_only: &Path) -> Option<Ended> {
    let rights = "-dac_override,-dac_read_search";
    let prefix = match rustix::process::geteuid().is_root() {
        true => &["setpriv", "--bounding-set", rights, "--inh-caps", rights][..],
        false => &["env"],
    };
    let with_prefix = |words: &[String]| -> Vec<String> {
        prefix.iter().map(|word| (*word).to_owned()).chain(words.iter().cloned()).collect()
    };
    let probe = read_only.join("probe");
    let made = desk.command(&with_prefix(&["mkdir".to_owned(), probe.display().to_string()])).output();
    if made.is_err() || probe.exists() {
        eprintln!("NOT TESTED, setpriv cannot take the superuser's rights: {made:?}");
        let _ = fs::remove_dir(probe);
        return None;
    }
    Some(desk.run_command(desk.command(&with_prefix(words))))
}

/// Forbids or allows to write to a folder.
fn set_writable(folder: &Path, is_writable: bool) {
    let mode = if is_writable { 0o755 } else { 0o555 };
    fs::set_permissions(folder, fs::Permissions::from_mode(mode)).unwrap();
}

/// Fails unless the picture was written, each warning names a file below the cache folder, and there are warnings.
fn assert_only_cache_failed(desk: &Desk, ended: &Ended, reason: &str) {
    ended.assert_success();
    desk.assert_complete();
    let cache = desk.cache().display().to_string();
    assert!(!ended.warnings().is_empty(), "{}", ended.err);
    for warning in ended.warnings() {
        assert!(warning.contains(&cache) && warning.contains(reason), "{warning}");
    }
}

#[test]
fn a_read_only_cache_folder_is_warned_of() {
    if !has_device() {
        return;
    }
    for task in [Task::Small, Task::Structures] {
        let desk = Desk::new(task);
        set_writable(&desk.cache(), false);
        let ended = run_unprivileged(&desk, &desk.words(), &desk.cache());
        set_writable(&desk.cache(), true);
        let Some(ended) = ended else { return };
        assert_only_cache_failed(&desk, &ended, "ermission denied");
        assert_eq!(fs::read_dir(desk.cache()).unwrap().count(), 0);
        desk.assert_next_start();
    }
}

#[test]
fn a_filled_read_only_cache_is_used() {
    if !has_device() {
        return;
    }
    let desk = Desk::new(Task::Small);
    desk.run().assert_success();
    set_writable(&desk.cache(), false);
    let ended = run_unprivileged(&desk, &desk.words(), &desk.cache());
    set_writable(&desk.cache(), true);
    let Some(ended) = ended else { return };
    ended.assert_success();
    assert!(ended.warnings().is_empty(), "{}", ended.err);
    desk.assert_complete();
}

#[test]
fn a_read_only_folder_of_pictures_is_an_error_before_any_work() {
    if !has_device() {
        return;
    }
    for task in [Task::Small, Task::Sequence] {
        let desk = Desk::new(task);
        set_writable(&desk.output(), false);
        let ended = run_unprivileged(&desk, &desk.words(), &desk.output());
        set_writable(&desk.output(), true);
        let Some(ended) = ended else { return };
        ended.assert_error(&["cannot write", &desk.output().display().to_string(), "ermission denied"]);
        assert!(crate::program::paths(&desk.output()).is_empty() && desk.leftovers().is_empty());
        assert_eq!(fs::read_dir(desk.cache()).unwrap().count(), 0, "it has begun to work");
    }
}

#[test]
fn a_cache_folder_that_is_removed_while_the_program_runs_is_no_obstacle() {
    if !has_device() {
        return;
    }
    for number in [1, 3] {
        let desk = Desk::new(Task::Small);
        let mut child = desk.start(0);
        assert!(wait_for(KillPoint::Completed(number), &desk, &mut child), "the caches stayed empty");
        // Files that appear meanwhile keep the folder from being removed.
        while fs::remove_dir_all(desk.cache()).is_err() && desk.cache().exists() {}
        let ended = desk.wait(child, 0);
        ended.assert_success();
        desk.assert_complete();
        let cache = desk.cache().display().to_string();
        assert!(ended.warnings().iter().all(|warning| warning.contains(&cache)), "{}", ended.err);
        assert!(desk.leftovers().is_empty());
        desk.assert_next_start();
    }
}

#[test]
fn a_file_in_place_of_the_cache_folder_is_warned_of() {
    if !has_device() {
        return;
    }
    let desk = Desk::new(Task::Small);
    fs::remove_dir(desk.cache()).unwrap();
    fs::write(desk.cache(), "mine").unwrap();
    let ended = desk.run();
    assert_only_cache_failed(&desk, &ended, "File exists");
    assert_eq!(fs::read_to_string(desk.cache()).unwrap(), "mine");
}

#[test]
fn a_folder_in_place_of_a_cache_file_is_warned_of() {
    if !has_device() {
        return;
    }
    let desk = Desk::new(Task::Small);
    fs::create_dir(desk.cache().join("rtx_hello.pipelines")).unwrap();
    let ended = desk.run();
    assert_only_cache_failed(&desk, &ended, "rtx_hello.pipelines");
    assert!(desk.leftovers().is_empty());
}

/// Runs a shell script with the words of the program as `"$@"`.
fn script(desk: &Desk, prefix: &[&str], text: &str, words: &[String]) -> Command {
    let mut all: Vec<String> = prefix.iter().map(|word| (*word).to_owned()).collect();
    all.extend(["sh", "-c", text, "sh"].map(str::to_owned));
    all.extend(words.iter().cloned());
    desk.command(&all)
}

#[test]
fn a_limit_of_file_sizes_that_the_software_driver_does_not_survive_is_an_error() {
    if !has_device() || std::env::var("LVK_DRIVER").is_ok() {
        return;
    }
    let desk = Desk::new(Task::Small);
    let ended = desk.run_command(script(&desk, &[], "ulimit -f 65536; exec \"$@\"", &desk.words()));
    if ended.status.code() == Some(0) {
        eprintln!("NOT TESTED, the driver is no software driver that was fetched");
        return;
    }
    assert_eq!(ended.status.code(), Some(1), "{:?} {}", ended.status, ended.err);
    for part in ["files of this process", "needs 256 MiB", "ulimit -f unlimited"] {
        assert!(ended.err.contains(part), "{}", ended.err);
    }
    assert!(desk.leftovers().is_empty() && crate::program::paths(&desk.output()).is_empty());
}

/// Prefix of a command that may mount file systems for itself; `None`, loudly, where that is forbidden.
fn mounting() -> Option<&'static [&'static str]> {
    const PREFIX: &[&str] = &["unshare", "--user", "--map-root-user", "--mount"];
    let tried =
        Command::new(PREFIX[0]).args(&PREFIX[1..]).args(["mount", "-t", "tmpfs", "none", "/mnt"]).output();
    if tried.as_ref().is_ok_and(|output| output.status.success()) {
        return Some(PREFIX);
    }
    eprintln!("NOT TESTED, no file system can be mounted: {tried:?}");
    None
}

/// Mounts a file system of so many bytes on `folder`, runs the program, and writes the names of the files there to standard error.
/// They are lost with the file system.
fn run_on_small_disk(desk: &Desk, prefix: &[&str], folder: &Path, bytes: u64) -> Ended {
    let folder = folder.display();
    let text = format!(
        "mount -t tmpfs -o size={bytes} none '{folder}' && {{ \"$@\"; status=$?; \
         find '{folder}' -type f -exec echo 'file {{}}' \\; >&2; exit $status; }}"
    );
    desk.run_command(script(desk, prefix, &text, &desk.words()))
}

/// Names of the files on the disk of [`run_on_small_disk`].
fn files_on_disk(ended: &Ended) -> Vec<&str> {
    ended.err.lines().filter_map(|line| line.strip_prefix("file ")).collect()
}

#[test]
fn a_full_disk_of_the_caches_is_warned_of() {
    let Some(prefix) = mounting().filter(|_| has_device()) else { return };
    for (task, bytes) in [(Task::Small, 4096), (Task::Small, 32768), (Task::Structures, 16384)] {
        let desk = Desk::new(task);
        let ended = run_on_small_disk(&desk, prefix, &desk.cache(), bytes);
        assert_only_cache_failed(&desk, &ended, "No space left on device");
        let files = files_on_disk(&ended);
        assert!(!files.iter().any(|file| crate::program::is_temporary(Path::new(file))), "{files:?}");
    }
}

#[test]
fn a_full_disk_of_the_pictures_is_an_error_and_earlier_pictures_stay() {
    let Some(prefix) = mounting().filter(|_| has_device()) else { return };
    let mut written = Vec::new();
    for bytes in [4096, 16384] {
        let desk = Desk::new(Task::Sequence);
        let ended = run_on_small_disk(&desk, prefix, &desk.output(), bytes);
        let output = desk.output().display().to_string();
        ended.assert_error(&["cannot write", &output, "frame_000", "No space left on device"]);
        let files = files_on_disk(&ended);
        assert!(!files.iter().any(|file| crate::program::is_temporary(Path::new(file))), "{files:?}");
        written.push(files.len());
    }
    assert!(written[0] < written[1], "{written:?}");
}

#[test]
fn a_full_device_is_no_picture_and_no_reason_to_stop() {
    if !has_device() {
        return;
    }
    let desk = Desk::new(Task::Small);
    let ended = desk.run_command(desk.command(&desk.words_to(Path::new("/dev/full"))));
    ended.assert_error(&["/dev/full", "a device"]);
    assert_eq!(fs::read_dir(desk.cache()).unwrap().count(), 0, "it has begun to work");
    // Lines that cannot be printed are lost, the picture is not.
    let ended = desk.run_command(script(&desk, &[], "exec \"$@\" >/dev/full 2>/dev/full", &desk.words()));
    ended.assert_success();
    desk.assert_complete();
}
