//! The file of the pipeline cache: it is written, loaded again, and dropped with a warning when it is damaged.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::path::{Path, PathBuf};

use lvk::{Error, RayTracingPipelineDesc, ShaderStage};
use lvk_tests::compute::compute_pipeline;
use lvk_tests::device::swiftshader;
use lvk_tests::shader_groups::{Counts, GroupScene, answering, ray_gen};
use lvk_tests::subprocess::in_subprocess;
use lvk_tests::warnings::{capture_warnings, take_warnings};
use lvk_tests::{TestDevice, device, device_with};

/// A folder whose name is in every warning about files in it.
fn folder() -> tempfile::TempDir {
    capture_warnings();
    tempfile::tempdir().unwrap()
}

fn warnings_about(path: &Path) -> Vec<String> {
    take_warnings(path.to_str().unwrap())
}

/// A context with its cache in a file.
fn start(path: &Path) -> Option<TestDevice> {
    device_with(|desc| desc.pipeline_cache = Some(path))
}

/// Makes a pipeline of each kind the device has, and runs the ray tracing pipeline.
fn make_pipelines(ctx: &TestDevice) {
    let _compute = compute_pipeline(ctx, "layout(local_size_x = 1) in; void main() {}");
    if !ctx.capabilities().ray_tracing_pipeline {
        return;
    }
    let scene = GroupScene::new(ctx).unwrap();
    let ray_gen = ray_gen(ctx, "", "0u").unwrap();
    let miss = answering(ctx, ShaderStage::Miss, "", "31u").unwrap();
    let pipeline = ctx
        .create_ray_tracing_pipeline(&RayTracingPipelineDesc {
            ray_gen: &[*ray_gen],
            miss: &[*miss],
            ..Default::default()
        })
        .unwrap();
    let counts = Counts { hits: 0, misses: 1, callables: 0 };
    assert_eq!(scene.run(*pipeline, 0, counts).unwrap(), [31]);
}

/// Names in a folder, sorted.
fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    let mut names: Vec<_> =
        entries.map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

#[test]
fn the_next_context_starts_from_the_file() {
    let folder = folder();
    let path = folder.path().join("pipelines");
    let Some(ctx) = start(&path) else { return };
    assert_eq!(ctx.pipeline_cache_loaded_bytes(), 0);
    make_pipelines(&ctx);
    assert!(!path.exists());
    ctx.save_pipeline_cache().unwrap();
    let saved = std::fs::read(&path).unwrap();
    drop(ctx);
    assert_eq!(names(folder.path()), ["pipelines"]);
    let ctx = start(&path).unwrap();
    let loaded = ctx.pipeline_cache_loaded_bytes();
    assert!(loaded >= 32 && loaded < saved.len() as u64, "{loaded} of {}", saved.len());
    make_pipelines(&ctx);
    drop(ctx);
    assert_eq!(names(folder.path()), ["pipelines"]);
    assert!(start(&path).unwrap().pipeline_cache_loaded_bytes() >= loaded);
    assert_eq!(warnings_about(folder.path()), [""; 0]);
}

#[test]
fn the_end_of_a_context_writes_the_file() {
    let folder = folder();
    let path = folder.path().join("at the end");
    let Some(ctx) = start(&path) else { return };
    make_pipelines(&ctx);
    drop(ctx);
    assert!(start(&path).unwrap().pipeline_cache_loaded_bytes() >= 32);
    let written = std::fs::metadata(&path).unwrap().modified().unwrap();
    drop(start(&path));
    // Nothing new was compiled.
    assert_eq!(std::fs::metadata(&path).unwrap().modified().unwrap(), written);
    std::fs::remove_file(&path).unwrap();
    drop(start(&path));
    assert!(path.exists());
}

/// Fails unless a context drops the file with a warning that has `words`, works, and replaces the file.
fn expect_replacement(path: &Path, words: &str) {
    let Some(ctx) = start(path) else { return };
    assert_eq!(ctx.pipeline_cache_loaded_bytes(), 0, "{words}");
    let warnings = warnings_about(path);
    assert!(warnings.len() == 1 && warnings[0].contains(words), "{words}: {warnings:?}");
    make_pipelines(&ctx);
    drop(ctx);
    assert!(start(path).unwrap().pipeline_cache_loaded_bytes() >= 32, "{words}");
    assert_eq!(warnings_about(path), [""; 0]);
}

