//! Licences, sources and duplicates of dependencies are those that `.ci/deny.toml` allows. `cargo tree` tells them without
//! the network.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::collections::{BTreeMap, BTreeSet};
use std::process::Command;

use crate::held_by::project;

/// Arguments of `cargo tree` for everything that the workspace compiles anywhere, and for the library alone.
const ALL: [&str; 1] = ["--workspace"];
const LIBRARY: [&str; 4] = ["-p", "lvk", "-e", "normal,build"];

/// A package as `cargo tree` prints it.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
struct Package {
    name: String,
    version: String,
    /// The words behind the version: the source, or what kind of crate the package is.
    remarks: String,
    licence: String,
}

impl Package {
    /// Reads a line such as `libc v0.2.1 (proc-macro)|MIT`.
    fn parse(line: &str) -> Option<Self> {
        let (package, licence) = line.trim_end_matches(" (*)").split_once('|')?;
        let mut words = package.splitn(3, ' ').map(str::to_owned);
        let (name, version) = (words.next()?, words.next()?);
        let version = version.strip_prefix('v')?.to_owned();
        Some(Self { name, version, remarks: words.next().unwrap_or_default(), licence: licence.to_owned() })
    }

    /// True for packages of crates.io, and for those of this repository.
    fn is_from_a_known_source(&self, repository: &str) -> bool {
        let remarks = self.remarks.replace("(proc-macro)", "");
        let remarks = remarks.trim();
        remarks.is_empty() || remarks.strip_prefix('(').is_some_and(|path| path.starts_with(repository))
    }
}

/// Packages that `cargo tree` lists.
struct Packages {
    found: BTreeSet<Package>,
    /// True if they are those of all targets and features.
    is_whole: bool,
}

/// Returns the packages of `selection`, for all targets and features, as far as they were ever fetched: else for this target
/// alone, and else those of the build that the test belongs to.
fn packages(selection: &[&str]) -> Packages {
    let own = if selection == ALL { &[] } else { selection };
    let everywhere: &[&str] = &["--all-features", "--target", "all"];
    let attempts = [[selection, everywhere].concat(), [selection, &everywhere[..1]].concat(), own.to_vec()];
    let listed = attempts.iter().enumerate().find_map(|(attempt, arguments)| match tree(arguments) {
        Ok(listed) => Some((attempt, listed)),
        Err(missing) => {
            eprintln!("NOT CHECKED, packages of `cargo tree {}`: {missing}", arguments.join(" "));
            None
        }
    });
    let (attempt, listed) = listed.unwrap();
    let found: BTreeSet<_> = listed.lines().filter_map(Package::parse).collect();
    let lines = listed.lines().filter(|line| !line.is_empty()).count();
    assert_eq!(listed.lines().filter_map(Package::parse).count(), lines, "a line is not understood");
    Packages { found, is_whole: attempt == 0 }
}

/// Returns what `cargo tree` prints, or its errors.
fn tree(arguments: &[&str]) -> Result<String, String> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut command = Command::new(cargo);
    command.current_dir(project()).args(["tree", "--offline", "--locked"]);
    command.args(["--prefix", "none", "--format", "{p}|{l}"]).args(arguments);
    let output = command.output().map_err(|error| error.to_string())?;
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    if output.status.success() { Ok(text(&output.stdout)) } else { Err(text(&output.stderr)) }
}

/// What `.ci/deny.toml` allows.
struct Rules {
    licences: BTreeSet<String>,
    /// Further licences of single packages.
    exceptions: BTreeMap<String, BTreeSet<String>>,
    /// Packages with the beginnings of their versions that may stand beside a newer one.
    duplicates: BTreeSet<(String, String)>,
}

impl Rules {
    fn read() -> Self {
        Self::parse(&std::fs::read_to_string(project().join(".ci/deny.toml")).unwrap())
    }

    fn parse(text: &str) -> Self {
        let exception = |line: &str| {
            let mut words = quoted(line).map(str::to_owned);
            Some((words.next()?, words.collect()))
        };
        let duplicate = |line: &str| {
            let (name, version) = quoted(line).next()?.split_once('@')?;
            Some((name.to_owned(), version.to_owned()))
        };
        Self {
            licences: list(text, "allow").flat_map(quoted).map(str::to_owned).collect(),
            exceptions: list(text, "exceptions").filter_map(exception).collect(),
            duplicates: list(text, "skip").filter_map(duplicate).collect(),
        }
    }

    /// True if the licences of the package allow its use, with the exceptions or without them.
    fn allow(&self, package: &Package, with_exceptions: bool) -> bool {
        let own = self.exceptions.get(&package.name).filter(|_| with_exceptions);
        is_satisfied(&package.licence, &|licence| {
            self.licences.contains(licence) || own.is_some_and(|own| own.contains(licence))
        })
    }

