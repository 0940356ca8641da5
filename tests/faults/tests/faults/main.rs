//! Calls of the samples and of scenarios fail: each run ends with the right result or with an error, and leaves nothing.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on has failed")]

mod losses;
mod messages;
mod sampled;
mod whole;

use std::path::PathBuf;

use lvk::{Context, ContextDesc};
use lvk_dev_driver::{DriverRequest, VirtualDisplay, prepare, virtual_display};
use lvk_faults::sweep::clean_program::CleanProgram;
use lvk_faults::sweep::plan::SweepPlan;
use lvk_faults::sweep::run::{Caches, Program};
use lvk_faults::sweep::verdict::RunOutcome;
use x11rb::rust_connection::RustConnection;

/// A scene of six triangles: a floor, a mirror behind and a pane of glass before it.
const SCENE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scene.obj");

fn program(line: &str) -> Program {
    let args = line.split_whitespace().map(|word| word.replace("SCENE", SCENE)).collect();
    let path = PathBuf::from(env!("CARGO_BIN_EXE_fault_scenarios"));
    Program { path, args, variables: Vec::new(), caches: Caches::Warm, tries_again: true }
}

/// Variable of scenarios that run with the validation layer.
const VALIDATES: &str = "LVK_FAULT_VALIDATE";

/// Returns a program with the validation layer: samples have an argument for it, scenarios a variable.
fn validated(line: &str) -> Program {
    let mut program = program(line);
    match line.contains("--frames") {
        true => program.args.push("--validate".to_owned()),
        false => program.variables.push((VALIDATES.to_owned(), "1".to_owned())),
    }
    program
}

/// True for the programs of [`validated`].
fn is_validated(program: &Program) -> bool {
    program.args.iter().any(|word| word == "--validate")
        || program.variables.iter().any(|(name, _)| name == VALIDATES)
}

/// Asserts that a program which [`validated`] returns has the validation layer: the library listens to its messages.
fn assert_validated(program: &CleanProgram) {
    let listens = program.count("vkCreateDebugUtilsMessengerEXT");
    assert!(listens > 0, "the program runs without the validation layer");
}

/// True for the scenario whose number of calls differs from run to run, by the order of its threads, so that a few faults are not reached.
fn varies(line: &str) -> bool {
    line == "threads"
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

/// Returns a program in a window, the X server that shows it, and a connection: without one the server ends with the first
/// program.
fn in_window(mut program: Program) -> Option<(RustConnection, VirtualDisplay, Program)> {
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
    let text = |value: std::ffi::OsString| value.into_string().unwrap();
    program
        .variables
        .extend(display.variables().into_iter().map(|(name, value)| (name.to_owned(), text(value))));
    let (connection, _) = RustConnection::connect(Some(display.name())).unwrap();
    Some((connection, display, program))
}

/// Samples in a window, which gets another size after its first frame.
const WINDOWED: [&str; 3] = [
    "windowed hybrid --rt software --scene SCENE --resized 480x96",
    "windowed hello_triangle --resized 480x96",
    "windowed viewer SCENE --rt query --samples 2 --resized 480x96",
];

/// Some of the faults of the whole sweeps, spread evenly.
fn some(most: usize) -> SweepPlan {
    SweepPlan { most, ..SweepPlan::full() }
}

/// Asserts that a fault of a program is reached, and has no flaws. Returns what was found.
fn assert_reached(program: &CleanProgram, fault: &str) -> RunOutcome {
    let (outcome, flaws) = program.run(&fault.parse().unwrap()).unwrap();
    assert!(outcome.reached, "{fault}");
    assert_eq!(flaws, [], "{fault}: {}", outcome.stderr);
    outcome
}

/// Asserts that a fault of a program is reached, and has no flaws. Returns what was found.
fn assert_told(program: Program, fault: &str) -> RunOutcome {
    assert_reached(&clean(program), fault)
}

/// Returns a program with its run without a fault.
fn clean(program: Program) -> CleanProgram {
    CleanProgram::new(program).unwrap()
}

/// Returns the error of a run.
fn error_line(outcome: &RunOutcome) -> &str {
    outcome.stderr.lines().find(|line| line.starts_with("error: ")).unwrap_or_default()
}