#[test]
fn damaged_files_are_dropped_and_replaced() {
    let folder = folder();
    let path = folder.path().join("good");
    let Some(ctx) = start(&path) else { return };
    make_pipelines(&ctx);
    drop(ctx);
    let good = std::fs::read(&path).unwrap();
    let mut flipped = good.clone();
    *flipped.last_mut().unwrap() ^= 4;
    let cases: [(&str, &[u8], &str); 6] = [
        ("cut", &good[..good.len() - 1], "damaged or cut off"),
        ("short", &good[..20], "damaged or cut off"),
        ("long", &[&good[..], b"more"].concat(), "damaged or cut off"),
        ("flipped", &flipped, "damaged or cut off"),
        ("empty", &[], "no pipeline cache"),
        ("garbage", &[0x5a; 5000], "no pipeline cache"),
    ];
    for (name, bytes, words) in cases {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        expect_replacement(&path, words);
    }
}

/// The file comes from the device without ray tracing, in a process of its own.
#[test]
fn a_file_of_another_device_is_dropped_and_replaced() {
    const FILE: &str = "LVK_TEST_PIPELINE_CACHE";
    let Some(icd) = swiftshader() else { return };
    let folder = folder();
    let inherited = std::env::var_os(FILE).map(PathBuf::from);
    let path = inherited.clone().unwrap_or_else(|| folder.path().join("foreign"));
    let variables = [
        ("VK_DRIVER_FILES", Some(icd.as_os_str())),
        ("VK_ICD_FILENAMES", None),
        ("LVK_DRIVER", None),
        ("LVK_DEVICE", None),
        (FILE, Some(path.as_os_str())),
    ];
    in_subprocess(a_file_of_another_device_is_dropped_and_replaced, &variables, || {
        let ctx = start(&path).unwrap();
        assert!(ctx.capabilities().device_name.contains("SwiftShader"), "{:?}", ctx.capabilities());
        make_pipelines(&ctx);
    });
    if inherited.is_none() {
        assert!(path.exists());
        let Some(ctx) = device() else { return };
        let name = &ctx.capabilities().device_name;
        if name.contains("SwiftShader") {
            return eprintln!("NOT TESTED, {name} is the other device");
        }
        expect_replacement(&path, "driver");
    }
}

#[test]
fn a_missing_folder_is_named() {
    let folder = folder();
    let path = folder.path().join("nowhere").join("pipelines");
    let Some(ctx) = start(&path) else { return };
    let warnings = warnings_about(&path);
    assert!(warnings.len() == 1 && warnings[0].contains("does not exist"), "{warnings:?}");
    make_pipelines(&ctx);
    match ctx.save_pipeline_cache() {
        Err(Error::File { path: named, message }) => {
            assert!(named == path && message.contains("cannot be written"), "{message}");
        }
        other => unreachable!("{other:?}"),
    }
    drop(ctx);
    let warnings = warnings_about(&path);
    assert!(warnings.len() == 1 && warnings[0].contains("cannot be written"), "{warnings:?}");
    assert!(names(folder.path()).is_empty());
}

#[test]
fn a_folder_with_the_name_of_the_file_is_left_alone() {
    let folder = folder();
    let path = folder.path().join("folder");
    std::fs::create_dir(&path).unwrap();
    let Some(ctx) = start(&path) else { return };
    make_pipelines(&ctx);
    assert!(matches!(ctx.save_pipeline_cache(), Err(Error::File { .. })));
    drop(ctx);
    assert!(path.is_dir());
    assert_eq!(names(folder.path()), ["folder"]);
    assert_eq!(warnings_about(&path).len(), 2);
}

#[test]
fn without_a_file_there_is_nothing_to_save() {
    let Some(ctx) = device() else { return };
    let outcome = ctx.save_pipeline_cache();
    assert!(
        matches!(&outcome, Err(Error::InvalidUsage { message, .. }) if message.contains("ContextDesc::pipeline_cache"))
    );
    assert_eq!(ctx.pipeline_cache_loaded_bytes(), 0);
}

/// Contexts that end at the same time leave one whole file.
#[test]
fn contexts_side_by_side_leave_a_whole_file() {
    let folder = folder();
    let path = folder.path().join("shared");
    let Some(first) = start(&path) else { return };
    let second = start(&path).unwrap();
    std::thread::scope(|scope| {
        for ctx in [&first, &second] {
            scope.spawn(move || {
                for _ in 0..20 {
                    ctx.save_pipeline_cache().unwrap();
                }
            });
        }
        for _ in 0..5 {
            let reader = start(&path).unwrap();
            drop(reader);
        }
    });
    drop((first, second));
    assert!(start(&path).unwrap().pipeline_cache_loaded_bytes() >= 32);
    assert_eq!(names(folder.path()), ["shared"]);
    assert_eq!(warnings_about(&path), [""; 0]);
}