    /// Returns the complaints about packages that are there in several versions, and about entries without such a package
    /// where the list is whole.
    fn duplicates(&self, packages: &Packages) -> Vec<String> {
        let mut versions = BTreeMap::<_, BTreeSet<_>>::new();
        for package in &packages.found {
            versions.entry(&package.name).or_default().insert(&package.version);
        }
        versions.retain(|_, versions| versions.len() > 1);
        let covers = |(name, begin): &(String, String), found: &str, version: &str| {
            name == found && version.strip_prefix(&**begin).is_some_and(|rest| rest.starts_with('.'))
        };
        let mut complaints = Vec::new();
        let mut used = BTreeSet::new();
        for (name, versions) in &versions {
            let skipped = |version: &str| self.duplicates.iter().find(|entry| covers(entry, name, version));
            used.extend(versions.iter().filter_map(|version| skipped(version)));
            let others: Vec<_> = versions.iter().filter(|version| skipped(version).is_none()).collect();
            if others.len() > 1 {
                complaints.push(format!("{name}: the versions {others:?} stand beside each other"));
            }
        }
        let unused = self.duplicates.iter().filter(|entry| packages.is_whole && !used.contains(entry));
        complaints.extend(
            unused.map(|(name, version)| format!("skip {name}@{version}: no such duplicate is left")),
        );
        complaints
    }
}

/// Returns the lines of the list `key = [...]`, which ends at a line with its bracket alone.
fn list<'a>(text: &'a str, key: &str) -> impl Iterator<Item = &'a str> {
    let head = format!("{key} = [");
    text.lines().skip_while(move |line| *line != head).skip(1).take_while(|line| *line != "]")
}

/// Returns the words in quotes.
fn quoted(line: &str) -> impl Iterator<Item = &str> {
    line.split('"').skip(1).step_by(2)
}

/// True if a licence expression of SPDX can be satisfied by accepted licences. Old manifests write `/` for `OR`.
fn is_satisfied(expression: &str, accepts: &dyn Fn(&str) -> bool) -> bool {
    let spaced = expression.replace('(', " ( ").replace(')', " ) ").replace('/', " OR ");
    let mut words = Words { words: spaced.split_whitespace().collect(), at: 0, accepts };
    words.any() && words.at == words.words.len()
}

/// The words of a licence expression, read from left to right.
struct Words<'a> {
    words: Vec<&'a str>,
    at: usize,
    accepts: &'a dyn Fn(&str) -> bool,
}

impl Words<'_> {
    fn any(&mut self) -> bool {
        let mut found = self.all();
        while self.skip("OR") {
            found |= self.all();
        }
        found
    }

    fn all(&mut self) -> bool {
        let mut found = self.one();
        while self.skip("AND") {
            found &= self.one();
        }
        found
    }

    fn one(&mut self) -> bool {
        if self.skip("(") {
            return self.any() & self.skip(")");
        }
        let mut licence = self.word().to_owned();
        if self.skip("WITH") {
            licence = format!("{licence} WITH {}", self.word());
        }
        (self.accepts)(&licence)
    }

    fn word(&mut self) -> &str {
        self.at += 1;
        self.words.get(self.at - 1).copied().unwrap_or_default()
    }

    fn skip(&mut self, word: &str) -> bool {
        let is_next = self.words.get(self.at) == Some(&word);
        self.at += usize::from(is_next);
        is_next
    }
}

#[test]
fn licences_are_accepted_ones() {
    let rules = Rules::read();
    assert!(rules.licences.contains("MIT"), "the list is read");
    for (arguments, with_exceptions) in [(&ALL[..], true), (&LIBRARY[..], false)] {
        let all = packages(arguments).found;
        let refused: Vec<_> = all.iter().filter(|package| !rules.allow(package, with_exceptions)).collect();
        assert!(refused.is_empty(), "licences that .ci/deny.toml does not allow: {refused:#?}");
        println!("{arguments:?}: {} packages", all.len());
    }
    let all = packages(&ALL);
    let is_there = |name: &String| all.found.iter().any(|package| package.name == *name);
    let are_there = rules.exceptions.keys().all(is_there);
    assert!(are_there || !all.is_whole, "an exception is for a package that is gone");
}

#[test]
fn sources_are_crates_io_and_this_repository() {
    let repository = project().canonicalize().unwrap();
    let repository = repository.to_str().unwrap();
    let all = packages(&ALL).found;
    let strange: Vec<_> = all.iter().filter(|package| !package.is_from_a_known_source(repository)).collect();
    assert!(strange.is_empty(), "{strange:#?}");
    let lock = std::fs::read_to_string(project().join("Cargo.lock")).unwrap();
    let index = "source = \"registry+https://github.com/rust-lang/crates.io-index\"";
    let sources = lock.lines().filter(|line| line.starts_with("source = "));
    assert_eq!(sources.filter(|line| *line != index).collect::<Vec<_>>(), [""; 0]);
}

