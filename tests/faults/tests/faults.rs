//! Calls of the samples and of scenarios fail: each run ends with the right result or with an error, and leaves nothing.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on has failed")]

use std::collections::BTreeSet;
use std::fmt::Display;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::time::Duration;

use lvk::{Context, ContextDesc};
use lvk_dev_driver::{DriverRequest, VirtualDisplay, prepare, virtual_display};
use lvk_faults::fault::{FaultError, Span};
use lvk_faults::fault_report::{DESCRIPTION, FaultReport, REPORT_VARIABLE};
use lvk_faults::sweep::plan::SweepPlan;
use lvk_faults::sweep::report::sweep;
use lvk_faults::sweep::run::{Caches, LayerFolder, Program, run};
use lvk_faults::sweep::verdict::{Ending, Flaw, RunOutcome, flaws};
use x11rb::rust_connection::RustConnection;

/// Time of a full sweep.
const WHOLE: Duration = Duration::from_secs(6 * 3600);
/// Time of a sweep in the normal tests.
const SAMPLE: Duration = Duration::from_secs(40);
/// Faults that a sweep of the normal tests reaches in that time at the least, on slow machines too.
const LEAST: usize = 5;

/// A scene of six triangles: a floor, a mirror behind and a pane of glass before it.
const SCENE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scene.obj");

fn program(line: &str) -> Program {
    let args = line.split_whitespace().map(|word| word.replace("SCENE", SCENE)).collect();
    let path = PathBuf::from(env!("CARGO_BIN_EXE_fault_scenarios"));
    Program { path, args, variables: Vec::new(), caches: Caches::Warm, tries_again: true }
}

fn assert_no_flaws(line: &str, program: &Program, plan: &SweepPlan, budget: Duration) {
    let report = sweep(program, plan, budget).unwrap();
    println!("{line}: {report}");
    assert!(report.flawed.is_empty() && report.reached >= LEAST, "{line}: {report}");
}

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
    let unreached = report.runs - report.reached;
    let is_reached = report.reached > 0 && 20 * unreached <= if varies(line) { report.runs } else { 0 };
    assert!(report.flawed.is_empty() && is_reached, "{line}: {report}");
    assert_eq!(report.runs, report.planned, "{line}: {report}");
}

/// True for programs whose number of calls differs from run to run, by the order of threads or the time of a window, so that a
/// few faults are not reached.
fn varies(line: &str) -> bool {
    ["threads", "window"].iter().any(|start| line.starts_with(start))
}

/// Declares an ignored test for each scenario.
macro_rules! whole_sweeps {
    ($($test:ident: $line:literal;)*) => {$(
        #[test]
        #[ignore = "minutes: .ci/slow faults"]
        fn $test() {
            whole(stringify!($test), $line, &program($line));
        }
    )*};
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
    whole_path_tracer: "viewer SCENE --width 64 --height 36 --frames 1 --rt query --samples 2 --method pathtrace";
    whole_blas: "blas";
    whole_blas_software: "blas_software";
    whole_threads: "threads";
    whole_queues: "queues";
    whole_raw_device: "raw_device";
    whole_hot_reload: "hot_reload";
    whole_interop: "interop";
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
            whole(stringify!($test), $line, &validated($line));
        }
    )*};
}

validated_sweeps! {
    whole_validated_hybrid_pipeline: "hybrid --width 64 --height 36 --frames 1 --rt hardware --scene SCENE";
    whole_validated_hybrid_lowered: "hybrid --width 64 --height 36 --frames 1 --rt pipeline --scene SCENE";
    whole_validated_viewer: "viewer SCENE --width 64 --height 36 --frames 1 --rt query --samples 2";
    whole_validated_blas: "blas";
    whole_validated_blas_software: "blas_software";
    whole_validated_threads: "threads";
    whole_validated_queues: "queues";
    whole_validated_hot_reload: "hot_reload";
    whole_validated_interop: "interop";
}

