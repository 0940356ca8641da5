//! The package of `lvk` has the project's licence and changelog, and says what a registry shows.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use crate::held_by::project;

/// `LVK_WRITE_DOCS=1` copies the project's files.
#[test]
fn the_package_has_the_licence_and_the_changelog_of_the_project() {
    for name in ["LICENSE", "CHANGELOG.md"] {
        let whole = std::fs::read_to_string(project().join(name)).unwrap();
        let copy = project().join("lvk").join(name);
        if std::env::var_os("LVK_WRITE_DOCS").is_some() {
            std::fs::write(copy, whole).unwrap();
        } else {
            let is_equal = std::fs::read_to_string(copy).is_ok_and(|copy| copy == whole);
            assert!(is_equal, "lvk/{name} differs from {name}: set LVK_WRITE_DOCS=1 once");
        }
    }
}

#[test]
fn the_manifest_has_what_a_registry_shows() {
    let manifest = std::fs::read_to_string(project().join("lvk/Cargo.toml")).unwrap();
    for field in
        ["description", "license", "readme", "documentation", "keywords", "categories", "rust-version"]
    {
        let is_set = manifest.lines().any(|line| line.split([' ', '.']).next() == Some(field));
        assert!(is_set, "lvk/Cargo.toml has no {field}");
    }
    assert!(manifest.contains("[package.metadata.docs.rs]"), "docs.rs builds without the features");
    assert!(!manifest.contains("publish"), "the library is the package that may be published");
}
