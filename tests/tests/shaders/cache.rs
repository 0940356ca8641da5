//! The disk cache of compiled GLSL: it is loaded again, detects outdated entries, and is dropped with a warning when
//! it is damaged.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::path::{Path, PathBuf};
use std::time::Instant;

use lvk::{
    ComputePipelineDesc, Context, Dependencies, Error, ShaderCacheStats, ShaderModuleDesc, ShaderSource,
    ShaderStage,
};
use lvk_tests::compute::{read_words, words_buffer};
use lvk_tests::pipelines;
use lvk_tests::warnings::{capture_warnings, take_warnings};
use lvk_tests::{TestDevice, device, device_with};

fn folder() -> tempfile::TempDir {
    capture_warnings();
    tempfile::tempdir().unwrap()
}

fn start(folder: &Path) -> Option<TestDevice> {
    device_with(|desc| desc.shader_cache = Some(folder))
}

fn counts(found: u64, compiled: u64) -> ShaderCacheStats {
    ShaderCacheStats { found, compiled }
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let mut files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files
}

const TEXT: &str = r#"
    #include "value.glsl"
    layout(local_size_x = 1) in;
    layout(buffer_reference, scalar) writeonly buffer Result { uint at[]; };
    layout(push_constant, scalar) uniform Push { Result result; };
    void main() { result.at[0] = VALUE + ADDED; }"#;

/// Returns the shader's result.
fn answer(ctx: &Context, desc: &ShaderModuleDesc<'_>) -> u32 {
    let module = ctx.create_shader_module(desc).unwrap();
    let pipeline = ctx
        .create_compute_pipeline(&ComputePipelineDesc { module: Some(*module), ..Default::default() })
        .unwrap();
    let result = words_buffer(ctx, &[0]);
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    cmd.bind_compute_pipeline(*pipeline).unwrap();
    cmd.push_constants(&ctx.buffer_address(*result).unwrap()).unwrap();
    cmd.dispatch([1, 1, 1], &Dependencies { buffers: &[*result], ..Default::default() }).unwrap();
    ctx.submit(cmd).unwrap();
    read_words(ctx, *result, 1)[0]
}

fn desc<'a>(includes: &'a [(&'a str, &'a str)], defines: &'a [(&'a str, &'a str)]) -> ShaderModuleDesc<'a> {
    ShaderModuleDesc {
        stage: ShaderStage::Compute,
        source: ShaderSource::Glsl(TEXT),
        includes,
        defines,
        ..Default::default()
    }
}

#[test]
fn a_second_run_finds_what_the_first_has_compiled() {
    let folder = folder();
    let place = folder.path().join("made").join("when needed");
    let Some(ctx) = start(&place) else { return };
    let seven = desc(&[("value.glsl", "const uint VALUE = 7;")], &[("ADDED", "1")]);
    assert_eq!((answer(&ctx, &seven), ctx.shader_cache_stats()), (8, counts(0, 1)));
    assert_eq!((answer(&ctx, &seven), ctx.shader_cache_stats()), (8, counts(1, 1)), "in the same run too");
    drop(ctx);
    let ctx = start(&place).unwrap();
    assert_eq!((answer(&ctx, &seven), ctx.shader_cache_stats()), (8, counts(1, 0)));
    let named = ShaderModuleDesc { debug_name: "another name", ..seven };
    assert_eq!((answer(&ctx, &named), ctx.shader_cache_stats()), (8, counts(2, 0)));
    assert_eq!(files(&place).len(), 1);
    assert_eq!(take_warnings(place.to_str().unwrap()), [""; 0]);
    let Some(plain) = device() else { return };
    assert_eq!((answer(&plain, &seven), plain.shader_cache_stats()), (8, counts(0, 0)), "without a folder");
}