/// Returns a program with the validation layer: samples have an argument for it, scenarios a variable.
fn validated(line: &str) -> Program {
    let mut program = program(line);
    match line.contains("--frames") {
        true => program.args.push("--validate".to_owned()),
        false => program.variables.push(("LVK_FAULT_VALIDATE".to_owned(), "1".to_owned())),
    }
    program
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
    whole_cold_large_scene: "large_scene --width 64 --height 36 --frames 1 --rt query --triangles 2000 --copies 3 --samples 1";
    whole_cold_rtx_hello: "rtx_hello --width 64 --height 36 --frames 1 --rt hardware";
    whole_cold_blas_software: "blas_software";
}

#[test]
#[ignore = "minutes: .ci/slow faults"]
fn whole_window() {
    let Some((_connection, _display, program)) = in_window() else { return };
    whole("whole_window", "window", &program);
}

/// True if the device draws to windows of an X server without a screen. NVIDIA's driver (580.159.04) makes no swapchain there.
fn draws_to_virtual_displays() -> bool {
    let driver = prepare(&DriverRequest::default()).unwrap();
    let desc = ContextDesc { vulkan_library: driver.loader.as_deref(), ..ContextDesc::default() };
    let draws = Context::new(&desc).unwrap().capabilities().driver_name != "NVIDIA";
    if !draws {
        eprintln!("NOT TESTED, NVIDIA's driver does not draw to an X server without a screen");
    }
    draws
}

/// Returns the scenario in a window, the X server that shows it, and a connection: without one the server ends with the first
/// program.
fn in_window() -> Option<(RustConnection, VirtualDisplay, Program)> {
    if !draws_to_virtual_displays() {
        return None;
    }
    let display = match virtual_display() {
        Ok(display) => display,
        Err(error) => {
            assert!(std::env::var_os("LVK_REQUIRE_GPU").is_none(), "{error}");
            eprintln!("SKIPPED, no X server for windows: {error}");
            return None;
        }
    };
    let variables = vec![("DISPLAY".to_owned(), display.name().to_owned())];
    let (connection, _) = RustConnection::connect(Some(display.name())).unwrap();
    Some((connection, display, Program { variables, ..program("window") }))
}

/// The samples in a window: three frames of each. A process has one event loop, so there is no second try.
#[test]
#[ignore = "minutes: .ci/slow faults"]
fn whole_windows_of_samples() {
    let Some((_connection, _display, window)) = in_window() else { return };
    for line in WINDOWED {
        let program = Program { variables: window.variables.clone(), tries_again: false, ..program(line) };
        whole(&format!("window of {line}"), line, &program);
    }
}

/// Samples in a window.
const WINDOWED: [&str; 3] = [
    "windowed hybrid --rt software --scene SCENE",
    "windowed hello_triangle",
    "windowed viewer SCENE --rt query --samples 2",
];

/// Some of the faults of the whole sweeps, spread evenly.
fn some(most: usize) -> SweepPlan {
    SweepPlan { most, ..SweepPlan::full() }
}

#[test]
fn some_calls_of_the_hybrid_sample_fail() {
    let line = "hybrid --width 64 --height 36 --frames 1 --rt hardware --scene SCENE";
    assert_no_flaws(line, &program(line), &some(30), SAMPLE);
}

#[test]
fn some_calls_of_scenarios_fail() {
    for line in ["blas", "threads", "queues", "raw_device", "hot_reload", "interop"] {
        assert_no_flaws(line, &program(line), &some(12), SAMPLE / 2);
    }
}

#[test]
fn some_calls_fail_above_the_validation_layer() {
    assert_no_flaws("queues", &validated("queues"), &some(12), SAMPLE / 2);
}

#[test]
fn some_calls_of_a_sample_in_a_window_fail() {
    let Some((_connection, _display, window)) = in_window() else { return };
    let program = Program { variables: window.variables, tries_again: false, ..program(WINDOWED[0]) };
    assert_no_flaws(WINDOWED[0], &program, &some(12), SAMPLE / 2);
}

