//! Downloads Debian packages without root: `apt-get` resolves, verifies and downloads them into a private folder.

mod apt_config;
mod mirror;
mod parse_output;

use std::ffi::OsStr;
use std::fs::{self, File};
use std::io::{self, BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use crate::error::DownloadError;
use crate::file;
use crate::platform::HAS_PACKAGES;
use mirror::Mirror;

/// A private apt state with up-to-date package lists.
pub(super) struct Apt<'a> {
    /// Inherited by every package tool, which keeps the lock even if this process is killed.
    lock: &'a File,
    work: PathBuf,
    mirror: Mirror,
    index_size: Option<String>,
}

/// A request to download packages together.
#[derive(Clone, Copy, Debug)]
pub(super) struct PackageRequest {
    /// Names of the packages.
    pub(super) packages: &'static [&'static str],
    /// Also download the dependencies.
    pub(super) with_dependencies: bool,
    /// The suite of the packages.
    pub(super) suite: Suite,
}

/// A suite of Debian's archive besides the stable release.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Suite {
    /// Newer versions for the stable release.
    Backports,
    /// Security updates.
    Security,
}

/// The packages and the size of a [`PackageRequest`].
#[derive(Clone, Debug, Default)]
pub(super) struct DownloadPlan {
    /// Name and version of each requested package, without the dependencies.
    pub(super) packages: Vec<(String, String)>,
    /// Download size with the dependencies.
    pub(super) size_bytes: u64,
}

impl<'a> Apt<'a> {
    /// Creates the state in the empty folder `work` and downloads the package lists from the system's mirror, or from
    /// `deb.debian.org` if that fails. `progress` gets percent.
    pub(super) fn open(
        work: &Path,
        lock: &'a File,
        mut progress: impl FnMut(f64),
    ) -> Result<Self, DownloadError> {
        check_requirements()?;
        for folder in ["state/lists/partial", "cache/archives/partial", "log", "download"] {
            let path = work.join(folder);
            file::create_dir_all(&path)?;
        }
        file::write(&work.join("state/status"), apt_config::dpkg_status(&libc_version()?))?;
        file::write(&work.join("apt.conf"), apt_config::apt_conf(work))?;
        let mut last_error = DownloadError::MissingTool { what: "a package source".to_owned() };
        for mirror in Mirror::candidates(Path::new("/etc/apt")) {
            file::write(&work.join("debian.sources"), apt_config::debian_sources(&mirror))?;
            let mut apt = Self { lock, work: work.to_path_buf(), mirror, index_size: None };
            match apt.run(&["update", "-q"], &mut progress) {
                Ok(text) => {
                    apt.index_size = parse_output::downloaded_size(&text).map(str::to_owned);
                    return Ok(apt);
                }
                Err(error) => last_error = error,
            }
        }
        Err(last_error)
    }

    /// Returns the address and name of `suite` for messages, without credentials.
    pub(super) fn origin(&self, suite: Suite) -> String {
        let (address, name) = match suite {
            Suite::Backports => (&self.mirror.archive, apt_config::BACKPORTS),
            Suite::Security => (&self.mirror.security, apt_config::SECURITY),
        };
        format!("{} {name}", without_credentials(address))
    }

    /// Returns the download size of the package lists, as apt prints it.
    pub(super) fn index_size(&self) -> Option<&str> {
        self.index_size.as_deref()
    }

    /// Returns the packages and the size that `request` would download now.
    pub(super) fn plan(&self, request: PackageRequest) -> Result<DownloadPlan, DownloadError> {
        let text =
            self.run(&[request.arguments(), &["-qq", "--print-uris"], request.packages].concat(), |_| {})?;
        let archives = parse_output::archives(&text);
        let size_bytes = archives.iter().map(|archive| archive.size_bytes).sum();
        let requested =
            archives.into_iter().filter(|archive| request.packages.contains(&archive.name.as_str()));
        Ok(DownloadPlan {
            packages: requested.map(|archive| (archive.name, archive.version)).collect(),
            size_bytes,
        })
    }

    /// Downloads and verifies the packages of `request`, then unpacks them below `tree`. `progress` gets percent.
    pub(super) fn download(
        &self,
        request: PackageRequest,
        tree: &Path,
        mut progress: impl FnMut(f64),
    ) -> Result<(), DownloadError> {
        const DOWNLOAD_SHARE: f64 = 0.6;
        self.run(&[request.arguments(), &["-qq"], request.packages].concat(), |percent| {
            progress(percent * DOWNLOAD_SHARE)
        })?;
        let folder = self.work.join(if request.with_dependencies { "cache/archives" } else { "download" });
        let archives = debian_archives(&folder)?;
        for (index, archive) in archives.iter().enumerate() {
            unpack(archive, tree, self.lock)?;
            fs::remove_file(archive).map_err(DownloadError::file("remove", archive))?;
            let unpacked = (index + 1) as f64 / archives.len() as f64;
            progress(100.0 * (DOWNLOAD_SHARE + (1.0 - DOWNLOAD_SHARE) * unpacked));
        }
        Ok(())
    }

