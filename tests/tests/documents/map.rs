//! The `map` block of `CONTRIBUTING.md` lists every folder of source files, one a line, as `path  description`.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::collections::BTreeSet;
use std::path::Path;

use crate::contributing::{block, contributing};
use crate::held_by::project;

/// Endings of source files.
const SOURCES: [&str; 3] = ["rs", "glsl", "md"];

/// Returns the folders that the map has to list for the files of a repository, by paths below it.
fn folders<'a>(files: impl Iterator<Item = &'a str>) -> BTreeSet<&'a str> {
    let is_source = |file: &&str| file.rsplit_once('.').is_some_and(|(_, ending)| SOURCES.contains(&ending));
    let is_hidden = |file: &str| file.split('/').any(|part| part.starts_with('.') || part == "target");
    files.filter(is_source).filter(|file| !is_hidden(file)).flat_map(parents).collect()
}

/// Returns all folders around a file.
fn parents(file: &str) -> impl Iterator<Item = &str> {
    file.match_indices('/').map(|(end, _)| &file[..end])
}

/// Returns what is wrong with the lines of a map.
fn complaints(lines: &[&str], needed: &BTreeSet<&str>, exists: impl Fn(&str) -> bool) -> Vec<String> {
    let (mut found, mut listed) = (Vec::new(), BTreeSet::new());
    for line in lines {
        let (path, description) = line.split_once("  ").unwrap_or((line, ""));
        let path = path.trim_end_matches('/');
        if description.trim().is_empty() {
            found.push(format!("{path}: no description, two spaces behind the path"));
        }
        if !listed.insert(path) {
            found.push(format!("{path}: listed twice"));
        }
        if !exists(path) {
            found.push(format!("{path}: no such folder"));
        }
    }
    found.extend(needed.difference(&listed).map(|folder| format!("{folder}: missing from the block")));
    found
}

/// Returns the files of the repository that git knows or would add; every file where there is no repository.
pub fn files() -> Vec<String> {
    let mut git = std::process::Command::new("git");
    git.args(["ls-files", "--cached", "--others", "--exclude-standard"]).current_dir(project());
    match git.output() {
        Ok(output) if output.status.success() => {
            let listed = String::from_utf8(output.stdout).unwrap();
            listed.lines().filter(|file| project().join(file).exists()).map(str::to_owned).collect()
        }
        _ => list_files(&project(), ""),
    }
}

fn list_files(root: &Path, below: &str) -> Vec<String> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(root.join(below)).unwrap() {
        let entry = entry.unwrap();
        let name = entry.file_name().to_string_lossy().into_owned();
        let path = if below.is_empty() { name.clone() } else { format!("{below}/{name}") };
        match entry.file_type().unwrap().is_dir() {
            true if name.starts_with('.') || name == "target" => {}
            true => found.extend(list_files(root, &path)),
            false => found.push(path),
        }
    }
    found
}

#[test]
fn the_map_lists_every_folder() {
    let text = contributing();
    let files = files();
    let needed = folders(files.iter().map(String::as_str));
    let complaints = complaints(&block(&text, "map").unwrap(), &needed, |path| project().join(path).is_dir());
    assert!(complaints.is_empty(), "{} complaints:\n{}", complaints.len(), complaints.join("\n"));
}

/// Prints the folders that the map has to list, with `-- --nocapture`.
#[test]
fn the_folders_of_the_repository_are_listed() {
    let files = files();
    let needed = folders(files.iter().map(String::as_str));
    for folder in ["lvk/src", "lvk/src/gpu", "samples/src", "shaders/common", "tests/src", "tests/tests"] {
        assert!(needed.contains(folder), "{folder}");
    }
    println!("{}", needed.into_iter().map(|folder| format!("{folder}\n")).collect::<String>());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_are_listed_at_every_level() {
        let files =
            ["a/src/b/c/d/e.rs", "a/Cargo.toml", "f/g/h/i.glsl", ".ci/run.md", "target/j/k.rs", "l/m.png"];
        let expected = ["a", "a/src", "a/src/b", "a/src/b/c", "a/src/b/c/d", "f", "f/g", "f/g/h"];
        assert_eq!(folders(files.into_iter()), expected.into());
    }

    #[test]
    fn a_map_of_all_folders_passes() {
        let needed = BTreeSet::from(["a", "a/b"]);
        let lines = ["a    one", "a/b/  two", "pictures  three"];
        assert_eq!(complaints(&lines, &needed, |_| true), Vec::<String>::new());
    }

    #[test]
    fn missing_and_wrong_lines_are_named() {
        let needed = BTreeSet::from(["a", "b"]);
        let wrong = complaints(&["a  one", "a  one", "c"], &needed, |path| path != "c");
        let expected = [
            "a: listed twice",
            "c: no description, two spaces behind the path",
            "c: no such folder",
            "b: missing from the block",
        ];
        assert_eq!(wrong, expected);
    }
}