#[test]
fn some_calls_fail_while_caches_are_written() {
    let line = "rtx_hello --width 64 --height 36 --frames 1 --rt hardware";
    let cold = Program { caches: Caches::Cold, ..program(line) };
    assert_no_flaws(line, &cold, &some(12), SAMPLE / 2);
}

#[test]
fn some_calls_of_a_window_fail() {
    let Some((_connection, _display, program)) = in_window() else { return };
    let errors = vec![FaultError::SurfaceLost, FaultError::OutOfDate];
    assert_no_flaws("window", &program, &SweepPlan { errors, ..some(12) }, SAMPLE);
}

/// Asserts that a fault is reached, and has no flaws. Returns what was found with the fault, and without.
fn assert_told(program: &Program, fault: &str) -> [RunOutcome; 2] {
    let (layer, caches) = (LayerFolder::new().unwrap(), tempfile::tempdir().unwrap());
    let (clean, _) = run(program, &layer, caches.path(), None).unwrap();
    let parsed = fault.parse().unwrap();
    let (outcome, _) = run(program, &layer, caches.path(), Some(&parsed)).unwrap();
    assert!(outcome.reached, "{fault}");
    assert_eq!(flaws(Some(&parsed), &outcome, &clean), [], "{fault}: {}", outcome.stderr);
    [outcome, clean]
}

/// Faults that a whole sweep found once (docs/reliability.md).
#[test]
fn faults_that_had_flaws_have_none() {
    assert_told(&program("queues"), "vkQueueWaitIdle 1 device-memory stays");
    assert_told(&program("blas"), "vkGetQueryPoolResults 1 device-lost once");
    let Some((_connection, _display, program)) = in_window() else { return };
    for fault in [
        "vkGetFenceStatus 1 device-lost once",
        "vkGetPhysicalDeviceSurfaceSupportKHR 1 host-memory once",
        "vkCreateXcbSurfaceKHR 1 host-memory once",
    ] {
        assert_told(&program, fault);
    }
}

/// Shortages in questions about what a driver supports are no lack of support.
#[test]
fn shortages_in_questions_are_no_lack_of_support() {
    let (layer, caches) = (LayerFolder::new().unwrap(), tempfile::tempdir().unwrap());
    let (_, calls) = run(&program("interop"), &layer, caches.path(), None).unwrap();
    for command in
        ["vkGetPhysicalDeviceImageFormatProperties2", "vkGetPhysicalDeviceCalibrateableTimeDomainsKHR"]
    {
        let count = calls.iter().filter(|call| call.command == command).count();
        assert!(count > 1, "{command}: {count}");
        for number in 1..=count {
            // The verdict asks for the command where the run fails.
            assert_told(&program("interop"), &format!("{command} {number} host-memory once"));
        }
    }
}

/// Every fault of commands that few programs call: handles of shader groups, sizes of fragments, modifiers of shared images.
#[test]
fn commands_of_few_programs_fail_as_others_do() {
    let hybrid = "hybrid --width 64 --height 36 --frames 1 --rt hardware --scene SCENE";
    let few = [
        "vkGetRayTracingShaderGroupHandlesKHR",
        "vkGetPhysicalDeviceFragmentShadingRatesKHR",
        "vkGetImageDrmFormatModifierPropertiesEXT",
    ];
    let mut reached = BTreeSet::new();
    for line in [hybrid, "interop"] {
        let (layer, caches) = (LayerFolder::new().unwrap(), tempfile::tempdir().unwrap());
        let (_, calls) = run(&program(line), &layer, caches.path(), None).unwrap();
        let of_few = SweepPlan::full().faults(&calls).into_iter();
        for fault in of_few.filter(|fault| few.contains(&&*fault.command)) {
            assert_told(&program(line), &fault.to_string());
            reached.insert(fault.command);
        }
    }
    println!("reached: {reached:?}");
    assert!(reached.contains(few[0]), "{reached:?}");
}

