//! Finds the Debian mirror of this system in its package sources.

use std::fs;
use std::path::{Path, PathBuf};

use crate::file;

const ARCHIVE: &str = "http://deb.debian.org/debian";
const SECURITY: &str = "http://deb.debian.org/debian-security";
const RELEASES: [&str; 9] =
    ["bookworm", "trixie", "forky", "bullseye", "stable", "testing", "unstable", "oldstable", "sid"];

/// A mirror of Debian's archives.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Mirror {
    /// Address of the main archive, which contains the backports.
    pub(super) archive: String,
    /// Address of the security archive.
    pub(super) security: String,
}

/// One package source: every address has every suite.
#[derive(Debug, Default, PartialEq, Eq)]
struct Source {
    addresses: Vec<String>,
    suites: Vec<String>,
    components: Vec<String>,
}

impl Mirror {
    /// Debian's default mirror, `deb.debian.org`.
    pub(super) fn debian() -> Self {
        Self { archive: ARCHIVE.to_owned(), security: SECURITY.to_owned() }
    }

    /// Returns the mirror in the system's configuration, if any, then the default mirror.
    pub(super) fn candidates(configuration: &Path) -> Vec<Self> {
        let mut mirrors = vec![Self::from_sources(&read_sources(configuration)), Self::debian()];
        mirrors.dedup();
        mirrors
    }

    fn from_sources(sources: &[Source]) -> Self {
        let find = |wanted: fn(&Source) -> bool| {
            sources
                .iter()
                .filter(|source| wanted(source))
                .find_map(|source| source.addresses.first().cloned())
        };
        Self {
            archive: find(Source::is_archive).unwrap_or_else(|| ARCHIVE.to_owned()),
            security: find(Source::is_security).unwrap_or_else(|| SECURITY.to_owned()),
        }
    }
}

impl Source {
    fn is_archive(&self) -> bool {
        let is_release = |suite: &String| RELEASES.contains(&suite.trim_end_matches("-updates"));
        let has_updates = self.suites.iter().any(|suite| suite.ends_with("-updates"));
        let looks_like_debian = |address: &String| {
            address.trim_end_matches('/').rsplit('/').next().is_some_and(|last| last.starts_with("debian"))
        };
        self.has_main()
            && self.suites.iter().any(is_release)
            && (has_updates || self.addresses.iter().any(looks_like_debian))
    }

    fn is_security(&self) -> bool {
        let is_release = |suite: &String| {
            suite.strip_suffix("-security").is_some_and(|release| RELEASES.contains(&release))
        };
        self.has_main() && self.suites.iter().any(is_release)
    }

    fn has_main(&self) -> bool {
        self.components.iter().any(|component| component == "main")
    }
}

/// Reads all sources below `configuration` (`/etc/apt`). Skips unreadable files, because the default mirror remains.
fn read_sources(configuration: &Path) -> Vec<Source> {
    let listed = fs::read_dir(configuration.join("sources.list.d")).into_iter().flatten().flatten();
    let mut files: Vec<PathBuf> = listed.map(|entry| entry.path()).collect();
    files.sort();
    files.insert(0, configuration.join("sources.list"));
    let parse = |path: &PathBuf| {
        let text = file::text(path).unwrap_or_default();
        match path.extension().and_then(|extension| extension.to_str()) {
            Some("list") => parse_lines(&text),
            Some("sources") => parse_stanzas(&text),
            _ => Vec::new(),
        }
    };
    files.iter().flat_map(parse).filter(|source| !source.addresses.is_empty()).collect()
}

/// Parses the one-line form, `deb [options] address suite component...`.
fn parse_lines(text: &str) -> Vec<Source> {
    text.lines().filter_map(parse_line).collect()
}

fn parse_line(line: &str) -> Option<Source> {
    let line = line.split('#').next()?.trim();
    let rest = line.strip_prefix("deb").filter(|rest| rest.starts_with([' ', '\t', '[']))?.trim_start();
    let rest = if rest.starts_with('[') { rest.split_once(']')?.1 } else { rest };
    let mut words = rest.split_whitespace().map(str::to_owned);
    let (address, suite) = (words.next()?, words.next()?);
    let addresses = [address].into_iter().filter(|address| is_network(address)).collect();
    Some(Source { addresses, suites: vec![suite], components: words.collect() })
}

