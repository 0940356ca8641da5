//! The manifest in `docs/android.md` says what the table says that `cargo apk` reads.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on has failed")]

use std::fs::read_to_string;

use crate::held_by::project;

/// Names of values in the table and in the manifest.
const VALUES: [(&str, &str); 8] = [
    ("package", " package"),
    ("min_sdk_version", "android:minSdkVersion"),
    ("target_sdk_version", "android:targetSdkVersion"),
    ("version", "android:version"),
    ("label", "android:label"),
    ("theme", "android:theme"),
    ("config_changes", "android:configChanges"),
    ("launch_mode", "android:launchMode"),
];

/// Returns the value of the line `key = value`, without quotation marks.
fn table_value<'a>(table: &'a str, key: &str) -> &'a str {
    let line = table.lines().find_map(|line| line.strip_prefix(key)?.strip_prefix(" = "));
    line.unwrap_or_else(|| panic!("no {key} in the table")).trim_matches('"')
}

#[test]
fn the_manifest_is_that_of_the_table() {
    let cargo = read_to_string(project().join("samples/android/Cargo.toml")).unwrap();
    let document = read_to_string(project().join("docs/android.md")).unwrap();
    let (_, table) = cargo.split_once("[package.metadata.android]").unwrap();
    let (_, manifest) = document.split_once("<manifest").unwrap();
    let (manifest, _) = manifest.split_once("</manifest>").unwrap();
    for (key, attribute) in VALUES {
        let expected = format!("{attribute}=\"{}\"", table_value(table, key));
        assert!(manifest.contains(&expected), "{expected} is not in the manifest of docs/android.md");
    }
    let library = table_value(&cargo, "name").replace('-', "_");
    assert!(manifest.contains(&format!("android:value=\"{library}\"")), "{library}");
    assert!(
        document.contains(&format!("lib{library}.so"))
            && document.contains(&format!("/{}.apk", table_value(table, "apk_name")))
    );
}