/// Returns the scenario whose context ends before its work. The C library overwrites memory that is freed, so that a driver
/// that works on destroyed objects crashes.
fn slow_work() -> Program {
    let overwrite = ("MALLOC_PERTURB_".to_owned(), "165".to_owned());
    Program { variables: vec![overwrite], ..program("slow_work") }
}

/// The end of a context asks the timelines where the queue cannot be waited for. The context destroys nothing before its work
/// has ended: else lavapipe would execute a command buffer that is freed.
#[test]
fn objects_in_use_outlive_waits_that_fail() {
    let [outcome, _] = assert_told(&slow_work(), "vkQueueWaitIdle 1 device-memory command");
    assert!(outcome.result.is_some() && !leaks(&outcome), "{}", outcome.stderr);
}

/// Where questions about the timelines fail too, the context is leaked.
#[test]
fn objects_that_may_be_in_use_are_leaked() {
    let [outcome, _] = assert_told(&slow_work(), "vkQueueWaitIdle 1 device-memory unanswered");
    assert!(outcome.result.is_some() && leaks(&outcome), "{}", outcome.stderr);
    let said = "warning: the end of a context: out of device memory in vkQueueWaitIdle for 'graphics queue'; its objects are";
    assert!(outcome.stderr.contains(said), "{}", outcome.stderr);
}

/// True if objects are alive at the end.
fn leaks(outcome: &RunOutcome) -> bool {
    outcome.live.values().any(|count| *count != 0)
}

/// The path tracer reads the number of its rays after the picture.
#[test]
fn shortages_after_the_picture_are_errors() {
    let line = "viewer SCENE --width 64 --height 36 --frames 1 --rt query --samples 2 --method pathtrace";
    let (layer, caches) = (LayerFolder::new().unwrap(), tempfile::tempdir().unwrap());
    let (_, calls) = run(&program(line), &layer, caches.path(), None).unwrap();
    let last = calls.iter().filter(|call| call.command == "vkQueueSubmit2").count();
    let [outcome, _] = assert_told(&program(line), &format!("vkQueueSubmit2 {last} device-memory once"));
    assert!(outcome.result.is_some() && outcome.ending == Ending::Status(1), "{}", outcome.stderr);
}

/// Objects of calls that create nothing: recording, submission and waits.
#[test]
fn errors_of_recording_submission_and_waits_name_the_object() {
    let (layer, caches) = (LayerFolder::new().unwrap(), tempfile::tempdir().unwrap());
    for (command, object) in [
        ("vkResetCommandPool", "command buffer of the graphics queue"),
        ("vkBeginCommandBuffer", "command buffer of the graphics queue"),
        ("vkEndCommandBuffer", "uploads and builds"),
        ("vkQueueSubmit2", "graphics queue"),
        ("vkWaitSemaphores", "timeline semaphore of the graphics queue"),
        ("vkEnumeratePhysicalDevices", "instance"),
    ] {
        let fault = format!("{command} 1 host-memory stays").parse().unwrap();
        let (outcome, _) = run(&program("hot_reload"), &layer, caches.path(), Some(&fault)).unwrap();
        let expected = format!("error: out of host memory in {command} for '{object}'\n");
        assert!(outcome.reached && outcome.stderr.contains(&expected), "{fault}: {}", outcome.stderr);
    }
}

/// The layer sees objects that are not destroyed, and the process what else it holds.
#[test]
fn what_a_scenario_forgets_is_seen() {
    let (layer, caches) = (LayerFolder::new().unwrap(), tempfile::tempdir().unwrap());
    let ran = |line| run(&program(line), &layer, caches.path(), None).unwrap();
    let ((clean, _), (forgetful, calls)) = (ran("leak remembers"), ran("leak forgets"));
    assert_eq!(flaws(None, &clean, &clean), [], "{}", clean.stderr);
    let found = flaws(None, &forgetful, &clean);
    let [Flaw::Leak(leak), Flaw::Held(held)] = &*found else { panic!("{found:?}") };
    assert_eq!(leak, "1 VkFence", "{}", forgetful.stderr);
    assert!(held.starts_with("1 file descriptors, 1 threads, 6"), "{held}");
    assert!(calls.len() > 50 && calls.iter().any(|call| call.command == "vkCreateFence"));
}