/// Parses the deb822 form (`Types: deb` and so on).
fn parse_stanzas(text: &str) -> Vec<Source> {
    let lines: Vec<&str> = text.lines().filter(|line| !line.starts_with('#')).collect();
    lines.split(|line| line.trim().is_empty()).filter_map(parse_stanza).collect()
}

fn parse_stanza(lines: &[&str]) -> Option<Source> {
    let types = field(lines, "Types");
    let enabled = field(lines, "Enabled");
    if !types.iter().any(|kind| kind == "deb") || enabled.iter().any(|value| value.eq_ignore_ascii_case("no"))
    {
        return None;
    }
    let addresses = field(lines, "URIs").into_iter().filter(|address| is_network(address)).collect();
    Some(Source { addresses, suites: field(lines, "Suites"), components: field(lines, "Components") })
}

/// Returns the words of a field, with its continuation lines.
fn field(lines: &[&str], name: &str) -> Vec<String> {
    let value_of = |line: &str| {
        let (key, value) = line.split_once(':')?;
        key.eq_ignore_ascii_case(name).then(|| value.to_owned())
    };
    let Some(start) = lines.iter().position(|line| value_of(line).is_some()) else { return Vec::new() };
    let first = value_of(lines[start]).unwrap_or_default();
    let more = lines[start + 1..].iter().take_while(|line| line.starts_with([' ', '\t'])).copied();
    std::iter::once(first.as_str()).chain(more).flat_map(str::split_whitespace).map(str::to_owned).collect()
}

/// True for network addresses: removable media do not have other suites.
fn is_network(address: &str) -> bool {
    address.contains(':') && !address.starts_with("cdrom:")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mirror(lines: &str, stanzas: &str) -> Mirror {
        let mut sources = parse_lines(lines);
        sources.extend(parse_stanzas(stanzas));
        sources.retain(|source| !source.addresses.is_empty());
        Mirror::from_sources(&sources)
    }

    #[test]
    fn one_line_sources() {
        let found = mirror(
            "# deb http://old/debian bookworm main\n\
             deb cdrom:[Debian 12]/ bookworm main\n\
             deb-src http://source/debian bookworm main\n\
             deb [ arch=amd64 signed-by=/k.gpg ] http://near/debian/ bookworm main contrib # comment\n\
             deb\thttp://near/debian-security bookworm-security main\n",
            "",
        );
        assert_eq!(found.archive, "http://near/debian/");
        assert_eq!(found.security, "http://near/debian-security");
    }

    #[test]
    fn stanzas_with_continuation_and_comments() {
        let found = mirror(
            "",
            "Types: deb deb-src\n# a comment\nURIs: https://proxy/repo-a\n https://other/repo\nSuites: bookworm\n bookworm-updates\n\
             Components: main\n\nTypes: deb\nuris: https://proxy/sec\nSuites: bookworm-security\nComponents: main\n",
        );
        assert_eq!(
            found,
            Mirror { archive: "https://proxy/repo-a".into(), security: "https://proxy/sec".into() }
        );
    }

    #[test]
    fn third_party_archives_are_not_debian() {
        let found = mirror(
            "deb https://download.example/linux/debian bookworm stable\n\
             deb https://packages.example/apt stable main\n\
             deb https://apt.example/pub/repos/debian bookworm-pgdg main\n\
             deb https://flat.example ./\n",
            "Types: deb\nEnabled: no\nURIs: http://off/debian\nSuites: bookworm\nComponents: main\n",
        );
        assert_eq!(found, Mirror::debian());
    }

    #[test]
    fn unreadable_configuration_falls_back_to_debian() {
        assert_eq!(Mirror::candidates(Path::new("/no/such/folder")), [Mirror::debian()]);
    }

    #[test]
    fn the_configured_mirror_comes_before_the_default() {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join("sources.list.d")).unwrap();
        fs::write(folder.path().join("sources.list"), "deb http://near/debian bookworm main\n").unwrap();
        fs::write(folder.path().join("sources.list.d/x.list.off"), "deb http://far/debian bookworm main\n")
            .unwrap();
        let found = Mirror::candidates(folder.path());
        assert_eq!(found.len(), 2);
        assert_eq!(found[0], Mirror { archive: "http://near/debian".into(), ..Mirror::debian() });
        assert_eq!(found[1], Mirror::debian());
    }
}