#[test]
fn nothing_outdated_is_taken() {
    let folder = folder();
    let Some(ctx) = start(folder.path()) else { return };
    let (one, two) = ([("ADDED", "1")], [("ADDED", "2")]);
    let listed = [("value.glsl", "const uint VALUE = 10;")];
    let nested = [("value.glsl", "#include <deep.glsl>\n"), ("deep.glsl", "const uint VALUE = 20;")];
    let deeper = [("value.glsl", "#include <deep.glsl>\n"), ("deep.glsl", "const uint VALUE = 30;")];
    let cases = [
        (desc(&listed, &one), 11),
        (desc(&listed, &two), 12),
        (desc(&nested, &one), 21),
        (desc(&deeper, &one), 31),
    ];
    for (desc, expected) in cases {
        assert_eq!(answer(&ctx, &desc), expected);
    }
    assert_eq!(ctx.shader_cache_stats(), counts(0, 4));
    let (found, _) = (answer(&ctx, &cases[3].0), answer(&ctx, &cases[0].0));
    assert_eq!((found, ctx.shader_cache_stats()), (31, counts(2, 4)));
    let with_text = ShaderModuleDesc { debug_info: true, ..cases[0].0 };
    assert_eq!((answer(&ctx, &with_text), ctx.shader_cache_stats()), (11, counts(2, 5)));
}

#[test]
fn files_that_were_changed_or_put_in_front_are_noticed() {
    let folder = folder();
    let Some(ctx) = start(&folder.path().join("cache")) else { return };
    let dirs = ["first", "second"].map(|name| folder.path().join(name));
    dirs.iter().for_each(|dir| std::fs::create_dir(dir).unwrap());
    let include_dirs = [dirs[0].as_path(), dirs[1].as_path()];
    let added = [("ADDED", "0")];
    let desc = ShaderModuleDesc { include_dirs: &include_dirs, ..desc(&[], &added) };
    let write = |dir: usize, value: u32| {
        std::fs::write(dirs[dir].join("value.glsl"), format!("const uint VALUE = {value};")).unwrap();
    };
    write(1, 5);
    assert_eq!((answer(&ctx, &desc), answer(&ctx, &desc)), (5, 5));
    write(1, 6);
    assert_eq!((answer(&ctx, &desc), answer(&ctx, &desc)), (6, 6));
    write(0, 7);
    assert_eq!((answer(&ctx, &desc), answer(&ctx, &desc)), (7, 7), "found in a folder before it");
    std::fs::remove_file(dirs[0].join("value.glsl")).unwrap();
    assert_eq!(answer(&ctx, &desc), 6);
    std::fs::remove_file(dirs[1].join("value.glsl")).unwrap();
    let gone = ctx.create_shader_module(&desc);
    assert!(matches!(&gone, Err(Error::Shader { log, .. }) if log.contains("value.glsl")), "{gone:?}");
    assert_eq!(ctx.shader_cache_stats(), counts(3, 4));
}

#[test]
fn damaged_and_foreign_files_are_dropped_and_replaced() {
    let folder = folder();
    let path = folder.path();
    let Some(ctx) = start(path) else { return };
    let listed = [("value.glsl", "const uint VALUE = 7;")];
    let [a, b] = [[("ADDED", "1")], [("ADDED", "2")]];
    answer(&ctx, &desc(&listed, &a));
    let file = files(path).remove(0);
    answer(&ctx, &desc(&listed, &b));
    let other = files(path).into_iter().find(|found| *found != file).unwrap();
    let good = std::fs::read(&file).unwrap();
    let mut flipped = good.clone();
    *flipped.last_mut().unwrap() ^= 4;
    let cases: [(&[u8], &str); 6] = [
        (&good[..good.len() - 1], "damaged or cut off"),
        (&[&good[..], b"more"].concat(), "damaged or cut off"),
        (&flipped, "damaged or cut off"),
        (&[], "no compiled shader"),
        (b"#version 460", "no compiled shader"),
        (&std::fs::read(&other).unwrap(), "compiled from something else"),
    ];
    for (bytes, words) in cases {
        std::fs::write(&file, bytes).unwrap();
        let before = ctx.shader_cache_stats();
        assert_eq!(answer(&ctx, &desc(&listed, &a)), 8);
        let warnings = take_warnings(path.to_str().unwrap());
        assert!(warnings.len() == 1 && warnings[0].contains(words), "{words}: {warnings:?}");
        assert_eq!(ctx.shader_cache_stats().compiled, before.compiled + 1, "{words}");
        assert_eq!(std::fs::read(&file).unwrap(), good, "{words}");
    }
}