/// The layer of the faults lies above the validation layer, which sees what the library does.
#[test]
fn a_mistake_of_a_scenario_is_a_validation_message() {
    let (layer, caches) = (LayerFolder::new().unwrap(), tempfile::tempdir().unwrap());
    let (outcome, _) = run(&validated("leak forgets"), &layer, caches.path(), None).unwrap();
    let found = flaws(None, &outcome, &outcome);
    let is_message =
        |flaw: &Flaw| matches!(flaw, Flaw::Validation(text) if text.contains("VUID-vkDestroyDevice"));
    assert!(found.iter().any(is_message), "{found:?}");
}

/// Faults are injected, and told by the name of the call; a library that goes on without ray tracing needs a device, too.
#[test]
fn a_fault_at_the_creation_of_the_device_is_told() {
    let (layer, caches) = (LayerFolder::new().unwrap(), tempfile::tempdir().unwrap());
    for (error, text) in [("host-memory", "out of host memory"), ("device-lost", "lost")] {
        let fault = format!("vkCreateDevice 1 {error} stays").parse().unwrap();
        let (outcome, _) = run(&program("queues"), &layer, caches.path(), Some(&fault)).unwrap();
        assert!(outcome.reached && outcome.stderr.contains(text), "{}", outcome.stderr);
        assert!(outcome.stderr.contains("vkCreateDevice"), "{}", outcome.stderr);
    }
}

/// The layer stays loaded, so that a fault that is to happen once does not hit the second try.
#[test]
fn a_fault_happens_once_in_a_process() {
    let [outcome, clean] = assert_told(&program("queues"), "vkQueueSubmit2 2 device-lost once");
    assert_eq!((outcome.result, outcome.second_result), (None, clean.result));
}

/// Returns a scenario whose device reports why it was lost.
fn reporting(program: Program, report: FaultReport) -> Program {
    let variable = (REPORT_VARIABLE.to_owned(), report.name().to_owned());
    Program { variables: [program.variables, vec![variable]].concat(), ..program }
}

/// Returns the error of a run.
fn error_line(outcome: &RunOutcome) -> &str {
    outcome.stderr.lines().find(|line| line.starts_with("error: ")).unwrap_or_default()
}

/// Loses the device in each call that may lose it. Each error must have the driver's report, if there was a device.
fn assert_losses_are_explained(line: &str, program: Program, plan: &SweepPlan) {
    let program = reporting(program, FaultReport::Complete);
    let (layer, caches) = (LayerFolder::new().unwrap(), tempfile::tempdir().unwrap());
    let (clean, calls) = run(&program, &layer, caches.path(), None).unwrap();
    let description = DESCRIPTION.to_str().unwrap();
    let (mut explained, faults) = (0, plan.faults(&calls));
    for fault in &faults {
        let (outcome, _) = run(&program, &layer, caches.path(), Some(fault)).unwrap();
        assert_eq!(flaws(Some(fault), &outcome, &clean), [], "{line}, {fault}: {}", outcome.stderr);
        assert!(outcome.reached || varies(line), "{line}, {fault}: not reached");
        let has_failed = outcome.reached && outcome.result.is_none() && fault.command != "vkCreateDevice";
        if has_failed {
            assert!(error_line(&outcome).contains(description), "{line}, {fault}: {}", outcome.stderr);
            explained += 1;
        }
    }
    println!("{line}: {explained} of {} losses explained", faults.len());
    assert!(explained > 0, "{line}");
}

