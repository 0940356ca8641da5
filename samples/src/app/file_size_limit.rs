//! The limit of file sizes (`ulimit -f`) as the error of a write.

/// Lets a write beyond the limit of file sizes fail from now on. Otherwise the signal SIGXFSZ ends the process in the middle
/// of the write.
#[cfg(unix)]
pub(super) fn report_as_error() {
    let unread = std::sync::Arc::default();
    if let Err(error) = signal_hook::flag::register(signal_hook::consts::SIGXFSZ, unread) {
        log::warn!("cannot listen to the limit of file sizes: {error}");
    }
}

/// Other systems have no such signal.
#[cfg(not(unix))]
pub(super) fn report_as_error() {}

#[cfg(all(test, unix))]
mod tests {
    use std::process::Command;

    use super::*;

    const FILE: &str = "LVK_TEST_LIMITED_FILE";

    /// The limit holds for a process, so another one tries to write.
    #[test]
    fn a_write_beyond_the_limit_is_an_error() {
        if let Some(path) = std::env::var_os(FILE) {
            report_as_error();
            let error = lvk::temporary_file::replace_file(path.as_ref(), &[0; 4096]).unwrap_err();
            assert_eq!(error.kind(), std::io::ErrorKind::FileTooLarge);
            return;
        }
        let folder = tempfile::tempdir().unwrap();
        let mut command = Command::new("sh");
        command.args(["-c", "ulimit -f 1; exec \"$0\" \"$@\""]).arg(std::env::current_exe().unwrap());
        let test = "app::file_size_limit::tests::a_write_beyond_the_limit_is_an_error";
        let output = command.args([test, "--exact"]).env(FILE, folder.path().join("a")).output().unwrap();
        let said = String::from_utf8_lossy(&output.stdout);
        assert!(output.status.success() && said.contains("1 passed"), "{:?} {said}", output.status);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
