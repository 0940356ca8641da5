//! Whole sweeps: every fault of every program, in minutes each (`.ci/slow faults`).

use std::fmt::Display;
use std::path::Path;
use std::str::FromStr;
use std::time::Duration;

use lvk_dev_driver::{DriverRequest, prepare};
use lvk_faults::fault::Span;
use lvk_faults::sweep::plan::SweepPlan;
use lvk_faults::sweep::report::sweep;
use lvk_faults::sweep::run::{Caches, Program};
use lvk_samples::app::cli::command;
use lvk_samples::catalogue::SAMPLES;
use lvk_viewer::Viewer;

use crate::{WINDOWED, assert_validated, clean, in_window, is_validated, program, validated, varies};

/// Time of a full sweep.
const WHOLE: Duration = Duration::from_secs(6 * 3600);

/// Returns the plan of whole sweeps, bounded by `LVK_FAULT_MOST`, a number, by `LVK_FAULT_PART`, as `2/3`, and by `LVK_FAULT_COMMANDS`, as
/// `vkMapMemory,vkCreateBuffer`.
fn whole_plan() -> SweepPlan {
    let full = SweepPlan::full();
    SweepPlan {
        most: variable("LVK_FAULT_MOST", full.most),
        part: variable("LVK_FAULT_PART", full.part),
        commands: variable("LVK_FAULT_COMMANDS", String::new())
            .split_terminator(',')
            .map(str::to_owned)
            .collect(),
        ..full
    }
}

/// Returns the value of an environment variable, or `default` where it is not set.
fn variable<T: FromStr>(name: &str, default: T) -> T
where
    T::Err: Display,
{
    match std::env::var(name) {
        Ok(text) => text.parse().unwrap_or_else(|error| panic!("{name}: {error}")),
        Err(_) => default,
    }
}

/// Runs the whole sweep, as far as [`whole_plan`] goes, and prints its row of the table in `docs/reliability.md`.
fn whole(name: &str, line: &str, program: &Program) {
    whole_of(name, line, program, &whole_plan());
}

fn whole_of(name: &str, line: &str, program: &Program, plan: &SweepPlan) {
    let report = sweep(program, plan, WHOLE).unwrap();
    println!("{line}: {report}\n{}", report.row(name));
    let is_reached = report.reached > 0 && 20 * report.missed <= if varies(line) { report.runs } else { 0 };
    assert!(report.flawed.is_empty() && is_reached, "{line}: {report}");
    assert_eq!(report.runs, report.planned, "{line}: {report}");
}

/// Declares an ignored test for each scenario.
macro_rules! whole_sweeps {
    ($($test:ident: $line:literal;)*) => {
        /// The programs of all these sweeps.
        const LINES: &[&str] = &[$($line),*];

        $(
            #[test]
            #[ignore = "minutes: .ci/slow faults"]
            fn $test() {
                whole(stringify!($test), $line, &program($line));
            }
        )*
    };
}

