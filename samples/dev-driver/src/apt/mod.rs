//! Fetching Debian packages as an ordinary user: `apt-get` resolves, verifies and downloads into a private folder.

mod configuration;
mod output;
mod sources;

use std::ffi::OsStr;
use std::fs::{self, File};
use std::io::{self, BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use super::error::FetchError;
use sources::Mirror;

/// A private apt state with up-to-date package lists.
pub(super) struct Apt<'a> {
    /// Held by every package tool that runs, even when this process is killed.
    lock: &'a File,
    work: PathBuf,
    mirror: Mirror,
    index_size: Option<String>,
}

/// Packages to fetch together.
#[derive(Clone, Copy, Debug)]
pub(super) struct Order {
    /// Names of the packages.
    pub(super) packages: &'static [&'static str],
    /// Whether what they depend on comes too.
    pub(super) with_dependencies: bool,
    /// The suite they come from.
    pub(super) suite: Suite,
}

/// A part of Debian's archive that carries what its stable part lacks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Suite {
    /// Newer versions for a stable system.
    Backports,
    /// Security updates.
    Security,
}

/// What an [`Order`] amounts to.
#[derive(Clone, Debug, Default)]
pub(super) struct Quote {
    /// Name and version of each ordered package, without the dependencies.
    pub(super) packages: Vec<(String, String)>,
    /// Download size with the dependencies.
    pub(super) size_bytes: u64,
}

impl<'a> Apt<'a> {
    /// Makes the state in the empty folder `work` and reads the package lists of the machine's mirror, or of
    /// Debian's own network if that one does not serve. `progress` takes percent.
    pub(super) fn open(
        work: &Path,
        lock: &'a File,
        mut progress: impl FnMut(f64),
    ) -> Result<Self, FetchError> {
        require_tools()?;
        for folder in ["state/lists/partial", "cache/archives/partial", "log", "download"] {
            let path = work.join(folder);
            fs::create_dir_all(&path).map_err(FetchError::file("create", &path))?;
        }
        write(&work.join("state/status"), &configuration::status(&libc_version()?))?;
        write(&work.join("apt.conf"), &configuration::settings(work))?;
        let mut refusal = FetchError::MissingTool { what: "a package source".to_owned() };
        for mirror in Mirror::candidates(Path::new("/etc/apt")) {
            write(&work.join("debian.sources"), &configuration::sources(&mirror))?;
            let mut apt = Self { lock, work: work.to_path_buf(), mirror, index_size: None };
            match apt.run(&["update", "-q"], &mut progress) {
                Ok(text) => {
                    apt.index_size = output::fetched(&text).map(str::to_owned);
                    return Ok(apt);
                }
                Err(error) => refusal = error,
            }
        }
        Err(refusal)
    }

    /// Address and name of `suite`, for a person to read; credentials in the address are left out.
    pub(super) fn origin(&self, suite: Suite) -> String {
        let (address, name) = match suite {
            Suite::Backports => (&self.mirror.archive, configuration::BACKPORTS),
            Suite::Security => (&self.mirror.security, configuration::SECURITY),
        };
        format!("{} {name}", without_credentials(address))
    }

    /// How much the package lists took, as apt words it.
    pub(super) fn index_size(&self) -> Option<&str> {
        self.index_size.as_deref()
    }

    /// What `order` would fetch now.
    pub(super) fn quote(&self, order: Order) -> Result<Quote, FetchError> {
        let text = self.run(&[order.verb(), &["-qq", "--print-uris"], order.packages].concat(), |_| {})?;
        let archives = output::archives(&text);
        let size_bytes = archives.iter().map(|archive| archive.size_bytes).sum();
        let ordered = archives.into_iter().filter(|archive| order.packages.contains(&archive.name.as_str()));
        Ok(Quote { packages: ordered.map(|archive| (archive.name, archive.version)).collect(), size_bytes })
    }

    /// Fetches and verifies `order`, then unpacks it below `tree`. `progress` takes percent.
    pub(super) fn fetch(
        &self,
        order: Order,
        tree: &Path,
        mut progress: impl FnMut(f64),
    ) -> Result<(), FetchError> {
        const DOWNLOAD_SHARE: f64 = 0.6;
        self.run(&[order.verb(), &["-qq"], order.packages].concat(), |percent| {
            progress(percent * DOWNLOAD_SHARE)
        })?;
        let folder = self.work.join(if order.with_dependencies { "cache/archives" } else { "download" });
        let archives = debian_archives(&folder)?;
        for (index, archive) in archives.iter().enumerate() {
            unpack(archive, tree, self.lock)?;
            fs::remove_file(archive).map_err(FetchError::file("remove", archive))?;
            let unpacked = (index + 1) as f64 / archives.len() as f64;
            progress(100.0 * (DOWNLOAD_SHARE + (1.0 - DOWNLOAD_SHARE) * unpacked));
        }
        Ok(())
    }

