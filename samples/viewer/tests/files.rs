//! Files that the program is given: what is wrong with one is said in a line, with status 2, and nothing is written.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::path::Path;
use std::process::{Command, Output};

/// Runs the program in a folder.
fn viewer(folder: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_viewer")).args(args).current_dir(folder).output().unwrap()
}

fn assert_refused(folder: &Path, args: &[&str], words: &[&str]) {
    let output = viewer(folder, args);
    let error = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{args:?}: {error}");
    let line = error.lines().last().unwrap_or_default();
    assert!(line.starts_with("error: "), "{args:?}: {error}");
    assert!(words.iter().all(|word| line.contains(word)), "{args:?}: {line}");
    assert!(!folder.join("viewer.png").exists());
}

#[test]
fn files_that_cannot_be_read_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, bytes: &[u8]| std::fs::write(folder.path().join(name), bytes).unwrap();
    write("empty.glb", b"");
    write("cut.glb", b"glTF\x02\x00\x00\x00\xff\x00\x00\x00");
    write("text.gltf", b"{ \"asset\": ");
    write("list.gltf", b"{ \"asset\": { \"version\": \"2.0\" } }");
    write("bad.obj", b"v 0 0 0\nf 1 2 3\n");
    assert_refused(folder.path(), &["absent.glb"], &["absent.glb"]);
    assert_refused(folder.path(), &["absent.obj"], &["absent.obj"]);
    assert_refused(folder.path(), &["."], &["."]);
    for name in ["empty.glb", "cut.glb", "text.gltf", "bad.obj"] {
        assert_refused(folder.path(), &[name], &[name]);
    }
    assert_refused(folder.path(), &["list.gltf"], &["list.gltf shows no triangle"]);
}

#[test]
fn a_picture_does_not_replace_its_model() {
    let folder = tempfile::tempdir().unwrap();
    let model = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    std::fs::write(folder.path().join("model.obj"), model).unwrap();
    assert_refused(folder.path(), &["model.obj", "--out", "model.obj"], &["model.obj"]);
    assert_eq!(std::fs::read(folder.path().join("model.obj")).unwrap(), model);
}

#[test]
fn cameras_are_listed_without_a_device() {
    let folder = tempfile::tempdir().unwrap();
    let output = viewer(folder.path(), &["--list-cameras"]);
    assert!(output.status.success());
    assert_eq!(String::from_utf8(output.stdout).unwrap(), "1  showcase\n2  overview\nanimation 1  turn\n");
}