whole_sweeps! {
    whole_hybrid_pipeline: "hybrid --width 64 --height 36 --frames 1 --rt hardware --scene SCENE";
    whole_hybrid_lowered: "hybrid --width 64 --height 36 --frames 1 --rt pipeline --scene SCENE";
    whole_hybrid_query: "hybrid --width 64 --height 36 --frames 1 --rt query --scene SCENE";
    whole_hybrid_software: "hybrid --width 64 --height 36 --frames 1 --rt software --scene SCENE";
    whole_rtx_hello_pipeline: "rtx_hello --width 64 --height 36 --frames 1 --rt hardware";
    whole_rtx_hello_lowered: "rtx_hello --width 64 --height 36 --frames 1 --rt pipeline";
    whole_rtx_hello_query: "rtx_hello --width 64 --height 36 --frames 1 --rt query";
    whole_rtx_hello_software: "rtx_hello --width 64 --height 36 --frames 1 --rt software";
    whole_rtx_ao_pipeline: "rtx_ao --width 64 --height 36 --frames 1 --rt hardware --passes 1";
    whole_rtx_ao_lowered: "rtx_ao --width 64 --height 36 --frames 1 --rt pipeline --passes 1";
    whole_rtx_ao_query: "rtx_ao --width 64 --height 36 --frames 1 --rt query --passes 1";
    whole_rtx_ao_software: "rtx_ao --width 64 --height 36 --frames 1 --rt software --passes 1";
    whole_rtx_pipeline_pipeline: "rtx_pipeline --width 64 --height 36 --frames 1 --rt hardware";
    whole_rtx_pipeline_lowered: "rtx_pipeline --width 64 --height 36 --frames 1 --rt pipeline";
    whole_rtx_pipeline_query: "rtx_pipeline --width 64 --height 36 --frames 1 --rt query";
    whole_rtx_pipeline_software: "rtx_pipeline --width 64 --height 36 --frames 1 --rt software";
    whole_rtx_textures_pipeline: "rtx_textures --width 64 --height 36 --frames 1 --rt hardware";
    whole_rtx_textures_lowered: "rtx_textures --width 64 --height 36 --frames 1 --rt pipeline";
    whole_rtx_textures_query: "rtx_textures --width 64 --height 36 --frames 1 --rt query";
    whole_rtx_textures_software: "rtx_textures --width 64 --height 36 --frames 1 --rt software";
    whole_hybrid_oit_pipeline: "hybrid_oit --width 64 --height 36 --frames 1 --rt hardware --supersampling 1";
    whole_hybrid_oit_lowered: "hybrid_oit --width 64 --height 36 --frames 1 --rt pipeline --supersampling 1";
    whole_hybrid_oit_query: "hybrid_oit --width 64 --height 36 --frames 1 --rt query --supersampling 1";
    whole_hybrid_oit_software: "hybrid_oit --width 64 --height 36 --frames 1 --rt software --supersampling 1";
    whole_large_scene_pipeline: "large_scene --width 64 --height 36 --frames 1 --rt hardware --triangles 2000 --copies 3 --samples 1";
    whole_large_scene_lowered: "large_scene --width 64 --height 36 --frames 1 --rt pipeline --triangles 2000 --copies 3 --samples 1";
    whole_large_scene_query: "large_scene --width 64 --height 36 --frames 1 --rt query --triangles 2000 --copies 3 --samples 1";
    whole_large_scene_software: "large_scene --width 64 --height 36 --frames 1 --rt software --triangles 2000 --copies 3 --samples 1";
    whole_reflections_pipeline: "reflections --width 64 --height 36 --frames 1 --rt hardware --samples 1";
    whole_reflections_lowered: "reflections --width 64 --height 36 --frames 1 --rt pipeline --samples 1";
    whole_reflections_query: "reflections --width 64 --height 36 --frames 1 --rt query --samples 1";
    whole_reflections_software: "reflections --width 64 --height 36 --frames 1 --rt software --samples 1";
    whole_hello_triangle: "hello_triangle --width 64 --height 36 --frames 1";
    whole_deferred: "deferred --width 64 --height 36 --frames 1 --lights 20";
    whole_mesh_shaders: "mesh_shaders --width 64 --height 36 --frames 1";
    whole_omni_shadows: "omni_shadows --width 64 --height 36 --frames 1";
    whole_render_to_cube_map: "render_to_cube_map --width 64 --height 36 --frames 1 --face-size 32";
    whole_sponza: "sponza --width 64 --height 36 --frames 1 --shadow-size 256";
    whole_triplanar: "triplanar --width 64 --height 36 --frames 1";
    whole_yuv: "yuv --width 64 --height 36 --frames 1";
    whole_triangle: "triangle";
    whole_viewer_pipeline: "viewer SCENE --width 64 --height 36 --frames 1 --rt hardware --samples 2";
    whole_viewer_lowered: "viewer SCENE --width 64 --height 36 --frames 1 --rt pipeline --samples 2";
    whole_viewer_query: "viewer SCENE --width 64 --height 36 --frames 1 --rt query --samples 2";
    whole_viewer_software: "viewer SCENE --width 64 --height 36 --frames 1 --rt software --samples 2";
    whole_path_tracer_pipeline: "viewer SCENE --width 64 --height 36 --frames 1 --rt hardware --samples 2 --method pathtrace";
    whole_path_tracer_lowered: "viewer SCENE --width 64 --height 36 --frames 1 --rt pipeline --samples 2 --method pathtrace";
    whole_path_tracer_query: "viewer SCENE --width 64 --height 36 --frames 1 --rt query --samples 2 --method pathtrace";
    whole_path_tracer_software: "viewer SCENE --width 64 --height 36 --frames 1 --rt software --samples 2 --method pathtrace";
    whole_blas: "blas";
    whole_blas_software: "blas_software";
    whole_threads: "threads";
    whole_queues: "queues";
    whole_own_queues: "own_queues";
    whole_raw_device: "raw_device";
    whole_hot_reload: "hot_reload";
    whole_pipelines: "pipelines";
    whole_serialize: "serialize";
    whole_interop: "interop";
}

#[test]
fn every_sample_has_a_sweep_of_each_of_its_paths() {
    let samples = SAMPLES.iter().map(|sample| (sample.command)()).chain([command::<Viewer>()]);
    for sample in samples {
        let name = sample.get_name();
        let paths: &[&str] = match sample.get_arguments().any(|argument| argument.get_id() == "rt") {
            true => &["hardware", "pipeline", "query", "software"],
            false => &[""],
        };
        for path in paths {
            let of_path = |line: &&&str| line.split(' ').any(|word| path.is_empty() || word == *path);
            let is_swept = LINES.iter().filter(of_path).any(|line| line.split(' ').next() == Some(name));
            assert!(is_swept, "no sweep of {name} {path}");
        }
    }
}

