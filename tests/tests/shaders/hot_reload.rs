//! Shaders that are compiled anew when their files change: texts, includes, broken texts, deleted files.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use lvk::{
    ComputePipelineDesc, ComputePipelineHandle, Context, Error, Holder, Reloadable, ShaderFiles,
    ShaderModuleDesc, ShaderStage,
};
use lvk_tests::compute::run_on_words;
use lvk_tests::{device, device_with};
use tempfile::TempDir;

const TEXT: &str = "
    #include \"value.glsl\"
    layout(local_size_x = 1) in;
    layout(buffer_reference, scalar) writeonly buffer Words { uint at[]; };
    layout(push_constant, scalar) uniform Push { Words words; };
    void main() { words.at[0] = VALUE; }";

/// A folder with a compute shader that writes a value from its include.
struct Shaders {
    folder: TempDir,
}

impl Shaders {
    fn new() -> Self {
        let shaders = Self { folder: tempfile::tempdir().unwrap() };
        shaders.write("write.comp.glsl", TEXT);
        shaders.write("value.glsl", "#define VALUE 1");
        shaders
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Writes a file with a length of its own, so that the change shows whatever the resolution of times.
    fn write(&self, name: &str, text: &str) {
        let old = fs::metadata(self.path(name)).map_or(0, |about| about.len() as usize);
        let padding = if text.len() == old { "\n" } else { "" };
        fs::write(self.path(name), format!("{text}{padding}")).unwrap();
    }

    fn reloadable(&self, ctx: &Context) -> Reloadable<Holder<ComputePipelineHandle>> {
        let path = self.path("write.comp.glsl");
        let pipeline = Reloadable::new(ctx, move |ctx, files| compute(ctx, files, &path)).unwrap();
        pipeline.with_period(Duration::ZERO)
    }
}

fn compute(ctx: &Context, files: &ShaderFiles, path: &Path) -> lvk::Result<Holder<ComputePipelineHandle>> {
    let stage = ShaderStage::Compute;
    let desc = ShaderModuleDesc { stage, debug_name: "write", ..Default::default() };
    let module = files.create_module(ctx, path, &desc)?;
    ctx.create_compute_pipeline(&ComputePipelineDesc { module: Some(*module), ..Default::default() })
}

/// Returns the word that the pipeline writes.
fn written(ctx: &Context, pipeline: ComputePipelineHandle) -> u32 {
    run_on_words(ctx, pipeline, &[0])[0]
}

#[test]
fn a_changed_text_or_include_is_compiled_anew_once() {
    let Some(ctx) = device() else { return };
    let shaders = Shaders::new();
    let mut pipeline = shaders.reloadable(&ctx);
    assert!(!pipeline.poll().unwrap());
    assert_eq!(written(&ctx, **pipeline), 1);
    for (file, text, value) in [
        ("value.glsl", "#define VALUE 20", 20),
        ("write.comp.glsl", &*TEXT.replace("= VALUE", "= VALUE + 1"), 21),
        ("value.glsl", "#define VALUE 300", 301),
    ] {
        let old = **pipeline;
        shaders.write(file, text);
        assert_eq!([pipeline.poll().unwrap(), pipeline.poll().unwrap()], [true, false], "{file}");
        assert_eq!(written(&ctx, **pipeline), value, "{file}");
        let mut cmd = ctx.acquire_command_buffer().unwrap();
        let stale = cmd.bind_compute_pipeline(old).unwrap_err();
        assert!(matches!(stale, Error::StaleHandle { .. }), "the old pipeline is destroyed");
    }
}

#[test]
fn a_broken_text_is_reported_once_and_the_old_pipeline_stays_until_it_heals() {
    let Some(ctx) = device() else { return };
    let shaders = Shaders::new();
    let mut pipeline = shaders.reloadable(&ctx);
    let old = **pipeline;
    shaders.write("value.glsl", "#define VALUE noSuchValue");
    match pipeline.poll() {
        Err(Error::Shader { name, log }) => assert!(name == "write" && log.contains("noSuchValue"), "{log}"),
        other => unreachable!("{other:?}"),
    }
    assert!(!pipeline.poll().unwrap(), "an error is reported once");
    assert_eq!((**pipeline, written(&ctx, **pipeline)), (old, 1));
    shaders.write("value.glsl", "#define VALUE 5");
    assert!(pipeline.poll().unwrap());
    assert_eq!(written(&ctx, **pipeline), 5);
}

#[test]
fn deleted_files_keep_the_old_pipeline_until_they_are_back() {
    let Some(ctx) = device() else { return };
    let shaders = Shaders::new();
    let mut pipeline = shaders.reloadable(&ctx);
    for (file, text) in [("write.comp.glsl", TEXT), ("value.glsl", "#define VALUE 1")] {
        fs::remove_file(shaders.path(file)).unwrap();
        let error = pipeline.poll().unwrap_err();
        assert!(matches!(error, Error::File { .. } | Error::Shader { .. }), "{error}");
        assert!(error.to_string().contains(file) && error.to_string().contains("write"), "{error}");
        assert!(!pipeline.poll().unwrap());
        assert_eq!(written(&ctx, **pipeline), 1);
        shaders.write(file, text);
        assert!(pipeline.poll().unwrap(), "{file} is back");
        assert_eq!(written(&ctx, **pipeline), 1);
    }
}

#[test]
fn an_include_that_takes_the_place_of_another_is_noticed() {
    let Some(ctx) = device() else { return };
    let shaders = Shaders::new();
    let below = shaders.path("below");
    fs::create_dir(&below).unwrap();
    fs::rename(shaders.path("value.glsl"), below.join("value.glsl")).unwrap();
    let path = shaders.path("write.comp.glsl");
    let build = move |ctx: &Context, files: &ShaderFiles| {
        let include_dirs: &[&Path] = &[&below];
        let desc = ShaderModuleDesc { stage: ShaderStage::Compute, include_dirs, ..Default::default() };
        let module = files.create_module(ctx, &path, &desc)?;
        ctx.create_compute_pipeline(&ComputePipelineDesc { module: Some(*module), ..Default::default() })
    };
    let mut pipeline = Reloadable::new(&ctx, build).unwrap().with_period(Duration::ZERO);
    assert_eq!(written(&ctx, **pipeline), 1);
    shaders.write("value.glsl", "#define VALUE 77");
    assert!(pipeline.poll().unwrap());
    assert_eq!(written(&ctx, **pipeline), 77);
}

/// Words that come from the cache have includes too.
#[test]
fn files_of_cached_modules_are_checked_as_well() {
    let cache = tempfile::tempdir().unwrap();
    let Some(ctx) = device_with(|desc| desc.shader_cache = Some(cache.path())) else { return };
    let shaders = Shaders::new();
    drop(shaders.reloadable(&ctx));
    let mut pipeline = shaders.reloadable(&ctx);
    assert_eq!(ctx.shader_cache_stats().found, 1);
    assert!(pipeline.files().paths().contains(&shaders.path("value.glsl")), "{:?}", pipeline.files());
    shaders.write("value.glsl", "#define VALUE 42");
    assert!(pipeline.poll().unwrap());
    assert_eq!(written(&ctx, **pipeline), 42);
}

#[test]
fn several_pipelines_are_replaced_together_or_not_at_all() {
    let Some(ctx) = device() else { return };
    let shaders = Shaders::new();
    shaders.write("other.comp.glsl", &TEXT.replace("= VALUE", "= 2 * VALUE"));
    let paths = ["write.comp.glsl", "other.comp.glsl"].map(|name| shaders.path(name));
    let build = move |ctx: &Context, files: &ShaderFiles| {
        Ok([compute(ctx, files, &paths[0])?, compute(ctx, files, &paths[1])?])
    };
    let mut pair = Reloadable::new(&ctx, build).unwrap().with_period(Duration::ZERO);
    let values = |pair: &Reloadable<[Holder<ComputePipelineHandle>; 2]>| {
        [written(&ctx, *pair[0]), written(&ctx, *pair[1])]
    };
    shaders.write("write.comp.glsl", &TEXT.replace("= VALUE", "= VALUE + 5"));
    shaders.write("other.comp.glsl", &TEXT.replace("= VALUE", "= noSuchValue"));
    assert!(pair.poll().unwrap_err().to_string().contains("noSuchValue"));
    assert_eq!(values(&pair), [1, 2]);
    shaders.write("other.comp.glsl", &TEXT.replace("= VALUE", "= 4 * VALUE + 0"));
    assert!(pair.poll().unwrap());
    assert_eq!(values(&pair), [6, 4]);
}

#[test]
fn the_first_build_must_succeed_and_a_reload_can_be_forced() {
    let Some(ctx) = device() else { return };
    let shaders = Shaders::new();
    let absent = shaders.path("absent.comp.glsl");
    let refused = Reloadable::new(&ctx, move |ctx, files| compute(ctx, files, &absent)).map(|_| ());
    match refused {
        Err(Error::File { path, message }) => {
            assert!(path.ends_with("absent.comp.glsl") && message.contains("'write'"), "{message}");
        }
        other => unreachable!("{other:?}"),
    }
    let mut pipeline = shaders.reloadable(&ctx);
    let old = **pipeline;
    pipeline.reload().unwrap();
    assert!(**pipeline != old);
    assert_eq!(written(&ctx, **pipeline), 1);
}