    /// Runs `apt-get` and answers with what it printed.
    fn run(&self, arguments: &[&str], mut progress: impl FnMut(f64)) -> Result<String, FetchError> {
        let mut command = Command::new("apt-get");
        command.arg("-c").arg(self.work.join("apt.conf")).args(["-o", "APT::Status-Fd=1"]).args(arguments);
        command.current_dir(self.work.join("download")).stdin(holding(self.lock));
        let take = |line: &str| {
            if let Some(percent) = output::percent(line) {
                progress(percent);
            }
        };
        capture(command, &format!("apt-get {}", arguments.join(" ")), take)
    }
}

impl Order {
    fn verb(&self) -> &'static [&'static str] {
        if self.with_dependencies { &["install", "--download-only"] } else { &["download"] }
    }
}

/// A standard input that never says anything and keeps the lock as long as the tool runs. Other children of this
/// process must not inherit the lock: they would wait for themselves.
fn holding(lock: &File) -> Stdio {
    lock.try_clone().map_or_else(|_| Stdio::null(), Stdio::from)
}

/// Runs `command`, hands each line of its output to `take`, and answers with the whole output.
fn capture(mut command: Command, shown: &str, mut take: impl FnMut(&str)) -> Result<String, FetchError> {
    command.env("LC_ALL", "C").env_remove("APT_CONFIG");
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    let failed = |message: String| FetchError::PackageTool { command: shown.to_owned(), message };
    let mut child = command.spawn().map_err(|error| match error.kind() {
        io::ErrorKind::NotFound => {
            FetchError::MissingTool { what: command.get_program().display().to_string() }
        }
        _ => failed(error.to_string()),
    })?;
    let complaints = child.stderr.take().map(|mut stream| {
        std::thread::spawn(move || {
            let mut bytes = Vec::new();
            // A half-read complaint is still the best message there is.
            let _ = stream.read_to_end(&mut bytes);
            String::from_utf8_lossy(&bytes).into_owned()
        })
    });
    let text = read_lines(&mut child, &mut take).map_err(|error| failed(error.to_string()))?;
    let status = child.wait().map_err(|error| failed(error.to_string()))?;
    let complaints = complaints.and_then(|thread| thread.join().ok()).unwrap_or_default();
    if status.success() { Ok(text) } else { Err(failed(output::complaint(&complaints))) }
}

fn read_lines(child: &mut Child, take: &mut impl FnMut(&str)) -> io::Result<String> {
    let mut text = String::new();
    for line in child.stdout.take().into_iter().flat_map(|stream| BufReader::new(stream).lines()) {
        let line = line?;
        take(&line);
        text.push_str(&line);
        text.push('\n');
    }
    Ok(text)
}

/// The machine must be of the packages' kind, and its own keyring is the root of trust.
fn require_tools() -> Result<(), FetchError> {
    if !cfg!(all(target_os = "linux", target_arch = "x86_64", target_env = "gnu")) {
        return Err(FetchError::Platform);
    }
    let keyring = configuration::keyring();
    if keyring.is_file() {
        Ok(())
    } else {
        Err(FetchError::MissingTool { what: keyring.display().to_string() })
    }
}

fn libc_version() -> Result<String, FetchError> {
    let mut command = Command::new("dpkg-query");
    command.args(["-W", "-f", "${Version}", "libc6:amd64"]).stdin(Stdio::null());
    capture(command, "dpkg-query -W libc6", |_| {}).map(|text| text.trim().to_owned())
}

fn unpack(archive: &Path, tree: &Path, lock: &File) -> Result<(), FetchError> {
    let mut command = Command::new("dpkg-deb");
    command.arg("--extract").arg(archive).arg(tree).stdin(holding(lock));
    capture(command, &format!("dpkg-deb --extract {}", archive.display()), |_| {}).map(drop)
}

fn debian_archives(folder: &Path) -> Result<Vec<PathBuf>, FetchError> {
    let entries = fs::read_dir(folder).map_err(FetchError::file("list", folder))?;
    let paths = entries.flatten().map(|entry| entry.path());
    Ok(paths.filter(|path| path.extension() == Some(OsStr::new("deb"))).collect())
}

fn write(path: &Path, text: &str) -> Result<(), FetchError> {
    fs::write(path, text).map_err(FetchError::file("write", path))
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

    #[test]
    fn a_failing_program_is_named_with_its_first_error() {
        let mut command = Command::new("sh");
        command.args(["-c", "echo fine; echo 'E: no such suite' >&2; exit 100"]);
        let message = capture(command, "the command", |_| {}).unwrap_err().to_string();
        assert_eq!(message, "`the command` failed: no such suite");
    }

    #[test]
    fn a_missing_program_is_named() {
        let error = capture(Command::new("no-such-program-here"), "x", |_| {}).unwrap_err();
        assert!(matches!(error, FetchError::MissingTool { what } if what == "no-such-program-here"));
    }
}