#[test]
fn errors_stay_errors_and_a_file_in_the_folders_place_only_warns() {
    let folder = folder();
    let Some(ctx) = start(folder.path()) else { return };
    let wrong = ShaderModuleDesc {
        stage: ShaderStage::Compute,
        source: ShaderSource::Glsl("\nvoid main() { nothing(); }"),
        ..Default::default()
    };
    for _ in 0..2 {
        let log = ctx.create_shader_module(&wrong).unwrap_err().to_string();
        assert!(log.contains("line 2") && log.contains("nothing"), "{log}");
    }
    assert_eq!((ctx.shader_cache_stats(), files(folder.path()).len()), (counts(0, 0), 0));
    let file = folder.path().join("a file");
    std::fs::write(&file, "mine").unwrap();
    let ctx = start(&file).unwrap();
    let seven = desc(&[("value.glsl", "const uint VALUE = 7;")], &[("ADDED", "1")]);
    assert_eq!(answer(&ctx, &seven), 8);
    let warnings = take_warnings(file.to_str().unwrap());
    assert!(
        !warnings.is_empty() && warnings.iter().any(|text| text.contains("cannot be kept")),
        "{warnings:?}"
    );
    assert_eq!(std::fs::read(&file).unwrap(), b"mine");
}

#[test]
fn contexts_side_by_side_share_a_folder() {
    let folder = folder();
    let Some(first) = start(folder.path()) else { return };
    let second = start(folder.path()).unwrap();
    std::thread::scope(|scope| {
        for ctx in [&first, &second] {
            scope.spawn(|| {
                for value in (0..10).cycle().take(30) {
                    let added = value.to_string();
                    let defines = [("ADDED", added.as_str())];
                    let module = desc(&[("value.glsl", "const uint VALUE = 7;")], &defines);
                    drop(ctx.create_shader_module(&module).unwrap());
                }
            });
        }
    });
    let (a, b) = (first.shader_cache_stats(), second.shader_cache_stats());
    assert!(a.found + b.found + a.compiled + b.compiled == 60 && a.found.min(b.found) >= 20, "{a:?} {b:?}");
    assert_eq!(files(folder.path()).len(), 10);
    assert_eq!(take_warnings(folder.path().to_str().unwrap()), [""; 0]);
}

/// All modules of the samples, twice; the times go to standard error.
#[test]
fn every_module_of_the_samples_is_cached() {
    let folder = folder();
    let Some(ctx) = start(folder.path()) else { return };
    let make_all = |ctx: &Context| {
        let start = Instant::now();
        let modules = pipelines::all().into_iter().flat_map(|pipeline| pipeline.stages);
        let made = modules.filter(|stage| ctx.create_shader_module(&stage.module()).is_ok()).count() as u64;
        (made, start.elapsed())
    };
    let (made, first) = make_all(&ctx);
    // A few are compiled and then refused for what the device lacks.
    let ShaderCacheStats { found, compiled } = ctx.shader_cache_stats();
    assert!(made >= 60 && compiled >= 50 && found + compiled >= made, "{made} {found} {compiled}");
    let again = start(folder.path()).unwrap();
    let (made_again, second) = make_all(&again);
    assert_eq!((made_again, again.shader_cache_stats()), (made, counts(found + compiled, 0)));
    eprintln!("{made} modules: {first:?} without, {second:?} with what was kept");
}
