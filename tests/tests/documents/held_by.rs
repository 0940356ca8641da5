//! Table cells that name test files, by a letter for the kind and without the ending.

use std::path::{Path, PathBuf};

pub fn project() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The cells of a line of a table, or `None` where it is no such line.
pub fn cells(line: &str) -> Option<Vec<&str>> {
    let inside = line.strip_prefix('|')?;
    Some(inside.strip_suffix('|').unwrap_or(inside).split('|').map(str::trim).collect())
}

/// The error of a cell that names test files: a prefix is unknown, or a file has no test. `None` if the cell is valid.
pub fn complaint(held_by: &str) -> Option<String> {
    let files = match files(held_by) {
        Ok(files) => files,
        Err(wrong) => return Some(wrong),
    };
    let without_test = files.into_iter().find(|file| {
        let text = std::fs::read_to_string(project().join(file)).unwrap_or_default();
        !text.contains("#[test]")
    });
    without_test.map(|file| format!("{file} has no test"))
}

/// Files of tests that a cell names, below the folder that their kind says.
fn files(held_by: &str) -> Result<Vec<String>, String> {
    let mut found = Vec::new();
    for part in held_by.split("; ") {
        let folder = match part.get(..3) {
            Some("t: ") => "tests/tests",
            Some("s: ") => "samples/tests",
            Some("u: ") => "lvk/src",
            Some("w: ") => "samples/wgpu-guest/tests",
            _ => return Err(format!("{part:?} begins with none of t:, s:, u: and w:")),
        };
        found.extend(part[3..].split(", ").map(|name| format!("{folder}/{name}.rs")));
    }
    Ok(found)
}
