//! Runs one scenario in which a Vulkan call may fail: `fault_scenarios FOLDER NAME ARGUMENTS...`.
//!
//! The result is written to the folder. After a failure the scenario is tried again, in the same process, if the
//! environment says so. Status 0: the first try has succeeded. Status 1: it has failed, with one line `error: ...`.

mod blas;
mod compute;
mod device_fault;
mod hot_reload;
#[cfg(target_os = "linux")]
mod interop;
mod leak;
mod pipelines;
mod queues;
mod raw_device;
mod single_file_programs;
mod slow_work;
mod threads;
#[cfg(target_os = "linux")]
mod window;
mod windowed;
#[cfg(target_os = "linux")]
mod x_window;

use std::error::Error;
use std::ffi::OsString;
use std::fs::File;
use std::io::Write;
use std::path::Path;
use std::process::ExitCode;

use lvk::{Context, ContextDesc, ValidationMode};
use lvk_dev_driver::{DriverRequest, prepare};
use lvk_faults::call_log::left_line;
use lvk_faults::layer::LOG_VARIABLE;
use lvk_faults::leftovers::Leftovers;
use lvk_samples::app::cli::{event_loop, main_with};
use lvk_samples::app::library_warnings;
use lvk_samples::catalogue::run_line;
use lvk_viewer::Viewer;
use peak_alloc::PeakAlloc;

#[global_allocator]
static HEAP: PeakAlloc = PeakAlloc;

/// Error of a scenario.
type Failure = Box<dyn Error + Send + Sync>;

/// A scenario that returns its result as bytes.
type Scenario = fn() -> Result<Vec<u8>, Failure>;

/// Names of the results, as the crate's library expects them.
const RESULTS: [&str; 2] = ["first.png", "second.png"];

fn scenario(name: &str) -> Option<Scenario> {
    Some(match name {
        "blas" => blas::on_device,
        "blas_software" => blas::in_software,
        "serialize" => blas::serialized_in_compaction,
        "threads" => threads::eight,
        "queues" => queues::emulated,
        "own_queues" => queues::own,
        "raw_device" => raw_device::guest,
        "hot_reload" => hot_reload::reload,
        "pipelines" => pipelines::in_background,
        #[cfg(target_os = "linux")]
        "interop" => interop::exchange,
        "device_fault" => device_fault::explained,
        "slow_work" => slow_work::outlives_its_context,
        #[cfg(target_os = "linux")]
        "window" => window::frames_and_resize,
        #[cfg(target_os = "linux")]
        "another_window" => window::another_window,
        #[cfg(target_os = "linux")]
        "kept_surface" => window::kept_surface,
        _ => return None,
    })
}

/// Creates the context of a scenario, with caches in the folder `LVK_CACHE`, and with the validation layer where the environment has
/// `LVK_FAULT_VALIDATE`. Its messages are printed.
fn context(desc: ContextDesc<'_>) -> Result<Context, Failure> {
    let caches = std::env::var_os("LVK_CACHE").map(std::path::PathBuf::from);
    let pipelines = caches.as_ref().map(|folder| folder.join("pipelines"));
    context_without_caches(ContextDesc {
        pipeline_cache: pipelines.as_deref(),
        shader_cache: caches.as_deref(),
        tree_cache: caches.as_deref(),
        ..desc
    })
}

/// Opens a context with the driver of tests and, where the environment asks for it, the validation layer.
fn context_without_caches(desc: ContextDesc<'_>) -> Result<Context, Failure> {
    let validation = validation();
    let driver = prepare(&driver_request(validation))?;
    Ok(Context::new(&ContextDesc {
        application_name: "faults",
        vulkan_library: driver.loader.as_deref(),
        validation,
        ..desc
    })?)
}

/// Returns the validation that the environment asks for.
fn validation() -> ValidationMode {
    match std::env::var_os("LVK_FAULT_VALIDATE") {
        Some(_) => ValidationMode::Standard,
        None => ValidationMode::Off,
    }
}

/// Returns the request for the driver of tests, with the validation layer where it is needed.
fn driver_request(validation: ValidationMode) -> DriverRequest {
    DriverRequest { validation: validation != ValidationMode::Off, ..DriverRequest::default() }
}

/// Runs a scenario of this program, or the sample of this name.
fn attempt(name: &str, args: &[String], result: &Path) -> Result<(), ExitCode> {
    if let ("windowed", Some((name, args))) = (name, args.split_first()) {
        return windowed::run(name, args, result);
    }
    let written = if name == "leak" {
        library_warnings::print();
        leak::leak(args == ["forgets"]).and_then(|bytes| Ok(std::fs::write(result, bytes)?))
    } else if let Some(program) = single_file_programs::of_name(name) {
        library_warnings::print();
        program.run(result)
    } else if let Some(scenario) = scenario(name) {
        library_warnings::print();
        scenario().and_then(|bytes| Ok(std::fs::write(result, bytes)?))
    } else {
        return run_sample(name, args, result);
    };
    written.map_err(|error| {
        eprintln!("error: {error}");
        ExitCode::FAILURE
    })
}

fn run_sample(name: &str, args: &[String], result: &Path) -> Result<(), ExitCode> {
    let mut words: Vec<OsString> = args.iter().map(OsString::from).collect();
    words.extend([OsString::from("--out"), result.into()]);
    let status = match name {
        "viewer" => main_with::<Viewer>([vec![name.into()], words].concat(), &mut event_loop()),
        _ => run_line(name, words, &mut event_loop()),
    };
    if status == ExitCode::SUCCESS { Ok(()) } else { Err(status) }
}

/// Adds what the process still holds to the log of the layer.
fn log_leftovers() -> std::io::Result<()> {
    let Some(path) = std::env::var_os(LOG_VARIABLE) else { return Ok(()) };
    let mut log = File::options().append(true).create(true).open(path)?;
    let left = Leftovers::of_process(HEAP.current_usage())?;
    writeln!(log, "{}", left_line(&left))
}

fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [folder, name, args @ ..] = &*words else {
        eprintln!("error: write FOLDER NAME ARGUMENTS...");
        return ExitCode::from(2);
    };
    let [first, second] = RESULTS.map(|result| Path::new(folder).join(result));
    let status = attempt(name, args, &first).err();
    if status.is_some() && std::env::var_os("LVK_FAULT_AGAIN").is_some() {
        // The result of the second try says how it went.
        let _ = attempt(name, args, &second);
    }
    // The sweep notices a log without this line.
    let _ = log_leftovers();
    status.unwrap_or(ExitCode::SUCCESS)
}