/// Losses of a device, spread evenly.
fn losses(most: usize) -> SweepPlan {
    SweepPlan { errors: vec![FaultError::DeviceLost], spans: vec![Span::Once], ..some(most) }
}

/// The report has the description, the address, with the name of the buffer there, and the code. What fails in the query
/// of the report hides no loss.
#[test]
fn the_fault_of_a_lost_device_is_told() {
    for report in FaultReport::ALL {
        let program = reporting(program("device_fault"), report);
        let [outcome, _] = assert_told(&program, "vkQueueSubmit2 1 device-lost once");
        let error = error_line(&outcome);
        let loss = "error: the device was lost in vkQueueSubmit2 for 'graphics queue'";
        let has_report = !matches!(report, FaultReport::NoCounts | FaultReport::NoLists);
        let start = if has_report {
            format!("{loss} (injected page fault; InvalidWrite at 0x")
        } else {
            format!("{loss}; ")
        };
        assert!(error.starts_with(&start), "{}: {error}", report.name());
        assert_eq!(
            error.contains("; injected unit (code 0x1d, data 0xfa))"),
            has_report,
            "{}: {error}",
            report.name()
        );
        let named = error.ends_with("; buffers at these addresses: target of the step");
        assert_eq!(named, has_report, "{}: {error}", report.name());
        let addresses = if report == FaultReport::Many { 8 } else { usize::from(has_report) };
        assert_eq!(error.matches("InvalidWrite").count(), addresses, "{}: {error}", report.name());
    }
}

#[test]
fn losses_are_told_with_their_fault() {
    for line in ["device_fault", "queues", "blas"] {
        assert_losses_are_explained(line, program(line), &losses(8));
    }
    let Some((_connection, _display, program)) = in_window() else { return };
    assert_losses_are_explained("window", program, &losses(16));
}

/// Losses whose error once came without the report.
#[test]
fn losses_that_lacked_their_fault_have_it() {
    let assert_explained = |program: Program, fault| {
        let [outcome, _] = assert_told(&reporting(program, FaultReport::Complete), fault);
        assert!(error_line(&outcome).contains("injected page fault"), "{fault}: {}", outcome.stderr);
    };
    assert_explained(program("blas"), "vkGetQueryPoolResults 2 device-lost once");
    let Some((_connection, _display, program)) = in_window() else { return };
    assert_explained(program, "vkCreateSwapchainKHR 1 device-lost once");
}

#[test]
#[ignore = "minutes: .ci/slow faults"]
fn whole_losses_are_told_with_their_fault() {
    for line in ["device_fault", "queues", "threads", "blas", "blas_software", "hot_reload"] {
        assert_losses_are_explained(line, program(line), &losses(usize::MAX));
    }
    let Some((_connection, _display, program)) = in_window() else { return };
    assert_losses_are_explained("window", program, &losses(usize::MAX));
}

/// Shortages in questions about formats, tools and cached pipelines are errors too: none is an answer that the program goes on with.
#[test]
fn shortages_in_other_questions_are_no_answers() {
    for (line, command) in [
        ("interop", "vkGetPhysicalDeviceImageFormatProperties"),
        ("interop", "vkGetPhysicalDeviceToolProperties"),
        ("yuv --width 64 --height 36 --frames 1", "vkGetPhysicalDeviceImageFormatProperties2"),
        ("yuv --width 64 --height 36 --frames 1", "vkCreatePipelineCache"),
    ] {
        let (layer, caches) = (LayerFolder::new().unwrap(), tempfile::tempdir().unwrap());
        let (_, calls) = run(&program(line), &layer, caches.path(), None).unwrap();
        let count = calls.iter().filter(|call| call.command == command).count();
        assert!(count > 0, "{line}: {command}");
        for number in 1..=count {
            let [outcome, _] = assert_told(&program(line), &format!("{command} {number} host-memory once"));
            let start = format!("error: out of host memory in {command} for '");
            assert!(error_line(&outcome).starts_with(&start), "{line}: {}", outcome.stderr);
        }
    }
}