/// The example opens the loader that the dynamic linker finds.
#[test]
#[ignore = "minutes: .ci/slow faults"]
fn whole_example_triangle() {
    let driver = prepare(&DriverRequest::default()).unwrap();
    let folder = driver.loader.as_deref().and_then(Path::parent).map(|folder| folder.display().to_string());
    let variables = folder.map(|folder| ("LD_LIBRARY_PATH".to_owned(), folder)).into_iter().collect();
    whole(
        "whole_example_triangle",
        "example_triangle",
        &Program { variables, ..program("example_triangle") },
    );
}

/// Declares an ignored test for each program that runs with the validation layer, below the layer of the faults: what the library does
/// after a failed call must be valid.
macro_rules! validated_sweeps {
    ($($test:ident: $line:literal;)*) => {$(
        #[test]
        #[ignore = "minutes: .ci/slow faults"]
        fn $test() {
            assert_validated(&clean(validated($line)));
            whole(stringify!($test), $line, &validated($line));
        }
    )*};
}

validated_sweeps! {
    whole_validated_hybrid_pipeline: "hybrid --width 64 --height 36 --frames 1 --rt hardware --scene SCENE";
    whole_validated_hybrid_lowered: "hybrid --width 64 --height 36 --frames 1 --rt pipeline --scene SCENE";
    whole_validated_viewer_query: "viewer SCENE --width 64 --height 36 --frames 1 --rt query --samples 2";
    whole_validated_blas: "blas";
    whole_validated_blas_software: "blas_software";
    whole_validated_threads: "threads";
    whole_validated_queues: "queues";
    whole_validated_hot_reload: "hot_reload";
    whole_validated_pipelines: "pipelines";
    whole_validated_serialize: "serialize";
    whole_validated_raw_device: "raw_device";
    whole_validated_interop: "interop";
}

/// Declares an ignored test for each scenario whose context may be leaked, as questions about the progress of its work fail too.
macro_rules! unanswered_sweeps {
    ($($test:ident: $line:literal;)*) => {$(
        #[test]
        #[ignore = "minutes: .ci/slow faults"]
        fn $test() {
            let plan = SweepPlan { spans: vec![Span::Unanswered], ..whole_plan() };
            whole_of(stringify!($test), $line, &program($line), &plan);
        }
    )*};
}

unanswered_sweeps! {
    whole_unanswered_threads: "threads";
    whole_unanswered_queues: "queues";
    whole_unanswered_blas: "blas";
    whole_unanswered_raw_device: "raw_device";
    whole_unanswered_hybrid: "hybrid --width 64 --height 36 --frames 1 --rt software --scene SCENE";
}

/// Declares an ignored test for each program that starts without caches and writes them: of shaders, pipelines, BVHs and scenes.
macro_rules! cold_sweeps {
    ($($test:ident: $line:literal;)*) => {$(
        #[test]
        #[ignore = "minutes: .ci/slow faults"]
        fn $test() {
            whole(stringify!($test), $line, &Program { caches: Caches::Cold, ..program($line) });
        }
    )*};
}

cold_sweeps! {
    whole_cold_hybrid: "hybrid --width 64 --height 36 --frames 1 --rt software --scene SCENE";
    whole_cold_large_scene_query: "large_scene --width 64 --height 36 --frames 1 --rt query --triangles 2000 --copies 3 --samples 1";
    whole_cold_rtx_hello: "rtx_hello --width 64 --height 36 --frames 1 --rt hardware";
    whole_cold_blas_software: "blas_software";
}

/// Declares an ignored test for each program in a window. A swapchain that stays out of date has no end where a program waits for an
/// image for ever, as samples do.
macro_rules! window_sweeps {
    ($($test:ident: $program:expr, $stays_out_of_date:literal;)*) => {$(
        #[test]
        #[ignore = "minutes: .ci/slow faults"]
        fn $test() {
            whole_in_window(stringify!($test), $program, $stays_out_of_date);
        }
    )*};
}

window_sweeps! {
    whole_window: program("window"), true;
    whole_another_window: program("another_window"), true;
    whole_kept_surface: program("kept_surface"), true;
    whole_window_of_hybrid: sample_in_window(program(WINDOWED[0])), false;
    whole_window_of_hello_triangle: sample_in_window(program(WINDOWED[1])), false;
    whole_window_of_viewer: sample_in_window(program(WINDOWED[2])), false;
    whole_validated_window: validated("window"), true;
    whole_validated_another_window: validated("another_window"), true;
}

/// Returns a sample for a window: three frames. A process has one event loop, so there is no second try.
fn sample_in_window(program: Program) -> Program {
    Program { tries_again: false, ..program }
}

fn whole_in_window(name: &str, program: Program, stays_out_of_date: bool) {
    let Some((_connection, _display, program)) = in_window(program) else { return };
    if is_validated(&program) {
        assert_validated(&clean(program.clone()));
    }
    let plan = SweepPlan { stays_out_of_date, ..whole_plan() };
    whole_of(name, &program.args.join(" "), &program, &plan);
}