    /// Runs `apt-get` and returns its output.
    fn run(&self, arguments: &[&str], mut progress: impl FnMut(f64)) -> Result<String, DownloadError> {
        let mut command = Command::new("apt-get");
        command.arg("-c").arg(self.work.join("apt.conf")).args(["-o", "APT::Status-Fd=1"]).args(arguments);
        command.current_dir(self.work.join("download")).stdin(stdin_with_lock(self.lock));
        let on_line = |line: &str| {
            if let Some(percent) = parse_output::percent_done(line) {
                progress(percent);
            }
        };
        run_and_capture(command, &format!("apt-get {}", arguments.join(" ")), on_line)
    }
}

impl PackageRequest {
    fn arguments(&self) -> &'static [&'static str] {
        if self.with_dependencies { &["install", "--download-only"] } else { &["download"] }
    }
}

/// Returns the lock file as standard input of a tool: the input is empty, and the tool keeps the lock while it runs. Other
/// child processes must not inherit the lock, or they would wait for themselves.
fn stdin_with_lock(lock: &File) -> Stdio {
    lock.try_clone().map_or_else(|_| Stdio::null(), Stdio::from)
}

/// Runs `command`, passes each line of its output to `on_line`, and returns the whole output.
fn run_and_capture(
    mut command: Command,
    description: &str,
    mut on_line: impl FnMut(&str),
) -> Result<String, DownloadError> {
    command.env("LC_ALL", "C").env_remove("APT_CONFIG");
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    let failed = |message: String| DownloadError::PackageTool { command: description.to_owned(), message };
    let mut child = command.spawn().map_err(|error| match error.kind() {
        io::ErrorKind::NotFound => {
            DownloadError::MissingTool { what: lvk::readable_name(command.get_program()) }
        }
        _ => failed(error.to_string()),
    })?;
    let errors = child.stderr.take().map(|mut stream| {
        std::thread::spawn(move || {
            let mut bytes = Vec::new();
            // A partly read message is still the best one available.
            let _ = stream.read_to_end(&mut bytes);
            String::from_utf8_lossy(&bytes).into_owned()
        })
    });
    let text = read_lines(&mut child, &mut on_line).map_err(|error| failed(error.to_string()))?;
    let status = child.wait().map_err(|error| failed(error.to_string()))?;
    let errors = errors.and_then(|thread| thread.join().ok()).unwrap_or_default();
    if status.success() { Ok(text) } else { Err(failed(parse_output::first_error(&errors))) }
}

fn read_lines(child: &mut Child, on_line: &mut impl FnMut(&str)) -> io::Result<String> {
    let mut text = String::new();
    for line in child.stdout.take().into_iter().flat_map(|stream| BufReader::new(stream).lines()) {
        let line = line?;
        on_line(&line);
        text.push_str(&line);
        text.push('\n');
    }
    Ok(text)
}

/// Checks the platform, and that Debian's keyring, the root of trust, is installed.
fn check_requirements() -> Result<(), DownloadError> {
    if !HAS_PACKAGES {
        return Err(DownloadError::Platform);
    }
    let keyring = apt_config::keyring();
    if keyring.is_file() {
        Ok(())
    } else {
        Err(DownloadError::MissingTool { what: lvk::readable_name(keyring) })
    }
}

fn libc_version() -> Result<String, DownloadError> {
    let mut command = Command::new("dpkg-query");
    command.args(["-W", "-f", "${Version}", "libc6:amd64"]).stdin(Stdio::null());
    run_and_capture(command, "dpkg-query -W libc6", |_| {}).map(|text| text.trim().to_owned())
}

fn unpack(archive: &Path, tree: &Path, lock: &File) -> Result<(), DownloadError> {
    let mut command = Command::new("dpkg-deb");
    command.arg("--extract").arg(archive).arg(tree).stdin(stdin_with_lock(lock));
    run_and_capture(command, &format!("dpkg-deb --extract {}", archive.display()), |_| {}).map(drop)
}

fn debian_archives(folder: &Path) -> Result<Vec<PathBuf>, DownloadError> {
    let entries = fs::read_dir(folder).map_err(DownloadError::file("list", folder))?;
    let paths = entries.flatten().map(|entry| entry.path());
    Ok(paths.filter(|path| path.extension() == Some(OsStr::new("deb"))).collect())
}

fn without_credentials(address: &str) -> String {
    let Some((scheme, rest)) = address.split_once("://") else { return address.to_owned() };
    let host = rest.split('/').next().unwrap_or_default();
    let secret_bytes = host.rfind('@').map_or(0, |at| at + 1);
    format!("{scheme}://{}", &rest[secret_bytes..])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn credentials_stay_out_of_messages() {
        assert_eq!(without_credentials("https://u:p@near/debian"), "https://near/debian");
        assert_eq!(without_credentials("https://near/a@b"), "https://near/a@b");
        assert_eq!(without_credentials("file:/srv/debian"), "file:/srv/debian");
    }

    #[cfg(unix)]
    #[test]
    fn a_failing_program_is_named_with_its_first_error() {
        let mut command = Command::new("sh");
        command.args(["-c", "echo fine; echo 'E: no such suite' >&2; exit 100"]);
        let message = run_and_capture(command, "the command", |_| {}).unwrap_err().to_string();
        assert_eq!(message, "`the command` failed: no such suite");
    }

    #[test]
    fn a_missing_program_is_named() {
        let error = run_and_capture(Command::new("no-such-program-here"), "x", |_| {}).unwrap_err();
        assert!(matches!(error, DownloadError::MissingTool { what } if what == "no-such-program-here"));
    }
}
