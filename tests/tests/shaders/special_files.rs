//! Pipes, devices and huge files in place of shaders, includes and caches, and object names with control characters.
#![cfg(unix)]
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::Command;

use lvk::{BufferDesc, Error, ShaderFiles, ShaderModuleDesc, ShaderStage};
use lvk_tests::compute::compute_pipeline;
use lvk_tests::warnings::{capture_warnings, take_warnings};
use lvk_tests::{device, device_with};

fn pipe(folder: &Path, name: &str) -> PathBuf {
    let path = folder.join(name);
    assert!(Command::new("mkfifo").arg(&path).status().unwrap().success());
    path
}

#[test]
fn shaders_and_includes_are_regular_files_of_a_bounded_size() {
    let Some(ctx) = device() else { return };
    let folder = tempfile::tempdir().unwrap();
    let huge = folder.path().join("huge.glsl");
    fs::File::create(&huge).unwrap().set_len((16 << 20) + 1).unwrap();
    let endless = folder.path().join("endless.glsl");
    symlink("/dev/zero", &endless).unwrap();
    let files = ShaderFiles::new();
    let desc = ShaderModuleDesc { stage: ShaderStage::Compute, debug_name: "light", ..Default::default() };
    for (path, reason) in [
        (pipe(folder.path(), "pipe.glsl"), "it is a named pipe, no file"),
        (endless, "it is a device, no file"),
        (huge, "it has 16777217 bytes, more than the 16777216 that are read"),
    ] {
        let error = files.create_module(&ctx, &path, &desc).unwrap_err();
        assert!(matches!(&error, Error::File { path: named, .. } if *named == path), "{error}");
        assert!(error.to_string().contains(reason), "{error}");
        let name = path.file_name().unwrap().to_str().unwrap();
        let includer = folder.path().join("includer.glsl");
        fs::write(&includer, format!("#include \"{name}\"\nvoid main() {{}}")).unwrap();
        let error = files.create_module(&ctx, &includer, &desc).unwrap_err();
        assert!(matches!(error, Error::Shader { .. }) && error.to_string().contains(name), "{error}");
    }
}

#[test]
fn a_pipe_in_place_of_a_cache_file_is_replaced_with_a_warning() {
    capture_warnings();
    let folder = tempfile::tempdir().unwrap();
    let path = pipe(folder.path(), "pipelines");
    let Some(ctx) = device_with(|desc| desc.pipeline_cache = Some(&path)) else { return };
    let warnings = take_warnings(path.to_str().unwrap());
    assert!(warnings.len() == 1 && warnings[0].contains("a named pipe"), "{warnings:?}");
    drop(compute_pipeline(&ctx, "layout(local_size_x = 1) in; void main() {}"));
    drop(ctx);
    assert!(path.is_file());
}

#[test]
fn debug_names_with_control_characters_are_escaped_in_errors() {
    let Some(ctx) = device() else { return };
    let long = "n".repeat(1 << 20);
    for (name, shown) in
        [("a\u{1b}[2Jb", "a\\u{1b}[2Jb: "), ("a\u{202e}b", "a\\u{202e}b: "), (&long, " (1048576 bytes): ")]
    {
        let error = ctx.create_buffer(&BufferDesc { debug_name: name, ..Default::default() }).unwrap_err();
        let text = error.to_string();
        assert!(text.contains(shown) && text.len() < 1_000, "{text:.300}");
        assert!(!text.contains(|c: char| c.is_control() || c == '\u{202e}'), "{text:?}");
    }
    let buffer = ctx.create_buffer(&BufferDesc { size_bytes: 4, debug_name: &long, ..Default::default() });
    assert!(buffer.is_ok(), "a long name is no error");
}
