//! The `main.rs` of each test program declares every file beside it: an undeclared file would never run.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// The entries of a folder.
fn entries(folder: &Path) -> impl Iterator<Item = PathBuf> {
    std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path())
}

#[test]
fn every_file_is_part_of_its_program() {
    let programs: Vec<_> =
        entries(&Path::new(env!("CARGO_MANIFEST_DIR")).join("tests")).filter(|path| path.is_dir()).collect();
    assert!(programs.len() >= 15, "{programs:?}");
    for program in programs {
        let main = std::fs::read_to_string(program.join("main.rs")).unwrap();
        let named: BTreeSet<_> = main
            .lines()
            .filter_map(|line| line.strip_prefix("mod ")?.strip_suffix(';').map(str::to_owned))
            .collect();
        let files: BTreeSet<_> = entries(&program)
            .map(|path| path.file_stem().unwrap().to_str().unwrap().to_owned())
            .filter(|name| name != "main")
            .collect();
        assert_eq!(named, files, "{}", program.display());
    }
}