#[test]
fn duplicates_are_accepted_ones() {
    let complaints = Rules::read().duplicates(&packages(&ALL));
    assert!(complaints.is_empty(), "see `skip` in .ci/deny.toml:\n{}", complaints.join("\n"));
}

/// Their crates take a fifth of the first build, and a member of the workspace can turn them on for all others.
#[test]
fn tests_alone_turn_on_the_windows_of_samples() {
    let has_windows = |arguments: &[&str]| {
        let dependents = tree(&[arguments, &["-i", "winit"]].concat()).unwrap();
        dependents.lines().filter_map(Package::parse).any(|package| package.name == "lvk-samples")
    };
    assert!(has_windows(&[]), "tests have windows");
    assert!(!has_windows(&["-e", "no-dev"]), "`cargo run` would build windows");
}

#[cfg(test)]
mod tests {
    use super::*;

    fn package(line: &str) -> Package {
        Package::parse(line).unwrap()
    }

    #[test]
    fn lines_of_the_tree_are_read() {
        let found = package("serde_derive v1.0.2 (proc-macro)|MIT OR Apache-2.0 (*)");
        assert_eq!((&*found.name, &*found.version), ("serde_derive", "1.0.2"));
        assert_eq!((&*found.remarks, &*found.licence), ("(proc-macro)", "MIT OR Apache-2.0"));
        assert!(Package::parse("no package").is_none());
    }

    #[test]
    fn packages_of_other_sources_are_strange() {
        for (line, known) in [
            ("a v1.0.0|MIT", true),
            ("a v1.0.0 (proc-macro)|MIT", true),
            ("a v1.0.0 (/home/lvk/samples)|MIT", true),
            ("a v1.0.0 (proc-macro) (/home/other)|MIT", false),
            ("a v1.0.0 (https://github.com/b/a#0123)|MIT", false),
            ("a v1.0.0 (registry `mine`)|MIT", false),
        ] {
            assert_eq!(package(line).is_from_a_known_source("/home/lvk"), known, "{line}");
        }
    }

    #[test]
    fn licence_expressions_are_evaluated() {
        let accepts = |licence: &str| ["MIT", "Zlib", "Apache-2.0 WITH LLVM-exception"].contains(&licence);
        for (expression, expected) in [
            ("MIT", true),
            ("MIT OR GPL-3.0", true),
            ("GPL-3.0/MIT", true),
            ("GPL-3.0", false),
            ("MIT AND GPL-3.0", false),
            ("GPL-3.0 OR MIT AND Zlib", true),
            ("(GPL-3.0 OR MIT) AND GPL-3.0", false),
            ("(GPL-3.0 OR MIT) AND (Zlib)", true),
            ("Apache-2.0 WITH LLVM-exception OR GPL-3.0", true),
            ("Apache-2.0", false),
            ("(MIT", false),
            ("MIT MIT", false),
            ("", false),
        ] {
            assert_eq!(is_satisfied(expression, &accepts), expected, "{expression}");
        }
    }

    #[test]
    fn rules_are_read_and_those_without_use_are_named() {
        let rules = Rules::parse(
            "allow = [\n    \"MIT\",\n]\nexceptions = [\n    { crate = \"font\", allow = [\"OFL-1.1\"] },\n]\n\
             skip = [\n    { crate = \"a@1\", reason = \"b\" },\n    { crate = \"c@0.1\", reason = \"d\" },\n]\n",
        );
        let font = package("font v1.0.0|MIT AND OFL-1.1");
        assert!(rules.allow(&font, true) && !rules.allow(&font, false));
        assert!(!rules.allow(&package("other v1.0.0|OFL-1.1"), true));
        let packages = |lines: &[&str], is_whole| Packages {
            found: lines.iter().map(|line| package(line)).collect(),
            is_whole,
        };
        let of = |lines: &[&str]| rules.duplicates(&packages(lines, true));
        let good = ["a v1.2.0|MIT", "a v2.0.0|MIT", "c v0.1.5|MIT", "c v0.10.0|MIT", "d v1.0.0|MIT"];
        assert_eq!(of(&good), [""; 0]);
        let bad = ["a v1.2.0|MIT", "a v2.0.0|MIT", "a v3.0.0|MIT", "c v0.10.0|MIT"];
        let expected = [
            "a: the versions [\"2.0.0\", \"3.0.0\"] stand beside each other",
            "skip c@0.1: no such duplicate is left",
        ];
        assert_eq!(of(&bad), expected);
        assert_eq!(rules.duplicates(&packages(&bad, false)), expected[..1]);
    }
}
